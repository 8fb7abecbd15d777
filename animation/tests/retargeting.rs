//! Motions of many skeletons on one person: metamorphic on our own walk, measured on real captures.
#![allow(clippy::unwrap_used)] // helpers of tests are not seen as tests

use std::path::{Path, PathBuf};

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use toile_animation::{
    AnimationError, Bvh, RetargetSettings, Retargeted,
    bvh::{self, Channel},
    foot_figures, retarget, retarget_body, shipped_walk,
};
use toile_character::{BodyModel, JOINT_COUNT, Joint, JointNaming, Pose, Skeleton};

const LIMBS: [(Joint, Joint); 8] = [
    (Joint::LeftUpperArm, Joint::LeftLowerArm),
    (Joint::LeftLowerArm, Joint::LeftHand),
    (Joint::RightUpperArm, Joint::RightLowerArm),
    (Joint::RightLowerArm, Joint::RightHand),
    (Joint::LeftUpperLeg, Joint::LeftLowerLeg),
    (Joint::LeftLowerLeg, Joint::LeftFoot),
    (Joint::RightUpperLeg, Joint::RightLowerLeg),
    (Joint::RightLowerLeg, Joint::RightFoot),
];

fn person() -> Skeleton {
    let model = BodyModel::load_default().unwrap();
    let beta: Vec<f64> = (0..model.component_count()).map(|i| if i == 0 { 1.0 } else { 0.0 }).collect();
    model.skeleton_at(&beta)
}

fn settings() -> RetargetSettings {
    RetargetSettings { max_rate: 1000.0, lift_feet: false, ..RetargetSettings::default() }
}

fn carried(bvh: &Bvh) -> Retargeted {
    retarget(bvh, "test", &person(), &settings()).unwrap()
}

/// Largest angle between the joints' rotations and largest distance of the hips of two motions.
fn difference(a: &[Pose], b: &[Pose]) -> (f64, f64) {
    assert_eq!(a.len(), b.len());
    let pairs = || a.iter().zip(b);
    let angle =
        |(a, b): (&Pose, &Pose)| a.rotations.iter().zip(&b.rotations).map(|(a, b)| a.angle_to(b)).fold(0.0, f64::max);
    let shift = |(a, b): (&Pose, &Pose)| (a.translation - b.translation).norm();
    (pairs().map(angle).fold(0.0, f64::max), pairs().map(shift).fold(0.0, f64::max))
}

fn assert_same(bvh: &Bvh, what: &str) {
    let (angle, shift) = difference(&carried(bvh).motion.poses, &carried(&shipped_walk().unwrap()).motion.poses);
    assert!(angle < 1e-4 && shift < 1e-4, "{what}: {angle} rad, {shift} m");
}

#[test]
fn units_do_not_matter() {
    let mut inches = shipped_walk().unwrap();
    for joint in &mut inches.joints {
        joint.offset /= 2.54;
        joint.end_site = joint.end_site.map(|e| e / 2.54);
    }
    inches.frames.iter_mut().for_each(|f| f[..3].iter_mut().for_each(|v| *v /= 2.54));
    assert_same(&inches, "inches");
    let centimetres = carried(&shipped_walk().unwrap()).report.metres_per_unit;
    assert!((carried(&inches).report.metres_per_unit / centimetres - 2.54).abs() < 1e-6);
}

#[test]
fn the_file_may_have_z_up_and_face_anywhere() {
    // Z up, -Y front, as MakeHuman and Rokoko write it: positions and offsets turned, rotations conjugated
    for turn in [
        Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2),
        Rotation3::from_axis_angle(&Vector3::y_axis(), std::f64::consts::FRAC_PI_2),
    ] {
        assert_same(&turned(&shipped_walk().unwrap(), &UnitQuaternion::from(turn)), &format!("{turn}"));
    }
}

#[test]
fn names_that_we_write_are_names_that_we_read() {
    let walk = shipped_walk().unwrap();
    let known = carried(&walk).report.joints;
    for naming in JointNaming::ALL {
        let mut renamed = walk.clone();
        for joint in &mut renamed.joints {
            if let Some((ours, _)) = known.iter().find(|(_, name)| *name == joint.name) {
                joint.name = naming.name(*ours);
            }
        }
        assert_same(&renamed, &format!("{naming:?}"));
    }
}

