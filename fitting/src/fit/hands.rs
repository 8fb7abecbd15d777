//! Hands that are turned the wrong way round: a forearm is nearly round, so that closest points never turn it by a half.
//!
//! Once arms lie on the scan, each hand is tried turned about its forearm and bent at the wrist; a turn that agrees clearly
//! better is taken. What is left is for the finer resolutions.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use toile_character::{BodyModel, Joint};

use super::resolution::Sampled;
use crate::{
    solve::{Articulated, State},
    surface::{Cloud, Samples, Thinned},
};

/// Sampling of a hand, metres: a finger's width.
const CELL: f32 = 0.012;
/// Scale of the robust cost, metres: a finger's width and what the resolution before leaves.
const KERNEL: f32 = 0.02;
/// Scan within this of a hand's middle is its own, metres, unless another part of the body explains it within [`EXPLAINED`].
const AROUND: f32 = 0.14;
const EXPLAINED: f32 = 0.02;
/// Cost of skin or scan without the other near it.
const ALONE: f32 = 0.8;
/// Cost of another turn, as a share of the hand's as it is, below which it is taken.
const BETTER: f32 = 0.75;
/// Smallest number of scan samples that say how a hand is turned: a half of the back of a hand.
const FEWEST: usize = 12;
/// Turns tried, degrees: of the forearm about itself, of the hand about itself, and bends of the wrist.
const FOREARM: [f64; 5] = [-120.0, -60.0, 0.0, 60.0, 120.0];
const HAND: [f64; 3] = [-50.0, 0.0, 50.0];
const BEND: [f64; 3] = [-45.0, 0.0, 45.0];

/// The state with hands turned to what the scan shows of them; everything else stays.
pub(crate) fn turned_hands(model: &BodyModel, sampled: &Sampled, mut state: State) -> State {
    for (elbow, wrist) in [(Joint::LeftLowerArm, Joint::LeftHand), (Joint::RightLowerArm, Joint::RightHand)] {
        if let Some(turned) = turned(model, sampled, &state, elbow, wrist) {
            state = turned;
        }
    }
    state
}

fn turned(model: &BodyModel, sampled: &Sampled, state: &State, elbow: Joint, wrist: Joint) -> Option<State> {
    let mesh = toile_geometry::Mesh::new(model.mean.clone(), model.triangles.clone());
    let is_hand = |j: Joint| j == wrist || j.is_finger() && j.name().starts_with(side(wrist));
    let main = |v: usize| Joint::from_index(usize::from(model.weights.joints[v][0]));
    let picked = Thinned::new(&mesh, &mesh.vertex_normals(), CELL, |v| main(v).is_some_and(is_hand));
    let hand = Articulated::of_model(model, &picked, state.beta.len());
    let own = own_scan(sampled, &hand, state, &is_hand)?;
    let all: Vec<usize> = (0..hand.len()).collect();
    let cost = |s: &State| disagreement(&own, &hand.pose_of(s, &all));
    let mut lowest = BETTER * cost(state);
    let mut best = None;
    for candidate in candidates(&hand, state, elbow, wrist) {
        let there = cost(&candidate);
        if there < lowest {
            (lowest, best) = (there, Some(candidate));
        }
    }
    best
}

fn side(wrist: Joint) -> &'static str {
    if wrist == Joint::LeftHand { "left" } else { "right" }
}

/// Scan around a hand that no other part of the body explains; `None` where there is too little.
fn own_scan(sampled: &Sampled, hand: &Articulated, state: &State, is_hand: &dyn Fn(Joint) -> bool) -> Option<Cloud> {
    let points = hand.pose(state).points;
    let middle = Point3::from(points.iter().map(|p| p.coords).sum::<Vector3<f32>>() / points.len().max(1) as f32);
    let posed = sampled.body.pose(state);
    let others: Vec<usize> = (0..sampled.body.len()).filter(|&v| !is_hand(sampled.body.main_joint(v))).collect();
    let others = Cloud::new(Samples {
        points: others.iter().map(|&v| posed.points[v]).collect(),
        normals: others.iter().map(|&v| posed.normals[v]).collect(),
        ..Samples::default()
    })?;
    let scan = &sampled.scan.samples;
    let is_own = |k: &usize| {
        let (p, n) = (&scan.points[*k], &scan.normals[*k]);
        (p - middle).norm() < AROUND && others.nearest(p, n, EXPLAINED, 0.3).is_none()
    };
    let own: Vec<usize> = (0..scan.points.len()).filter(is_own).collect();
    let samples = Samples {
        points: own.iter().map(|&k| scan.points[k]).collect(),
        normals: own.iter().map(|&k| scan.normals[k]).collect(),
        areas: own.iter().map(|&k| scan.areas[k]).collect(),
        weights: own.iter().map(|&k| scan.weights[k]).collect(),
        colors: Vec::new(),
    };
    if own.len() < FEWEST { None } else { Cloud::new(samples) }
}

fn candidates(hand: &Articulated, state: &State, elbow: Joint, wrist: Joint) -> Vec<State> {
    let skeleton = hand.skeleton_at(&state.beta);
    let forearm = (skeleton.position(wrist) - skeleton.position(elbow)).try_normalize(1e-9).unwrap_or_else(Vector3::x);
    let across = forearm.cross(&Vector3::z()).try_normalize(1e-9).unwrap_or_else(Vector3::y);
    let turn = |axis: &Vector3<f64>, degrees: f64| UnitQuaternion::from_scaled_axis(axis * degrees.to_radians());
    let mut out = Vec::new();
    for about in FOREARM {
        for hand_about in HAND {
            for bend in BEND {
                let mut next = state.clone();
                // the forearm's own axis: the elbow's bend stays
                *next.pose.rotation_mut(elbow) *= turn(&forearm, about);
                // palms rest facing the thighs: wrists bend about the axis to the front
                let palm = across.cross(&forearm);
                *next.pose.rotation_mut(wrist) = turn(&palm, bend) * turn(&forearm, hand_about);
                out.push(next);
            }
        }
    }
    out
}

/// Robust distance from skin to scan and from scan to skin, each averaged over its area, 0–2.
fn disagreement(own: &Cloud, skin: &[(Point3<f32>, Vector3<f32>, f32)]) -> f32 {
    let robust = |squared: f32| (squared / (squared + KERNEL * KERNEL)).min(ALONE);
    let (mut forward, mut area) = (0.0, 0.0);
    for (p, n, a) in skin {
        let near = own.nearest(p, n, 3.0 * KERNEL, 0.2);
        forward += a * near.map_or(ALONE, |q| robust((p - own.samples.points[q as usize]).norm_squared()));
        area += a;
    }
    let (mut backward, mut seen) = (0.0, 0.0);
    for (k, w) in own.samples.weights.iter().enumerate() {
        let (q, m) = (&own.samples.points[k], &own.samples.normals[k]);
        let fits = skin.iter().filter(|(_, n, _)| n.dot(m) > 0.2).map(|(p, ..)| (p - q).norm_squared());
        backward += w * robust(fits.fold(1.0, f32::min));
        seen += w;
    }
    forward / area.max(1e-9) + backward / seen.max(1e-9)
}
