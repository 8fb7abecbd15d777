//! Skeletons of the usual tools: the shipped walk under each tool's names is recognised joint by joint.
#![allow(clippy::unwrap_used)] // helpers of tests are not seen as tests

use toile_animation::{RetargetSettings, retarget, shipped_walk};
use toile_character::{BodyModel, Joint};

/// Names of hips, head, and of one side's shoulder, upper arm, lower arm, hand, upper leg, lower leg, foot and toes; `{}` stands
/// for the side, written as in the second column.
const TOOLS: [(&str, [&str; 2], [&str; 10]); 26] = [
    (
        "Mixamo",
        ["Left", "Right"],
        [
            "mixamorig:Hips",
            "mixamorig:Head",
            "mixamorig:{}Shoulder",
            "mixamorig:{}Arm",
            "mixamorig:{}ForeArm",
            "mixamorig:{}Hand",
            "mixamorig:{}UpLeg",
            "mixamorig:{}Leg",
            "mixamorig:{}Foot",
            "mixamorig:{}ToeBase",
        ],
    ),
    (
        "Mixamo, a second copy, in Blender",
        ["Left", "Right"],
        [
            "Armature|mixamorig9:Hips",
            "Armature|mixamorig9:Head",
            "Armature|mixamorig9:{}Shoulder",
            "Armature|mixamorig9:{}Arm",
            "Armature|mixamorig9:{}ForeArm",
            "Armature|mixamorig9:{}Hand",
            "Armature|mixamorig9:{}UpLeg",
            "Armature|mixamorig9:{}Leg",
            "Armature|mixamorig9:{}Foot",
            "Armature|mixamorig9:{}ToeBase",
        ],
    ),
    (
        "Mixamo in three.js",
        ["Left", "Right"],
        [
            "mixamorigHips",
            "mixamorigHead",
            "mixamorig{}Shoulder",
            "mixamorig{}Arm",
            "mixamorig{}ForeArm",
            "mixamorig{}Hand",
            "mixamorig{}UpLeg",
            "mixamorig{}Leg",
            "mixamorig{}Foot",
            "mixamorig{}ToeBase",
        ],
    ),
    (
        "an armature without colon",
        ["Left", "Right"],
        [
            "Armature|Hips",
            "Armature|Head",
            "Armature|{}Shoulder",
            "Armature|{}Arm",
            "Armature|{}ForeArm",
            "Armature|{}Hand",
            "Armature|{}UpLeg",
            "Armature|{}Leg",
            "Armature|{}Foot",
            "Armature|{}ToeBase",
        ],
    ),
    (
        "Rokoko",
        ["Left", "Right"],
        ["Hips", "Head", "{}Shoulder", "{}Arm", "{}ForeArm", "{}Hand", "{}Thigh", "{}Shin", "{}Foot", "{}Toe"],
    ),
    (
        "Xsens BVH",
        ["Left", "Right"],
        ["Hips", "Head", "{}Collar", "{}Shoulder", "{}Elbow", "{}Wrist", "{}Hip", "{}Knee", "{}Ankle", "{}Toe"],
    ),
    (
        "Xsens MVN",
        ["Left", "Right"],
        [
            "Pelvis",
            "Head",
            "{}Shoulder",
            "{}UpperArm",
            "{}ForeArm",
            "{}Hand",
            "{}UpperLeg",
            "{}LowerLeg",
            "{}Foot",
            "{}Toe",
        ],
    ),
    (
        "OptiTrack",
        ["L", "R"],
        ["Hip", "Head", "{}Shoulder", "{}UArm", "{}FArm", "{}Hand", "{}Thigh", "{}Shin", "{}Foot", "{}Toe"],
    ),
    (
        "OptiTrack with an actor",
        ["L", "R"],
        [
            "Bob 001_Hip",
            "Bob 001_Head",
            "Bob 001_{}Shoulder",
            "Bob 001_{}UArm",
            "Bob 001_{}FArm",
            "Bob 001_{}Hand",
            "Bob 001_{}Thigh",
            "Bob 001_{}Shin",
            "Bob 001_{}Foot",
            "Bob 001_{}Toe",
        ],
    ),
    (
        "Unreal",
        ["l", "r"],
        [
            "pelvis",
            "head",
            "clavicle_{}",
            "upperarm_{}",
            "lowerarm_{}",
            "hand_{}",
            "thigh_{}",
            "calf_{}",
            "foot_{}",
            "ball_{}",
        ],
    ),
    (
        "Unity",
        ["Left", "Right"],
        [
            "Hips",
            "Head",
            "{}Shoulder",
            "{}UpperArm",
            "{}LowerArm",
            "{}Hand",
            "{}UpperLeg",
            "{}LowerLeg",
            "{}Foot",
            "{}Toes",
        ],
    ),
    (
        "Rigify",
        ["L", "R"],
        [
            "DEF-spine",
            "DEF-head",
            "DEF-shoulder.{}",
            "DEF-upper_arm.{}",
            "DEF-forearm.{}",
            "DEF-hand.{}",
            "DEF-thigh.{}",
            "DEF-shin.{}",
            "DEF-foot.{}",
            "DEF-toe.{}",
        ],
    ),
    (
        "Auto-Rig Pro",
        ["l", "r"],
        [
            "root.x",
            "head.x",
            "shoulder.{}",
            "arm_stretch.{}",
            "forearm_stretch.{}",
            "hand.{}",
            "thigh_stretch.{}",
            "leg_stretch.{}",
            "foot.{}",
            "toes_01.{}",
        ],
    ),
    (
        "DAZ Genesis 8",
        ["l", "r"],
        [
            "hip",
            "head",
            "{}Collar",
            "{}ShldrBend",
            "{}ForearmBend",
            "{}Hand",
            "{}ThighBend",
            "{}Shin",
            "{}Foot",
            "{}Toe",
        ],
    ),
    (
        "DAZ Genesis 9",
        ["l", "r"],
        [
            "hip",
            "head",
            "{}_shoulder",
            "{}_upperarm",
            "{}_forearm",
            "{}_hand",
            "{}_thigh",
            "{}_shin",
            "{}_foot",
            "{}_toes",
        ],
    ),
    (
        "3ds Max Biped",
        ["L", "R"],
        [
            "Bip01 Pelvis",
            "Bip01 Head",
            "Bip01 {} Clavicle",
            "Bip01 {} UpperArm",
            "Bip01 {} Forearm",
            "Bip01 {} Hand",
            "Bip01 {} Thigh",
            "Bip01 {} Calf",
            "Bip01 {} Foot",
            "Bip01 {} Toe0",
        ],
    ),
    (
        "Perception Neuron",
        ["Left", "Right"],
        [
            "Robot_Hips",
            "Robot_Head",
            "Robot_{}Shoulder",
            "Robot_{}Arm",
            "Robot_{}ForeArm",
            "Robot_{}Hand",
            "Robot_{}UpLeg",
            "Robot_{}Leg",
            "Robot_{}Foot",
            "Robot_{}Toe",
        ],
    ),
    (
        "Character Creator, AccuRig",
        ["L", "R"],
        [
            "CC_Base_Hip",
            "CC_Base_Head",
            "CC_Base_{}_Clavicle",
            "CC_Base_{}_Upperarm",
            "CC_Base_{}_Forearm",
            "CC_Base_{}_Hand",
            "CC_Base_{}_Thigh",
            "CC_Base_{}_Calf",
            "CC_Base_{}_Foot",
            "CC_Base_{}_ToeBase",
        ],
    ),
    (
        "SMPL",
        ["L", "R"],
        [
            "Pelvis",
            "Head",
            "{}_Collar",
            "{}_Shoulder",
            "{}_Elbow",
            "{}_Wrist",
            "{}_Hip",
            "{}_Knee",
            "{}_Ankle",
            "{}_Foot",
        ],
    ),
    (
        "SMPL-X",
        ["left", "right"],
        [
            "pelvis",
            "head",
            "{}_collar",
            "{}_shoulder",
            "{}_elbow",
            "{}_wrist",
            "{}_hip",
            "{}_knee",
            "{}_ankle",
            "{}_foot",
        ],
    ),
    (
        "SMPL as FBX",
        ["L", "R"],
        [
            "m_avg_Pelvis",
            "m_avg_Head",
            "m_avg_{}_Collar",
            "m_avg_{}_Shoulder",
            "m_avg_{}_Elbow",
            "m_avg_{}_Wrist",
            "m_avg_{}_Hip",
            "m_avg_{}_Knee",
            "m_avg_{}_Ankle",
            "m_avg_{}_Foot",
        ],
    ),
    (
        "H-Anim",
        ["l", "r"],
        [
            "sacroiliac",
            "skullbase",
            "{}_sternoclavicular",
            "{}_shoulder",
            "{}_elbow",
            "{}_radiocarpal",
            "{}_hip",
            "{}_knee",
            "{}_talocrural",
            "{}_metatarsophalangeal_2",
        ],
    ),
    (
        "DeepMotion",
        ["l", "r"],
        [
            "hips_JNT",
            "head_JNT",
            "{}_shoulder_JNT",
            "{}_arm_JNT",
            "{}_forearm_JNT",
            "{}_hand_JNT",
            "{}_upleg_JNT",
            "{}_leg_JNT",
            "{}_foot_JNT",
            "{}_toebase_JNT",
        ],
    ),
    (
        "Second Life",
        ["Left", "Right"],
        [
            "mPelvis",
            "mHead",
            "mCollar{}",
            "mShoulder{}",
            "mElbow{}",
            "mWrist{}",
            "mHip{}",
            "mKnee{}",
            "mAnkle{}",
            "mToe{}",
        ],
    ),
    (
        "MikuMikuDance",
        ["左", "右"],
        ["センター", "頭", "{}肩", "{}腕", "{}ひじ", "{}手首", "{}足", "{}ひざ", "{}足首", "{}つま先"],
    ),
    (
        "VRoid",
        ["L", "R"],
        [
            "J_Bip_C_Hips",
            "J_Bip_C_Head",
            "J_Bip_{}_Shoulder",
            "J_Bip_{}_UpperArm",
            "J_Bip_{}_LowerArm",
            "J_Bip_{}_Hand",
            "J_Bip_{}_UpperLeg",
            "J_Bip_{}_LowerLeg",
            "J_Bip_{}_Foot",
            "J_Bip_{}_ToeBase",
        ],
    ),
];

