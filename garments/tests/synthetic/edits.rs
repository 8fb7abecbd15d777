//! Corrections by hand.

use nalgebra::Point3;
use toile_character::Pose;
use toile_garments::{
    DressedTake, EDITS_VERSION, EditName, Edits, ExtractSettings, GROWTH, HemLine, Mark, Stroke, Warning, extract,
};
use toile_geometry::{Mesh, bvh::Bvh, topology::boundary_loops};

use crate::column::*;

fn stroke(mark: Mark, at: Point3<f32>, radius: f32) -> Edits {
    let stroke = Stroke { mark, points: vec![at.into()], radius };
    Edits { version: EDITS_VERSION, strokes: vec![stroke], hems: Vec::new() }
}

#[test]
fn a_stroke_changes_its_neighbourhood_and_nothing_else() {
    let (person, pose, before, scan) = (person(), Pose::identity(), bare(), dressed(0.01, BLUE));
    let run = |edits: Option<&Edits>| {
        let take = DressedTake { edits, ..take(&person, &scan, &before, &pose) };
        extracted(&take)
    };
    let plain = run(None);
    for (mark, y) in [(Mark::DoesNotBelong, 0.75), (Mark::Belongs, 0.82)] {
        let (at, radius) = (Point3::new(0.0, y, RADIUS + 0.005), 0.03);
        let edited = run(Some(&stroke(mark, at, radius)));
        for (v, p) in scan.positions.iter().enumerate() {
            let (was, is) = (plain.labels.garment[v], edited.labels.garment[v]);
            let far = (p - at).norm();
            assert!(far < GROWTH * radius || was == is, "{p} changed, {far} m from the stroke");
            assert!(far > radius || is == (mark == Mark::Belongs), "{p} was touched and did not follow");
        }
        assert!(edited.report.edited_m2 > 0.0005);
        // The mesh is the same surface away from the stroke.
        let bvh = Bvh::new(&plain.garment.positions, &plain.garment.triangles);
        let away = edited.garment.positions.iter().filter(|p| (*p - at).norm() > GROWTH * radius + 0.03);
        let worst = away.map(|p| bvh.closest(p, 1.0).unwrap().distance).fold(0.0, f32::max);
        assert!(worst < 0.0015, "{worst}");
    }
}

#[test]
fn the_garments_mesh_shows_what_strokes_say() {
    let (person, pose, before, scan) = (person(), Pose::identity(), bare(), dressed(0.01, BLUE));
    let run = |edits: Option<&Edits>| {
        let take = DressedTake { edits, ..take(&person, &scan, &before, &pose) };
        extracted(&take).garment
    };
    let nearest =
        |mesh: &Mesh, at: &Point3<f32>| Bvh::new(&mesh.positions, &mesh.triangles).closest(at, 1.0).unwrap().distance;
    let loops = |mesh: &Mesh| boundary_loops(&mesh.triangles).len();
    let plain = run(None);
    // A hole in the middle is not closed again, nor smoothed away where it is small.
    let inside = Point3::new(0.0, 0.55, RADIUS + 0.01);
    for radius in [0.015, 0.008] {
        let cut = run(Some(&stroke(Mark::DoesNotBelong, inside, radius)));
        assert_eq!(loops(&cut), loops(&plain) + 1, "radius {radius}");
        assert!(nearest(&cut, &inside) > 0.4 * radius, "radius {radius}: {}", nearest(&cut, &inside));
    }
    // A patch away from the rest stays.
    let apart = Point3::new(0.0, 1.0, RADIUS);
    assert!(nearest(&plain, &apart) > 0.1);
    assert!(nearest(&run(Some(&stroke(Mark::Belongs, apart, 0.03))), &apart) < 0.003);
}

#[test]
fn the_hem_follows_a_line() {
    let (person, pose, before, scan) = (person(), Pose::identity(), bare(), dressed(0.01, BLUE));
    let height = |a: f32| 0.785 + 0.01 * (2.0 * a).sin();
    let points: Vec<[f32; 3]> = (0..=60)
        .map(|i| i as f32 % 60.0 / 60.0 * std::f32::consts::TAU)
        .map(|a| [0.13 * a.sin(), height(a), 0.13 * a.cos()])
        .collect();
    let hems = vec![HemLine { points, reach: 0.035 }];
    let edits = Edits { version: EDITS_VERSION, strokes: Vec::new(), hems };
    let take = DressedTake { edits: Some(&edits), ..take(&person, &scan, &before, &pose) };
    let found = extracted(&take);
    let top = boundary_loops(&found.garment.triangles)
        .into_iter()
        .find(|l| found.garment.positions[l[0] as usize].y > 0.6)
        .unwrap();
    for p in top.iter().map(|&v| found.garment.positions[v as usize]) {
        assert!((p.y - height(p.x.atan2(p.z))).abs() < 0.003, "{p}");
    }
}

