//! Arms that are held away from the body for what is worn.
#![allow(clippy::unwrap_used)] // all of it is test code

use toile_animation::blend::{Clothed, Room};
use toile_character::{BodyModel, Joint, Motion, Pose, SkinnedMesh, dress_pose::straight_limbs};
use toile_geometry::Mesh;

/// The skin moved out by `by` metres: a padded suit.
fn suit(body: &SkinnedMesh, by: f32) -> Mesh {
    let mut mesh = body.mesh.clone();
    let normals = mesh.vertex_normals();
    mesh.positions.iter_mut().zip(&normals).for_each(|(p, n)| *p += n * by);
    mesh
}

/// Half a second of standing with the arms `down` below the horizontal, radians, then a second as it was scanned.
fn motion(body: &SkinnedMesh, down: f64) -> Motion {
    let hanging = straight_limbs(&body.skeleton, down, 0.05);
    let poses = (0..45).map(|k| if k < 15 { hanging.clone() } else { Pose::identity() }).collect();
    Motion { name: "stand".into(), frame_time: 1.0 / 30.0, poses }
}

fn room(body: &SkinnedMesh, layers: &[&Mesh], motion: &mut Motion) -> Room {
    Clothed::new(&body.skeleton, &Pose::identity(), layers, &body.weights).unwrap().make_room(motion)
}

#[test]
fn arms_make_room_for_a_thick_suit_and_not_for_skin() {
    let body = BodyModel::load_default().unwrap().skinned(&[]);
    let (thin, thick) = (suit(&body, 0.010), suit(&body, 0.040));
    let mut moved = motion(&body, 1.4);
    let hand = |pose: &Pose| pose.joint_positions(&body.skeleton)[Joint::LeftHand.index()];
    let before = hand(&moved.poses[0]);
    let of_skin = room(&body, &[&body.mesh], &mut motion(&body, 1.4));
    let of_thin = room(&body, &[&body.mesh, &thin], &mut motion(&body, 1.4));
    let of_thick = room(&body, &[&body.mesh, &thick], &mut moved);
    for side in 0..2 {
        assert!(of_skin.largest[side] < of_thin.largest[side], "{of_skin:?} {of_thin:?}");
        assert!(of_thin.largest[side] + 0.05 < of_thick.largest[side], "{of_thin:?} {of_thick:?}");
    }
    // The hand goes to its own side, and the arm goes back before the pose that was scanned ends.
    assert!(hand(&moved.poses[0]).x > before.x + 0.05);
    assert_eq!(moved.poses[44], Pose::identity());
    assert!((24..32).contains(&of_thick.poses), "{of_thick:?}");
    // No jump: from pose to pose an arm turns by less than a sixth of the way.
    let turn = |k: usize| {
        moved.poses[k].rotation(Joint::LeftUpperArm).angle_to(&moved.poses[k + 1].rotation(Joint::LeftUpperArm))
    };
    assert!((0..13).all(|k| turn(k) < of_thick.largest[0] / 6.0));
}

#[test]
fn arms_that_are_held_out_are_left_alone() {
    let body = BodyModel::load_default().unwrap().skinned(&[]);
    let mut moved = motion(&body, 0.3);
    let before = moved.clone();
    let found = room(&body, &[&body.mesh, &suit(&body, 0.03)], &mut moved);
    assert_eq!((found, moved), (Room::default(), before));
}
