//! Cases that are hard to label: black cloth, open fronts, arms that touch, cloth that swings or was taken off.

use nalgebra::Point3;
use toile_character::Pose;
use toile_garments::Warning;
use toile_geometry::{Mesh, topology::boundary_loops};

use crate::column::*;

const RED: [u8; 3] = [170, 40, 40];

/// A coat 60 mm off the body, open in front from −`edge` to `edge` radians, and a scarf above it.
fn in_open_coat(edge: f32, has_scarf: bool) -> Mesh {
    let mut scan = column(|y, a| RADIUS + noise(y, a), |_| SKIN);
    for v in 0..scan.positions.len() {
        let p = scan.positions[v];
        let a = p.x.atan2(p.z);
        let (off, color) = match p.y {
            y if inside(y) && a.abs() > edge => (0.06, BLUE),
            y if has_scarf && (0.9..1.0).contains(&y) => (0.01, RED),
            _ => continue,
        };
        let at = RADIUS + noise(p.y, a) + off;
        (scan.positions[v], scan.colors[v]) = (Point3::new(at * a.sin(), p.y, at * a.cos()), color);
    }
    scan
}

#[test]
fn black_cloth_with_dropouts_is_found_and_the_unseen_marked() {
    let (person, pose, before) = (person(), Pose::identity(), bare());
    let mut scan = dressed(0.008, [14, 14, 16]);
    let centers: Vec<Point3<f32>> = (0..40)
        .map(|k| (k as f32 * 2.4, 0.33 + 0.44 * k as f32 / 40.0))
        .map(|(a, y)| Point3::new(RADIUS * a.sin(), y, RADIUS * a.cos()))
        .collect();
    let dropped = |p: &Point3<f32>| centers.iter().any(|c| (p - c).norm() < 0.03);
    let filled: Vec<f32> = scan.positions.iter().map(|p| f32::from(u8::from(dropped(p)))).collect();
    let share = filled.iter().sum::<f32>() / filled.len() as f32;
    assert!(share > 0.1, "{share}");
    scan.attributes.insert("filled".into(), filled);
    let found = extracted(&take(&person, &scan, &before, &pose));
    assert!(iou(&scan, &found.labels.garment) > 0.97, "{}", iou(&scan, &found.labels.garment));
    assert!(found.report.filled_share > 0.2 && found.report.openings_m.len() == 2, "{:?}", found.report);
}

#[test]
fn an_open_jacket_has_one_rim() {
    let (person, pose, before) = (person(), Pose::identity(), bare());
    let cloth = |p: &Point3<f32>| inside(p.y) && p.x.atan2(p.z).abs() > 0.5;
    let mut scan = bare();
    for v in 0..scan.positions.len() {
        let p = scan.positions[v];
        if cloth(&p) {
            let (a, at) = (p.x.atan2(p.z), RADIUS + 0.01);
            scan.positions[v] = Point3::new(at * a.sin(), p.y, at * a.cos());
            scan.colors[v] = BLUE;
        }
    }
    let found = extracted(&take(&person, &scan, &before, &pose));
    assert!(iou_of(&scan, &found.labels.garment, cloth) > 0.96);
    assert_eq!(found.report.openings_m.len(), 1, "{:?}", found.report);
}

#[test]
fn two_garments_at_once_are_one_layer_with_a_warning() {
    let (person, pose, before) = (person(), Pose::identity(), bare());
    let cloth = |y: f32| (0.08..0.28).contains(&y) || (0.5..0.72).contains(&y);
    let radius = |y: f32, a: f32| RADIUS + noise(y, a) + if cloth(y) { 0.008 } else { 0.0 };
    let scan = column(radius, |y| if cloth(y) { BLUE } else { SKIN });
    let found = extracted(&take(&person, &scan, &before, &pose));
    assert_eq!((found.report.pieces, &found.warnings[..]), (2, &[Warning::TwoAtOnce][..]));
    assert_eq!(boundary_loops(&found.garment.triangles).len(), 4);
}

