//! Layers in other poses, when they follow their skin weights alone: crossings between them, and stretch.

use nalgebra::Point3;
use serde::{Deserialize, Serialize};
use toile_character::{Pose, Skeleton, SkinWeights, skinning};
use toile_geometry::{Mesh, bvh::Bvh, intersection::crossings};

use crate::skin::stretch::stretches;

/// A triangle stretched further than this counts as torn.
pub const TORN: f32 = 3.0;

/// Triangles of two layers this near lie over one another, metres; those further apart belong to different limbs.
const OVER: f32 = 0.04;

/// A layer with its weights.
#[derive(Debug, Clone, Copy)]
pub struct Worn<'a> {
    /// Its mesh, in the pose that all are given in.
    pub mesh: &'a Mesh,
    /// Its skin weights.
    pub weights: &'a SkinWeights,
}

/// One layer in other poses.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct PosedReport {
    /// Poses that were looked at.
    pub poses: usize,
    /// Pairs of triangles that poke through a layer below: they cross, and lie close over one another in the pose that
    /// all are given in. Mean over the poses.
    pub crossing_pairs_mean: f32,
    /// The same in the worst pose.
    pub crossing_pairs_most: usize,
    /// Share of the layer's triangles that poke through, over all poses.
    pub crossing_share: f32,
    /// Other pairs that cross: limbs that meet, such as a sleeve and the side. Mean over the poses.
    pub touching_pairs_mean: f32,
    /// Largest stretch of a triangle in any direction, in any pose; 1 where nothing stretches.
    pub stretch_most: f32,
    /// Triangles stretched beyond [`TORN`], in the worst pose.
    pub torn_most: usize,
}

/// Poses the layers (the body first, then inside to outside, all in `pose0`) by their weights.
pub fn posed_report(layers: &[Worn], skeleton: &Skeleton, pose0: &Pose, poses: &[Pose]) -> Vec<PosedReport> {
    let rest_from_pose0 = pose0.skinning_transforms(skeleton);
    let rest: Vec<Vec<Point3<f32>>> =
        layers.iter().map(|l| skinning::unskin(&l.mesh.positions, l.weights, &rest_from_pose0)).collect();
    let mut reports =
        vec![PosedReport { poses: poses.len(), stretch_most: 1.0, ..PosedReport::default() }; layers.len()];
    let mut crossing = vec![0usize; layers.len()];
    for pose in poses {
        let transforms = pose.skinning_transforms(skeleton);
        let posed = layers.iter().zip(&rest).map(|(l, rest)| {
            let positions = skinning::skin(rest, l.weights, &transforms);
            let mesh = Mesh::new(positions, l.mesh.triangles.clone());
            let bvh = Bvh::new(&mesh.positions, &mesh.triangles);
            (mesh, bvh)
        });
        let posed: Vec<(Mesh, Bvh)> = posed.collect();
        for (k, report) in reports.iter_mut().enumerate() {
            crossing[k] += report.add(layers, &posed, k);
        }
    }
    for ((report, layer), crossing) in reports.iter_mut().zip(layers).zip(crossing) {
        report.crossing_share = crossing as f32 / (layer.mesh.triangles.len() * poses.len()).max(1) as f32;
    }
    reports
}

impl PosedReport {
    /// Adds a pose of layer `k`. Returns how many of its triangles poke through.
    fn add(&mut self, layers: &[Worn], posed: &[(Mesh, Bvh)], k: usize) -> usize {
        let crossings = |l: usize| crossings(&posed[k].0, &posed[k].1, &posed[l].0, &posed[l].1);
        let all = (0..k).flat_map(|l| crossings(l).into_iter().map(move |pair| (l, pair)));
        let over = |(l, pair): &(usize, [u32; 2])| lies_over(layers[k].mesh, layers[*l].mesh, *pair);
        let (pairs, touching): (Vec<_>, Vec<_>) = all.partition(over);
        self.touching_pairs_mean += touching.len() as f32 / self.poses as f32;
        self.crossing_pairs_mean += pairs.len() as f32 / self.poses as f32;
        self.crossing_pairs_most = self.crossing_pairs_most.max(pairs.len());
        let stretch: Vec<f32> = stretches(layers[k].mesh, &posed[k].0.positions).collect();
        self.stretch_most = stretch.iter().copied().fold(self.stretch_most, f32::max);
        self.torn_most = self.torn_most.max(stretch.iter().filter(|s| **s > TORN).count());
        let mut of_upper: Vec<u32> = pairs.iter().map(|(_, pair)| pair[0]).collect();
        of_upper.sort_unstable();
        of_upper.dedup();
        of_upper.len()
    }
}

/// True where the triangles of a pair lie close over one another, facing alike.
fn lies_over(upper: &Mesh, lower: &Mesh, [t, u]: [u32; 2]) -> bool {
    let (x, y) = (upper.corners(t as usize), lower.corners(u as usize));
    let center = |c: &[Point3<f32>; 3]| (c[0].coords + c[1].coords + c[2].coords) / 3.0;
    let normal = |c: &[Point3<f32>; 3]| (c[1] - c[0]).cross(&(c[2] - c[0]));
    (center(&x) - center(&y)).norm() < OVER && normal(&x).dot(&normal(&y)) > 0.0
}
