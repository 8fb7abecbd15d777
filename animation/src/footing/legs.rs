//! Legs set so that ankles are where their feet stand, and feet out of the floor.

use nalgebra::Vector3;
use rayon::prelude::*;
use toile_character::{
    Pose,
    soles::{Sole, Soles},
};

use super::{hips, stances::Stances};

/// Feet in the air are lifted until no more than this is below the floor, metres, or as often as [`ROUNDS`].
const LEFT_OVER: f64 = 1e-4;
const ROUNDS: usize = 3;

/// Moves the hips of every pose by `up`, metres, ankles by `offsets`, and bends toes out of the floor.
pub(super) fn set(
    soles: &Soles,
    poses: &mut [Pose],
    stances: &[Stances; 2],
    offsets: &[Vec<Vector3<f64>>; 2],
    up: &[f64],
) {
    let masks = stances.each_ref().map(|s| s.mask(poses.len()));
    poses.par_iter_mut().enumerate().for_each(|(k, pose)| {
        pose.translation.y += up[k];
        for (foot, sole) in soles.feet().iter().enumerate() {
            let mut by = offsets[foot][k] - Vector3::y() * up[k];
            if !masks[foot][k] {
                by = within_reach(soles, sole, pose, by);
            }
            sole.leg.move_ankle(soles.skeleton(), pose, &by);
            if masks[foot][k] {
                soles.roll(sole, pose);
            } else {
                lift(soles, sole, pose);
            }
        }
    });
}

/// The displacement `by` of an ankle, shortened so that the leg does not become so straight that its knee pops.
fn within_reach(soles: &Soles, sole: &Sole, pose: &Pose, by: Vector3<f64>) -> Vector3<f64> {
    let at = pose.joint_positions(soles.skeleton());
    let (hip, ankle) = (at[sole.leg.upper.index()], at[sole.leg.foot.index()]);
    let way = ankle + by - hip;
    let limit = hips::reach(sole.leg.length(soles.skeleton()), (ankle - hip).norm());
    if way.norm() <= limit { by } else { hip + way * (limit / way.norm()) - ankle }
}

/// Lifts a foot that is below the floor: the knee bends until the sole is out, toes that would still be in it bend up.
pub(super) fn lift(soles: &Soles, sole: &Sole, pose: &mut Pose) {
    for round in 0..ROUNDS {
        // toes that bend take the ball's skin with them, so that the sole is looked at again
        let height = if round == 0 { soles.height_without_toes(sole, pose) } else { soles.height_of(sole, pose) };
        if height < 0.0 {
            sole.leg.move_ankle(soles.skeleton(), pose, &(Vector3::y() * -height));
        }
        if round == 0 {
            soles.bend_toes(sole, pose, 0.0);
        }
        if soles.height_of(sole, pose) > -LEFT_OVER {
            break;
        }
    }
}