/// The same motion in axes turned by `turn`.
fn turned(bvh: &Bvh, turn: &UnitQuaternion<f64>) -> Bvh {
    rebuilt(bvh, |_, offset| turn * offset, |_, local| turn * local * turn.inverse(), |position| turn * position)
}

/// A motion with other offsets, local rotations and root positions; channels become Zrotation Xrotation Yrotation.
fn rebuilt(
    bvh: &Bvh,
    offset: impl Fn(usize, Vector3<f64>) -> Vector3<f64>,
    local: impl Fn(usize, UnitQuaternion<f64>) -> UnitQuaternion<f64>,
    position: impl Fn(Vector3<f64>) -> Vector3<f64>,
) -> Bvh {
    let mut out = bvh.clone();
    for (i, joint) in out.joints.iter_mut().enumerate() {
        joint.offset = offset(joint.parent.unwrap_or(usize::MAX), joint.offset);
        joint.end_site = joint.end_site.map(|e| offset(i, e));
    }
    for (f, values) in out.frames.iter_mut().enumerate() {
        let world = bvh.joint_frames(f);
        let mut row = position(Vector3::new(values[0], values[1], values[2])).as_slice().to_vec();
        for (i, joint) in bvh.joints.iter().enumerate() {
            let parent = joint.parent.map_or_else(UnitQuaternion::identity, |p| world[p].rotation);
            row.extend(angles_zxy(&local(i, parent.inverse() * world[i].rotation)));
        }
        *values = row;
    }
    out
}

fn angles_zxy(r: &UnitQuaternion<f64>) -> [f64; 3] {
    let m = r.to_rotation_matrix();
    [(-m[(0, 1)]).atan2(m[(1, 1)]), m[(2, 1)].clamp(-1.0, 1.0).asin(), (-m[(2, 0)]).atan2(m[(2, 2)])]
        .map(f64::to_degrees)
}

#[test]
fn names_of_other_schools_are_as_good() {
    type Renaming = fn(&str) -> String;
    let schools: [(&str, Renaming); 4] = [
        ("mixamo", |n| {
            mapped(
                n,
                &[("UpperLeg", "UpLeg"), ("LowerLeg", "Leg"), ("UpperArm", "Arm"), ("LowerArm", "ForeArm")],
                "mixamorig:",
            )
        }),
        ("cmu", |n| {
            mapped(
                n,
                &[
                    ("UpperLeg", "Hip"),
                    ("LowerLeg", "Knee"),
                    ("Shoulder", "Collar"),
                    ("UpperArm", "Shoulder"),
                    ("LowerArm", "Elbow"),
                    ("Hand", "Wrist"),
                    ("Foot", "Ankle"),
                ],
                "",
            )
        }),
        ("unreal", |n| {
            mapped(n, &[("UpperLeg", "thigh"), ("LowerLeg", "calf"), ("Shoulder", "clavicle"), ("Toes", "ball")], "")
        }),
        ("h-anim", |n| match n.strip_prefix("left") {
            Some(rest) => format!("l_{}", h_anim(rest)),
            None => n.strip_prefix("right").map_or(n.into(), |rest| format!("r_{}", h_anim(rest))),
        }),
    ];
    for (school, rename) in schools {
        let mut other = shipped_walk().unwrap();
        other.joints.iter_mut().for_each(|j| j.name = rename(&j.name));
        assert_same(&other, school);
    }
}

fn mapped(name: &str, parts: &[(&str, &str)], prefix: &str) -> String {
    let (side, part) = match (name.strip_prefix("left"), name.strip_prefix("right")) {
        (Some(part), _) => ("Left", part),
        (_, Some(part)) => ("Right", part),
        _ => ("", name),
    };
    let part = parts.iter().find(|p| p.0 == part).map_or(part, |p| p.1);
    format!("{prefix}{side}{part}")
}

fn h_anim(part: &str) -> &str {
    match part {
        "UpperLeg" => "hip",
        "LowerLeg" => "knee",
        "Foot" => "talocrural",
        "Shoulder" => "sternoclavicular",
        "UpperArm" => "shoulder",
        "LowerArm" => "elbow",
        "Hand" => "radiocarpal",
        _ => "metatarsal",
    }
}