#[test]
fn bad_edits_are_refused_by_name() {
    let (person, pose, before, scan) = (person(), Pose::identity(), bare(), dressed(0.01, BLUE));
    let good = stroke(Mark::Belongs, Point3::new(0.0, 0.5, RADIUS + 0.01), 0.03);
    let refuse = |change: &dyn Fn(&mut Edits)| {
        let mut bad = good.clone();
        change(&mut bad);
        let take = DressedTake { edits: Some(&bad), ..take(&person, &scan, &before, &pose) };
        extract(&take, &ExtractSettings::default(), &|_| ()).unwrap_err().to_string()
    };
    assert!(refuse(&|e| e.version = 9).contains("version 9"));
    assert!(refuse(&|e| e.strokes[0].radius = 3.0).contains("stroke 1"));
    assert!(refuse(&|e| e.strokes[0].points.clear()).contains("0 points"));
    assert!(refuse(&|e| e.strokes[0].points[0][1] = f32::NAN).contains("stroke 1: point 1"));
    assert!(refuse(&|e| e.strokes[0].points[0][2] = 0.5).contains("off the scan"));
    let line = HemLine { points: vec![[0.0, 0.5, RADIUS]], reach: 0.02 };
    assert!(refuse(&|e| e.hems.push(line.clone())).contains("hem line 1 has 1 point"));
}

#[test]
fn hem_lines_away_from_the_hem_change_nothing_and_are_reported() {
    let (person, pose, before, scan) = (person(), Pose::identity(), bare(), dressed(0.01, BLUE));
    let ring = |y: f32, radius: f32| -> Vec<[f32; 3]> {
        let angle = |i: usize| (i % 60) as f32 / 60.0 * std::f32::consts::TAU;
        (0..=60).map(|i| [radius * angle(i).sin(), y, radius * angle(i).cos()]).collect()
    };
    let run = |edits: Option<&Edits>| extracted(&DressedTake { edits, ..take(&person, &scan, &before, &pose) });
    let plain = run(None);
    // On the garment's middle, and on bare skin; the hems lie at 0.3 and 0.8.
    for (y, radius, far) in [(0.55, RADIUS + 0.01, 0.25), (0.95, RADIUS, 0.15)] {
        let near = HemLine { points: ring(0.8, RADIUS + 0.005), reach: 0.02 };
        let hems = vec![near, HemLine { points: ring(y, radius), reach: 0.02 }];
        let edited = run(Some(&Edits { version: EDITS_VERSION, strokes: Vec::new(), hems }));
        let [Warning::EditWithoutEffect(edit)] = edited.warnings[..] else { panic!("{:?}", edited.warnings) };
        assert_eq!(edit.edit, EditName::HemLine(2));
        assert!((edit.distance_m - far).abs() < 0.02, "{edit:?}");
        let said = edited.warnings[0].to_string();
        assert!(
            said.contains("hem line 2") && said.contains(&format!("{:.0} mm away", 1e3 * edit.distance_m)),
            "{said}"
        );
        let away = scan.positions.iter().zip(plain.labels.garment.iter().zip(&edited.labels.garment));
        assert!(away.filter(|(p, _)| (p.y - 0.8).abs() > 0.03).all(|(_, (was, is))| was == is));
    }
}

#[test]
fn strokes_that_touch_nothing_are_reported() {
    let (person, pose, before, scan) = (person(), Pose::identity(), bare(), dressed(0.01, BLUE));
    let at = Point3::new(0.0, 0.55, RADIUS + 0.03);
    let edits = stroke(Mark::DoesNotBelong, at, 0.01);
    let found = extracted(&DressedTake { edits: Some(&edits), ..take(&person, &scan, &before, &pose) });
    let [Warning::EditWithoutEffect(edit)] = found.warnings[..] else { panic!("{:?}", found.warnings) };
    assert_eq!((edit.edit, edit.radius_m), (EditName::Stroke(1), 0.01));
    assert!((edit.distance_m - 0.02).abs() < 0.002 && found.report.edited_m2 == 0.0, "{edit:?}");
}
