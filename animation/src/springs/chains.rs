//! Joints down the cloth.

use nalgebra::Point3;
use toile_character::{SpringChain, SpringCollider, SpringJoint};

use super::{
    around::{Around, CHAINS},
    cloth::Cloth,
};
use crate::blend::DRAG;

/// Length that a bone of a chain aims at, metres: cloth bends over less only in folds.
const BONE: f64 = 0.1;
/// Bones of a chain: at least, at most.
const BONES: (usize, usize) = (2, 4);
/// Distance that joints keep from capsules, metres. A capsule of 80 mm between two chains that lie 100 mm apart would come through the
/// cloth's chord by as much.
const HIT: f64 = 0.02;
/// Angular frequency of a bone that swings, rad/s. Cloth is held by its neighbours around the hem beside its own tie (`LOOSE` of
/// [`crate::blend`]), which single chains are not. Fitted to the simulated skirt of a generated person in the walk (`figures` in
/// `avatar/tests/springs`): its hem was 101 mm away at 14 rad/s, 95 at 20, 96 at 28.
const SWING: f64 = 20.0;
/// Seconds between two updates: the format's constants are of one update, and programs draw 60 pictures a second.
const UPDATE: f64 = 1.0 / 60.0;

/// The chains, evenly around the body and down to the lowest hem.
pub(super) fn lay(around: &Around, cloth: &Cloth, colliders: &[SpringCollider]) -> Vec<SpringChain> {
    let length = around.top - cloth.low;
    let bones = ((length / BONE).round() as usize).clamp(BONES.0, BONES.1);
    let chain = |k: usize| {
        let places: Vec<Point3<f64>> = (0..=bones)
            .map(|r| joint(around, cloth, colliders, k as f64, around.top - length * r as f64 / bones as f64))
            .collect();
        let length = |r: usize| places.get(r + 1).map_or(0.0, |next| (next - places[r]).norm());
        let joints = (0..=bones)
            .map(|r| SpringJoint { place: places[r], stiffness: stiffness(length(r)), hit_radius: HIT })
            .collect();
        SpringChain { name: format!("hem {}", k + 1), joints }
    };
    (0..CHAINS).map(chain).collect()
}

/// The place on the cloth at an angle (in chains) and a height, moved out until it is clear of all capsules.
fn joint(around: &Around, cloth: &Cloth, colliders: &[SpringCollider], turn: f64, height: f64) -> Point3<f64> {
    // Each step is the distance that lacks: steps outward never go too far, and soon bring little.
    const STEPS: usize = 50;
    let mut radius = cloth.radius(turn, height);
    for _ in 0..STEPS {
        let place = around.place(turn, radius, height);
        let lacks = colliders.iter().map(|c| HIT - c.distance(&place)).fold(0.0, f64::max);
        if lacks <= 0.0 {
            break;
        }
        radius += lacks + 1e-4;
    }
    around.place(turn, radius, height)
}

/// Stiffness of a bone of this `length` (metres) that swings with the frequency [`SWING`] = ω: an update turns the bone by stiffness · Δt / length of
/// the way back, and a spring by ω² Δt².
fn stiffness(length: f64) -> f64 {
    SWING * SWING * UPDATE * length
}

/// Share of its velocity that a joint loses in an update, as the air and the layers below damp the cloth of [`crate::blend`].
pub(super) fn drag() -> f64 {
    1.0 - (-DRAG * UPDATE).exp()
}
