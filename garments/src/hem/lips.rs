//! Lips: a fused scan closes the space behind a hanging hem by a surface that turns in past the fold.

use nalgebra::{Point3, Vector3};

use super::border::Border;

/// Lips are looked for within this share of the greatest depth of a step; the cloth is read beyond it.
const LIP_WIDTH: f32 = 0.7;
/// A lip's normal is further than this (cosine) from the cloth's.
const LIP_ALIGNMENT: f32 = 0.7;
/// A lip lies at least this far below the cloth's plane, metres.
const LIP_DROP: f32 = 0.002;
/// Cloth behind a hem must have this area to be believed, square metres.
const MIN_BEHIND: f32 = 5e-5;
/// Cloth behind a hem is flat enough where the sum of its normals has this share of its area.
const FLAT: f32 = 0.7;

/// Vertices near the border that lie past a fold: below the plane of the cloth further in and turned away from it.
pub(super) fn lip_vertices(border: &Border) -> Vec<u32> {
    let graph = &border.on.graph;
    let is_turned = |cloth: Plane, v: usize| {
        graph.normals[v].dot(&cloth.normal) < LIP_ALIGNMENT
            && (graph.positions[v] - cloth.center).dot(&cloth.normal) < -LIP_DROP
    };
    let is_lip = |&v: &u32| {
        let near = border.garment[v as usize] && border.distance[v as usize] < LIP_WIDTH * border.depth;
        near && cloth_behind(border, v).is_some_and(|cloth| is_turned(cloth, v as usize))
    };
    (0..graph.len() as u32).filter(is_lip).collect()
}

/// Middle and normal of a piece of cloth.
struct Plane {
    center: Point3<f32>,
    normal: Vector3<f32>,
}

/// The cloth beyond the lip's width around `center`; `None` where there is too little of it, or where it is bent so much
/// that it has no direction.
fn cloth_behind(border: &Border, center: u32) -> Option<Plane> {
    let graph = &border.on.graph;
    let (mut area, mut sum, mut normal) = (0.0, Vector3::zeros(), Vector3::zeros());
    for v in border.around(center).into_iter().map(|v| v as usize) {
        if border.distance[v] > LIP_WIDTH * border.depth {
            area += graph.areas[v];
            sum += graph.positions[v].coords * graph.areas[v];
            normal += graph.normals[v] * graph.areas[v];
        }
    }
    let believed = normal.norm() > FLAT * area && area > MIN_BEHIND;
    believed.then(|| Plane { center: Point3::from(sum / area), normal: normal.normalize() })
}
