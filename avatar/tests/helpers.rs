//! A motion of layers that swing, by helper joints: written, read with another reader, played, validated.
#![allow(clippy::unwrap_used)] // helpers of tests are not seen as tests

mod common;

use std::{fs, path::Path, process::Command};

use common::dressed;
use nalgebra::{Isometry3, Matrix4, Point3, Vector3, Vector4};
use toile_animation::{
    RetargetSettings,
    decomposition::{DecompositionSettings, LayerMotion, decompose, sample_frames},
    retarget, shipped_walk,
};
use toile_avatar::{Avatar, HelperJoints, write_glb, write_glb_with_helpers};
use toile_character::{Pose, skinning};

/// `posed_from_avatar` of the skeleton's joints: what moves the avatar's meshes into `pose`.
fn moved(avatar: &Avatar, pose: &Pose) -> Vec<Isometry3<f64>> {
    pose.transforms_from(&avatar.pose0, &avatar.skeleton)
}

/// An avatar that walks, and where the vertices of its layers are in each frame: the trousers swing below the knee and the top at its hem.
fn walking() -> (Avatar, Vec<Vec<Vec<Point3<f32>>>>) {
    let mut avatar = dressed();
    let walk = retarget(&shipped_walk().unwrap(), "walk", &avatar.skeleton, &RetargetSettings::default()).unwrap();
    avatar.motions = vec![walk.motion];
    avatar.motions[0].poses.truncate(70);
    let mut caches = Vec::new();
    for (l, layer) in avatar.layers.iter().enumerate() {
        let hem = [-1.0, 0.45, 1.15][l];
        let of_frame = |(f, pose): (usize, &Pose)| {
            let t = f as f32 * avatar.motions[0].frame_time as f32 * 6.0;
            let mut positions = skinning::skin(&layer.mesh.positions, &layer.weights, &moved(&avatar, pose));
            for (p, rest) in positions.iter_mut().zip(&layer.mesh.positions) {
                let loose = 0.25 * (hem - rest.y).max(0.0);
                *p += loose * Vector3::new((t - 3.0 * rest.y).sin(), 0.0, (t - 2.0 * rest.y + 4.0 * rest.x).cos());
            }
            positions
        };
        caches.push(avatar.motions[0].poses.iter().enumerate().map(of_frame).collect());
    }
    (avatar, caches)
}

/// The avatar hung on helpers, found from what its layers do.
fn with_helpers(mut avatar: Avatar, caches: &[Vec<Vec<Point3<f32>>>], budget: usize) -> (Avatar, HelperJoints) {
    let kept = sample_frames(caches[0].len());
    let poses = &avatar.motions[0].poses;
    let joints: Vec<_> = kept.iter().map(|&f| moved(&avatar, &poses[f])).collect();
    let frames: Vec<Vec<Vec<Point3<f32>>>> =
        caches.iter().map(|cache| kept.iter().map(|&f| cache[f].clone()).collect()).collect();
    let layer = |(l, frames)| {
        let layer: &toile_avatar::AvatarLayer = &avatar.layers[l];
        LayerMotion { rest: &layer.mesh.positions, weights: &layer.weights, frames }
    };
    let motions: Vec<LayerMotion<'_>> = frames.iter().map(Vec::as_slice).enumerate().map(layer).collect();
    let settings = DecompositionSettings { helpers: budget, ..Default::default() };
    let found = decompose(&motions, &joints, &settings).unwrap();
    let mut helpers = HelperJoints { frames: vec![Vec::new(); poses.len()], ..Default::default() };
    for (l, layer) in found.iter().enumerate() {
        for (h, center) in layer.centers.iter().enumerate() {
            helpers.names.push(format!("{} helper {}", avatar.layers[l].name, h + 1));
            helpers.centers.push(*center);
        }
        for (f, frame) in helpers.frames.iter_mut().enumerate() {
            let solved = layer.solve(&moved(&avatar, &poses[f]), &caches[l][f]).unwrap();
            frame.extend(solved.iter().map(|t| t.cast::<f32>()));
        }
    }
    for (layer, found) in avatar.layers.iter_mut().zip(found) {
        layer.weights = found.weights;
    }
    (avatar, helpers)
}

/// A file as another reader has it.
struct Played {
    document: gltf::Document,
    buffers: Vec<gltf::buffer::Data>,
}

impl Played {
    fn new(bytes: &[u8]) -> Self {
        let (document, buffers, _) = gltf::import_slice(bytes).unwrap();
        Self { document, buffers }
    }

