//! What each scan vertex tells about being new: its height over what was worn before, its colour, its place.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use toile_geometry::{
    Mesh,
    bvh::{Bvh, Closest},
    topology::VertexNeighbors,
};

use crate::{
    ExtractSettings, Take,
    body_parts::{PART_COUNT, part_shares},
    color,
    scan_graph::ScanGraph,
};

/// Least scales that are believed, metres and colour units: no sensor does better.
const LEAST_DISTANCE_NOISE: f32 = 0.0007;
const LEAST_COLOR_NOISE: f32 = 1.5;
/// Cloth worn before lies otherwise in each take, by this share of its distance from the body.
const SLIP_SHARE: f32 = 0.2;
/// At this distance from the body half of it does, metres.
const SLIPS: f32 = 0.03;
/// Largest scale that uncovered skin can explain, metres and colour units.
const MOST_DISTANCE_NOISE: f32 = 0.004;
const MOST_COLOR_NOISE: f32 = 8.0;
/// A part needs this many vertices to tell the noise.
const PART_VERTICES: usize = 150;
/// Heights of new cloth over what is below fall off on this scale, metres: near hems most is low, skirts reach far.
const CLOTH_HEIGHT: f32 = 0.06;
/// What the density of cloth heights is divided by, metres: most cloth lies within this.
const CLOTH_SPREAD: f32 = 0.017;
/// How far new cloth presses in what is below, metres.
const CLOTH_PRESS: f32 = 0.002;
/// Extent of colour differences between different cloths.
const COLOR_RANGE: f32 = 60.0;

/// What was measured at each scan vertex.
#[derive(Debug, Clone)]
pub struct Evidence {
    /// Signed height over the earlier surface, metres; infinite where none is within reach.
    pub height: Vec<f32>,
    /// Distance from the earlier surface whichever way it faces, metres; infinite where none is within reach.
    pub clearance: Vec<f32>,
    /// Colour difference from the nearest place of the earlier surface; NaN where either was not seen.
    pub color: Vec<f32>,
    /// Cosine between the scan's normal and the earlier surface's: small where a hem's edge drops to what is below.
    pub facing: Vec<f32>,
    /// Shares of the body parts at the closest body vertex.
    pub parts: Vec<[f32; PART_COUNT]>,
    /// Distance from the body, metres.
    pub body_distance: Vec<f32>,
    /// Cosine between the scan's normal and the body's at the closest place.
    pub body_facing: Vec<f32>,
    /// Laplacian scale of `height` on uncovered parts, metres.
    pub height_noise: f32,
    /// Exponential scale of `color` on uncovered parts.
    pub color_noise: f32,
}

/// Measures a take.
pub fn measure(take: &Take, graph: &ScanGraph, settings: &ExtractSettings) -> Evidence {
    let body = Bvh::new(&take.body.positions, &take.body.triangles);
    let shares = part_shares(take.weights);
    let body_normals = take.body.triangle_normals();
    let (parts, on_body): (Vec<_>, Vec<[f32; 2]>) = take
        .scan
        .positions
        .par_iter()
        .zip(&graph.normals)
        .map(|(p, normal)| match body.closest(p, f32::INFINITY) {
            Some(hit) => {
                let corners = take.body.triangles[hit.triangle as usize];
                let facing = body_normals[hit.triangle as usize].dot(normal);
                (blend(&shares, corners, hit.barycentric), [hit.distance, facing])
            }
            None => ([0.0; PART_COUNT], [f32::INFINITY, 0.0]),
        })
        .unzip();
    let (body_distance, body_facing): (Vec<f32>, _) = on_body.into_iter().map(|[far, facing]| (far, facing)).unzip();
    let before = Before::new(take.previous);
    let compared: Vec<[f32; 4]> = (0..graph.len())
        .into_par_iter()
        .map(|v| before.compare(&take.scan.positions[v], &graph.normals[v], graph.lab.get(v), settings))
        .collect();
    let column = |k: usize| compared.iter().map(|row| row[k]).collect::<Vec<f32>>();
    let color = column(1).into_iter().zip(&graph.filled).map(|(c, &f)| if f > 0.5 { f32::NAN } else { c }).collect();
    let (height, facing, clearance) = (column(0), column(2), column(3));
    let (height_noise, color_noise) = (0.0, 0.0);
    let mut evidence =
        Evidence { height, clearance, color, facing, parts, body_distance, body_facing, height_noise, color_noise };
    evidence.estimate_noise();
    evidence
}

