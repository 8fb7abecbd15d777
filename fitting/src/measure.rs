//! Stature and girths of a body standing in the A-pose.
//!
//! A girth is the convex-hull perimeter of the largest closed part of a horizontal section, as a tape lies; arms are
//! parts of their own. Chest: the largest between 70 and 73.5 % of the stature; waist: the least between 57 and 66 %;
//! hip: the largest between 47 and 55 %.

use rayon::prelude::*;
use serde::Serialize;
use toile_geometry::Mesh;

use crate::section::{Plane, largest_girth};

/// Distance of the sections, metres.
const STEP: f64 = 0.005;

/// One girth and where it was taken.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Girth {
    /// Height above the soles, metres.
    pub height_m: f64,
    /// Convex perimeter, metres; 0 where there is no closed section.
    pub girth_m: f64,
}

/// Measures of a standing body.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Measurements {
    /// From the soles to the crown, metres.
    pub stature_m: f64,
    /// Largest girth at 70 to 73.5 % of the stature.
    pub chest: Girth,
    /// Least girth at 57 to 66 %.
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

/// Girths of a closed body that stands on +Y with its arms clear of the trunk, at heights by its `stature` (metres).
pub fn measure(body: &Mesh, inner: &[bool], stature: f64) -> Measurements {
    let (low, high) = height_range(body, inner);
    if low >= high || stature <= 0.0 {
        return Measurements::default();
    }
    let largest = |a: &Girth, b: &Girth| a.girth_m.total_cmp(&b.girth_m);
    let least = |a: &Girth, b: &Girth| b.girth_m.total_cmp(&a.girth_m);
    Measurements {
        stature_m: stature,
        chest: extreme(body, low, stature, (0.70, 0.735), largest),
        waist: extreme(body, low, stature, (0.57, 0.66), least),
        hip: extreme(body, low, stature, (0.47, 0.55), largest),
        volume_m3: body.signed_volume(),
    }
}

/// Lowest and highest outer point; nothing when there is none.
pub(crate) fn height_range(body: &Mesh, inner: &[bool]) -> (f64, f64) {
    let outer = body.positions.iter().enumerate().filter(|(v, _)| !inner.get(*v).copied().unwrap_or(false));
    let nothing = (f64::INFINITY, f64::NEG_INFINITY);
    outer.map(|(_, p)| f64::from(p.y)).fold(nothing, |(low, high), y| (low.min(y), high.max(y)))
}

fn extreme(
    body: &Mesh,
    floor: f64,
    stature: f64,
    range: (f64, f64),
    order: impl Fn(&Girth, &Girth) -> std::cmp::Ordering,
) -> Girth {
    let count = ((range.1 - range.0) * stature / STEP).ceil() as usize;
    let girths: Vec<Girth> = (0..count)
        .into_par_iter()
        .map(|k| {
            let height_m = range.0 * stature + k as f64 * STEP;
            Girth { height_m, girth_m: girth_at(body, floor + height_m) }
        })
        .collect();
    // the first of equal ones, whatever `max_by` prefers
    girths.into_iter().reduce(|a, b| if order(&b, &a).is_gt() { b } else { a }).unwrap_or_default()
}

/// Convex-hull perimeter (metres) of the largest closed part of the section at height `y`; 0 where there is none.
pub fn girth_at(body: &Mesh, y: f64) -> f64 {
    largest_girth(body, &Plane::level(y)).map_or(0.0, |tape| tape.length)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};

    use nalgebra::Point3;

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
        let (bottom, top) = (mesh.positions.len() as u32, mesh.positions.len() as u32 + 1);
        mesh.positions.extend([Point3::new(x, 0.0, 0.0), Point3::new(x, height, 0.0)]);
        for k in 0..N {
            let n = (k + 1) % N;
            mesh.triangles.extend([[k, n, bottom], [k + N, top, n + N]]);
        }
        mesh
    }

    fn ellipse_perimeter(a: f64, b: f64) -> f64 {
        let h = ((a - b) / (a + b)).powi(2);
        PI * (a + b) * (1.0 + 3.0 * h / (10.0 + (4.0 - 3.0 * h).sqrt()))
    }

    #[test]
    fn an_elliptic_columns_girth_is_the_ellipses_perimeter_and_arms_do_not_count() {
        let mut mesh = column(0.0, 0.18, 0.12, 1.8);
        let arm = column(0.35, 0.05, 0.05, 1.5);
        let shift = mesh.positions.len() as u32;
        mesh.positions.extend(arm.positions);
        mesh.triangles.extend(arm.triangles.iter().map(|t| t.map(|v| v + shift)));
        let m = measure(&mesh, &[], stature(&mesh, &[]));
        let truth = ellipse_perimeter(0.18, 0.12);
        for girth in [m.chest, m.waist, m.hip] {
            assert!((girth.girth_m - truth).abs() < 5e-4, "{} against {truth}", girth.girth_m);
        }
        assert!((m.stature_m - 1.8).abs() < 1e-6);
    }

    #[test]
    fn nothing_measures_nothing() {
        assert_eq!(measure(&Mesh::default(), &[], 1.8), Measurements::default());
        assert_eq!(girth_at(&column(0.0, 0.1, 0.1, 1.0), 2.0), 0.0);
    }
}
