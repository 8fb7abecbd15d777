//! A motion as a glTF animation: rotation tracks of the joints that move, and the path of the hips.

use nalgebra::UnitQuaternion;
use serde_json::{Value, json};
use toile_character::{Joint, Motion, Pose, Skeleton, joint::JOINTS};

use crate::buffer::{Buffer, Shape, Target};

/// Smaller turns and shifts do not count as movement: radians, metres.
const STILL_ANGLE: f64 = 1e-5;
const STILL_SHIFT: f64 = 1e-6;

/// Accessors of key times, made when first used.
struct Times<'a> {
    motion: &'a Motion,
    all: Option<usize>,
    ends: Option<usize>,
}

/// The animation of `motion` on nodes that rest in `pose0`, arrays added to `buffer`. Joints that stay as they
/// rest get no track, joints that stay otherwise a key at either end. `None` where nothing differs from the rest.
pub(crate) fn clip(skeleton: &Skeleton, pose0: &Pose, motion: &Motion, buffer: &mut Buffer) -> Option<Value> {
    let mut times = Times { motion, all: None, ends: None };
    let (mut channels, mut samplers) = (Vec::new(), Vec::new());
    let mut add = |joint: Joint, path: &str, (input, output): (usize, usize)| {
        channels.push(json!({ "sampler": samplers.len(), "target": { "node": joint.index(), "path": path } }));
        samplers.push(json!({ "input": input, "output": output, "interpolation": "LINEAR" }));
    };
    if let Some(track) = hips_track(skeleton, pose0, motion, &mut times, buffer) {
        add(Joint::Hips, "translation", track);
    }
    for joint in JOINTS {
        if let Some(track) = rotation_track(joint, pose0, motion, &mut times, buffer) {
            add(joint, "rotation", track);
        }
    }
    if channels.is_empty() {
        return None;
    }
    Some(json!({ "name": motion.name, "channels": channels, "samplers": samplers }))
}

impl Times<'_> {
    /// Accessor of the times of every pose, or of the first and last alone.
    fn of(&mut self, moving: bool, buffer: &mut Buffer) -> usize {
        let last = self.motion.poses.len() - 1;
        let step = self.motion.frame_time;
        let slot = if moving { &mut self.all } else { &mut self.ends };
        *slot.get_or_insert_with(|| {
            let indices: Vec<usize> = if moving { (0..=last).collect() } else { ends(last) };
            let seconds: Vec<f32> = indices.iter().map(|i| (*i as f64 * step) as f32).collect();
            buffer.add_bounded(&seconds, Shape::Scalar, Target::Data)
        })
    }
}

fn ends(last: usize) -> Vec<usize> {
    if last == 0 { vec![0] } else { vec![0, last] }
}

fn hips_track(
    skeleton: &Skeleton,
    pose0: &Pose,
    motion: &Motion,
    times: &mut Times<'_>,
    buffer: &mut Buffer,
) -> Option<(usize, usize)> {
    let first = motion.poses[0].translation;
    let moving = motion.poses.iter().any(|p| (p.translation - first).norm() > STILL_SHIFT);
    if !moving && (first - pose0.translation).norm() <= STILL_SHIFT {
        return None;
    }
    let rest = skeleton.position(Joint::Hips).coords;
    let keys: Vec<f32> =
        kept(motion, moving).flat_map(|p| <[f32; 3]>::from((rest + p.translation).cast::<f32>())).collect();
    Some((times.of(moving, buffer), buffer.add(&keys, Shape::Vec3, Target::Data)))
}

fn rotation_track(
    joint: Joint,
    pose0: &Pose,
    motion: &Motion,
    times: &mut Times<'_>,
    buffer: &mut Buffer,
) -> Option<(usize, usize)> {
    let first = motion.poses[0].rotation(joint);
    let moving = motion.poses.iter().any(|p| p.rotation(joint).angle_to(&first) > STILL_ANGLE);
    if !moving && first.angle_to(&pose0.rotation(joint)) <= STILL_ANGLE {
        return None;
    }
    let mut keys: Vec<f32> = Vec::with_capacity(4 * motion.poses.len());
    let mut before = pose0.rotation(joint);
    for pose in kept(motion, moving) {
        // q and -q are one rotation: the nearer one keeps linear interpolation on the short way
        let rotation = pose.rotation(joint);
        let near = if rotation.coords.dot(&before.coords) < 0.0 {
            UnitQuaternion::new_unchecked(-rotation.into_inner())
        } else {
            rotation
        };
        keys.extend(near.coords.cast::<f32>().iter());
        before = near;
    }
    Some((times.of(moving, buffer), buffer.add(&keys, Shape::Vec4, Target::Data)))
}

fn kept(motion: &Motion, moving: bool) -> impl Iterator<Item = &Pose> {
    let last = motion.poses.len() - 1;
    let indices = if moving { (0..=last).collect() } else { ends(last) };
    indices.into_iter().map(|i| &motion.poses[i])
}
