//! Helper joints: nodes beside the skeleton's that play a motion which skinning on the skeleton alone cannot show.

use nalgebra::{Isometry3, Point3, Translation3};
use serde_json::{Value, json};
use toile_character::{JOINT_COUNT, Joint, Motion, Pose};

use crate::{
    Avatar, AvatarError,
    buffer::{Buffer, Shape, Target},
    clip::clip,
    dressed::check_pose,
    glb::{document, finish},
    rig::Rig,
};

/// Joints that move parts of layers in one motion. The layers' weights name them behind the skeleton's 52, in order.
#[derive(Debug, Clone, Default)]
pub struct HelperJoints {
    /// Name of each node.
    pub names: Vec<String>,
    /// Where each rests, metres, in the avatar's pose and frame.
    pub centers: Vec<Point3<f64>>,
    /// In each frame of the avatar's only motion, the transform of each: it moves a vertex of the avatar's meshes to where the helper
    /// wants it. Single precision, as the file has it: a motion of ten minutes with 64 of them fills 32 MB.
    pub frames: Vec<Vec<Isometry3<f32>>>,
}

/// A GLB file as [`crate::write_glb`] makes it, with `helpers` as nodes below the hips and their tracks in the animation of the avatar's only motion.
///
/// Any player that knows skins of more than 52 joints shows it: no extension is used.
///
/// # Errors
/// The errors of [`Avatar::validate`], where layers may also hang on helpers; [`AvatarError::Helpers`] where the avatar has not one motion, or helpers, names
/// and frames do not fit together.
pub fn write_glb_with_helpers(avatar: &Avatar, helpers: &HelperJoints) -> Result<Vec<u8>, AvatarError> {
    let motion = helpers.check(avatar)?;
    avatar.validate_with(JOINT_COUNT + helpers.names.len())?;
    let rig = Rig::posed(&avatar.skeleton, &avatar.pose0).with_helpers(&helpers.names, &helpers.centers);
    let mut buffer = Buffer::default();
    let mut document = document(avatar, &rig, &mut buffer);
    let still = || json!({ "name": motion.name, "channels": [], "samplers": [] });
    let mut animation = clip(&avatar.skeleton, &avatar.pose0, motion, &mut buffer).unwrap_or_else(still);
    helpers.add_tracks(avatar, motion, &mut animation, &mut buffer);
    if animation["channels"].as_array().is_some_and(|channels| !channels.is_empty()) {
        document.insert("animations".into(), json!([animation]));
    }
    finish(buffer, document)
}

impl HelperJoints {
    /// The avatar's only motion, which the helpers play.
    fn check<'a>(&self, avatar: &'a Avatar) -> Result<&'a Motion, AvatarError> {
        let wrong = |reason: String| Err(AvatarError::Helpers(reason));
        let [motion] = avatar.motions.as_slice() else {
            return wrong(format!("they play one motion, but the avatar has {}", avatar.motions.len()));
        };
        let count = self.names.len();
        if self.centers.len() != count || JOINT_COUNT + count > 256 {
            let centers = self.centers.len();
            return wrong(format!("{count} names but {centers} places; both at most {}", 256 - JOINT_COUNT));
        }
        if let Some(i) =
            (0..count).find(|&i| self.names[i].trim().is_empty() || self.names[..i].contains(&self.names[i]))
        {
            return wrong(format!("the name {:?} of helper {i} is empty or taken", self.names[i]));
        }
        if self.frames.len() != motion.poses.len() || self.frames.iter().any(|f| f.len() != count) {
            let (frames, poses) = (self.frames.len(), motion.poses.len());
            return wrong(format!(
                "{frames} frames, but the motion has {poses}; each needs a transform of each of the {count} helpers"
            ));
        }
        let finite = |t: &Isometry3<f32>| {
            let length = t.rotation.norm();
            t.translation.vector.iter().all(|c| c.is_finite()) && (length - 1.0).abs() < 1e-3
        };
        if let Some(f) = self.frames.iter().position(|frame| !frame.iter().all(finite)) {
            return wrong(format!("a transform of frame {f} is not finite or its rotation not of unit length"));
        }
        if !self.centers.iter().all(|c| c.coords.iter().all(|c| c.is_finite())) {
            return wrong("the place of a helper is not finite".into());
        }
        motion.poses.iter().try_for_each(check_pose).map_err(AvatarError::Helpers)?;
        Ok(motion)
    }

    /// Adds a track of turns and one of places for each helper, relative to the hips.
    fn add_tracks(&self, avatar: &Avatar, motion: &Motion, animation: &mut Value, buffer: &mut Buffer) {
        if self.names.is_empty() {
            return;
        }
        let seconds: Vec<f32> = (0..motion.poses.len()).map(|i| (i as f64 * motion.frame_time) as f32).collect();
        let input = buffer.add_bounded(&seconds, Shape::Scalar, Target::Data);
        let hips = |pose: &Pose| {
            let place = avatar.skeleton.position(Joint::Hips).coords + pose.translation;
            (Translation3::from(place) * pose.rotation(Joint::Hips)).inverse()
        };
        let hips_from_scene: Vec<Isometry3<f64>> = motion.poses.iter().map(hips).collect();
        for helper in 0..self.names.len() {
            let rest = Translation3::from(self.centers[helper].coords);
            let (mut turns, mut places): (Vec<f32>, Vec<f32>) = (Vec::new(), Vec::new());
            let mut before = None;
            for (frame, hips_from_scene) in self.frames.iter().zip(&hips_from_scene) {
                let local = hips_from_scene * frame[helper].cast::<f64>() * rest;
                places.extend(local.translation.vector.cast::<f32>().iter());
                // q and −q are one rotation: the nearer one keeps linear interpolation on the short way.
                let turn = local.rotation.coords.normalize();
                let near = if before.is_some_and(|b| turn.dot(&b) < 0.0) { -turn } else { turn };
                turns.extend(near.map(|c| (c as f32).clamp(-1.0, 1.0)).iter());
                before = Some(near);
            }
            let node = JOINT_COUNT + helper;
            let output = buffer.add(&turns, Shape::Vec4, Target::Data);
            add_channel(animation, node, "rotation", [input, output]);
            let output = buffer.add(&places, Shape::Vec3, Target::Data);
            add_channel(animation, node, "translation", [input, output]);
        }
    }
}

fn add_channel(animation: &mut Value, node: usize, path: &str, [input, output]: [usize; 2]) {
    let sampler = animation["samplers"].as_array().map_or(0, Vec::len);
    let parts = [
        ("samplers", json!({ "input": input, "output": output, "interpolation": "LINEAR" })),
        ("channels", json!({ "sampler": sampler, "target": { "node": node, "path": path } })),
    ];
    for (list, entry) in parts {
        if let Some(list) = animation[list].as_array_mut() {
            list.push(entry);
        }
    }
}