/// Joint frames turned arbitrarily, so that the zero pose is a heap of bones as in Bandai Namco's files.
#[test]
fn a_zero_pose_that_is_not_a_pose_is_recognised() {
    let walk = shipped_walk().unwrap();
    let own: Vec<UnitQuaternion<f64>> = (0..walk.joints.len())
        .map(|i| UnitQuaternion::from_euler_angles(1.3 * i as f64, 0.9 + i as f64, 2.1 * i as f64))
        .collect();
    let parents: Vec<_> = walk.joints.iter().map(|j| j.parent).collect();
    let heap = rebuilt(
        &walk,
        |frame, offset| own.get(frame).map_or(offset, |r| r.inverse() * offset),
        |i, local| parents[i].map_or_else(UnitQuaternion::identity, |p| own[p].inverse()) * local * own[i],
        |position| position,
    );
    let (a, b) = (carried(&heap), carried(&walk));
    assert!(!a.report.zero_pose_used && b.report.zero_pose_used);
    let person = person();
    for (a, b) in a.motion.poses.iter().zip(&b.motion.poses) {
        let (p, q) = (a.joint_positions(&person), b.joint_positions(&person));
        for (from, to) in LIMBS {
            let angle = (p[to.index()] - p[from.index()]).angle(&(q[to.index()] - q[from.index()]));
            assert!(angle < 0.04, "{from:?} is {angle} rad off"); // heading is read off the most upright frame
        }
        let (f, g) = (a.joint_frames(&person), b.joint_frames(&person));
        for joint in [Joint::LeftHand, Joint::RightUpperArm, Joint::LeftFoot, Joint::RightLowerLeg, Joint::Head] {
            let twist = f[joint.index()].rotation.angle_to(&g[joint.index()].rotation);
            assert!(twist < 0.35, "{joint:?} is turned by {twist} rad");
        }
    }
}

#[test]
fn rates_are_reduced_and_loops_closed() {
    let walk = shipped_walk().unwrap();
    let slow = retarget(&walk, "w", &person(), &RetargetSettings { max_rate: 15.0, ..settings() }).unwrap().motion;
    let full = carried(&walk).motion;
    assert!((slow.frame_time - 1.0 / 15.0).abs() < 1e-12);
    assert_eq!(slow.poses.len(), full.poses.len().div_ceil(2));
    assert!(difference(&slow.poses[1..2], &full.poses[2..3]).0 < 1e-4);
    let looped = retarget(&walk, "w", &person(), &RetargetSettings { looped: true, ..settings() }).unwrap().motion;
    let last = looped.poses.len() - 1;
    assert!(difference(&looped.poses[last..], &looped.poses[..1]).0 < 1e-9);
    let bad = retarget(&walk, "w", &person(), &RetargetSettings { max_rate: 0.0, ..settings() });
    assert!(bad.unwrap_err().to_string().contains("max_rate"));
}

#[test]
fn an_unknown_skeleton_is_named() {
    let mut dog = shipped_walk().unwrap();
    dog.joints.iter_mut().enumerate().for_each(|(i, j)| j.name = format!("paw{i}"));
    let error = retarget(&dog, "dog", &person(), &settings()).unwrap_err();
    assert!(matches!(error, AnimationError::UnknownSkeleton { .. }));
    let text = error.to_string();
    assert!(text.contains("left upper leg") && text.contains("paw3"), "{text}");
    let mut armless = shipped_walk().unwrap();
    armless.joints.iter_mut().filter(|j| j.name == "rightLowerArm").for_each(|j| j.name = "hook".into());
    assert!(retarget(&armless, "x", &person(), &settings()).unwrap_err().to_string().contains("right upper arm"));
    let nowhere = Skeleton { rest: [nalgebra::Point3::origin(); JOINT_COUNT] };
    assert!(retarget(&shipped_walk().unwrap(), "x", &nowhere, &settings()).unwrap_err().to_string().contains("length"));
}

// ------------------------------------------------------------------------------------------- real captures