impl Evidence {
    /// Natural log odds of "new" against "old" at vertex `v`, from height and colour.
    pub fn log_odds(&self, v: usize) -> f32 {
        self.height_log_odds(self.height[v], self.body_distance[v] - self.height[v])
            + self.color_log_odds(self.color[v])
    }

    /// Uncovered skin is a Laplacian around zero with rare outliers; earlier cloth, `slack` metres off the body, one with
    /// a second, wider part; new cloth stands off either by an exponential height.
    fn height_log_odds(&self, height: f32, slack: f32) -> f32 {
        if !height.is_finite() {
            return 3.0;
        }
        let b = self.height_noise;
        let laplacian = |scale: f32| (-height.abs() / scale).exp() / (2.0 * scale);
        let slack = slack.max(0.0);
        let slipped = slack / (slack + SLIPS);
        let lies = (1.0 - slipped) * laplacian(b) + slipped * laplacian(b.max(SLIP_SHARE * slack));
        let old = 0.97 * lies + 0.03 / 0.06;
        let press = b.max(CLOTH_PRESS);
        let shape = if height >= 0.0 { (-height / CLOTH_HEIGHT).exp() } else { (height / press).exp() };
        let new = shape / CLOTH_SPREAD;
        (new.max(1e-4) / old).ln().clamp(-4.0, 4.0)
    }

    /// The same cloth differs by an exponential amount; another cloth by anything, now and then by nothing.
    fn color_log_odds(&self, difference: f32) -> f32 {
        if difference.is_nan() {
            return 0.0;
        }
        let b = self.color_noise;
        let same = (-difference / b).exp() / b;
        let any = 1.0 / COLOR_RANGE;
        let (old, new) = (0.97 * same + 0.03 * any, 0.3 * same + 0.7 * any);
        (new / old).ln().clamp(-4.0, 4.0)
    }

    /// Some parts are always uncovered or were covered before as they are now, and posing is not equally good for all:
    /// a low quantile over the parts tells the noise.
    fn estimate_noise(&mut self) {
        let of_part = |part: usize, value: &dyn Fn(usize) -> f32| {
            let mut values: Vec<f32> = (0..self.parts.len())
                .filter(|&v| self.parts[v][part] > 0.5)
                .map(value)
                .filter(|x| x.is_finite())
                .collect();
            (values.len() >= PART_VERTICES).then(|| {
                let middle = values.len() / 2;
                *values.select_nth_unstable_by(middle, f32::total_cmp).1
            })
        };
        let low = |value: &dyn Fn(usize) -> f32| {
            let mut medians: Vec<f32> = (0..PART_COUNT).filter_map(|p| of_part(p, value)).collect();
            medians.sort_by(f32::total_cmp);
            medians.get(medians.len() * 3 / 10).copied().unwrap_or(0.0)
        };
        // The median of |x| is ln 2 times the scale, for both distributions; parts differ, hence the half more.
        let scale = 1.5 / std::f32::consts::LN_2;
        let (height, color) = (low(&|v| self.height[v].abs()), low(&|v| self.color[v]));
        self.height_noise = (height * scale).clamp(LEAST_DISTANCE_NOISE, MOST_DISTANCE_NOISE);
        self.color_noise = (color * scale).clamp(LEAST_COLOR_NOISE, MOST_COLOR_NOISE);
    }
}

