//! Where resting cameras stand, from what they see of the same surfaces.
//!
//! Two cameras a quarter of a circle apart see little of a person in common, and that obliquely; but everything in the
//! room rests, and most cameras see the floor, which leaves only a shift along it and a turn open. So the subject's points
//! and those of the surroundings are registered together, all cameras at once.

use rayon::prelude::*;
use toile_geometry::{Rigid, element::Element};

use crate::{
    finish::{Node, apply, linearise, solve},
    frame::{CutDepth, DepthView, depth_noise, dot, window_for},
    rig::volume_at,
    subject::{Eye, SubjectVolume},
    tracking::samples,
};

/// Points of the subject, and of all that a camera sees, in the registration.
const SUBJECT_POINTS: usize = 8000;
const ROOM_POINTS: usize = 2000;
/// Distance gates: recorded places are off by 20 mm and 1 degree, which is 38 mm more at 2.2 m, and that twice.
const FIRST_GATE: f64 = 0.16;
/// Standard deviations of the difference of two depths at which the last gate ends (Tukey's 4.7 each, root of 2).
const LAST_GATE: f64 = 6.6;
const SMALLEST_GATE: f64 = 0.006;
/// What is seen more obliquely than this (cosine) of the subject is not compared with: pixels are wide there and the normals
/// of rounded surfaces lean towards the camera, which pushes cameras apart by half a millimetre.
const OBLIQUE: f32 = 0.6;
/// Rounds in which the gate closes, and those with the last one.
const CLOSING: usize = 20;
const SETTLED: usize = 6;
/// The floor stays this far under what counts as the subject: what a degree is at the distance of a person, twice.
const RAISED: f64 = 0.08;
/// Metres a unit of depth that many frames agree on: finer than a sensor's.
const FINE: f32 = 1e-4;

/// What a camera sees, prepared for registration.
pub(crate) struct Sight {
    /// Everything.
    pub room: DepthView,
    /// Everything but what is seen obliquely of the subject: what points of other cameras are compared with.
    pub targets: DepthView,
    /// The subject alone.
    pub subject: DepthView,
}

/// What each camera sees, and its noise (metres).
pub(crate) fn sights(eyes: &[Eye], volume: &SubjectVolume) -> (Vec<Sight>, f64) {
    let model_from_rig = volume.model_from_camera * eyes[0].rig_from_camera.inverse();
    let one = |eye: &Eye| {
        let depth = &eye.seen.depth;
        let within = volume_at(Some(volume), &(model_from_rig * eye.rig_from_camera), RAISED);
        let within = within.map_or_else(|| depth.clone(), |v| v.cut(&eye.camera, depth));
        let noise = depth_noise(&eye.camera, &within).unwrap_or(0.0);
        let cut = CutDepth::new(&eye.camera, &within, FINE);
        let mean = cut.meters().iter().map(|d| f64::from(*d)).sum::<f64>() / cut.count().max(1) as f64;
        let window = window_for(&eye.camera, noise, mean);
        let room = DepthView::new(&eye.camera, depth, window);
        let mut targets = room.clone();
        let is_oblique = |i: usize| within[i] > 0.0 && room.element(i).is_some_and(|(p, n)| is_oblique(p, n));
        (0..within.len()).filter(|&i| is_oblique(i)).for_each(|i| targets.elements[i] = Element::EMPTY);
        (Sight { room, targets, subject: cut.view(window) }, noise)
    };
    let (sights, noise): (Vec<Sight>, Vec<f64>) = eyes.par_iter().map(one).unzip();
    (sights, noise.into_iter().fold(0.0, f64::max))
}

fn is_oblique(p: [f32; 3], n: [f32; 3]) -> bool {
    -dot(n, p) < OBLIQUE * dot(p, p).sqrt()
}

fn node(sight: &Sight) -> Node<'_> {
    let points = [samples(&sight.subject, SUBJECT_POINTS), samples(&sight.room, ROOM_POINTS)].concat();
    Node { view: &sight.targets, points, halfway: true }
}

/// Refines the cameras' places (rig_from_camera); the first one stays. `noise`: standard deviation of the depth, metres.
pub(crate) fn align(sights: &[Sight], noise: f64, volume: &SubjectVolume, poses: &mut [Rigid]) {
    let nodes: Vec<Node> = sights.par_iter().map(node).collect();
    let pairs: Vec<(usize, usize)> = (0..poses.len()).flat_map(|i| (i + 1..poses.len()).map(move |j| (i, j))).collect();
    let center = poses[0] * volume.model_from_camera.inverse() * nalgebra::Point3::new(0.0, 0.9, 0.0);
    let last = (LAST_GATE * noise).clamp(SMALLEST_GATE, FIRST_GATE);
    for round in 0..CLOSING + SETTLED {
        let share = (round as f64 / CLOSING as f64).min(1.0);
        let gate = FIRST_GATE * (last / FIRST_GATE).powf(share);
        let systems = linearise(&nodes, poses, &pairs, &center, gate);
        apply(&solve(poses.len(), &pairs, &systems), poses, &center);
    }
}
