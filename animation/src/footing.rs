//! Feet that stand: held where they are, on the floor, without sliding.
//!
//! A motion carried onto other proportions slides by a few millimetres a step, and captures slide by themselves. The skin
//! that touches the floor tells how: where a sole is low and slow it stands ([`stances`]), and rolling from heel to ball it
//! must not slip; what it slips is taken back ([`offsets`]), and in the air the foot comes back to its way. The hips follow up and down as far
//! as the legs need it ([`hips`]), ankles are moved by bending the knee, and toes bend up out of the floor ([`legs`]). At last
//! what else of the body is below the floor lifts the whole ([`body`]). After Kovar, Schreiner and Gleicher 2002, "Footskate
//! cleanup for motion capture editing", with the rolling patch of skin in place of their constrained heel and ball, and
//! without their stretched legs.

mod body;
mod hips;
mod legs;
mod offsets;
mod smooth;
mod stances;
mod track;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use toile_character::{Motion, SkinnedMesh, soles::Soles};

use stances::Stances;
use track::Track;

/// How feet were made to stand. Lengths in metres.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Footing {
    /// Times that a foot stands.
    pub stances: usize,
    /// Farthest that a foot was moved along the floor,
    pub moved_most: f64,
    /// and farthest that one that stands was moved up or down.
    pub lifted_most: f64,
    /// Farthest that the hips were lowered or raised for the feet.
    pub hips_most: f64,
    /// Farthest that the whole was lifted because something other than feet was below the floor.
    pub body_most: f64,
}

/// Makes the feet of `motion` stand on the floor, y = 0, and keeps `body`, where there is one, above it.
pub(crate) fn stand(soles: &Soles, body: Option<&SkinnedMesh>, motion: &mut Motion) -> Footing {
    let step = motion.frame_time;
    if let Some(body) = body {
        body::put_on_floor(body, &mut motion.poses);
    }
    let tracks = soles.feet().each_ref().map(|sole| Track::of(soles, sole, &motion.poses));
    let stances = tracks.each_ref().map(|track| Stances::of(track, step));
    let offsets = [0, 1].map(|foot: usize| offsets::of(&tracks[foot], &stances[foot], step));
    let hips = hips::shift(soles, &motion.poses, &stances, &offsets, step);
    legs::set(soles, &mut motion.poses, &stances, &offsets, &hips);
    let lifted = body.map_or(0.0, |body| body::lift(soles, body, motion, &stances));
    let most = |value: &dyn Fn(&Vector3<f64>) -> f64| {
        let standing = (0..2).flat_map(|foot| stances[foot].poses().map(move |pose| (foot, pose)));
        standing.map(|(foot, pose)| value(&offsets[foot][pose])).fold(0.0, f64::max)
    };
    Footing {
        stances: stances.iter().map(Stances::count).sum(),
        moved_most: most(&|o| o.x.hypot(o.z)),
        lifted_most: most(&|o| o.y.abs()),
        hips_most: hips.iter().map(|h| h.abs()).fold(0.0, f64::max),
        body_most: lifted,
    }
}
