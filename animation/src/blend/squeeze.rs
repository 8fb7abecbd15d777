//! Cloth between parts of the body that come near each other: armpit, crotch, hand on hip.
//!
//! Over each vertex of the body stands a column along its normal, in which all layers lie in their order. Where another part of the
//! body stands in the column's way, half of the room between the two belongs to the column: what is higher is pressed together to fit, and
//! where the cloth is already as thin as it gets, the skin is pressed in. Heights in a column keep their order, and columns
//! change smoothly over the body, so that what did not cross before does not cross after.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use toile_geometry::{Mesh, bvh::Bvh, mesh::vertex_normals, topology::VertexNeighbors};

use super::{
    anchors::{Closeness, Over},
    loft::{Loft, TALLEST, THINNEST, smoothed, widened},
};

/// Deepest that another part of the body is looked for below the skin, metres.
const DEPTH: f32 = 0.05;
/// Cosines between the normals of two parts of the body, turned round: at the first they are beside each other, as belly and thigh
/// are, and cloth can leave; from the second on they hold it between them.
const BESIDE: f32 = 0.2;
const OPPOSITE: f32 = 0.6;
// The next three were chosen by trying, on three subjects in one walk, until the layers could be moved apart: no model of flesh or
// cloth stands behind them.

/// Room left between what belongs to either side, metres.
const MARGIN: f32 = 0.0020;
/// Rounds of smoothing over the body's vertices.
pub(crate) const SMOOTHINGS: usize = 12;
/// Rings of vertices by which too little room spreads before that.
pub(crate) const WIDENINGS: usize = 4;

/// The columns over the body.
pub(crate) struct Columns {
    pub triangles: Vec<[u32; 3]>,
    pub neighbours: VertexNeighbors,
    /// Over the body in the outfit's first pose.
    pub bvh: Bvh,
    /// How deep below the skin a ray may start and still be inside this part of the body, metres.
    depths: Vec<f32>,
    /// How high the layers stand over each vertex in the outfit's first pose.
    pub loft: Loft,
    /// True where no column stands: hands and feet, whose fingers and toes touch each other in any pose.
    bare: Vec<bool>,
    /// Room over each vertex in the outfit's first pose, metres.
    scanned: Vec<f32>,
}

/// How the columns are pressed in one pose.
pub(crate) struct Pressed {
    /// Height of the skin, metres: 0 or below.
    pub floor: Vec<f32>,
    /// Least height of a layer over the one below, metres; 0 where nothing is pressed.
    pub step: Vec<f32>,
    /// What is left of the height beside that, at most 1.
    pub share: Vec<f32>,
    pub normals: Vec<Vector3<f32>>,
}

impl Columns {
    /// The columns over the first of `layers`; none stand where it is `bare`.
    pub fn new(layers: &[&Mesh], bare: Vec<bool>, closeness: &Closeness) -> Self {
        let body = layers[0];
        let n = body.positions.len();
        let neighbours = VertexNeighbors::new(n, &body.triangles);
        let loft = Loft::new(&layers[1..], closeness, &neighbours, n);
        let bvh = Bvh::new(&body.positions, &body.triangles);
        let (triangles, depths) = (body.triangles.clone(), depths(body, &bvh));
        let mut columns = Self { triangles, neighbours, bvh, depths, loft, bare, scanned: Vec::new() };
        columns.scanned = columns.rooms(&body.positions, &body.vertex_normals());
        columns
    }

    /// Room over each vertex where the body stands at `body`, metres: half the way to another part of it, below 0 where they
    /// overlap.
    fn rooms(&self, body: &[Point3<f32>], normals: &[Vector3<f32>]) -> Vec<f32> {
        let mut bvh = self.bvh.clone();
        bvh.refit(body, &self.triangles);
        let faces: Vec<Vector3<f32>> = toile_geometry::mesh::triangle_normals(body, &self.triangles);
        let room = |v: usize| self.room(v, &bvh, &faces, (&body[v], &normals[v]));
        let less: Vec<f32> = (0..body.len()).into_par_iter().map(|v| -room(v)).collect();
        // Wider than the smoothing reaches, so that it adds nothing where two parts meet.
        let less = (0..WIDENINGS).fold(less, |less, _| widened(&less, &self.neighbours));
        smoothed(&less, &self.neighbours, SMOOTHINGS).iter().map(|r| -r).collect()
    }

    /// Room over vertex `v` of a body with this hierarchy and these `faces`' normals, where the vertex is at a place with a normal.
    pub fn room(&self, v: usize, bvh: &Bvh, faces: &[Vector3<f32>], (p, n): (&Point3<f32>, &Vector3<f32>)) -> f32 {
        let depth = self.depths[v];
        if self.bare[v] {
            return TALLEST;
        }
        let faces_us = |t: u32| faces[t as usize].dot(n) < 0.0;
        let hit = bvh.ray_where(&(p - n * depth), n, depth + 2.0 * self.loft.tops[v] + 2.0 * MARGIN, faces_us);
        hit.map_or(TALLEST, |h| {
            let opposite = ((-faces[h.triangle as usize].dot(n) - BESIDE) / (OPPOSITE - BESIDE)).clamp(0.0, 1.0);
            (h.t - depth) / 2.0 + (1.0 - opposite) * TALLEST
        })
    }

