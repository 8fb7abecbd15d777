//! Motions of a small outfit: killed and gone on with, and such as nobody should ask for.

use std::{
    fs,
    path::Path,
    process::{Command, Stdio},
    time::Duration,
};

use nalgebra::{Point3, UnitQuaternion, Vector3};
use toile_animation::{RetargetSettings, blend::Blend, retarget, shipped_walk};
use toile_avatar::{Avatar, AvatarLayer};
use toile_character::{BodyModel, Joint, JointNaming, Motion, Pose, SkinWeights};
use toile_cloth::Fabric;
use toile_geometry::Mesh;

use super::{inputs::Baking, options::AnimateOptions, report::AnimationReport};
use crate::{PipelineError, observer::Silent};

/// A tube of 24 by 12 vertices around the hips, from the waist to above the knees.
fn skirt(hips: Point3<f32>) -> Mesh {
    let (around, rows) = (24u32, 12u32);
    let at = |v: u32| {
        let down = (v / around) as f32 / (rows - 1) as f32;
        let angle = std::f32::consts::TAU * (v % around) as f32 / around as f32;
        let radius = 0.2 + 0.08 * down;
        Point3::new(hips.x + radius * angle.sin(), hips.y + 0.08 - 0.36 * down, hips.z + radius * angle.cos())
    };
    let cell = |q: u32| (q, q / around * around + (q + 1) % around);
    let cut = |(a, b): (u32, u32)| [[a, a + around, b], [b, a + around, b + around]];
    Mesh::new((0..around * rows).map(at).collect(), (0..around * (rows - 1)).map(cell).flat_map(cut).collect())
}

/// The mean person in a skirt.
fn dressed(skirt: impl Fn(Point3<f32>) -> Mesh) -> Avatar {
    let body = BodyModel::load_default().unwrap().skinned(&[]);
    let mesh = skirt(body.skeleton.position(Joint::Hips).cast());
    let mut weights = SkinWeights::default();
    (0..mesh.positions.len()).for_each(|_| weights.push(&[(Joint::Hips.index() as u8, 1.0)]));
    let layer = |name: &str, order, mesh, weights| {
        let garment = (order > 0).then(|| "skirt".to_string());
        AvatarLayer { name: name.into(), mesh, weights, order, garment, thickness: None, texture: None }
    };
    let layers = vec![layer("body", 0, body.mesh, body.weights), layer("01-skirt", 1, mesh, weights)];
    let (name, joint_names) = ("anna".into(), JointNaming::Vrm);
    Avatar { name, skeleton: body.skeleton, joint_names, pose0: Pose::identity(), layers, motions: Vec::new() }
}

/// The first poses of the shipped walk.
fn walk(poses: usize) -> Motion {
    let skeleton = BodyModel::load_default().unwrap().mean_skeleton;
    let mut walk = retarget(&shipped_walk().unwrap(), "walk", &skeleton, &RetargetSettings::default()).unwrap().motion;
    walk.poses.truncate(poses);
    walk
}

fn bake(
    avatar: &Avatar,
    motion: &Motion,
    blend: Blend,
    folder: &Path,
) -> Result<(AnimationReport, Vec<String>), PipelineError> {
    let fabrics = vec![Fabric::named("shirting").unwrap(); avatar.layers.len()];
    let options = AnimateOptions { blend, checkpoint_every: Duration::ZERO, ..AnimateOptions::default() };
    let (garments, options, observer) = (&[][..], &options, &Silent);
    Baking { avatar, garments, fabrics: &fabrics, motion, options, folder, observer }.run()
}

/// All files but the report, and the report without times.
fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut out: Vec<(String, Vec<u8>)> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            let mut bytes = fs::read(&path).unwrap();
            if name == "report.json" {
                let mut report: serde_json::Value = serde_json::from_slice(&bytes).unwrap();
                report["ms_a_frame"] = serde_json::Value::Null;
                let frames = report["frames"].as_array_mut().unwrap();
                frames.iter_mut().for_each(|frame| frame["ms"] = serde_json::Value::Null);
                bytes = report.to_string().into_bytes();
            }
            (name, bytes)
        })
        .collect();
    out.sort();
    out
}

/// Says where the test below is to bake; unset in any other run of the tests.
const FOLDER: &str = "TOILE_TEST_BAKE";

/// A process that is killed: it does something only where the next test starts it.
#[test]
fn baker_that_is_killed() {
    if let Some(folder) = std::env::var_os(FOLDER) {
        bake(&dressed(skirt), &walk(7), Blend::Anchored, Path::new(&folder)).unwrap();
    }
}

