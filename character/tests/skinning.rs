//! Skinning in log space against linear blending: what a twist leaves of a girth, steps between vertices, bad input.
#![allow(clippy::unwrap_used)] // helpers of tests are not seen as tests

use std::f64::consts::{PI, TAU};

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use toile_character::{BodyModel, Joint, Pose, PosedSkin, SkinWeights, Skinner, Skinning, skinning};
use toile_geometry::Mesh;

/// The largest turn of a wrist or forearm that motions hold.
const TWIST: f64 = 170.0 / 180.0 * PI;

fn posed(mesh: &Mesh, weights: &SkinWeights, transforms: &[Isometry3<f64>], way: Skinning) -> PosedSkin {
    let mut posed = PosedSkin::default();
    Skinner::new(mesh, weights).unwrap().pose(transforms, way, &mut posed).unwrap();
    posed
}

const RINGS: usize = 11;
const AROUND: usize = 40;

/// A forearm along +X, 250 mm long and 45 mm in radius, whose weights pass from joint 0 to joint 1.
fn forearm() -> (Mesh, SkinWeights) {
    let (mut mesh, mut weights) = (Mesh::default(), SkinWeights::default());
    for i in 0..RINGS * AROUND {
        let along = (i / AROUND) as f32 / (RINGS - 1) as f32;
        let angle = (i % AROUND) as f32 / AROUND as f32 * TAU as f32;
        mesh.normals.push(Vector3::new(0.0, angle.cos(), angle.sin()));
        mesh.positions.push(Point3::new(0.25 * along, 1.2, 0.1) + 0.045 * mesh.normals[i]);
        weights.push(&[(0, 1.0 - along), (1, along)]);
    }
    (mesh, weights)
}

/// Length of each ring's outline.
fn girths(positions: &[Point3<f32>]) -> Vec<f64> {
    let outline =
        |ring: &[Point3<f32>]| (0..AROUND).map(|k| f64::from((ring[(k + 1) % AROUND] - ring[k]).norm())).sum::<f64>();
    positions.chunks(AROUND).map(outline).collect()
}

#[test]
fn a_twisted_forearm_keeps_its_girth_in_log_space() {
    let (mesh, weights) = forearm();
    let axis = Point3::new(0.0, 1.2, 0.1);
    let turn = Isometry3::rotation_wrt_point(UnitQuaternion::from_scaled_axis(TWIST * Vector3::x()), axis);
    let rest = girths(&mesh.positions);
    let kept = |way| {
        let after = girths(&posed(&mesh, &weights, &[Isometry3::identity(), turn], way).positions);
        after.iter().zip(&rest).map(|(a, b)| a / b).fold(f64::INFINITY, f64::min)
    };
    for way in [Skinning::Log, Skinning::Hybrid] {
        assert!((kept(way) - 1.0).abs() < 1e-5, "{way}: {}", kept(way));
    }
    // Halfway, linear blending leaves cos(85°).
    assert!((kept(Skinning::Linear) - (TWIST / 2.0).cos()).abs() < 1e-5, "{}", kept(Skinning::Linear));
}

/// Of each slice across the forearm of the shipped body, ten between elbow and wrist: mean distance from the bone.
fn forearm_radii(rest: &[Point3<f32>], weights: &SkinWeights, at: [Point3<f64>; 2], now: &[Point3<f32>]) -> Vec<f64> {
    let bone = at[1] - at[0];
    let (mut sums, mut counts) = ([0.0; 10], [0.0; 10]);
    for v in 0..rest.len() {
        let along = (rest[v].cast::<f64>() - at[0]).dot(&bone) / bone.norm_squared();
        let on_arm = weights.of(v).any(|(j, w)| w > 0.05 && usize::from(j) == Joint::LeftLowerArm.index());
        if on_arm && (0.0..1.0).contains(&along) {
            let offset = now[v].cast::<f64>() - at[0];
            let slice = (10.0 * along) as usize;
            sums[slice] += (offset - bone * (offset.dot(&bone) / bone.norm_squared())).norm();
            counts[slice] += 1.0;
        }
    }
    sums.iter().zip(counts).map(|(sum, count)| sum / count).collect()
}