    /// `scene_from_node` of every node at a key of the only animation.
    fn globals(&self, key: usize) -> Vec<Matrix4<f64>> {
        let mut locals: Vec<_> = self.document.nodes().map(|n| n.transform().decomposed()).collect();
        for channel in self.document.animations().next().unwrap().channels() {
            let reader = channel.reader(|b| Some(&self.buffers[b.index()]));
            let key = key.min(reader.read_inputs().unwrap().count() - 1);
            let local = &mut locals[channel.target().node().index()];
            match reader.read_outputs().unwrap() {
                gltf::animation::util::ReadOutputs::Translations(mut t) => local.0 = t.nth(key).unwrap(),
                gltf::animation::util::ReadOutputs::Rotations(r) => local.1 = r.into_f32().nth(key).unwrap(),
                _ => panic!("unexpected track"),
            }
        }
        let matrix = |(translation, rotation, scale)| {
            let m = gltf::scene::Transform::Decomposed { translation, rotation, scale }.matrix();
            Matrix4::from_fn(|r, c| f64::from(m[c][r]))
        };
        let mut globals: Vec<Matrix4<f64>> = locals.into_iter().map(matrix).collect();
        let mut open: Vec<gltf::Node<'_>> = self.document.default_scene().unwrap().nodes().collect();
        while let Some(node) = open.pop() {
            for child in node.children() {
                globals[child.index()] = globals[node.index()] * globals[child.index()];
                open.push(child);
            }
        }
        globals
    }

    /// A layer's vertices.
    fn layer(&self, name: &str, globals: &[Matrix4<f64>]) -> Vec<Point3<f32>> {
        let node = self.document.nodes().find(|n| n.mesh().is_some() && n.name() == Some(name)).unwrap();
        let skin = node.skin().unwrap();
        let binds = skin.reader(|b| Some(&self.buffers[b.index()])).read_inverse_bind_matrices().unwrap();
        let moves: Vec<Matrix4<f64>> = skin
            .joints()
            .zip(binds)
            .map(|(joint, m)| globals[joint.index()] * Matrix4::from_fn(|r, c| f64::from(m[c][r])))
            .collect();
        let primitive = node.mesh().unwrap().primitives().next().unwrap();
        let reader = primitive.reader(|b| Some(&self.buffers[b.index()]));
        let influences = reader.read_joints(0).unwrap().into_u16().zip(reader.read_weights(0).unwrap().into_f32());
        let place = |(p, (joints, weights)): ([f32; 3], ([u16; 4], [f32; 4]))| {
            let p = Point3::from(p.map(f64::from)).to_homogeneous();
            let sum: Vector4<f64> = (0..4).map(|k| moves[joints[k] as usize] * p * f64::from(weights[k])).sum();
            Point3::from(sum.xyz()).cast::<f32>()
        };
        reader.read_positions().unwrap().zip(influences).map(place).collect()
    }
}

/// Distances between the played vertices and the caches' over some frames, ascending, metres.
fn errors(played: &Played, layers: &[(&str, &Vec<Vec<Point3<f32>>>)]) -> Vec<f64> {
    let mut errors = Vec::new();
    for f in (0..70).step_by(3) {
        let globals = played.globals(f);
        for (name, cache) in layers {
            let found = played.layer(name, &globals);
            errors.extend(found.iter().zip(&cache[f]).map(|(a, b)| f64::from((a - b).norm())));
        }
    }
    errors.sort_by(f64::total_cmp);
    errors
}

#[test]
fn a_player_shows_what_the_caches_hold() {
    let (avatar, caches) = walking();
    let before = Played::new(&write_glb(&avatar).unwrap());
    let (avatar, helpers) = with_helpers(avatar, &caches, 24);
    let bytes = write_glb_with_helpers(&avatar, &helpers).unwrap();
    let after = Played::new(&bytes);
    let names: Vec<String> =
        after.document.skins().next().unwrap().joints().skip(52).map(|n| n.name().unwrap().to_string()).collect();
    assert_eq!(names, helpers.names);
    assert!(!names.is_empty() && names.len() <= 24 && names.iter().all(|n| !n.starts_with("body")));
    let loose = [("01-trousers", &caches[1]), ("02-top", &caches[2])];
    let (skin, own) = (errors(&before, &loose), errors(&after, &loose));
    let [skin, mean] = [&skin, &own].map(|e| e.iter().sum::<f64>() / e.len() as f64);
    let p99 = own[own.len() * 99 / 100];
    println!("{} helpers: mean {mean:.5} m, p99 {p99:.5} m; skinning {skin:.4} m", names.len());
    assert!(mean < 0.001 && p99 < 0.005 && skin > 0.008);
    let body = errors(&after, &[("body", &caches[0])]);
    assert!(body[body.len() - 1] < 1e-4, "the body follows its skeleton: {} m", body[body.len() - 1]);
    assert_eq!(bytes, write_glb_with_helpers(&avatar, &helpers).unwrap());
}