    /// Between how they were pressed `before`, if they were, and `after`, of which it has the `share`, where the body stands at `body`.
    pub fn between(&self, before: Option<&Pressed>, after: &Pressed, share: f32, body: &[Point3<f32>]) -> Pressed {
        let before = before.unwrap_or(after);
        let mix = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| a + (b - a) * share).collect();
        Pressed {
            floor: mix(&before.floor, &after.floor),
            step: mix(&before.step, &after.step),
            share: mix(&before.share, &after.share),
            normals: vertex_normals(body, &self.triangles),
        }
    }

    /// Columns with all the room they want.
    pub fn unpressed(&self, body: &[Point3<f32>]) -> Pressed {
        let n = body.len();
        let normals = vertex_normals(body, &self.triangles);
        Pressed { floor: vec![0.0; n], step: vec![0.0; n], share: vec![1.0; n], normals }
    }

    /// How the columns are pressed where the body stands at `body`.
    pub fn press(&self, body: &[Point3<f32>]) -> Pressed {
        let mut pressed = self.unpressed(body);
        let rooms = self.rooms(body, &pressed.normals);
        for (v, &room) in rooms.iter().enumerate() {
            self.press_one(v, (room, self.scanned[v]), MARGIN, &mut pressed);
        }
        pressed
    }

    /// Presses the column over vertex `v`, which has this room now and had it in the outfit's first pose, with a `margin` between what
    /// belongs to either side; all in metres.
    pub fn press_one(&self, v: usize, (room, scanned): (f32, f32), margin: f32, pressed: &mut Pressed) {
        // What had no more room in the outfit's first pose was scanned so.
        let count = self.loft.count(v);
        let top = self.loft.tops[v].min(scanned);
        if room >= top.min(scanned - margin) || self.bare[v] {
            return;
        }
        // Slowly at first, so that layers with room are not moved.
        let step = THINNEST * ((top - room).max(0.0) / (THINNEST * count.max(1.0))).min(1.0);
        let lowest = |room: f32| (room - margin - step * count).min(0.0);
        pressed.step[v] = step;
        pressed.floor[v] = (lowest(room) - lowest(scanned)).min(0.0);
        let left = room - margin - pressed.floor[v] - step * count;
        pressed.share[v] = if top > 1e-6 { (left / top).clamp(0.0, 1.0) } else { 0.0 };
    }

    /// Presses vertices of garment `k` that stand `over` places of the skin.
    pub fn apply_over(
        &self,
        pressed: &Pressed,
        body: &[Point3<f32>],
        k: usize,
        over: &[Over],
        positions: &mut [Point3<f32>],
    ) {
        pressed.apply(body, over, &self.loft.ranks[k], positions);
    }

    /// Presses the vertices of garment `k`'s mesh.
    pub fn apply(&self, pressed: &Pressed, body: &[Point3<f32>], k: usize, positions: &mut [Point3<f32>]) {
        pressed.apply(body, &self.loft.over[k], &self.loft.ranks[k], positions);
    }
}

impl Pressed {
    /// Presses the body's own vertices.
    pub fn apply_to_body(&self, body: &mut [Point3<f32>]) {
        body.iter_mut().enumerate().for_each(|(v, p)| *p += self.normals[v] * self.floor[v]);
    }

    /// Presses vertices of a garment of these `ranks` that stand `over` places of the skin, which was at `body` before it was
    /// pressed.
    fn apply(&self, body: &[Point3<f32>], over: &[Over], ranks: &[f32], positions: &mut [Point3<f32>]) {
        positions.par_iter_mut().zip(over).for_each(|(p, over)| {
            let mix = |values: &[f32]| -> f32 {
                over.corners.iter().zip(over.barycentric).map(|(&v, w)| values[v as usize] * w).sum()
            };
            let (floor, step, share) = (mix(&self.floor), mix(&self.step), mix(&self.share));
            if floor == 0.0 && share == 1.0 {
                return;
            }
            let at = |k: usize| over.corners[k] as usize;
            let normal: Vector3<f32> = (0..3).map(|k| self.normals[at(k)] * over.barycentric[k]).sum();
            let Some(normal) = normal.try_normalize(1e-6) else { return };
            let skin: Vector3<f32> = (0..3).map(|k| body[at(k)].coords * over.barycentric[k]).sum();
            let height = (p.coords - skin).dot(&normal);
            *p += normal * (over.held * (floor + mix(ranks) * step + height * share - height));
        });
    }
}

/// How deep below each vertex of the skin the middle of its part of the body lies, metres, at most [`DEPTH`].
fn depths(body: &Mesh, bvh: &Bvh) -> Vec<f32> {
    let normals = body.vertex_normals();
    let depth = |v: usize| {
        let origin = body.positions[v] - normals[v] * 0.002;
        let through = bvh.ray(&origin, &-normals[v], 4.0 * DEPTH).map_or(4.0 * DEPTH, |h| h.t);
        (0.4 * through).min(DEPTH)
    };
    (0..body.positions.len()).into_par_iter().map(depth).collect()
}
