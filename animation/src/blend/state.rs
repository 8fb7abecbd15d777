//! What decides how an outfit moves on, as numbers: whoever writes them down can go on later, to the bit.
//!
//! Lists, in this order: the pose (translation, then a quaternion x, y, z, w a joint); where the blend simulates, the body of the last
//! step, and for each garment the four lists of its sheet ([`toile_cloth::Sheet::state`]), where it was carried, and its
//! corrections.

use nalgebra::{Point3, Quaternion, UnitQuaternion, Vector3};
use toile_character::Pose;

use super::{Blend, wearer::Wearer};
use crate::AnimationError;

/// Lists a garment.
const OF_GARMENT: usize = 6;

impl Wearer<'_> {
    /// What decides how the outfit moves on from the last pose.
    pub fn state(&self) -> Vec<Vec<f64>> {
        let mut out = vec![of_pose(&self.pose)];
        if self.blend == Blend::Skinning {
            return out;
        }
        out.push(self.body.positions().iter().flat_map(|p| [p.x, p.y, p.z]).map(f64::from).collect());
        for ((sheet, carried), corrections) in self.sheets.iter().zip(&self.carried).zip(&self.corrections) {
            out.extend(sheet.state());
            out.push(carried.iter().flat_map(|c| [c.x, c.y, c.z]).collect());
            out.push(corrections.iter().flat_map(|c| [c.x, c.y, c.z]).map(f64::from).collect());
        }
        out
    }

    /// Goes on from a [`state`](Wearer::state) of the same outfit and blend.
    ///
    /// # Errors
    /// [`AnimationError::Motion`] where it is that of another.
    pub fn restore(&mut self, state: &[Vec<f64>]) -> Result<(), AnimationError> {
        let other = || AnimationError::Motion("the state is not one of this outfit".into());
        let (pose, rest) = state.split_first().ok_or_else(other)?;
        let pose = pose_of(pose, &self.pose).ok_or_else(other)?;
        self.pose = pose.clone();
        if self.blend == Blend::Skinning {
            return if rest.is_empty() { Ok(()) } else { Err(other()) };
        }
        let (body, garments) = rest.split_first().ok_or_else(other)?;
        if body.len() != 3 * self.body.positions().len() || garments.len() != OF_GARMENT * self.sheets.len() {
            return Err(other());
        }
        let body: Vec<Point3<f32>> = vectors(body).map(Point3::from).collect();
        self.body.move_to(&body);
        for (k, lists) in garments.chunks_exact(OF_GARMENT).enumerate() {
            let [positions, velocities, pressed, anchors, carried, corrections] = lists else { return Err(other()) };
            if carried.len() != 3 * self.carried[k].len() || corrections.len() != 3 * self.corrections[k].len() {
                return Err(other());
            }
            self.sheets[k].restore([positions, velocities, pressed, anchors]).map_err(|_| other())?;
            self.carried[k] = carried.chunks_exact(3).map(|c| Vector3::new(c[0], c[1], c[2])).collect();
            self.corrections[k] = vectors(corrections).collect();
        }
        // How the columns are pressed follows from the pose alone.
        self.pressed = Some(self.pressed_at(&pose)?);
        Ok(())
    }
}

/// Numbers that were 32 bits wide before.
fn vectors(values: &[f64]) -> impl Iterator<Item = Vector3<f32>> + '_ {
    values.chunks_exact(3).map(|v| Vector3::new(v[0] as f32, v[1] as f32, v[2] as f32))
}

fn of_pose(pose: &Pose) -> Vec<f64> {
    let turns = pose.rotations.iter().flat_map(|r| r.coords.iter().copied().collect::<Vec<_>>());
    pose.translation.iter().copied().chain(turns).collect()
}

/// A pose of as many joints as `like` has.
fn pose_of(values: &[f64], like: &Pose) -> Option<Pose> {
    if values.len() != 3 + 4 * like.rotations.len() || !values.iter().all(|v| v.is_finite()) {
        return None;
    }
    // Not made of unit length again: that would change the last bit.
    let turn = |q: &[f64]| UnitQuaternion::new_unchecked(Quaternion::new(q[3], q[0], q[1], q[2]));
    let rotations = values[3..].chunks_exact(4).map(turn).collect();
    Some(Pose { translation: Vector3::new(values[0], values[1], values[2]), rotations })
}
