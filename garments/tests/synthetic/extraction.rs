//! Garments found, cut out and brought to the common frame.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use toile_character::{Joint, Pose, SkinWeights, skinning};
use toile_garments::{DressedTake, ExtractSettings, GarmentError, GarmentType, Warning, extract};
use toile_geometry::{
    Mesh,
    topology::{boundary_loops, loop_length},
};

use crate::column::*;

#[test]
fn cloth_is_found_by_colour_and_shape_by_shape_alone_and_by_colour_alone() {
    let (person, pose, before) = (person(), Pose::identity(), bare());
    for (thick, color, least) in [(0.01, BLUE, 0.97), (0.01, SKIN, 0.93), (0.001, BLUE, 0.97)] {
        let scan = dressed(thick, color);
        let found = extracted(&take(&person, &scan, &before, &pose));
        let iou = iou(&scan, &found.labels.garment);
        assert!(iou >= least, "{thick} m of {color:?}: IoU {iou}");
        assert!(found.warnings.is_empty(), "{:?}", found.warnings);
        let loops = boundary_loops(&found.garment.triangles);
        assert_eq!(loops.len(), 2);
        let round = std::f32::consts::TAU * (RADIUS + thick);
        for l in loops {
            let length = loop_length(&found.garment.positions, &l);
            assert!((length / round - 1.0).abs() < 0.05, "hem of {length} m around {round} m");
        }
    }
}

#[test]
fn a_hem_ends_at_its_fold_and_not_on_the_ledge_below() {
    let (person, pose, before) = (person(), Pose::identity(), bare());
    // Fusion closes the space under a hanging hem by a ledge in the cloth's own colour.
    let off = |y: f32| 0.03 * ((y - 0.28) / 0.02).clamp(0.0, 1.0) * f32::from(u8::from(y < 0.8));
    let scan = column(|y, a| RADIUS + noise(y, a) + off(y), |y| if (0.287..0.8).contains(&y) { BLUE } else { SKIN });
    let found = extracted(&take(&person, &scan, &before, &pose));
    let loops = boundary_loops(&found.garment.triangles);
    assert_eq!(loops.len(), 2);
    let hem = loops.iter().find(|l| found.garment.positions[l[0] as usize].y < 0.5).unwrap();
    for p in hem.iter().map(|&v| found.garment.positions[v as usize]) {
        let radius = p.x.hypot(p.z) - RADIUS;
        assert!(radius > 0.02, "the hem at {p} lies {radius} m off the body");
    }
}

#[test]
fn stripes_are_one_garment() {
    let (person, pose, before) = (person(), Pose::identity(), bare());
    let stripes = |y: f32| match () {
        () if !inside(y) => SKIN,
        () if (y * 14.0) as i32 % 2 == 0 => [200, 40, 40],
        () => [235, 230, 225],
    };
    let scan = column(|y, a| RADIUS + noise(y, a) + if inside(y) { 0.004 } else { 0.0 }, stripes);
    let found = extracted(&take(&person, &scan, &before, &pose));
    assert!(iou(&scan, &found.labels.garment) > 0.96);
    assert_eq!(found.report.pieces, 1);
}

#[test]
fn nothing_new_and_something_taken_off_are_said() {
    let (person, pose) = (person(), Pose::identity());
    let (before, scan) = (bare(), dressed(0.0, SKIN));
    let found = extracted(&take(&person, &scan, &before, &pose));
    assert_eq!(found.warnings, [Warning::NothingNew]);
    assert!(found.garment.is_empty());
    let coat = dressed(0.03, BLUE);
    let mut skin_again = take(&person, &scan, &coat, &pose);
    skin_again.garment_type = None;
    let found = extracted(&skin_again);
    assert!(found.warnings.iter().any(|w| matches!(w, Warning::TakenOff(_))), "{:?}", found.warnings);
}

#[test]
fn a_hidden_patch_is_closed_and_marked() {
    let (person, pose, before) = (person(), Pose::identity(), bare());
    let scan = dressed(0.008, BLUE);
    let hole = Point3::new(0.0, 0.55, RADIUS);
    let (scan, _) = scan.filter_triangles(|t| (scan.positions[scan.triangles[t][0] as usize] - hole).norm() > 0.05);
    let found = extracted(&take(&person, &scan, &before, &pose));
    assert_eq!(boundary_loops(&found.garment.triangles).len(), 2);
    let filled = &found.garment.attributes["filled"];
    let marked = found.garment.positions.iter().zip(filled).filter(|(_, f)| **f > 0.5);
    assert!(marked.clone().count() > 20);
    assert!(marked.clone().all(|(p, _)| (p - hole).norm() < 0.07));
}

#[test]
fn a_bent_take_comes_back_to_the_common_frame() {
    let (mut person, before, scan) = (person(), bare(), dressed(0.01, BLUE));
    let mut pose = Pose::identity();
    *pose.rotation_mut(Joint::Spine) = UnitQuaternion::from_euler_angles(0.15, 0.3, -0.1);
    pose.translation = Vector3::new(0.1, 0.02, -0.3);
    let transforms = pose.skinning_transforms(&person.skeleton);
    let weights = person.weights.clone();
    let bend = |mesh: &Mesh| Mesh { positions: skinning::skin(&mesh.positions, &weights, &transforms), ..mesh.clone() };
    let (scan, before) = (bend(&scan), bend(&before));
    person.body = bend(&person.body);
    let mut bent = take(&person, &scan, &before, &pose);
    let rest = Pose::identity();
    bent.pose0 = &rest;
    let found = extracted(&bent);
    assert!(found.garment.positions.len() > 1000);
    let worst = found.garment.positions.iter().map(|p| (p.x.hypot(p.z) - RADIUS - 0.01).abs()).fold(0.0, f32::max);
    assert!(worst < 0.006, "{worst}");
    assert!(found.in_take.positions.iter().zip(&found.garment.positions).any(|(a, b)| (a - b).norm() > 0.2));
}

#[test]
fn given_types_are_kept_and_others_guessed() {
    let (person, pose, before, scan) = (person(), Pose::identity(), bare(), dressed(0.01, BLUE));
    let mut input = take(&person, &scan, &before, &pose);
    let reported = extracted(&input).report;
    assert!((reported.garment_type, reported.type_guessed) == (GarmentType::Other, false));
    input.garment_type = None;
    let guessed = extracted(&input).report;
    assert!((guessed.garment_type, guessed.type_guessed) == (GarmentType::Top, true), "{guessed:?}");
}

#[test]
fn bad_input_is_refused() {
    let (person, pose, before, empty) = (person(), Pose::identity(), bare(), Mesh::default());
    let refuse = |take: &DressedTake| extract(take, &ExtractSettings::default(), &|_| ()).unwrap_err();
    assert_eq!(refuse(&take(&person, &empty, &before, &pose)), GarmentError::Empty("scan"));
    let mut broken = before.clone();
    broken.positions[3].x = f32::NAN;
    assert!(matches!(refuse(&take(&person, &broken, &before, &pose)), GarmentError::Mesh(_)));
    let short = Person { weights: SkinWeights::default(), ..person };
    assert!(matches!(refuse(&take(&short, &before, &before, &pose)), GarmentError::Mismatch(_)));
}