#[test]
fn the_names_of_the_usual_tools_are_recognised() {
    use Joint::*;
    let ours = [
        Hips,
        Head,
        LeftShoulder,
        LeftUpperArm,
        LeftLowerArm,
        LeftHand,
        LeftUpperLeg,
        LeftLowerLeg,
        LeftFoot,
        LeftToes,
    ];
    let model = BodyModel::load_default().unwrap();
    let settings = RetargetSettings { max_rate: 5.0, ..RetargetSettings::default() };
    let walk = shipped_walk().unwrap();
    for (tool, sides, names) in TOOLS {
        let mut renamed = walk.clone();
        let mut expected: Vec<(Joint, String)> = Vec::new();
        for (joint, name) in ours.iter().zip(names) {
            let both = [(*joint, sides[0]), (joint.mirrored(), sides[1])];
            expected.extend(both.map(|(joint, side)| (joint, name.replace("{}", side))));
        }
        let prefix = names[0].rsplit_once([':', '_', ' ', '|', '-']).map_or("", |(before, _)| before);
        for joint in &mut renamed.joints {
            joint.name = match expected.iter().find(|(ours, _)| ours.name() == joint.name) {
                Some((_, name)) => name.clone(),
                None => format!("{prefix}_{}", joint.name.replace("upperChest", "chest 2")),
            };
        }
        let found = retarget(&renamed, tool, &model.mean_skeleton, &settings).unwrap_or_else(|e| panic!("{tool}: {e}"));
        for (joint, name) in expected {
            let of = found.report.joints.iter().find(|(j, _)| *j == joint).map(|(_, name)| name);
            assert_eq!(of, Some(&name), "{tool}: {joint:?}");
        }
    }
}
