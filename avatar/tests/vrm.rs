//! VRM 1.0 files: bones, rest, terms of use.
#![allow(clippy::unwrap_used)] // helpers of tests are not seen as tests

mod common;

use std::collections::BTreeSet;

use common::dressed;
use nalgebra::Point3;
use serde_json::Value;
use toile_avatar::{Avatar, VrmMeta, write_vrm};
use toile_character::{
    JOINT_COUNT, Joint, SkinWeights, SpringBones, SpringChain, SpringCollider, SpringJoint, joint::JOINTS,
};

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
    write_vrm(&dressed(), &VrmMeta { authors: vec!["someone".into()], ..VrmMeta::default() }, None).unwrap()
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
    assert!(write_vrm(&dressed(), &nobody, None).unwrap_err().to_string().contains("author"));
}

/// Two chains of three joints beside the knees, on which the trousers hang.
fn springs(avatar: &Avatar) -> SpringBones {
    let joint = |x: f64, y: f64| SpringJoint { place: Point3::new(x, y, 0.0), stiffness: 0.3, hit_radius: 0.02 };
    let chain = |name: &str, x: f64| SpringChain {
        name: name.into(),
        joints: vec![joint(x, 0.8), joint(x, 0.7), joint(x, 0.6)],
    };
    let ends = [Point3::new(0.1, 0.8, 0.0), Point3::new(0.1, 0.5, 0.0)];
    let mut hung = SkinWeights::default();
    (0..avatar.layers[1].weights.len()).for_each(|v| hung.push(&[(JOINT_COUNT as u8 + (v % 6) as u8, 1.0), (0, 1.0)]));
    SpringBones {
        chains: vec![chain("hem 1", 0.2), chain("hem 2", -0.2)],
        colliders: vec![SpringCollider { joint: Joint::LeftUpperLeg, ends, radius: 0.08 }],
        drag: 0.1,
        weights: vec![None, Some(hung), None],
    }
}

#[test]
fn springs_hang_in_chains_below_the_hips() {
    let avatar = dressed();
    let meta = VrmMeta { authors: vec!["someone".into()], ..VrmMeta::default() };
    let bytes = write_vrm(&avatar, &meta, Some(&springs(&avatar))).unwrap();
    let file = json(&bytes);
    assert_eq!(file["extensionsUsed"], serde_json::json!(["VRMC_springBone", "VRMC_vrm"]));
    let extension = &file["extensions"]["VRMC_springBone"];
    let node = |i: &Value| &file["nodes"][i.as_u64().unwrap() as usize];
    let hips_children = file["nodes"][0]["children"].as_array().unwrap();
    for spring in extension["springs"].as_array().unwrap() {
        let joints: Vec<&Value> = spring["joints"].as_array().unwrap().iter().map(|j| &j["node"]).collect();
        assert_eq!(joints.len(), 3);
        assert!(hips_children.contains(joints[0]));
        assert!(joints.windows(2).all(|w| node(w[0])["children"] == serde_json::json!([w[1]])));
        assert!((node(joints[1])["translation"][1].as_f64().unwrap() + 0.1).abs() < 1e-9);
        assert!(
            spring["joints"].as_array().unwrap().iter().all(|j| j["gravityPower"] == 0.0),
            "the scan's shape hangs already"
        );
        assert_eq!(node(&spring["center"])["name"], "root");
    }
    let root = file["scenes"][0]["nodes"][0].clone();
    assert_eq!(node(&root)["children"], serde_json::json!([0]), "the root is above the hips");
    // The collider stands in the thigh.
    let thigh = &extension["colliders"][0];
    let rig = avatar.skeleton.position(Joint::LeftUpperLeg);
    assert_eq!(node(&thigh["node"])["name"], "leftUpperLeg");
    assert!((thigh["shape"]["capsule"]["offset"][0].as_f64().unwrap() + rig.x - 0.1).abs() < 0.05);
    let annotations = file["extensions"]["VRMC_vrm"]["firstPerson"]["meshAnnotations"].as_array().unwrap();
    assert!(annotations.iter().all(|a| node(&a["node"])["mesh"].is_u64()), "meshes are named, not joints");
    let (document, buffers, _) = gltf::import_slice(&bytes).unwrap();
    let trousers = document.meshes().nth(1).unwrap().primitives().next().unwrap();
    let joints = trousers.reader(|b| Some(&buffers[b.index()])).read_joints(0).unwrap().into_u16();
    assert_eq!(joints.flatten().max(), Some(JOINT_COUNT as u16 + 5));
}

#[test]
fn springs_without_meaning_are_refused() {
    let avatar = dressed();
    let meta = VrmMeta::default();
    let refused = |edit: &dyn Fn(&mut SpringBones)| {
        let mut springs = springs(&avatar);
        edit(&mut springs);
        write_vrm(&avatar, &meta, Some(&springs)).unwrap_err().to_string()
    };
    assert!(refused(&|s| drop(s.weights.pop())).contains("weights for 2 layers"));
    assert!(refused(&|s| s.chains[1].joints.truncate(1)).contains("hem 2"));
    assert!(refused(&|s| s.chains[0].joints[1].place.x = f64::NAN).contains("hem 1"));
    assert!(refused(&|s| s.chains[0].joints[1].stiffness = -1.0).contains("hem 1"));
    assert!(refused(&|s| s.colliders[0].radius = f64::INFINITY).contains("collider"));
    assert!(refused(&|s| s.drag = 1.5).contains("drag"));
    assert!(refused(&|s| s.chains = vec![s.chains[0].clone(); 80]).contains("240 joints"));
    assert!(refused(&|s| drop(s.chains.pop())).contains("beyond the last of 55"));
}