#[test]
fn a_bare_arm_that_touches_the_torso_is_not_cloth() {
    let angle = |p: &Point3<f32>| p.x.atan2(p.z).rem_euclid(std::f32::consts::TAU);
    // The arm is a ridge on the torso's side, a part of the same surface.
    let arm = |y: f32, a: f32| (0.4..0.9).contains(&y) && (a - 1.6).abs() < 0.45;
    let bulge = |y: f32, a: f32| if arm(y, a) { 0.06 * (1.0 - ((a - 1.6) / 0.45).powi(2)).sqrt() } else { 0.0 };
    let cloth = |y: f32, a: f32| inside(y) && !arm(y, a);
    let before = column(|y, a| RADIUS + bulge(y, a), |_| SKIN);
    let thick = |y: f32, a: f32| if cloth(y, a) { 0.008 } else { 0.0 };
    let mut scan = column(|y, a| RADIUS + bulge(y, a) + noise(y, a) + thick(y, a), |_| SKIN);
    for v in 0..scan.positions.len() {
        let p = scan.positions[v];
        scan.colors[v] = if cloth(p.y, angle(&p)) { BLUE } else { SKIN };
    }
    let person = Person { body: before.clone(), ..person() };
    let pose = Pose::identity();
    let found = extracted(&take(&person, &scan, &before, &pose));
    let iou = iou_of(&scan, &found.labels.garment, |p| cloth(p.y, angle(p)));
    assert!(iou > 0.96, "{iou}");
}

#[test]
fn a_coat_that_swings_is_not_new_and_a_scarf_over_it_is() {
    let (person, pose) = (person(), Pose::identity());
    let before = in_open_coat(0.5, false);
    let is_scarf = |p: &Point3<f32>| (0.9..1.0).contains(&p.y);
    for edge in [0.5, 0.4] {
        let run = |has_scarf: bool| {
            let scan = in_open_coat(edge, has_scarf);
            let found = extracted(&take(&person, &scan, &before, &pose));
            (scan, found)
        };
        let (scan, found) = run(true);
        let iou = iou_of(&scan, &found.labels.garment, is_scarf);
        assert!(iou > 0.95 && found.warnings.is_empty(), "{edge}: {iou}, {:?}", found.warnings);
        let (_, found) = run(false);
        assert_eq!(found.warnings, [Warning::NothingNew], "{edge}");
    }
}

#[test]
fn what_was_uncovered_is_not_new() {
    let (person, pose) = (person(), Pose::identity());
    let (bare, dressed) = (column(|y, a| RADIUS + noise(y, a), |_| SKIN), dressed(0.01, BLUE));
    let found = extracted(&take(&person, &bare, &dressed, &pose));
    assert!(found.in_take.is_empty() && found.garment.is_empty());
    let [Warning::NothingNew, Warning::TakenOff(area)] = found.warnings[..] else { panic!("{:?}", found.warnings) };
    let cloth = std::f32::consts::TAU * RADIUS * 0.5;
    assert!((area / cloth - 1.0).abs() < 0.15, "{area} m² of {cloth}");
}

#[test]
fn shorts_over_a_loose_shirt_of_the_same_colour_are_whole() {
    let (person, pose) = (person(), Pose::identity());
    // Loose at one side and close at the others.
    let shirt = |y: f32, a: f32| if (0.5..1.0).contains(&y) { 0.012 + 0.045 * a.cos().max(0.0).powi(2) } else { 0.0 };
    let before = column(|y, a| RADIUS + noise(y, a) + shirt(y, a), |y| if shirt(y, 0.0) > 0.0 { BLUE } else { SKIN });
    let is_shorts = |y: f32| (0.2..0.75).contains(&y);
    // Where the shirt hung most loosely, the shorts press it in by their own thickness.
    let pressed = |y: f32, a: f32| (0.56..0.64).contains(&y) && a.cos() > 0.9;
    let off = |y: f32, a: f32| shirt(y, a) + if is_shorts(y) && !pressed(y, a) { 0.012 } else { 0.0 };
    let scan = column(|y, a| RADIUS + noise(y, a) + off(y, a), |y| if off(y, 0.0) > 0.0 { BLUE } else { SKIN });
    let found = extracted(&take(&person, &scan, &before, &pose));
    let iou = iou_of(&scan, &found.labels.garment, |p| is_shorts(p.y));
    assert!(iou > 0.96 && found.report.openings_m.len() == 2, "{iou}, {:?}", found.report);
}

#[test]
fn bare_skin_in_an_opening_stays_bare() {
    let (person, pose, before) = (person(), Pose::identity(), bare());
    let mut scan = dressed(0.008, BLUE);
    let middle = Point3::new(0.0, 0.55, RADIUS);
    for v in 0..scan.positions.len() {
        let p = scan.positions[v];
        if (p - middle).norm() < 0.05 {
            let bare = RADIUS / p.x.hypot(p.z);
            (scan.positions[v], scan.colors[v]) = (Point3::new(p.x * bare, p.y, p.z * bare), SKIN);
        }
    }
    let found = extracted(&take(&person, &scan, &before, &pose));
    assert_eq!(found.report.openings_m.len(), 3, "{:?}", found.report);
}
