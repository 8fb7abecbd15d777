//! What layers do in other poses when they follow their skin weights alone: crossings between them, and stretch.

use nalgebra::{Matrix2, Point3};
use serde::Serialize;
use toile_character::{Pose, Skeleton, SkinWeights, skinning};
use toile_geometry::{Mesh, bvh::Bvh, intersection::crossings};

/// A triangle stretched further than this counts as torn.
pub const TORN: f32 = 3.0;

/// Triangles of two layers this near lie over one another, metres: what is further apart belongs to other limbs.
const OVER: f32 = 0.04;

/// A layer with its weights.
#[derive(Debug, Clone, Copy)]
pub struct Worn<'a> {
    /// Its mesh, in the pose that all are given in.
    pub mesh: &'a Mesh,
    /// Its skin weights.
    pub weights: &'a SkinWeights,
}

/// What became of one layer.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
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
    /// Other pairs that cross: of limbs that meet, as a sleeve and the side. Mean over the poses.
    pub touching_pairs_mean: f32,
    /// Largest stretch of a triangle in any direction, in any pose; 1 is none.
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
        let posed: Vec<Mesh> = layers
            .iter()
            .zip(&rest)
            .map(|(l, rest)| Mesh::new(skinning::skin(rest, l.weights, &transforms), l.mesh.triangles.clone()))
            .collect();
        let trees: Vec<Bvh> = posed.iter().map(|m| Bvh::new(&m.positions, &m.triangles)).collect();
        for k in 0..layers.len() {
            let by_lower = (0..k).map(|l| (l, crossings(&posed[k], &posed[l], &trees[l])));
            let all = by_lower.flat_map(|(l, pairs)| pairs.into_iter().map(move |pair| (l, pair)));
            let over = |(l, pair): &(usize, [u32; 2])| lies_over(layers[k].mesh, layers[*l].mesh, *pair);
            let (pairs, touching): (Vec<_>, Vec<_>) = all.partition(over);
            let report = &mut reports[k];
            report.touching_pairs_mean += touching.len() as f32 / poses.len() as f32;
            report.crossing_pairs_mean += pairs.len() as f32 / poses.len() as f32;
            report.crossing_pairs_most = report.crossing_pairs_most.max(pairs.len());
            let stretch: Vec<f32> = stretches(layers[k].mesh, &posed[k].positions).collect();
            report.stretch_most = stretch.iter().copied().fold(report.stretch_most, f32::max);
            report.torn_most = report.torn_most.max(stretch.iter().filter(|s| **s > TORN).count());
            let mut of_upper: Vec<u32> = pairs.iter().map(|(_, pair)| pair[0]).collect();
            of_upper.sort_unstable();
            of_upper.dedup();
            crossing[k] += of_upper.len();
        }
    }
    for ((report, layer), crossing) in reports.iter_mut().zip(layers).zip(crossing) {
        report.crossing_share = crossing as f32 / (layer.mesh.triangles.len() * poses.len()).max(1) as f32;
    }
    reports
}

/// True where the triangles of a pair lie close over one another, facing alike.
fn lies_over(upper: &Mesh, lower: &Mesh, [t, u]: [u32; 2]) -> bool {
    let (x, y) = (upper.corners(t as usize), lower.corners(u as usize));
    let center = |c: &[Point3<f32>; 3]| (c[0].coords + c[1].coords + c[2].coords) / 3.0;
    let normal = |c: &[Point3<f32>; 3]| (c[1] - c[0]).cross(&(c[2] - c[0]));
    (center(&x) - center(&y)).norm() < OVER && normal(&x).dot(&normal(&y)) > 0.0
}

/// The largest stretch of each triangle of `mesh` in any direction when its vertices lie at `positions`: the larger
/// singular value of the triangle's deformation; 0 for a triangle of no area.
pub fn stretches<'a>(mesh: &'a Mesh, positions: &'a [Point3<f32>]) -> impl Iterator<Item = f32> + 'a {
    mesh.triangles.iter().map(|t| {
        let at = |p: &[Point3<f32>]| t.map(|v| p[v as usize]);
        triangle_stretch(&at(&mesh.positions), &at(positions))
    })
}

/// Larger singular value of the linear map from triangle `from` to triangle `to`, each in its own plane; 0 for a
/// triangle of no area.
fn triangle_stretch(from: &[Point3<f32>; 3], to: &[Point3<f32>; 3]) -> f32 {
    let flat = |t: &[Point3<f32>; 3]| {
        let (u, v) = (t[1] - t[0], t[2] - t[0]);
        let x = u.try_normalize(1e-12)?;
        let y = v - x * v.dot(&x);
        Some(Matrix2::new(u.norm(), v.dot(&x), 0.0, y.norm()))
    };
    let map = || Some(flat(to)? * flat(from)?.try_inverse()?);
    map().map_or(0.0, |m| m.singular_values().max())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stretch_along_one_direction_is_told() {
        let mesh = Mesh::new(
            [[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.004, 0.009, 0.0]].map(Point3::from).to_vec(),
            vec![[0, 1, 2]],
        );
        let stretched: Vec<Point3<f32>> = mesh.positions.iter().map(|p| Point3::new(p.x, 0.0, 2.5 * p.y)).collect();
        assert!((stretches(&mesh, &stretched).next().unwrap() - 2.5).abs() < 1e-4);
        assert!((stretches(&mesh, &mesh.positions).next().unwrap() - 1.0).abs() < 1e-5);
    }
}
