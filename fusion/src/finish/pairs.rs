//! Poses of several depth images together, from what pairs of them see of the same surface.
//!
//! Every pair contributes point-to-plane residuals between its two depth images. In the linearised problem a pair's
//! residuals depend on the difference of its two increments only: one 6×6 block a pair.

use nalgebra::{DMatrix, DVector, Matrix6, Point3, Vector6};
use rayon::prelude::*;
use toile_geometry::{Rigid, transform_point};

use crate::{
    frame::{DepthView, dot},
    tracking::{NormalEquations, Sample, increment},
};

/// A frame of the optimisation.
pub(crate) struct Node<'a> {
    pub view: &'a DepthView,
    pub points: Vec<Sample>,
    /// Distances are taken along the direction halfway between the normals of a point and of the pixel it falls on: exact on
    /// rounded surfaces, however wide the pixels are (Rusinkiewicz 2019, "A symmetric objective function for ICP"). Frames
    /// of a turn, of which neighbours see surfaces alike, are compared along the pixel's, which are the steadier ones there.
    pub halfway: bool,
}

/// The equations of each pair, about `center`, with residuals up to `gate` metres.
pub(crate) fn linearise(
    nodes: &[Node],
    poses: &[Rigid],
    pairs: &[(usize, usize)],
    center: &Point3<f64>,
    gate: f64,
) -> Vec<NormalEquations> {
    let one = |&(i, j): &(usize, usize)| {
        let forth = pair_system(&nodes[i], &poses[i], &nodes[j], &poses[j], center, gate, 1.0);
        forth.plus(&pair_system(&nodes[j], &poses[j], &nodes[i], &poses[i], center, gate, -1.0))
    };
    pairs.par_iter().map(one).collect()
}

/// Residuals of the points of `a` against the surface seen by `b`; `sign` −1 exchanges whose increment counts.
fn pair_system(
    a: &Node,
    pose_a: &Rigid,
    b: &Node,
    pose_b: &Rigid,
    center: &Point3<f64>,
    gate: f64,
    sign: f64,
) -> NormalEquations {
    let b_from_a = pose_b.inverse() * pose_a;
    let turn_a = b_from_a.rotation.cast::<f32>();
    let turn_b = pose_b.rotation.cast::<f32>();
    let mut sum = NormalEquations::zero();
    for s in &a.points {
        let p = transform_point(&b_from_a, &s.point);
        let normal = turn_a * nalgebra::Vector3::from(s.normal);
        if let Some((r, n, weight)) = match_pixel(b, &p, normal.into(), gate as f32) {
            let kernel = 1.0 - (r / gate) * (r / gate);
            let q = transform_point(pose_b, &p);
            let n = turn_b * nalgebra::Vector3::from(n);
            let weight = kernel * kernel * f64::from((s.weight * weight).sqrt());
            sum.add(&q, center, n.into(), sign * r, weight);
        }
    }
    sum
}

/// Point-to-plane residual, normal and weight of a camera-frame point against the pixel it falls on.
#[inline]
pub(crate) fn match_pixel(node: &Node, p: &Point3<f32>, normal: [f32; 3], gate: f32) -> Option<(f64, [f32; 3], f32)> {
    if p.z < 0.05 {
        return None;
    }
    let Node { view, halfway, .. } = *node;
    let camera = &view.camera;
    let inverse = 1.0 / p.z;
    let u = camera.fx as f32 * p.x * inverse + camera.cx as f32 + 0.5;
    let v = camera.fy as f32 * p.y * inverse + camera.cy as f32 + 0.5;
    if u < 0.0 || v < 0.0 || u >= camera.width as f32 || v >= camera.height as f32 {
        return None;
    }
    let (q, n) = view.element_at(u as usize, v as usize).filter(|(_, n)| dot(*n, normal) >= 0.7)?;
    let d = [p.x - q[0], p.y - q[1], p.z - q[2]];
    // A point that lies some way beside the pixel on a rounded surface is under the pixel's tangent, but not under the chord.
    let m = [n[0] + normal[0], n[1] + normal[1], n[2] + normal[2]];
    let m = if halfway { m.map(|c| c / dot(m, m).sqrt()) } else { n };
    let r = dot(m, d);
    let cosine = -dot(n, q) / dot(q, q).sqrt();
    let near = r.abs() < gate && dot(d, d) < 4.0 * gate * gate;
    near.then(|| (f64::from(r), m, cosine * cosine / (q[2] * q[2]).max(0.25)))
}

/// Increments of all poses from the pairs' systems; the first is held.
pub(crate) fn solve(count: usize, pairs: &[(usize, usize)], systems: &[NormalEquations]) -> Vec<Vector6<f64>> {
    let mut matrix = DMatrix::<f64>::zeros(count * 6, count * 6);
    let mut right = DVector::<f64>::zeros(count * 6);
    for (&(i, j), system) in pairs.iter().zip(systems) {
        let h = system.symmetric();
        for (row, column, sign) in [(i, i, 1.0), (j, j, 1.0), (i, j, -1.0), (j, i, -1.0)] {
            let mut block = matrix.fixed_view_mut::<6, 6>(row * 6, column * 6);
            block += h * sign;
        }
        let mut a = right.fixed_rows_mut::<6>(i * 6);
        a -= system.gradient;
        let mut b = right.fixed_rows_mut::<6>(j * 6);
        b += system.gradient;
    }
    let scale = matrix.diagonal().max().max(1e-12);
    for k in 0..count * 6 {
        matrix[(k, k)] += scale * 1e-8;
    }
    let mut held = matrix.fixed_view_mut::<6, 6>(0, 0);
    held += Matrix6::identity() * (scale * 1e3);
    match matrix.cholesky() {
        Some(factor) => {
            let x = factor.solve(&right);
            (0..count).map(|k| x.fixed_rows::<6>(k * 6).into()).collect()
        }
        None => vec![Vector6::zeros(); count],
    }
}

/// Moves the poses by increments about `center`.
pub(crate) fn apply(steps: &[Vector6<f64>], poses: &mut [Rigid], center: &Point3<f64>) {
    for (pose, x) in poses.iter_mut().zip(steps) {
        *pose = increment(x, center) * *pose;
    }
}