/// The motion captures among the test data from outside; `None` where they are missing, which is said.
fn captures() -> Option<Vec<PathBuf>> {
    let root = toile_outside::data("real/motion")?;
    let list = |folder: &Path| -> Vec<PathBuf> {
        let entries = std::fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
        entries.map(|e| e.unwrap().path()).collect()
    };
    let mut files: Vec<PathBuf> = list(&root).iter().filter(|p| p.is_dir()).flat_map(|p| list(p)).collect();
    files.retain(|f| f.extension().is_some_and(|e| e == "bvh"));
    files.sort();
    Some(files)
}

/// Limb directions of the source by the names that the report gives, one row a frame.
fn source_directions(bvh: &Bvh, result: &Retargeted, frame: usize) -> Vec<Vector3<f64>> {
    let index = |joint: Joint| {
        let name = &result.report.joints.iter().find(|j| j.0 == joint).unwrap().1;
        bvh.joints.iter().position(|j| j.name == *name).unwrap()
    };
    let world = bvh.joint_frames(frame);
    let at = |joint: Joint| world[index(joint)].translation.vector;
    LIMBS.iter().map(|(a, b)| (at(*b) - at(*a)).normalize()).collect()
}

fn directions(pose: &Pose, person: &Skeleton) -> Vec<Vector3<f64>> {
    let at = pose.joint_positions(person);
    LIMBS.iter().map(|(a, b)| (at[b.index()] - at[a.index()]).normalize()).collect()
}

/// The rotation that fits `from` to `to` best (Kabsch 1976).
fn fitted(from: &[Vector3<f64>], to: &[Vector3<f64>]) -> Rotation3<f64> {
    let sum: Matrix3<f64> = from.iter().zip(to).map(|(f, t)| t * f.transpose()).sum();
    let svd = sum.svd(true, true);
    let (u, v) = (svd.u.unwrap(), svd.v_t.unwrap());
    let sign = (u * v).determinant().signum();
    Rotation3::from_matrix_unchecked(u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * v)
}

#[test]
fn limbs_of_real_captures_point_where_the_source_points() {
    let Some(files) = captures() else { return };
    let person = person();
    assert_eq!(files.len(), 16);
    for file in files {
        let bvh = bvh::read(&file).unwrap();
        let result = retarget(&bvh, "x", &person, &settings()).unwrap();
        let first = result.report.frames_dropped;
        assert_eq!(result.motion.poses.len(), bvh.frames.len() - first);
        let step = bvh.frames.len().div_ceil(50);
        let rows: Vec<(usize, &Pose)> = result.motion.poses.iter().enumerate().step_by(step).collect();
        let source: Vec<_> = rows.iter().flat_map(|(i, _)| source_directions(&bvh, &result, i + first)).collect();
        let target: Vec<_> = rows.iter().flat_map(|(_, p)| directions(p, &person)).collect();
        let subject_from_source = fitted(&source, &target);
        for (s, t) in source.iter().zip(&target) {
            let angle = (subject_from_source * s).angle(t).to_degrees();
            assert!(angle < 0.1, "{}: a limb is {angle}° off", file.display());
        }
        let up = Vector3::from(result.report.up);
        assert!((subject_from_source * up).y > 0.9999, "{}: up became {}", file.display(), subject_from_source * up);
        let forward = result.motion.poses[0].rotation(Joint::Hips) * Vector3::z();
        assert!(forward.x.abs() < 1e-6 && forward.z > 0.0, "{}: faces {forward}", file.display());
    }
}

#[test]
fn feet_of_real_captures_stand_on_the_floor_and_do_not_slide() {
    let Some(files) = captures() else { return };
    let body = BodyModel::load_default().unwrap().skinned(&[]);
    for file in files {
        let bvh = bvh::read(&file).unwrap();
        let name = file.file_stem().unwrap().to_string_lossy().to_string();
        let figures = |lift_feet: bool| {
            let settings = RetargetSettings { lift_feet, ..RetargetSettings::default() };
            let moved = retarget_body(&bvh, "x", &body, &settings).unwrap();
            foot_figures(&bvh, &moved, &body).unwrap()
        };
        let held = figures(true);
        // of a wild dance one step in 500 may slide: a foot that is dragged through the air slows down
        assert!(held.sliding * 500 <= held.standing, "{name}: skin on the floor slides: {held:?}");
        assert!(held.slide_p95 < 0.003, "{name}: {held:?}");
        assert!(held.deepest < 0.002, "{name}: {} m below the floor", held.deepest);
        assert!(held.floating * 50 <= held.standing, "{name}: {held:?}");
        if bvh.frames.len() < 200 {
            let free = figures(false);
            assert!(held.beyond_limits <= free.beyond_limits, "{name}: {held:?} where the file has {free:?}");
            // a foot that stops has to be stopped: no more than that
            assert!(held.acceleration_p99 < free.acceleration_p99 + 35.0, "{name}: {held:?} {free:?}");
        }
    }
}