/// The surface worn before, ready for comparison.
struct Before<'a> {
    mesh: &'a Mesh,
    bvh: Bvh,
    normals: Vec<Vector3<f32>>,
    vertex_normals: Vec<Vector3<f32>>,
    lab: Vec<[f32; 3]>,
    neighbors: VertexNeighbors,
    filled: Option<&'a Vec<f32>>,
}

impl<'a> Before<'a> {
    fn new(mesh: &'a Mesh) -> Self {
        Self {
            mesh,
            bvh: Bvh::new(&mesh.positions, &mesh.triangles),
            normals: mesh.triangle_normals(),
            vertex_normals: mesh.vertex_normals(),
            lab: mesh.colors.iter().map(|&c| color::lab(c)).collect(),
            neighbors: VertexNeighbors::new(mesh.positions.len(), &mesh.triangles),
            filled: mesh.attributes.get("filled"),
        }
    }

    /// Signed height of `p` over the closest surface that faces the same way, the colour difference there, the cosine
    /// between the normals, and the distance from the closest surface of any facing.
    fn compare(
        &self,
        p: &Point3<f32>,
        normal: &Vector3<f32>,
        lab: Option<&[f32; 3]>,
        settings: &ExtractSettings,
    ) -> [f32; 4] {
        let facing = |t: u32| self.normals[t as usize].dot(normal) > 0.2;
        let hit = self.bvh.closest_where(p, settings.reach, facing);
        let Some(hit) = hit.or_else(|| self.bvh.closest(p, settings.reach)) else {
            return [f32::INFINITY, f32::NAN, 1.0, f32::INFINITY];
        };
        let sign = if (p - hit.point).dot(&self.normals[hit.triangle as usize]) >= 0.0 { 1.0 } else { -1.0 };
        let corner = self.mesh.triangles[hit.triangle as usize][largest(hit.barycentric)];
        let color = match lab {
            Some(lab) if !self.lab.is_empty() => self.least_difference(corner, lab, settings.color_search),
            _ => f32::NAN,
        };
        let clearance = self.bvh.closest(p, hit.distance).map_or(hit.distance, |any| any.distance);
        [sign * hit.distance, color, self.smooth_normal(&hit).dot(normal), clearance]
    }

    fn smooth_normal(&self, hit: &Closest) -> Vector3<f32> {
        let corners = self.mesh.triangles[hit.triangle as usize];
        let sum = corners.iter().zip(hit.barycentric).map(|(&v, w)| self.vertex_normals[v as usize] * w).sum();
        Vector3::try_normalize(&sum, 1e-12).unwrap_or(self.normals[hit.triangle as usize])
    }

    /// Least colour difference from the surface within `radius` of vertex `center`.
    fn least_difference(&self, center: u32, lab: &[f32; 3], radius: f32) -> f32 {
        let seen = |v: u32| self.filled.is_none_or(|f| f[v as usize] < 0.5);
        let origin = self.mesh.positions[center as usize];
        let mut visited = vec![center];
        let (mut next, mut best) = (0, f32::NAN);
        while next < visited.len() && visited.len() < 64 {
            let v = visited[next];
            next += 1;
            if seen(v) {
                best = best.min(color::difference(&self.lab[v as usize], lab));
            }
            for &n in self.neighbors.of(v as usize) {
                if (self.mesh.positions[n as usize] - origin).norm() <= radius && !visited.contains(&n) {
                    visited.push(n);
                }
            }
        }
        best
    }
}

fn largest(w: [f32; 3]) -> usize {
    (0..3).max_by(|&a, &b| w[a].total_cmp(&w[b])).unwrap_or(0)
}

fn blend(shares: &[[f32; PART_COUNT]], corners: [u32; 3], w: [f32; 3]) -> [f32; PART_COUNT] {
    std::array::from_fn(|k| (0..3).map(|c| shares[corners[c] as usize][k] * w[c]).sum())
}