#[test]
fn khronos_validator_finds_nothing() {
    let (avatar, caches) = walking();
    let (avatar, helpers) = with_helpers(avatar, &caches, 12);
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let modules = root.join("target/outside/node_modules");
    if toile_outside::file(&modules.join("gltf-validator")).is_none() {
        return;
    }
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let (file, textured) = (folder.join("motion.glb"), folder.join("textured.glb"));
    fs::write(&file, write_glb_with_helpers(&avatar, &helpers).unwrap()).unwrap();
    fs::write(&textured, write_glb(&common::textured()).unwrap()).unwrap();
    let script = root.join("tests/validate_gltf.cjs");
    let done = Command::new("node").arg(script).args([&file, &textured]).env("NODE_PATH", &modules).output().unwrap();
    let report: serde_json::Value = serde_json::from_slice(&done.stdout).unwrap();
    let issues = &report[file.to_str().unwrap()];
    assert_eq!((&issues["errors"], &issues["warnings"]), (&0.into(), &0.into()), "{}", issues["messages"]);
    assert_eq!(issues["info"]["animationCount"], 1);
    let issues = &report[textured.to_str().unwrap()];
    assert_eq!((&issues["errors"], &issues["warnings"]), (&0.into(), &0.into()), "{}", issues["messages"]);
}

#[test]
fn without_helpers_the_file_is_the_plain_one() {
    let avatar = dressed();
    let helpers = HelperJoints { frames: vec![Vec::new(); 9], ..Default::default() };
    assert_eq!(write_glb_with_helpers(&avatar, &helpers).unwrap(), write_glb(&avatar).unwrap());
}

#[test]
fn helpers_that_do_not_fit_are_refused() {
    let avatar = dressed();
    let helpers = HelperJoints {
        names: vec!["a".into(), "b".into()],
        centers: vec![Point3::new(0.0, 1.0, 0.0); 2],
        frames: vec![vec![Isometry3::identity(); 2]; 9],
    };
    assert!(write_glb_with_helpers(&avatar, &helpers).is_ok());
    let refused = |avatar: &Avatar, change: &dyn Fn(&mut HelperJoints)| {
        let mut wrong = helpers.clone();
        change(&mut wrong);
        write_glb_with_helpers(avatar, &wrong).unwrap_err().to_string()
    };
    let text = refused(&Avatar { motions: Vec::new(), ..avatar.clone() }, &|_| {});
    assert_eq!(text, "helper joints: they play one motion, but the avatar has 0");
    let text = refused(&avatar, &|h| h.names[1] = "a".into());
    assert_eq!(text, "helper joints: the name \"a\" of helper 1 is empty or taken");
    let text = refused(&avatar, &|h| h.centers.truncate(1));
    assert_eq!(text, "helper joints: 2 names but 1 places; both at most 204");
    let text = refused(&avatar, &|h| h.frames.truncate(8));
    assert_eq!(text, "helper joints: 8 frames, but the motion has 9; each needs a transform of each of the 2 helpers");
    let text = refused(&avatar, &|h| h.frames[4][0].translation.vector.x = f32::NAN);
    assert_eq!(text, "helper joints: a transform of frame 4 is not finite or its rotation not of unit length");
    let text = refused(&avatar, &|h| h.centers[0].x = f64::INFINITY);
    assert_eq!(text, "helper joints: the place of a helper is not finite");
    let mut hung = avatar.clone();
    (hung.layers[2].weights.joints[5][0], hung.layers[2].weights.weights[5]) = (54, [1.0, 0.0, 0.0, 0.0]);
    assert_eq!(refused(&hung, &|_| {}), "layer `02-top`: vertex 5 hangs on a joint beyond the last of 54");
    hung.layers[2].weights.joints[5][0] = 53;
    assert!(write_glb_with_helpers(&hung, &helpers).is_ok());
    assert!(write_glb(&hung).is_err(), "a plain file has no helpers");
}
