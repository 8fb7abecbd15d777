//! VRM 1.0 files: bones, rest, terms of use.
#![allow(clippy::unwrap_used)] // helpers of tests are not seen as tests

mod common;

use std::collections::BTreeSet;

use common::dressed;
use nalgebra::Point3;
use serde_json::Value;
use toile_avatar::{VrmMeta, write_vrm};
use toile_character::{Joint, joint::JOINTS};

/// The bones that VRM 1.0 requires.
const REQUIRED: [&str; 15] = [
    "hips",
    "spine",
    "head",
    "leftUpperLeg",
    "leftLowerLeg",
    "leftFoot",
    "rightUpperLeg",
    "rightLowerLeg",
    "rightFoot",
    "leftUpperArm",
    "leftLowerArm",
    "leftHand",
    "rightUpperArm",
    "rightLowerArm",
    "rightHand",
];

fn json(bytes: &[u8]) -> Value {
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    serde_json::from_slice(&bytes[20..20 + length]).unwrap()
}

fn written() -> Vec<u8> {
    write_vrm(&dressed(), &VrmMeta { authors: vec!["someone".into()], ..VrmMeta::default() }).unwrap()
}

#[test]
fn bones_are_all_there_once_and_hang_together() {
    let file = json(&written());
    let bones = file["extensions"]["VRMC_vrm"]["humanoid"]["humanBones"].as_object().unwrap();
    assert!(REQUIRED.iter().all(|b| bones.contains_key(*b)));
    let nodes: BTreeSet<u64> = bones.values().map(|b| b["node"].as_u64().unwrap()).collect();
    assert_eq!(nodes.len(), bones.len(), "a node is one bone only");
    assert_eq!(bones.len(), 52);
    for joint in JOINTS {
        let node = bones[joint.name()]["node"].as_u64().unwrap();
        let parents: Vec<usize> = (0..file["nodes"].as_array().unwrap().len())
            .filter(|i| file["nodes"][i]["children"].as_array().is_some_and(|c| c.contains(&node.into())))
            .collect();
        assert_eq!(parents, joint.parent().map(Joint::index).into_iter().collect::<Vec<_>>());
    }
}

#[test]
fn elbows_say_that_they_bend_forward_only() {
    let file = json(&written());
    let node = file["nodes"].as_array().unwrap().iter().find(|n| n["name"] == "leftLowerArm").unwrap();
    let limit = &node["extras"]["limits"][0];
    let axis: Vec<f64> = limit["axis"].as_array().unwrap().iter().map(|a| a.as_f64().unwrap()).collect();
    assert!(axis[1] < -0.9, "the forearm of a T-pose swings forward about the vertical: {axis:?}");
    let (low, high) = (limit["low_rad"].as_f64().unwrap(), limit["high_rad"].as_f64().unwrap());
    assert!((-0.4..0.0).contains(&low) && (2.0..3.1).contains(&high), "{low} {high}");
}

#[test]
fn it_rests_unturned_in_a_t_pose_on_the_floor() {
    let bytes = written();
    let file = json(&bytes);
    let mut places = vec![Point3::<f64>::origin(); JOINTS.len()];
    for joint in JOINTS {
        let node = &file["nodes"][joint.index()];
        assert!(node.get("rotation").is_none() && node.get("scale").is_none());
        let offset = |k: usize| node["translation"][k].as_f64().unwrap();
        let parent = joint.parent().map_or(Point3::origin(), |p| places[p.index()]);
        places[joint.index()] = parent + nalgebra::Vector3::new(offset(0), offset(1), offset(2));
    }
    let bone = |a: Joint, b: Joint| (places[b.index()] - places[a.index()]).normalize();
    assert!(bone(Joint::LeftUpperArm, Joint::LeftHand).x > 0.9999);
    assert!(bone(Joint::RightUpperArm, Joint::RightHand).x < -0.9999);
    assert!(bone(Joint::LeftUpperLeg, Joint::LeftFoot).y < -0.9999);
    assert!(bone(Joint::Hips, Joint::Head).y > 0.95);
    let (document, buffers, _) = gltf::import_slice(&bytes).unwrap();
    let body = document.meshes().next().unwrap().primitives().next().unwrap();
    let reader = body.reader(|b| Some(&buffers[b.index()]));
    let positions: Vec<[f32; 3]> = reader.read_positions().unwrap().collect();
    let low = positions.iter().map(|p| p[1]).fold(f32::MAX, f32::min);
    let (left, right) = positions.iter().fold((0f32, 0f32), |(l, r), p| (l.max(p[0]), r.min(p[0])));
    assert!(low.abs() < 0.02, "soles at {low} m");
    assert!(left > 0.6 && right < -0.6, "hands at {left} and {right} m");
}

#[test]
fn terms_of_use_are_said_and_need_an_author() {
    let file = json(&written());
    let vrm = &file["extensions"]["VRMC_vrm"];
    assert_eq!(vrm["specVersion"], "1.0");
    assert_eq!(vrm["meta"]["name"], "tester");
    assert_eq!(vrm["meta"]["licenseUrl"], "https://vrm.dev/licenses/1.0/");
    assert_eq!(vrm["meta"]["avatarPermission"], "onlyAuthor");
    assert_eq!(file["extensionsUsed"], serde_json::json!(["VRMC_vrm"]));
    let nobody = VrmMeta { authors: vec![], ..VrmMeta::default() };
    assert!(write_vrm(&dressed(), &nobody).unwrap_err().to_string().contains("author"));
}
