//! The dressed character as a value, and the rules it must keep.

use std::collections::BTreeSet;

use toile_character::{JOINT_COUNT, JointNaming, Motion, Pose, Skeleton, SkinWeights, skinning};
use toile_geometry::Mesh;

use crate::{AvatarError, LayerTexture};

/// A person's body and garments, each a skinned layer of its own, on one skeleton.
#[derive(Debug, Clone)]
pub struct Avatar {
    /// Name of the avatar.
    pub name: String,
    /// Joints of the person in the A-pose rest.
    pub skeleton: Skeleton,
    /// Names of the joints in a GLB file.
    pub joint_names: JointNaming,
    /// The pose that the layers are in, relative to that rest: for an avatar from scans, the pose of scan 0.
    pub pose0: Pose,
    /// The layers, inside to outside.
    pub layers: Vec<AvatarLayer>,
    /// Motions, exported as clips, poses relative to the rest.
    pub motions: Vec<Motion>,
}

/// One layer: the body or a garment.
#[derive(Debug, Clone)]
pub struct AvatarLayer {
    /// Name, the same as on disk: `body`, `01-trousers`. Unique in the avatar.
    pub name: String,
    /// The mesh in the avatar's pose and frame, colours sRGB.
    pub mesh: Mesh,
    /// Its skin weights.
    pub weights: SkinWeights,
    /// Place in the order of dressing: 0 the body, 1 the first garment.
    pub order: u32,
    /// Type of the garment, such as `trousers`, where it is known.
    pub garment: Option<String>,
    /// Thickness of the cloth, metres, where it is known.
    pub thickness: Option<f32>,
    /// Its texture; without one, files have the colours of the vertices.
    pub texture: Option<LayerTexture>,
}

impl Avatar {
    /// The same avatar in `pose`: all layers moved there by their skin weights, normals dropped so that the writer recomputes them.
    ///
    /// # Errors
    /// As [`Avatar::validate`].
    pub fn in_pose(&self, pose: &Pose) -> Result<Self, AvatarError> {
        self.validate()?;
        check_pose(pose).map_err(AvatarError::Skeleton)?;
        let moved = pose.transforms_from(&self.pose0, &self.skeleton);
        let mut posed = self.clone();
        posed.pose0 = pose.clone();
        for layer in &mut posed.layers {
            layer.mesh.positions = skinning::skin(&layer.mesh.positions, &layer.weights, &moved);
            layer.mesh.normals = Vec::new();
        }
        Ok(posed)
    }

    /// Checks everything that a file of the avatar relies on.
    ///
    /// # Errors
    /// [`AvatarError`] names the first layer, motion or joint that breaks a rule.
    pub fn validate(&self) -> Result<(), AvatarError> {
        self.validate_with(JOINT_COUNT)
    }

    /// The same where layers may hang on `joints` joints.
    pub(crate) fn validate_with(&self, joints: usize) -> Result<(), AvatarError> {
        if self.name.trim().is_empty() {
            return Err(AvatarError::Avatar("it has no name".into()));
        }
        if self.layers.is_empty() {
            return Err(AvatarError::Avatar("it has no layer; add at least the body".into()));
        }
        if self.skeleton.rest.iter().any(|p| !p.coords.iter().all(|c| c.is_finite())) {
            return Err(AvatarError::Skeleton("the position of a joint is not finite".into()));
        }
        check_pose(&self.pose0).map_err(AvatarError::Skeleton)?;
        let mut names = BTreeSet::new();
        for layer in &self.layers {
            layer.validate(joints)?;
            if !names.insert(layer.name.as_str()) {
                return Err(AvatarError::layer(&layer.name, "a second layer of this name; names must differ"));
            }
        }
        let mut names = BTreeSet::new();
        for motion in &self.motions {
            check_motion(motion)?;
            if !names.insert(motion.name.as_str()) {
                let reason = "a second motion of this name; names must differ".into();
                return Err(AvatarError::Motion { motion: motion.name.clone(), reason });
            }
        }
        Ok(())
    }
}

impl AvatarLayer {
    fn validate(&self, joint_count: usize) -> Result<(), AvatarError> {
        let wrong = |reason: String| Err(AvatarError::layer(&self.name, reason));
        if self.name.trim().is_empty() {
            return wrong("it has no name".into());
        }
        if self.mesh.is_empty() {
            return wrong("it has no triangle".into());
        }
        if let Err(error) = self.mesh.validate() {
            return wrong(error.to_string());
        }
        let (vertices, weighted) = (self.mesh.positions.len(), self.weights.len());
        if vertices != weighted || self.weights.weights.len() != weighted {
            return wrong(format!("{vertices} vertices but skin weights for {weighted}"));
        }
        for (v, (joints, weights)) in self.weights.joints.iter().zip(&self.weights.weights).enumerate() {
            if joints.iter().zip(weights).any(|(j, w)| *w > 0.0 && *j as usize >= joint_count) {
                return wrong(format!("vertex {v} hangs on a joint beyond the last of {joint_count}"));
            }
            let sum: f32 = weights.iter().sum();
            if !weights.iter().all(|w| w.is_finite() && *w >= 0.0) || sum <= 0.0 {
                return wrong(format!(
                    "the skin weights of vertex {v} are {weights:?}; none may be negative and at least one must be above 0"
                ));
            }
        }
        if let Some(reason) = self.texture.as_ref().and_then(|texture| texture.fault(&self.mesh)) {
            return wrong(reason);
        }
        if self.thickness.is_some_and(|t| !t.is_finite() || t < 0.0) {
            return wrong("its thickness is not a length".into());
        }
        Ok(())
    }
}

fn check_motion(motion: &Motion) -> Result<(), AvatarError> {
    let wrong = |reason: String| Err(AvatarError::Motion { motion: motion.name.clone(), reason });
    if motion.name.trim().is_empty() {
        return wrong("it has no name".into());
    }
    if motion.poses.is_empty() {
        return wrong("it has no pose".into());
    }
    if !(motion.frame_time.is_finite() && motion.frame_time > 0.0) {
        return wrong(format!("its frame time is {} s; it must be above 0", motion.frame_time));
    }
    for (i, pose) in motion.poses.iter().enumerate() {
        if let Err(reason) = check_pose(pose) {
            return wrong(format!("pose {i}: {reason}"));
        }
    }
    Ok(())
}

pub(crate) fn check_pose(pose: &Pose) -> Result<(), String> {
    if pose.rotations.len() != JOINT_COUNT {
        return Err(format!("a pose has {} rotations but there are {JOINT_COUNT} joints", pose.rotations.len()));
    }
    let unit = |q: &nalgebra::UnitQuaternion<f64>| (q.norm() - 1.0).abs() < 1e-6;
    if !pose.translation.iter().all(|c| c.is_finite()) || !pose.rotations.iter().all(unit) {
        return Err("a pose is not finite or a rotation not of unit length".into());
    }
    Ok(())
}
