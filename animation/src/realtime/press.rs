//! Layers between parts of the body that come near each other, pressed together: the columns of `blend/squeeze.rs` without
//! allocation, and only where garments cover the skin.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use toile_geometry::{bvh::Bvh, topology::VertexNeighbors};

use crate::blend::{
    anchors::{FAR, NEAR},
    loft::TALLEST,
    squeeze::{Columns, Pressed, SMOOTHINGS, WIDENINGS},
};

/// Room left between what belongs to either side, metres: half as much again as in the bake, which moves apart what still crosses.
const MARGIN: f32 = 0.003;
/// Vertices in a parallel chunk.
const CHUNK: usize = 512;

/// How the columns are pressed, used again from frame to frame.
pub(super) struct Press {
    pub pressed: Pressed,
    bvh: Bvh,
    faces: Vec<Vector3<f32>>,
    /// The room over each vertex in the outfit's first pose, metres.
    scanned: Vec<f32>,
    /// Minus the room over each vertex, metres, and space to spread it.
    less: [Vec<f32>; 2],
    /// For each garment, how far each vertex of its mesh can move by itself: 1, less where it is held between parts of the body.
    pub free: Vec<Vec<f32>>,
}

impl Press {
    /// For `columns` over a body that is at `skin` in the outfit's first pose.
    pub fn new(columns: &Columns, skin: &[Point3<f32>], normals: &[Vector3<f32>]) -> Self {
        let n = skin.len();
        let pressed =
            Pressed { floor: vec![0.0; n], step: vec![0.0; n], share: vec![1.0; n], normals: normals.to_vec() };
        let faces = vec![Vector3::zeros(); columns.triangles.len()];
        let less = [vec![-TALLEST; n], vec![-TALLEST; n]];
        let free = columns.loft.over.iter().map(|over| vec![1.0; over.len()]).collect();
        let mut press = Self { free, pressed, bvh: columns.bvh.clone(), faces, scanned: vec![0.0; n], less };
        press.rooms(columns, skin, normals);
        press.scanned = press.less[0].iter().map(|less| -less).collect();
        press
    }

    /// Presses the columns where the body stands at `skin`.
    pub fn press(&mut self, columns: &Columns, skin: &[Point3<f32>], normals: &[Vector3<f32>]) {
        self.rooms(columns, skin, normals);
        let Self { pressed, scanned, less: [less, _], .. } = self;
        pressed.normals.copy_from_slice(normals);
        pressed.floor.fill(0.0);
        pressed.step.fill(0.0);
        pressed.share.fill(1.0);
        for (v, less) in less.iter().enumerate() {
            columns.press_one(v, (-less, scanned[v]), MARGIN, pressed);
        }
    }

    /// Presses the vertices of garment `k` (from 0) over a body that stood at `skin` before it was pressed itself.
    pub fn apply(&mut self, columns: &Columns, skin: &[Point3<f32>], k: usize, points: &mut [Point3<f32>]) {
        let Pressed { floor, step, share, normals } = &self.pressed;
        let ranks = &columns.loft.ranks[k];
        let vertices = points.par_iter_mut().zip(&mut self.free[k]).zip(&columns.loft.over[k]);
        vertices.with_min_len(CHUNK).for_each(|((p, free), over)| {
            let corners = over.corners.map(|v| v as usize);
            let hold = over.held * ((FAR as f32 - over.height) / (FAR - NEAR) as f32).clamp(0.0, 1.0);
            *free = 1.0;
            if hold == 0.0 || corners.iter().all(|&v| floor[v] == 0.0 && share[v] == 1.0) {
                return;
            }
            let mix = |values: &[f32]| -> f32 { (0..3).map(|k| values[corners[k]] * over.barycentric[k]).sum() };
            let normal: Vector3<f32> = (0..3).map(|k| normals[corners[k]] * over.barycentric[k]).sum();
            let Some(normal) = normal.try_normalize(1e-6) else { return };
            let foot: Vector3<f32> = (0..3).map(|k| skin[corners[k]].coords * over.barycentric[k]).sum();
            let (height, share) = ((p.coords - foot).dot(&normal), mix(share));
            *p += normal * (hold * (mix(floor) + mix(ranks) * mix(step) + height * (share - 1.0)));
            *free = 1.0 - hold * (1.0 - share);
        });
    }

    /// Minus the room over each vertex, into `less[0]`.
    fn rooms(&mut self, columns: &Columns, skin: &[Point3<f32>], normals: &[Vector3<f32>]) {
        let Self { bvh, faces, less: [less, other], .. } = self;
        bvh.refit_boxes(skin, &columns.triangles);
        let normal = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| skin[v as usize]);
            (b - a).cross(&(c - a)).try_normalize(1e-12).unwrap_or_default()
        };
        faces.iter_mut().zip(&columns.triangles).for_each(|(n, t)| *n = normal(t));
        let (bvh, faces) = (&*bvh, &*faces);
        less.par_chunks_mut(CHUNK).enumerate().for_each(|(c, chunk)| {
            for (k, less) in chunk.iter_mut().enumerate() {
                let v = c * CHUNK + k;
                let covered = columns.loft.tops[v] > 0.0;
                *less = if covered { -columns.room(v, bvh, faces, (&skin[v], &normals[v])) } else { -TALLEST };
            }
        });
        for _ in 0..WIDENINGS {
            spread(less, other, &columns.neighbours, |own, around| around.fold(own, f32::max));
            std::mem::swap(less, other);
        }
        for _ in 0..SMOOTHINGS {
            spread(less, other, &columns.neighbours, |own, around| {
                let (sum, count) = around.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0f32));
                0.5 * own + 0.5 * sum / count
            });
            std::mem::swap(less, other);
        }
    }
}

/// Writes for each vertex what `mix` makes of its value and those of its neighbours; a vertex without any keeps its own.
fn spread(
    from: &[f32],
    to: &mut [f32],
    neighbours: &VertexNeighbors,
    mix: impl Fn(f32, std::iter::Map<std::slice::Iter<u32>, &dyn Fn(&u32) -> f32>) -> f32 + Sync,
) {
    let value = |u: &u32| from[*u as usize];
    to.par_chunks_mut(4 * CHUNK).enumerate().for_each(|(c, chunk)| {
        for (k, to) in chunk.iter_mut().enumerate() {
            let v = c * 4 * CHUNK + k;
            let around = neighbours.of(v);
            *to = if around.is_empty() { from[v] } else { mix(from[v], around.iter().map(&value)) };
        }
    });
}
