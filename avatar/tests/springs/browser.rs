//! The avatar in `@pixiv/three-vrm`, in Debian's Chromium.

use std::{path::Path, process::Command};

use nalgebra::{Isometry3, Point3};
use serde_json::json;
use toile_character::{Joint, joint::JOINTS};

use crate::scene::{SETTLE, Scene, UPDATES};

/// The garment's vertices in each frame of the simulation; `None` where Node, Chromium or the packages are missing.
pub fn play(scene: &Scene) -> Option<Vec<Vec<Point3<f32>>>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let packages = root.join("../target/outside");
    toile_outside::file(&packages.join("node_modules/@pixiv/three-vrm"))?;
    let (node, _) = (toile_outside::program("node")?, toile_outside::program("chromium")?);
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    std::fs::write(at("avatar.vrm"), scene.vrm()).unwrap();
    std::fs::write(at("motion.json"), motion(scene).to_string()).unwrap();
    let mut command = Command::new(node);
    command.arg(root.join("../tests/vrm/in_browser.mjs")).args([
        &packages,
        &at("avatar.vrm"),
        &at("motion.json"),
        &at("out"),
    ]);
    let done = command.output().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let bytes = std::fs::read(at(&format!("out.{}.f32", scene.garment().name))).unwrap();
    let numbers: Vec<f32> = bytes.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
    let points: Vec<Point3<f32>> = numbers.chunks_exact(3).map(|p| Point3::new(p[0], p[1], p[2])).collect();
    Some(points.chunks_exact(scene.garment().mesh.positions.len()).map(<[_]>::to_vec).collect())
}

/// The walk as turns of VRM's bones.
fn motion(scene: &Scene) -> serde_json::Value {
    let pose = |moved: &[Isometry3<f64>], hips: Point3<f64>| {
        let mut numbers = hips.coords.as_slice().to_vec();
        for joint in JOINTS {
            let own = moved[joint.index()].rotation;
            let turn = joint.parent().map_or(own, |p: Joint| moved[p.index()].rotation.inverse() * own);
            numbers.extend(turn.coords.iter());
        }
        numbers
    };
    let poses: Vec<Vec<f64>> =
        scene.poses.iter().map(|p| pose(&scene.moved(p), p.joint_positions(scene.skeleton())[0])).collect();
    json!({
        "bones": JOINTS.iter().map(|j| j.name()).collect::<Vec<_>>(),
        "poses": poses,
        "step": 1.0 / UPDATES as f64,
        "settle": SETTLE,
        "wanted": scene.updates(),
    })
}
