//! The walk of our own making.
#![allow(clippy::unwrap_used)] // helpers of tests are not seen as tests

use toile_animation::{RetargetSettings, WalkSettings, bvh, retarget, shipped_walk, walk};
use toile_character::{BodyModel, Joint, Skeleton};

fn person() -> Skeleton {
    let model = BodyModel::load_default().unwrap();
    model.skeleton_at(&vec![0.0; model.component_count()])
}

#[test]
fn the_shipped_file_is_what_the_generator_makes() {
    let made = walk(&WalkSettings::default()).unwrap();
    let shipped = shipped_walk().unwrap();
    let header =
        |b| toile_animation::bvh::write(b).lines().take_while(|l| *l != "MOTION").collect::<Vec<_>>().join("\n");
    assert_eq!(header(&made), header(&shipped));
    assert_eq!(made.frames.len(), shipped.frames.len());
    for (a, b) in made.frames.iter().flatten().zip(shipped.frames.iter().flatten()) {
        assert!((a - b).abs() < 2e-6, "{a} is not {b}: run the example write_walk");
    }
}

#[test]
fn it_closes_stands_on_the_floor_and_swings_its_arms_against_its_legs() {
    let person = person();
    let motion = retarget(&shipped_walk().unwrap(), "walk", &person, &RetargetSettings::default()).unwrap().motion;
    let (first, last) = (&motion.poses[0], &motion.poses[motion.poses.len() - 1]);
    assert!(first.rotations.iter().zip(&last.rotations).all(|(a, b)| a.angle_to(b) < 1e-3));
    assert!((first.translation - last.translation).norm() < 1e-3);
    let (mut forearm_angles, mut products, mut knees) = (Vec::new(), 0.0, 0.0f64);
    for pose in &motion.poses {
        let at = pose.joint_positions(&person);
        let height = |j: Joint| at[j.index()].y - person.position(j).y;
        let toes = height(Joint::LeftToes).min(height(Joint::RightToes));
        let heels = height(Joint::LeftFoot).min(height(Joint::RightFoot));
        assert!(toes.min(heels).abs() < 0.03, "neither foot near the floor: {toes}, {heels}");
        let ahead = |j: Joint| at[j.index()].z - at[0].z;
        products += ahead(Joint::LeftHand) * ahead(Joint::LeftFoot) + ahead(Joint::RightHand) * ahead(Joint::RightFoot);
        let arm = at[Joint::LeftLowerArm.index()] - at[Joint::LeftUpperArm.index()];
        forearm_angles.push(arm.x.atan2(-arm.y).to_degrees());
        let thigh = at[Joint::LeftLowerLeg.index()] - at[Joint::LeftUpperLeg.index()];
        knees = knees.max(thigh.angle(&(at[Joint::LeftFoot.index()] - at[Joint::LeftLowerLeg.index()])).to_degrees());
    }
    assert!(products < 0.0, "arms swing with the legs of their side");
    assert!(forearm_angles.iter().all(|a| (5.0..20.0).contains(a)), "arms hang at {forearm_angles:?}");
    assert!((45.0..75.0).contains(&knees), "knees bend up to {knees}°");
}

#[test]
fn standing_feet_do_not_slide_when_it_travels() {
    let settings = WalkSettings { in_place: false, rate: 120.0, ..WalkSettings::default() };
    let bvh = walk(&settings).unwrap();
    let toes = bvh.joints.iter().position(|j| j.name == "leftToes").unwrap();
    let at = |f: usize| bvh.joint_frames(f)[toes].translation.vector;
    let mut standing = 0;
    for frame in 1..bvh.frames.len() {
        let (a, b) = (at(frame - 1), at(frame));
        if a.y < 2.001 && b.y < 2.001 {
            standing += 1;
            assert!((a - b).norm() < 0.1, "frame {frame}: toes move {} cm", (a - b).norm());
        }
    }
    assert!(standing > bvh.frames.len() / 3);
    let travelled = bvh.frames[bvh.frames.len() - 1][2] - bvh.frames[0][2];
    let seconds = bvh.frame_time * (bvh.frames.len() - 1) as f64;
    assert!((travelled / 100.0 / seconds - 1.15).abs() < 1e-6);
}

#[test]
fn other_paces_walk_too_and_impossible_ones_are_refused() {
    for (speed, cadence) in [(0.3, 60.0), (0.8, 100.0), (1.6, 125.0), (2.0, 140.0)] {
        let made = walk(&WalkSettings { speed, cadence, ..WalkSettings::default() }).unwrap();
        let heights: Vec<f64> = made.frames.iter().map(|f| f[1]).collect();
        assert!(heights.iter().all(|h| (70.0..100.0).contains(h)), "{speed} m/s: hips at {heights:?} cm");
        let again = bvh::parse(&bvh::write(&made), "again").unwrap();
        assert!(again.joints.iter().zip(&made.joints).all(|(a, b)| (a.offset - b.offset).norm() < 1e-6));
    }
    for wrong in [f64::NAN, 0.0, 9.0] {
        let error = walk(&WalkSettings { speed: wrong, ..WalkSettings::default() }).unwrap_err();
        assert!(error.to_string().contains("speed"));
    }
}