/// Somebody who walks and then goes down on the back, or over onto the hands: nothing of the body is below the floor, and it does
/// not shake.
#[test]
fn who_lies_down_or_turns_over_is_not_in_the_floor() {
    let body = BodyModel::load_default().unwrap().skinned(&[]);
    let walk = shipped_walk().unwrap();
    let settings = RetargetSettings { max_rate: 15.0, ..RetargetSettings::default() };
    for turn in [Vector3::x() * -1.5, Vector3::z() * 3.1] {
        let mut turned = walk.clone();
        for frame in 0..walk.frames.len() {
            let share = (3.0 * frame as f64 / walk.frames.len() as f64 - 2.0).clamp(0.0, 1.0);
            let turn = UnitQuaternion::from_scaled_axis(turn * share * share * (3.0 - 2.0 * share));
            let one = Bvh { frames: vec![walk.frames[frame].clone()], ..walk.clone() };
            let of = |joint: usize, local| if joint == 0 { turn * local } else { local };
            turned.frames[frame] =
                rebuilt(&one, |_, offset| offset, of, |at| at - Vector3::y() * 80.0 * share).frames[0].clone();
        }
        turned.joints = rebuilt(&walk, |_, o| o, |_, l| l, |p| p).joints;
        let figures = |lift_feet: bool| {
            let settings = RetargetSettings { lift_feet, ..settings.clone() };
            let moved = retarget_body(&turned, "turned", &body, &settings).unwrap();
            foot_figures(&turned, &moved, &body).unwrap()
        };
        let (held, free) = (figures(true), figures(false));
        assert!(free.deepest > 0.1 && held.deepest < 0.002, "{turn}: {held:?}, {free:?}");
        assert!(held.acceleration_p99 < free.acceleration_p99 + 20.0, "{turn}: {held:?}, {free:?}");
    }
}

#[test]
fn one_capture_in_units_and_metres_is_one_motion() {
    let Some(files) = captures() else { return };
    let read =
        |name: &str| bvh::read(files.iter().find(|f| f.file_stem().is_some_and(|s| s == name)).unwrap()).unwrap();
    let (units, mut metres) = (carried(&read("131_01")), carried(&read("scaled_131_01")));
    metres.motion.poses.truncate(units.motion.poses.len());
    let (angle, shift) = difference(&units.motion.poses, &metres.motion.poses);
    assert!(angle < 1e-3 && shift < 0.01, "{angle} rad, {shift} m");
}

#[test]
fn channel_orders_are_equal() {
    let walk = shipped_walk().unwrap();
    let mut other = rebuilt(&walk, |_, o| o, |_, l| l, |p| p);
    // Y X Z order in the file: the same rotations need other angles
    for (f, values) in other.frames.iter_mut().enumerate() {
        let world = walk.joint_frames(f);
        for (i, joint) in walk.joints.iter().enumerate() {
            let parent = joint.parent.map_or_else(UnitQuaternion::identity, |p| world[p].rotation);
            let m = (parent.inverse() * world[i].rotation).to_rotation_matrix();
            let (y, x, z) = (m[(0, 2)].atan2(m[(2, 2)]), (-m[(1, 2)]).asin(), m[(1, 0)].atan2(m[(1, 1)]));
            values[3 + 3 * i..6 + 3 * i].copy_from_slice(&[y, x, z].map(f64::to_degrees));
        }
    }
    for joint in &mut other.joints {
        let rotations = [Channel::Rotation(1), Channel::Rotation(0), Channel::Rotation(2)];
        let at = joint.channels.len() - 3;
        joint.channels[at..].copy_from_slice(&rotations);
    }
    assert_same(&other, "YXZ");
}