/// Bakes into `folder` in another process, and kills that when so many frames are said to be in the caches.
fn bake_and_kill(folder: &Path, frames: usize) {
    let mut baker = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "animate::trials::baker_that_is_killed"])
        .env(FOLDER, folder)
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    loop {
        let text = fs::read(folder.join("unfinished")).unwrap_or_default();
        let done = String::from_utf8_lossy(&text).matches("\"ms\"").count();
        if done >= frames {
            baker.kill().unwrap();
        }
        if baker.try_wait().unwrap().is_some() {
            break;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn a_killed_run_goes_on_and_ends_with_the_same_bytes_for_any_number_of_threads() {
    let (whole, killed) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let (avatar, motion) = (dressed(skirt), walk(7));
    let threads = |n| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
    let (_, said) = threads(2).install(|| bake(&avatar, &motion, Blend::Anchored, whole.path())).unwrap();
    assert!(said.is_empty(), "{said:?}");
    for frames in [1, 3, 6] {
        bake_and_kill(killed.path(), frames);
        assert!(!killed.path().join("report.json").exists(), "it was killed before its end");
    }
    let (report, said) = threads(1).install(|| bake(&avatar, &motion, Blend::Anchored, killed.path())).unwrap();
    assert!(said.len() == 1 && said[0].contains("is gone on with") && report.frames.len() == 7, "{said:?}");
    let (a, b) = (files(whole.path()), files(killed.path()));
    assert_eq!(a.iter().map(|f| &f.0).collect::<Vec<_>>(), b.iter().map(|f| &f.0).collect::<Vec<_>>());
    a.iter().zip(&b).for_each(|(a, b)| assert!(a == b, "{} has other bytes", a.0));
}

#[test]
fn what_another_run_left_is_not_used_and_that_is_said() {
    let folder = tempfile::tempdir().unwrap();
    bake_and_kill(folder.path(), 2);
    let avatar = dressed(skirt);
    let (report, said) = bake(&avatar, &walk(5), Blend::Anchored, folder.path()).unwrap();
    assert!(said[0].contains("of another motion") && report.frames.len() == 5, "{said:?}");
    bake_and_kill(folder.path(), 2);
    let (_, said) = bake(&avatar, &walk(7), Blend::Skinning, folder.path()).unwrap();
    assert!(said[0].contains("another profile, blend, skinning or fabric"), "{said:?}");
    bake_and_kill(folder.path(), 2);
    fs::write(folder.path().join("01-skirt.pc2.part"), b"POINTCACHE2").unwrap();
    let (report, said) = bake(&avatar, &walk(7), Blend::Anchored, folder.path()).unwrap();
    assert!(said[0].contains("its caches are not whole") && report.frames.len() == 7, "{said:?}");
    assert!(!folder.path().join("unfinished").exists());
}

/// Bakes, and gives the largest distance of a vertex of the skirt from the hips, metres.
fn farthest_from_hips(avatar: &Avatar, motion: &Motion) -> (f32, AnimationReport, Vec<String>) {
    let folder = tempfile::tempdir().unwrap();
    let (report, said) = bake(avatar, motion, Blend::Anchored, folder.path()).unwrap();
    let bytes = fs::read(folder.path().join("01-skirt.pc2")).unwrap();
    let points = avatar.layers[1].mesh.positions.len();
    let number = |b: &[u8]| f32::from_le_bytes(b.try_into().unwrap());
    let mut farthest = 0.0f32;
    for (frame, pose) in bytes[32..].chunks_exact(12 * points).zip(&motion.poses) {
        let hips = pose.joint_positions(&avatar.skeleton)[0].cast::<f32>();
        for p in frame.chunks_exact(12) {
            let p = Point3::new(number(&p[..4]), number(&p[4..8]), number(&p[8..]));
            farthest = farthest.max((p - hips).norm());
        }
    }
    assert_eq!(report.frames.len(), motion.poses.len());
    (farthest, report, said)
}

#[test]
fn hard_motions_end_with_a_skirt_that_is_still_worn() {
    let avatar = dressed(skirt);
    let reach = avatar.layers[1].mesh.positions.iter();
    let hips = avatar.skeleton.position(Joint::Hips).cast::<f32>();
    let reach = reach.map(|p| (p - hips).norm()).fold(0.0, f32::max);
    let motion = |frame_time: f64, poses: Vec<Pose>| Motion { name: "m".into(), frame_time, poses };
    let placed = |translation: Vector3<f64>, turn: Vector3<f64>| {
        let mut pose = Pose::identity();
        pose.translation = translation;
        *pose.rotation_mut(Joint::Hips) = UnitQuaternion::from_scaled_axis(turn);
        pose
    };
    let still = || placed(Vector3::zeros(), Vector3::zeros());
    let flat = || placed(Vector3::new(0.0, -0.8, 0.0), Vector3::new(-1.5, 0.0, 0.0));
    let away = || placed(Vector3::new(4.0, 0.0, -3.0), Vector3::new(0.0, 2.0, 0.0));
    let flying = |k: usize| placed(Vector3::new(0.0, 0.3 * k as f64, 0.2 * k as f64), Vector3::new(1.2, 0.0, 0.0));
    for (name, motion) in [
        ("one frame", motion(1.0 / 30.0, vec![still()])),
        ("a frame a second", motion(1.0, vec![still(), placed(Vector3::new(0.0, 0.0, 1.4), Vector3::zeros())])),
        ("480 a second", motion(1.0 / 480.0, walk(5).poses)),
        ("a jump", motion(1.0 / 30.0, vec![still(), still(), away(), away()])),
        ("lying down", motion(1.0 / 10.0, vec![flat(), flat(), flat()])),
        ("flying", motion(1.0 / 10.0, (0..4).map(flying).collect())),
    ] {
        let (farthest, report, said) = farthest_from_hips(&avatar, &motion);
        assert!(farthest < 1.3 * reach, "{name}: {farthest} m from the hips, {reach} m as scanned");
        assert!(said.is_empty(), "{said:?}");
        let jumps = report.warnings().iter().filter(|w| w.contains("jumps to another place at frame 2,")).count();
        assert_eq!(jumps, usize::from(name == "a jump"), "{name}: {:?}", report.warnings());
    }
}

#[test]
fn a_garment_that_crosses_itself_is_told_of_and_moves() {
    // A vertex of the hem is pulled through the cloth on the other side.
    let pierced = |hips: Point3<f32>| {
        let mut mesh = skirt(hips);
        let v = mesh.positions.len() - 6;
        mesh.positions[v].x = hips.x - 1.3 * (mesh.positions[v].x - hips.x);
        mesh
    };
    let avatar = dressed(pierced);
    let (farthest, _, said) = farthest_from_hips(&avatar, &walk(2));
    assert!(farthest < 0.8 && said.len() == 1 && said[0].contains("01-skirt ("), "{farthest} {said:?}");
}
