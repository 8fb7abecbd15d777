//! The motion of the avatar: a BVH file, the animation of a GLB or VRMA file, or the walk that ships with Toile.

use std::path::Path;

use toile_animation::{
    AnimationError, Bvh, RetargetSettings, Retargeted, blend::Clothed, bvh, bvh::RestJoint, retarget, retarget_body,
    shipped_walk,
};
use toile_avatar::{MotionJoint, read_motion};
use toile_capture::files::read_limited;
use toile_character::{BodyModel, Pose, SkinnedMesh};
use toile_geometry::Mesh;

use crate::PipelineError;

/// Name of the clip when no motion was given.
pub const WALK: &str = "walk";

/// Reads the motion and carries it onto `body`, whose own skin stands on the floor and stays out of it where the settings lift feet.
///
/// # Errors
/// [`PipelineError`] where the file is no motion that can be read, or its skeleton is not a person's.
pub fn load(path: Option<&Path>, body: &SkinnedMesh, settings: &RetargetSettings) -> Result<Retargeted, PipelineError> {
    let (bvh, name) = source(path)?;
    let at = path.unwrap_or(Path::new(WALK));
    retarget_body(&bvh, &name, body, settings).map_err(|e| PipelineError::stage(at, e))
}

/// As [`load`], for somebody who wears the garments among `layers` (the first is the body, which is in `pose0`): arms are held as far
/// from the body as the clothes need, where the settings say so.
///
/// # Errors
/// As [`load`].
pub fn load_clothed(
    path: Option<&Path>,
    body: &SkinnedMesh,
    pose0: &Pose,
    layers: &[&Mesh],
    settings: &RetargetSettings,
) -> Result<Retargeted, PipelineError> {
    let mut moved = load(path, body, settings)?;
    if let Some(clothed) =
        Clothed::new(&body.skeleton, pose0, layers, &body.weights).filter(|_| settings.room_for_clothes)
    {
        moved.report.room = clothed.make_room(&mut moved.motion);
    }
    let furthest = moved.report.room.largest.iter().copied().fold(0.0, f64::max).to_degrees();
    if furthest > NOTICED {
        moved.report.warnings.push(format!(
            "arms are held up to {furthest:.0}° further from the body than the file has them: what is worn needs the room \
             (motion.room_for_clothes = false leaves them as they are)"
        ));
    }
    Ok(moved)
}

/// Degrees by which an arm is turned before that is said: an elbow moves by 25 mm.
const NOTICED: f64 = 5.0;

/// Checks a motion before any work is done: read it, and carry it onto the mean person.
///
/// # Errors
/// As [`load`].
pub fn check(path: &Path) -> Result<(), PipelineError> {
    let (bvh, name) = source(Some(path))?;
    let mean = BodyModel::load_default()?.mean_skeleton;
    retarget(&bvh, &name, &mean, &RetargetSettings::default()).map_err(|e| PipelineError::stage(path, e)).map(drop)
}

/// The motion as its file has it, and its name; the shipped walk where there is no file.
///
/// # Errors
/// [`PipelineError`] where the file is no motion that can be read.
pub fn source(path: Option<&Path>) -> Result<(Bvh, String), PipelineError> {
    Ok(match path {
        Some(path) => (read(path)?, path.file_stem().unwrap_or_default().to_string_lossy().into_owned()),
        None => (shipped_walk().map_err(|e| PipelineError::stage(Path::new(WALK), e))?, WALK.to_string()),
    })
}

fn read(path: &Path) -> Result<Bvh, PipelineError> {
    if is_gltf(path) {
        return read_gltf(path);
    }
    bvh::read(path).map_err(|e| match e {
        AnimationError::Io { path, source } => PipelineError::io(&path, source),
        // The line and the file's name are in the message already.
        AnimationError::Bvh { line, reason, .. } => PipelineError::format(path, format!("line {line}: {reason}")),
        AnimationError::File(error) => error.into(),
        other => PipelineError::stage(path, other),
    })
}

/// Largest motion file that is read, bytes: an avatar with large pictures may be in it.
const LARGEST: u64 = 1 << 28;

/// By the file's name: a file of any other name is read as BVH, whose errors say what is missing.
fn is_gltf(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    ["glb", "gltf", "vrm", "vrma"].contains(&extension.as_str())
}

fn read_gltf(path: &Path) -> Result<Bvh, PipelineError> {
    let bytes = read_limited(path, LARGEST)?;
    let wrong = |reason: String| PipelineError::format(path, reason);
    let motion = read_motion(&bytes, &path.to_string_lossy()).map_err(|e| wrong(e.to_string()))?;
    let joint = |j: MotionJoint| RestJoint { name: j.name, parent: j.parent, rest: j.rest };
    let joints: Vec<RestJoint> = motion.joints.into_iter().map(joint).collect();
    let bvh = Bvh::of_joints(&joints, motion.frame_time, &motion.frames).map_err(|e| wrong(e.to_string()))?;
    Ok(Bvh { warnings: motion.warnings, ..bvh })
}

