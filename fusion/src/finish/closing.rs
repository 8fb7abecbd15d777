//! Closing the turn: all poses together, over frame pairs that see the same surface.
//!
//! Every pair contributes point-to-plane residuals between its two depth images; the first and last frames of a full
//! turn overlap as well as neighbours do, so the seam's error spreads over the whole turn.

use nalgebra::{Matrix6, Point3};
use rayon::prelude::*;
use toile_geometry::{Rigid, statistics::median, transform_point};

use super::pairs::{Node, apply, linearise, match_pixel, solve};
use crate::{
    frame::DepthView,
    tracking::{MAX_VIEWS, NormalEquations, hold_open_directions, samples},
};

/// Points of a frame used in each pair.
const POINTS: usize = 1500;
/// Points of a frame used to find out who overlaps whom.
const PROBES: usize = 150;
/// Smallest share of probes that a partner must see.
const MIN_OVERLAP: f64 = 0.4;
/// The same where each view has but its two neighbours.
const MIN_OVERLAP_OF_VIEWS: f64 = 0.2;
/// Index distances of pairs along the way.
const STRIDES: [usize; 7] = [1, 2, 3, 5, 8, 13, 21];
/// Of farther pairs (across the seam, or back at a place seen before) one in this many is used.
const SEAM_THINNING: usize = 3;
/// Distance gate of the first and of the last round, metres.
const GATES: (f64, f64) = (0.04, 0.012);

/// The result of the optimisation.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Closing {
    /// Frame pairs used.
    pub pairs: usize,
    /// Those of them more than half the take apart: across the seam.
    pub seam_pairs: usize,
    /// Median offset of the seam pairs at the subject's centre before, metres.
    pub seam_before: f64,
    /// The same after.
    pub seam_after: f64,
    /// Root mean square residual of the last round, metres.
    pub residual: f64,
}

/// Optimises `poses` (model_from_camera of each view, those of each sensor in the order of time) together. The first
/// pose stays.
pub fn close(views: &[DepthView], sensors: &[usize], poses: &mut [Rigid], rounds: usize) -> Closing {
    let nodes: Vec<Node> =
        views.par_iter().map(|view| Node { view, points: samples(view, POINTS), halfway: false }).collect();
    let center = subject_center(&nodes, poses);
    let pairs = overlapping_pairs(&nodes, poses);
    let views_of = |sensor: usize| sensors.iter().filter(|s| **s == sensor).count();
    let seam = |p: &(usize, usize)| sensors[p.0] == sensors[p.1] && p.1 - p.0 > views_of(sensors[p.0]) / 2;
    let mut closing =
        Closing { pairs: pairs.len(), seam_pairs: pairs.iter().filter(|p| seam(p)).count(), ..Closing::default() };
    if poses.len() < 2 || pairs.is_empty() {
        return closing;
    }
    for round in 0..rounds {
        let share = round as f64 / (rounds - 1).max(1) as f64;
        let gate = GATES.0 * (GATES.1 / GATES.0).powf(share);
        let systems = held(&nodes, poses, &pairs, &center, gate);
        if round == 0 {
            closing.seam_before = seam_offset(&pairs, &systems, seam);
        }
        apply(&solve(poses.len(), &pairs, &systems), poses, &center);
    }
    let systems = held(&nodes, poses, &pairs, &center, GATES.1);
    closing.seam_after = seam_offset(&pairs, &systems, seam);
    let (squares, weight) = systems.iter().fold((0.0, 0.0), |(s, w), n| (s + n.squares, w + n.weight));
    closing.residual = (squares / f64::max(weight, 1e-12)).sqrt();
    closing
}

/// The equations of each pair; what a pair leaves open stays as it is.
fn held(
    nodes: &[Node],
    poses: &[Rigid],
    pairs: &[(usize, usize)],
    center: &Point3<f64>,
    gate: f64,
) -> Vec<NormalEquations> {
    let mut systems = linearise(nodes, poses, pairs, center, gate);
    systems.iter_mut().for_each(hold_open_directions);
    systems
}

/// Pairs that see the same surface: along the way at growing strides, and across the seam.
fn overlapping_pairs(nodes: &[Node], poses: &[Rigid]) -> Vec<(usize, usize)> {
    let count = nodes.len();
    let far = STRIDES[STRIDES.len() - 1];
    // Of a few views each overlaps its neighbours alone, the last one the first.
    let are_views = count <= MAX_VIEWS;
    let wanted = |i: usize, j: usize| {
        are_views || STRIDES.contains(&(j - i)) || (j - i > far && (i + 2 * j).is_multiple_of(SEAM_THINNING))
    };
    let all: Vec<(usize, usize)> =
        (0..count).flat_map(|i| (i + 1..count).map(move |j| (i, j))).filter(|&(i, j)| wanted(i, j)).collect();
    let overlaps = |&&(i, j): &&(usize, usize)| {
        let turn = poses[i].rotation.inverse() * poses[j].rotation;
        if turn.angle() > 1.3 {
            return false;
        }
        let b_from_a = poses[j].inverse() * poses[i];
        let turn = b_from_a.rotation.cast::<f32>();
        let thin = (nodes[i].points.len() / PROBES).max(1);
        let probes = nodes[i].points.iter().step_by(thin);
        let total = probes.clone().count();
        let seen = probes.filter(|s| {
            let normal = turn * nalgebra::Vector3::from(s.normal);
            match_pixel(&nodes[j], &transform_point(&b_from_a, &s.point), normal.into(), 0.05).is_some()
        });
        let least = if are_views { MIN_OVERLAP_OF_VIEWS } else { MIN_OVERLAP };
        seen.count() as f64 >= least * total.max(1) as f64
    };
    all.par_iter().filter(overlaps).copied().collect()
}

/// Median over seam pairs of the motion that each pair alone asks for, metres at the subject's centre.
fn seam_offset(pairs: &[(usize, usize)], systems: &[NormalEquations], seam: impl Fn(&(usize, usize)) -> bool) -> f64 {
    let alone = |s: &NormalEquations| {
        let h = s.symmetric();
        let damped = h + Matrix6::identity() * (h.trace() * 1e-5).max(1e-12);
        damped.cholesky().map(|c| c.solve(&s.gradient).fixed_rows::<3>(3).norm())
    };
    let mut sizes: Vec<f64> =
        pairs.iter().zip(systems).filter(|(p, s)| seam(p) && s.count > 100).filter_map(|(_, s)| alone(s)).collect();
    median(&mut sizes).unwrap_or(0.0)
}

fn subject_center(nodes: &[Node], poses: &[Rigid]) -> Point3<f64> {
    let (mut sum, mut count) = (nalgebra::Vector3::zeros(), 0);
    for (node, pose) in nodes.iter().zip(poses) {
        for s in node.points.iter().step_by(10) {
            sum += (pose * s.point.cast::<f64>()).coords;
            count += 1;
        }
    }
    Point3::from(sum / f64::from(count.max(1)))
}
