//! People of the generator in poses of motion files, and their scans.
#![allow(dead_code)] // each user takes a part

use std::{fs, path::Path};

use nalgebra::{Isometry3, Point3, Vector3};
use toile_animation::{RetargetSettings, bvh, retarget};
use toile_character::{BodyModel, Joint, Pose, Region, Skeleton, SkinnedMesh};
use toile_geometry::{Mesh, bvh::Bvh};
use toile_synthetic::{Person, Sex, SyntheticSettings};

use super::{Numbers, strangers};

/// Height of the lower sole over the floor up to which a foot stands, metres: soles of retargeted motions are that exact.
const STANDS: f32 = 0.03;
/// Share of the standing height at which hips are lowest in somebody who stands.
const LOWEST_HIPS: f64 = 0.55;
/// Distance over a surface at which its inside is looked for, metres.
const OVER: f32 = 0.002;

/// One pose of a motion.
pub struct Moment {
    /// File and number of the pose.
    pub name: String,
    pub pose: Pose,
}

/// The poses of all BVH files below `folder` in which at least a foot stands, on the mean skeleton, `rate` a second.
/// `half`: 0 or 1 for every other file, by name.
pub fn moments(model: &BodyModel, folder: &Path, half: usize, rate: f64) -> Vec<Moment> {
    let mut files = Vec::new();
    collect(folder, &mut files);
    files.sort();
    let settings = RetargetSettings { max_rate: rate, fingers: false, ..RetargetSettings::default() };
    let mut out = Vec::new();
    for path in files.iter().skip(half).step_by(2) {
        let name = path.file_stem().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let Ok(motion) = bvh::read(path).and_then(|b| retarget(&b, &name, &model.mean_skeleton, &settings)) else {
            continue;
        };
        let poses = motion.motion.poses.into_iter().enumerate();
        let stands = |(_, pose): &(usize, Pose)| is_standing(model, pose);
        out.extend(poses.filter(stands).map(|(k, pose)| Moment { name: format!("{name}:{k}"), pose }));
    }
    out
}

fn collect(folder: &Path, files: &mut Vec<std::path::PathBuf>) {
    for path in fs::read_dir(folder).into_iter().flatten().flatten().map(|e| e.path()) {
        if path.is_dir() {
            collect(&path, files);
        } else if path.extension().is_some_and(|e| e == "bvh") {
            files.push(path);
        }
    }
}

fn is_standing(model: &BodyModel, pose: &Pose) -> bool {
    let points = model.posed(&[], pose);
    let feet = points.iter().zip(&model.regions).filter(|(_, r)| matches!(r, Region::LeftFoot | Region::RightFoot));
    let sole = feet.map(|(p, _)| p.y).fold(f32::INFINITY, f32::min);
    let lowest = points.iter().map(|p| p.y).fold(f32::INFINITY, f32::min);
    let hips = pose.joint_positions(&model.mean_skeleton)[0].y;
    sole < STANDS && sole < lowest + STANDS && hips > LOWEST_HIPS * model.mean_skeleton.position(Joint::Hips).y
}

/// `count` of the poses: the odd ones the farthest from all before (by the place of the joints), the even ones by chance.
pub fn diverse(model: &BodyModel, moments: &[Moment], count: usize) -> Vec<usize> {
    let features: Vec<Vec<Point3<f64>>> = moments.iter().map(|m| in_own_frame(&m.pose, &model.mean_skeleton)).collect();
    let gap =
        |a: usize, b: usize| features[a].iter().zip(&features[b]).map(|(p, q)| (p - q).norm_squared()).sum::<f64>();
    let mut numbers = Numbers(17);
    let mut nearest = vec![f64::INFINITY; moments.len()];
    let mut out: Vec<usize> = Vec::new();
    while out.len() < count.min(moments.len()) {
        let chance = ((numbers.next() * 0.5 + 0.5) * moments.len() as f64) as usize % moments.len();
        let farthest = (0..moments.len()).max_by(|a, b| nearest[*a].total_cmp(&nearest[*b])).unwrap_or(0);
        let next = if out.len().is_multiple_of(2) { chance } else { farthest };
        out.push(next);
        (0..moments.len()).for_each(|k| nearest[k] = nearest[k].min(gap(k, next)));
    }
    out
}

fn in_own_frame(pose: &Pose, skeleton: &Skeleton) -> Vec<Point3<f64>> {
    let front = pose.rotation(Joint::Hips) * Vector3::z();
    let turn = nalgebra::UnitQuaternion::from_scaled_axis(Vector3::y() * -front.x.atan2(front.z));
    let joints = pose.joint_positions(skeleton);
    joints.iter().take(22).map(|p| Point3::from(turn * (p - joints[0]))).collect()
}

/// Person `seed` of the generator: women and men in turn, of varying build.
pub fn somebody(model: &BodyModel, seed: u64) -> SkinnedMesh {
    let sex = if seed.is_multiple_of(2) { Sex::Female } else { Sex::Male };
    let settings = SyntheticSettings { seed, sex, ..SyntheticSettings::default() };
    Person::new(model, &settings).expect("the generator's people can be measured").body
}

/// The pose with the lower foot on the floor, turned to a random heading.
pub fn placed(body: &SkinnedMesh, pose: &Pose, numbers: &mut Numbers) -> Pose {
    let heading = Vector3::y() * numbers.next() * std::f64::consts::PI;
    let mut pose = pose.moved(&Isometry3::new(Vector3::zeros(), heading), &body.skeleton);
    let joints = pose.joint_positions(&body.skeleton);
    let lowest = body.posed(&pose).iter().map(|p| p.y).fold(f32::INFINITY, f32::min);
    pose.translation -= Vector3::new(joints[0].x, f64::from(lowest), joints[0].z);
    pose
}

/// The part that a turntable scan shows of the posed body: 2 mm of noise, a fifth missing, nothing of what lies inside the
/// body itself (limbs that cross or touch).
pub fn scanned(model: &BodyModel, body: &Mesh, numbers: &mut Numbers) -> Mesh {
    let bvh = Bvh::new(&body.positions, &body.triangles);
    let is_hidden = |v: usize| model.inner[v] || bvh.contains(&(body.positions[v] + body.normals[v] * OVER));
    let hidden: Vec<bool> = (0..body.positions.len()).map(is_hidden).collect();
    strangers::scanned_without(body, &hidden, 0.2, 0.002, numbers)
}