/// Seconds of the walk that ships with Toile, and its frames a second.
pub fn walk_length() -> (f64, f64) {
    // The program's own file is tested to be readable.
    shipped_walk().map_or((0.0, 0.0), |walk| (walk.frame_time * walk.frames.len() as f64, 1.0 / walk.frame_time))
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;
    use toile_avatar::{Avatar, AvatarLayer, write_glb};
    use toile_character::{JointNaming, Skeleton, SkinWeights};

    use super::*;

    fn carried(
        path: Option<&Path>,
        skeleton: &Skeleton,
        settings: &RetargetSettings,
    ) -> Result<Retargeted, PipelineError> {
        let (bvh, name) = source(path)?;
        retarget(&bvh, &name, skeleton, settings).map_err(|e| PipelineError::stage(Path::new("test"), e))
    }

    /// A GLB of the mean person with the shipped walk, its glTF text changed by `edit`.
    fn walking(model: &BodyModel, edit: impl Fn(&mut serde_json::Value)) -> Vec<u8> {
        let skeleton = model.mean_skeleton.clone();
        let walk = carried(None, &skeleton, &RetargetSettings::default()).unwrap().motion;
        let mut weights = SkinWeights::default();
        (0..3).for_each(|_| weights.push(&[(0, 1.0)]));
        let corners = [[0.0, 1.0, 0.0], [0.1, 1.0, 0.0], [0.0, 1.1, 0.0]].map(Point3::from);
        let mesh = Mesh::new(corners.to_vec(), vec![[0, 1, 2]]);
        let layer =
            AvatarLayer { name: "body".into(), mesh, weights, order: 0, garment: None, thickness: None, texture: None };
        let (name, joint_names, pose0) = ("anna".into(), JointNaming::Vrm, Pose::identity());
        let avatar = Avatar { name, skeleton, joint_names, pose0, layers: vec![layer], motions: vec![walk] };
        let glb = write_glb(&avatar).unwrap();
        let length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
        let mut json: serde_json::Value = serde_json::from_slice(&glb[20..20 + length]).unwrap();
        edit(&mut json);
        let mut text = serde_json::to_vec(&json).unwrap();
        text.resize(text.len().next_multiple_of(4), b' ');
        let rest = &glb[20 + length..];
        let total = (20 + text.len() + rest.len()) as u32;
        [&glb[..8], &total.to_le_bytes(), &(text.len() as u32).to_le_bytes(), b"JSON", &text, rest].concat()
    }

    fn moves_as_the_walk(bytes: &[u8], file: &str) {
        let model = BodyModel::load_default().unwrap();
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join(file);
        std::fs::write(&path, bytes).unwrap();
        let walk = carried(None, &model.mean_skeleton, &RetargetSettings::default()).unwrap();
        let read = carried(Some(&path), &model.mean_skeleton, &RetargetSettings::default()).unwrap();
        assert_eq!(read.motion.poses.len(), walk.motion.poses.len());
        for (a, b) in read.motion.poses.iter().zip(&walk.motion.poses) {
            let (a, b) = (a.joint_positions(&model.mean_skeleton), b.joint_positions(&model.mean_skeleton));
            let off = a.iter().zip(&b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
            assert!(off < 0.03, "a joint is {off} m away");
        }
    }

    #[test]
    fn the_animation_of_a_glb_moves_as_the_motion_it_was_made_from() {
        moves_as_the_walk(&walking(&BodyModel::load_default().unwrap(), |_| {}), "walk.glb");
    }

    #[test]
    fn a_vrm_animation_names_its_nodes_by_human_bones() {
        let as_vrma = |json: &mut serde_json::Value| {
            let mut bones = serde_json::Map::new();
            for (k, node) in json["nodes"].as_array_mut().unwrap().iter_mut().enumerate() {
                let name = node["name"].as_str().unwrap_or_default().to_string();
                if toile_character::joint::JOINTS.iter().any(|j| j.name() == name) {
                    bones.insert(name, serde_json::json!({ "node": k }));
                    node["name"] = format!("n{k}").into();
                }
            }
            assert_eq!(bones.len(), 52);
            json["extensions"]["VRMC_vrm_animation"] =
                serde_json::json!({ "specVersion": "1.0", "humanoid": { "humanBones": bones } });
        };
        moves_as_the_walk(&walking(&BodyModel::load_default().unwrap(), as_vrma), "walk.vrma");
    }

    #[test]
    fn a_glb_without_animation_says_so() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("still.glb");
        let still = |json: &mut serde_json::Value| drop(json.as_object_mut().unwrap().remove("animations"));
        std::fs::write(&path, walking(&BodyModel::load_default().unwrap(), still)).unwrap();
        assert!(check(&path).unwrap_err().to_string().contains("no animation"));
        std::fs::write(&path, b"glTF").unwrap();
        assert!(check(&path).unwrap_err().to_string().contains("not a glTF file"));
    }
}