#[test]
fn the_shipped_body_keeps_its_wrist() {
    let body = BodyModel::load_default().unwrap().skinned(&[]);
    let at = [Joint::LeftLowerArm, Joint::LeftHand].map(|j| body.skeleton.position(j));
    let mut pose = Pose::identity();
    *pose.rotation_mut(Joint::LeftHand) = UnitQuaternion::from_scaled_axis((at[1] - at[0]).normalize() * TWIST);
    let transforms = pose.skinning_transforms(&body.skeleton);
    let radii = |now: &[Point3<f32>]| forearm_radii(&body.mesh.positions, &body.weights, at, now);
    let rest = radii(&body.mesh.positions);
    let kept = |way| -> Vec<f64> {
        let now = radii(&posed(&body.mesh, &body.weights, &transforms, way).positions);
        now.iter().zip(&rest).map(|(now, rest)| now / rest).collect()
    };
    let least = |shares: Vec<f64>| shares.into_iter().fold(f64::INFINITY, f64::min);
    println!(
        "linear {:.3?}\nlog {:.3?}\nhybrid {:.3?}",
        kept(Skinning::Linear),
        kept(Skinning::Log),
        kept(Skinning::Hybrid)
    );
    assert!(least(kept(Skinning::Log)) > 0.99);
    assert!(least(kept(Skinning::Hybrid)) > 0.99);
    assert!(least(kept(Skinning::Linear)) < 0.7);
}

#[test]
fn a_body_moved_as_a_whole_stays_as_it_is() {
    let body = BodyModel::load_default().unwrap().skinned(&[0.7]);
    let moved = Isometry3::new(Vector3::new(0.5, -0.2, 1.0), Vector3::new(2.0, 1.0, -0.5));
    for way in Skinning::ALL {
        let after = posed(&body.mesh, &body.weights, &vec![moved; 52], way);
        for (now, rest) in after.positions.iter().zip(&body.mesh.positions) {
            assert!((now.cast::<f64>() - moved * rest.cast::<f64>()).norm() < 1e-6, "{way}");
        }
    }
}

#[test]
fn single_precision_matches_the_older_linear_blend() {
    let body = BodyModel::load_default().unwrap().skinned(&[]);
    let mut pose = Pose::identity();
    *pose.rotation_mut(Joint::RightUpperLeg) = UnitQuaternion::from_euler_angles(-0.9, 0.2, 0.1);
    let transforms = pose.skinning_transforms(&body.skeleton);
    let older = skinning::skin(&body.mesh.positions, &body.weights, &transforms);
    let after = posed(&body.mesh, &body.weights, &transforms, Skinning::Linear);
    assert!(after.positions.iter().zip(&older).all(|(a, b)| (a - b).norm() < 1e-6));
    assert!(after.normals.iter().all(|n| (n.norm() - 1.0).abs() < 1e-5));
}

/// Sets of joints change from vertex to vertex, and with them the joint that logarithms are relative to.
#[test]
fn log_space_tears_nothing_in_a_wild_pose() {
    let body = BodyModel::load_default().unwrap().skinned(&[]);
    let mut pose = Pose::identity();
    for (joint, turn) in [
        (Joint::Spine, [0.5, 0.6, 0.3]),
        (Joint::LeftUpperLeg, [-1.6, 0.3, 0.2]),
        (Joint::RightUpperLeg, [0.6, -0.4, -0.5]),
        (Joint::LeftUpperArm, [0.4, 0.9, 1.3]),
        (Joint::LeftLowerArm, [0.0, -2.2, 0.0]),
        (Joint::Neck, [0.3, 0.9, 0.0]),
    ] {
        *pose.rotation_mut(joint) = UnitQuaternion::from_scaled_axis(Vector3::from(turn));
    }
    let transforms = pose.skinning_transforms(&body.skeleton);
    let stretch = |way| {
        let after = posed(&body.mesh, &body.weights, &transforms, way).positions;
        let longest = |t: &[u32; 3]| {
            let edge = |p: &[Point3<f32>], k: usize| (p[t[k] as usize] - p[t[(k + 1) % 3] as usize]).norm();
            (0..3).map(|k| edge(&after, k) - edge(&body.mesh.positions, k)).fold(0.0, f32::max)
        };
        body.mesh.triangles.iter().map(longest).fold(0.0, f32::max)
    };
    let (linear, log) = (stretch(Skinning::Linear), stretch(Skinning::Log));
    println!("longest growth of an edge: linear {linear} m, log {log} m");
    assert!(log < 1.5 * linear, "linear {linear} m, log {log} m");
}

#[test]
fn what_does_not_fit_is_refused() {
    let (mesh, mut weights) = forearm();
    let skinner = Skinner::new(&mesh, &weights).unwrap();
    let error = skinner.pose(&[Isometry3::identity()], Skinning::Log, &mut PosedSkin::default()).unwrap_err();
    assert_eq!(error.to_string(), "character: transforms of 1 joints, but weights for joint 1");
    weights.weights[3][0] = f32::NAN;
    let error = Skinner::new(&mesh, &weights).unwrap_err();
    assert_eq!(error.to_string(), "character: a skin weight of vertex 3 is not a finite number");
    let error = Skinner::new(&Mesh::default(), &weights).unwrap_err();
    assert_eq!(error.to_string(), "character: 0 vertices but weights for 440");
    assert!("bones".parse::<Skinning>().is_err());
    assert!(Skinning::ALL.iter().all(|way| way.name().parse() == Ok(*way)));
}
