//! Stature, and the girths by which bodies are scored: extremes within shares of the stature.
//!
//! These girths are compared with truth that is stated by the same rule, and stand in `body.json`. They are not the
//! measurements of ISO 8559-1, which [`super::table`] takes at landmarks.

use rayon::prelude::*;
use serde::Serialize;
use toile_character::BodyModel;
use toile_geometry::Mesh;

use crate::measure::{
    parts::Parts,
    section::{Plane, Skin, Tape},
};

/// Distance between two sections, metres.
const STEP: f64 = 0.005;
/// Where each girth is searched, as shares of the stature.
const CHEST: (f64, f64) = (0.70, 0.735);
const WAIST: (f64, f64) = (0.57, 0.66);
const HIP: (f64, f64) = (0.47, 0.55);

/// One girth and where it was taken.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Girth {
    /// Height above the soles, metres.
    pub height_m: f64,
    /// Convex perimeter, metres; 0 where there is no section.
    pub girth_m: f64,
}

/// Stature, scored girths and volume of a body.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Measurements {
    /// From the soles to the crown, metres.
    pub stature_m: f64,
    /// Largest girth at 70 to 73.5 % of the stature.
    pub chest: Girth,
    /// Smallest girth at 57 to 66 %.
    pub waist: Girth,
    /// Largest girth at 47 to 55 %.
    pub hip: Girth,
    /// Volume, cubic metres.
    pub volume_m3: f64,
}

/// Height from the soles to the crown of a body standing straight, +Y up, metres; `inner` vertices (mouth, eye sockets)
/// do not count.
pub fn stature(body: &Mesh, inner: &[bool]) -> f64 {
    let (low, high) = height_range(body, inner);
    (high - low).max(0.0)
}

/// Girths of a body on the template's topology that stands on +Y, at heights by its `stature` (metres). Each is the length
/// of a taut tape around a horizontal section of trunk and legs; arms do not count, wherever they are.
pub fn measure_extremes(model: &BodyModel, body: &Mesh, stature: f64) -> Measurements {
    let (floor, top) = height_range(body, &model.inner);
    if floor >= top || stature <= 0.0 {
        return Measurements::default();
    }
    let parts = Parts::new(model);
    let trunk = Skin { positions: &body.positions, triangles: &parts.trunk };
    let largest = |a: &Girth, b: &Girth| a.girth_m.total_cmp(&b.girth_m);
    let smallest = |a: &Girth, b: &Girth| b.girth_m.total_cmp(&a.girth_m);
    // below the crotch the tape goes around one leg, which is never larger than the hip
    let around = |plane: &Plane| trunk.girth(plane);
    let around_hip = |plane: &Plane| trunk.largest_girth(plane);
    let scale = Scale { floor, stature };
    Measurements {
        stature_m: stature,
        chest: scale.extreme(CHEST, around, largest),
        waist: scale.extreme(WAIST, around, smallest),
        hip: scale.extreme(HIP, around_hip, largest),
        volume_m3: body.signed_volume(),
    }
}

/// Lowest and highest outer point; nothing when there is none.
pub(crate) fn height_range(body: &Mesh, inner: &[bool]) -> (f64, f64) {
    let outer = body.positions.iter().enumerate().filter(|(v, _)| !inner.get(*v).copied().unwrap_or(false));
    let nothing = (f64::INFINITY, f64::NEG_INFINITY);
    outer.map(|(_, p)| f64::from(p.y)).fold(nothing, |(low, high), y| (low.min(y), high.max(y)))
}

/// Heights of one body, metres.
struct Scale {
    floor: f64,
    stature: f64,
}

impl Scale {
    /// The first of the girths that `order` puts last within a range of shares.
    fn extreme(
        &self,
        range: (f64, f64),
        around: impl Fn(&Plane) -> Option<Tape> + Sync,
        order: impl Fn(&Girth, &Girth) -> std::cmp::Ordering,
    ) -> Girth {
        let count = ((range.1 - range.0) * self.stature / STEP).ceil() as usize;
        let girths: Vec<Girth> = (0..count)
            .into_par_iter()
            .map(|k| {
                let height_m = range.0 * self.stature + k as f64 * STEP;
                let tape = around(&Plane::level(self.floor + height_m));
                Girth { height_m, girth_m: tape.map_or(0.0, |t| t.length) }
            })
            .collect();
        girths.into_iter().reduce(|a, b| if order(&b, &a).is_gt() { b } else { a }).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};

    use nalgebra::Point3;
    use toile_character::Region;

    use super::*;

    /// A closed elliptic column around `x`, with many sides.
    fn column(x: f32, a: f32, b: f32, height: f32) -> Mesh {
        const N: u32 = 400;
        let mut mesh = Mesh::default();
        for y in [0.0, height] {
            for k in 0..N {
                let t = TAU as f32 * k as f32 / N as f32;
                mesh.positions.push(Point3::new(x + a * t.cos(), y, b * t.sin()));
            }
        }
        for k in 0..N {
            let n = (k + 1) % N;
            mesh.triangles.extend([[k, k + N, n], [n, k + N, n + N]]);
        }
        mesh
    }

    fn ellipse_perimeter(a: f64, b: f64) -> f64 {
        let h = ((a - b) / (a + b)).powi(2);
        PI * (a + b) * (1.0 + 3.0 * h / (10.0 + (4.0 - 3.0 * h).sqrt()))
    }

    /// A body model whose shape is a column with an arm; the arm stands in the trunk when `apart` is small.
    fn trunk_and_arm(apart: f32) -> (BodyModel, Mesh) {
        let mut mesh = column(0.0, 0.18, 0.12, 1.8);
        let trunk = mesh.positions.len();
        let arm = column(apart, 0.05, 0.05, 1.5);
        mesh.positions.extend(arm.positions);
        mesh.triangles.extend(arm.triangles.iter().map(|t| t.map(|v| v + trunk as u32)));
        let mut model = BodyModel::load_default().unwrap();
        let region = |v: usize| if v < trunk { Region::Torso } else { Region::LeftArm };
        model.regions = (0..mesh.positions.len()).map(region).collect();
        model.inner = vec![false; mesh.positions.len()];
        (model.triangles, model.mean) = (mesh.triangles.clone(), mesh.positions.clone());
        (model, mesh)
    }

    #[test]
    fn an_elliptic_trunks_girth_is_the_ellipses_perimeter_wherever_the_arm_is() {
        let truth = ellipse_perimeter(0.18, 0.12);
        for apart in [0.35, 0.22, 0.1] {
            let (model, mesh) = trunk_and_arm(apart);
            let m = measure_extremes(&model, &mesh, stature(&mesh, &model.inner));
            for girth in [m.chest, m.waist, m.hip] {
                assert!((girth.girth_m - truth).abs() < 5e-4, "{} against {truth}, arm {apart} m out", girth.girth_m);
            }
            assert!((m.stature_m - 1.8).abs() < 1e-6);
        }
    }

    #[test]
    fn an_empty_mesh_measures_nothing() {
        let model = BodyModel::load_default().unwrap();
        assert_eq!(measure_extremes(&model, &Mesh::default(), 1.8), Measurements::default());
    }
}
