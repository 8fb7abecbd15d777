//! Garments on a synthetic person: a column of cloth-covered rings with known truth.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use toile_character::{JOINT_COUNT, Joint, Pose, Skeleton, SkinWeights, skinning};
use toile_garments::{
    Edits, ExtractSettings, GarmentError, GarmentType, StackSettings, Take, Warning,
    edits::{self, HemLine, Mark, Stroke},
    extract, stack,
};
use toile_geometry::{
    Mesh,
    bvh::Bvh,
    intersection::crossings,
    topology::{boundary_loops, loop_length},
};

const SKIN: [u8; 3] = [205, 160, 140];
const BLUE: [u8; 3] = [40, 60, 160];
const RADIUS: f32 = 0.12;
const HEIGHT: f32 = 1.2;

/// A column with `radius(y, angle)` and `color(y)`, rings 5 mm apart.
fn column(radius: impl Fn(f32, f32) -> f32, color: impl Fn(f32) -> [u8; 3]) -> Mesh {
    let (around, rows) = (150u32, 240u32);
    let mut mesh = Mesh::default();
    for r in 0..=rows {
        for i in 0..around {
            let (y, a) = (HEIGHT * r as f32 / rows as f32, i as f32 / around as f32 * std::f32::consts::TAU);
            let at = radius(y, a);
            mesh.positions.push(Point3::new(at * a.sin(), y, at * a.cos()));
            mesh.colors.push(color(y));
        }
    }
    for r in 0..rows {
        for i in 0..around {
            let (a, b) = (r * around + i, r * around + (i + 1) % around);
            mesh.triangles.extend([[a, b, b + around], [a, b + around, a + around]]);
        }
    }
    mesh
}

fn noise(y: f32, a: f32) -> f32 {
    0.0004 * ((y * 211.0).sin() * (a * 17.0).cos() + (y * 97.0 + a * 31.0).sin())
}

fn inside(y: f32) -> bool {
    (0.3..0.8).contains(&y)
}

/// A cloth `thick` metres off the body between heights 0.3 and 0.8.
fn dressed(thick: f32, color: [u8; 3]) -> Mesh {
    let radius = move |y: f32, a: f32| RADIUS + noise(y, a) + if inside(y) { thick } else { 0.0 };
    column(radius, move |y| if inside(y) { color } else { SKIN })
}

fn bare() -> Mesh {
    column(|_, _| RADIUS, |_| SKIN)
}

struct Person {
    body: Mesh,
    weights: SkinWeights,
    skeleton: Skeleton,
}

/// Hips below 0.4, spine to 0.8, head above, blended over 20 cm; the other joints lie along the axis.
fn person() -> Person {
    let body = bare();
    let mut weights = SkinWeights::default();
    for p in &body.positions {
        let step = |edge: f32| ((p.y - edge) / 0.2 + 0.5).clamp(0.0, 1.0);
        let (chest, head) = (step(0.4), step(0.8));
        weights.push(&[
            (Joint::Hips as u8, 1.0 - chest),
            (Joint::Spine as u8, chest * (1.0 - head)),
            (Joint::Head as u8, chest * head),
        ]);
    }
    let mut rest = [Point3::new(0.0, 0.8, 0.0); JOINT_COUNT];
    rest[Joint::Hips.index()].y = 0.2;
    rest[Joint::Spine.index()].y = 0.4;
    Person { body, weights, skeleton: Skeleton { rest } }
}

fn take<'a>(person: &'a Person, scan: &'a Mesh, previous: &'a Mesh, pose: &'a Pose) -> Take<'a> {
    Take {
        scan,
        previous,
        body: &person.body,
        weights: &person.weights,
        skeleton: &person.skeleton,
        pose,
        pose0: pose,
        garment_type: Some(GarmentType::Other),
        edits: None,
    }
}

/// Share of the cloth's height that was found against all that was taken.
fn iou(scan: &Mesh, labels: &[bool]) -> f64 {
    let (mut both, mut either) = (0, 0);
    for (p, &l) in scan.positions.iter().zip(labels) {
        both += usize::from(inside(p.y) && l);
        either += usize::from(inside(p.y) || l);
    }
    both as f64 / either.max(1) as f64
}

#[test]
fn cloth_is_found_by_colour_and_shape_by_shape_alone_and_by_colour_alone() {
    let (person, pose, before) = (person(), Pose::identity(), bare());
    for (thick, color, least) in [(0.01, BLUE, 0.97), (0.01, SKIN, 0.93), (0.001, BLUE, 0.97)] {
        let scan = dressed(thick, color);
        let found = extract(&take(&person, &scan, &before, &pose), &ExtractSettings::default(), &|_| ()).unwrap();
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
    let found = extract(&take(&person, &scan, &before, &pose), &ExtractSettings::default(), &|_| ()).unwrap();
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
    let found = extract(&take(&person, &scan, &before, &pose), &ExtractSettings::default(), &|_| ()).unwrap();
    assert!(iou(&scan, &found.labels.garment) > 0.96);
    assert_eq!(found.report.pieces, 1);
}

#[test]
fn nothing_new_and_something_taken_off_are_said() {
    let (person, pose) = (person(), Pose::identity());
    let (before, scan) = (bare(), dressed(0.0, SKIN));
    let found = extract(&take(&person, &scan, &before, &pose), &ExtractSettings::default(), &|_| ()).unwrap();
    assert_eq!(found.warnings, [Warning::NothingNew]);
    assert!(found.garment.is_empty());
    let coat = dressed(0.03, BLUE);
    let mut skin_again = take(&person, &scan, &coat, &pose);
    skin_again.garment_type = None;
    let found = extract(&skin_again, &ExtractSettings::default(), &|_| ()).unwrap();
    assert!(found.warnings.iter().any(|w| matches!(w, Warning::TakenOff(_))), "{:?}", found.warnings);
}

#[test]
fn a_hidden_patch_is_closed_and_marked() {
    let (person, pose, before) = (person(), Pose::identity(), bare());
    let scan = dressed(0.008, BLUE);
    let hole = Point3::new(0.0, 0.55, RADIUS);
    let (scan, _) = scan.filter_triangles(|t| (scan.positions[scan.triangles[t][0] as usize] - hole).norm() > 0.05);
    let found = extract(&take(&person, &scan, &before, &pose), &ExtractSettings::default(), &|_| ()).unwrap();
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
    let found = extract(&bent, &ExtractSettings::default(), &|_| ()).unwrap();
    assert!(found.garment.positions.len() > 1000);
    let worst = found.garment.positions.iter().map(|p| (p.x.hypot(p.z) - RADIUS - 0.01).abs()).fold(0.0, f32::max);
    assert!(worst < 0.006, "{worst}");
    assert!(found.in_take.positions.iter().zip(&found.garment.positions).any(|(a, b)| (a - b).norm() > 0.2));
}

#[test]
fn told_types_are_kept_and_others_guessed() {
    let (person, pose, before, scan) = (person(), Pose::identity(), bare(), dressed(0.01, BLUE));
    let mut input = take(&person, &scan, &before, &pose);
    let told = extract(&input, &ExtractSettings::default(), &|_| ()).unwrap().report;
    assert!((told.garment_type, told.type_guessed) == (GarmentType::Other, false));
    input.garment_type = None;
    let guessed = extract(&input, &ExtractSettings::default(), &|_| ()).unwrap().report;
    assert!((guessed.garment_type, guessed.type_guessed) == (GarmentType::Top, true), "{guessed:?}");
}

#[test]
fn bad_input_is_refused() {
    let (person, pose, before, empty) = (person(), Pose::identity(), bare(), Mesh::default());
    let refuse = |take: &Take| extract(take, &ExtractSettings::default(), &|_| ()).unwrap_err();
    assert_eq!(refuse(&take(&person, &empty, &before, &pose)), GarmentError::Empty("scan"));
    let mut broken = before.clone();
    broken.positions[3].x = f32::NAN;
    assert!(matches!(refuse(&take(&person, &broken, &before, &pose)), GarmentError::Mesh(_)));
    let short = Person { weights: SkinWeights::default(), ..person };
    assert!(matches!(refuse(&take(&short, &before, &before, &pose)), GarmentError::Mismatch(_)));
}

/// A closed body, a shirt that cuts in and out of it, and a coat that cuts in and out of both.
fn crossing_layers() -> (Mesh, Vec<Mesh>) {
    let mut body = bare();
    let rings = body.positions.len() as u32 / 150;
    for (row, y) in [(0, 0.0), (rings - 1, HEIGHT)] {
        let center = body.positions.len() as u32;
        body.positions.push(Point3::new(0.0, y, 0.0));
        body.colors.push(SKIN);
        for i in 0..150 {
            let (a, b) = (row * 150 + i, row * 150 + (i + 1) % 150);
            body.triangles.push(if row == 0 { [center, b, a] } else { [center, a, b] });
        }
    }
    let band = |lo: f32, hi: f32, radius: &dyn Fn(f32, f32) -> f32| {
        let full = column(radius, |_| BLUE);
        full.filter_triangles(|t| full.triangles[t].iter().all(|&v| (lo..hi).contains(&full.positions[v as usize].y))).0
    };
    let shirt = band(0.3, 0.9, &|y, a| RADIUS + 0.001 + 0.004 * (y * 60.0).sin() * (3.0 * a).cos());
    let coat = band(0.2, 0.95, &|y, a| RADIUS + 0.003 + 0.005 * (y * 45.0 + 2.0 * a).cos());
    (body, vec![shirt, coat])
}

#[test]
fn stacked_layers_have_their_gap_and_cross_nowhere() {
    let (body, mut layers) = crossing_layers();
    let before = layers.clone();
    let report = stack(&body, &mut layers, &[0.001; 2], &StackSettings::default(), &|_| ()).unwrap();
    for (k, layer) in report.layers.iter().enumerate() {
        assert!(layer.settled && layer.crossing_pairs == 0, "layer {k}: {layer:?}");
        assert!(layer.least_gap_m >= 0.001, "layer {k}: {layer:?}");
        assert!((layer.gaps.iter().sum::<f32>() - 1.0).abs() < 1e-3 && layer.gaps[0] == 0.0, "{:?}", layer.gaps);
        assert!(layer.self_crossings[1] <= layer.self_crossings[0]);
    }
    let all = [&body, &layers[0], &layers[1]];
    for (i, lower) in all.iter().enumerate() {
        let bvh = Bvh::new(&lower.positions, &lower.triangles);
        for upper in &all[i + 1..] {
            assert!(crossings(upper, lower, &bvh).is_empty());
        }
    }
    let mean = |k: usize| {
        let sum: f32 = before[k].positions.iter().zip(&layers[k].positions).map(|(a, b)| (a - b).norm()).sum();
        sum / before[k].positions.len() as f32
    };
    assert!(mean(0) < 0.004 && mean(1) < 0.006, "{} {}", mean(0), mean(1));
}

#[test]
fn thicker_cloth_lies_higher_and_still_crosses_nowhere() {
    let mut gaps = Vec::new();
    for thickness in [0.0, 0.003, 0.005] {
        let (body, mut layers) = crossing_layers();
        let report = stack(&body, &mut layers, &[0.0, thickness], &StackSettings::default(), &|_| ()).unwrap();
        let [shirt, coat] = &report.layers[..] else { panic!("{report:?}") };
        assert!(shirt.settled && coat.settled && coat.crossing_pairs == 0, "{thickness}: {report:?}");
        assert_eq!((shirt.gap_m, coat.gap_m), (0.0015, thickness.max(0.0015)));
        assert!(shirt.least_gap_m >= 0.0012 && coat.least_gap_m >= 0.8 * coat.gap_m, "{thickness}: {coat:?}");
        gaps.push(coat.least_gap_m);
    }
    assert!(gaps[0] < 0.003 && gaps.windows(2).all(|pair| pair[1] > pair[0]), "{gaps:?}");
}

#[test]
fn every_layer_needs_a_thickness() {
    let (body, mut layers) = crossing_layers();
    let refused = stack(&body, &mut layers, &[0.001], &StackSettings::default(), &|_| ());
    assert!(matches!(refused, Err(GarmentError::Mismatch(_))), "{refused:?}");
}

#[test]
fn layers_that_are_apart_stay_to_the_bit() {
    let body = crossing_layers().0;
    let far = column(|_, _| RADIUS + 0.03, |_| BLUE);
    let mut layers = vec![far.clone()];
    stack(&body, &mut layers, &[0.001], &StackSettings::default(), &|_| ()).unwrap();
    assert_eq!(layers[0].positions, far.positions);
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let (person, pose, before, scan) = (person(), Pose::identity(), bare(), dressed(0.01, BLUE));
            let found = extract(&take(&person, &scan, &before, &pose), &ExtractSettings::default(), &|_| ()).unwrap();
            let (body, mut layers) = crossing_layers();
            stack(&body, &mut layers, &[0.001; 2], &StackSettings::default(), &|_| ()).unwrap();
            (found.garment, found.weights, layers)
        })
    };
    assert_eq!(run(1), run(2));
}

fn stroke(mark: Mark, at: Point3<f32>, radius: f32) -> Edits {
    let stroke = Stroke { mark, points: vec![at.into()], radius };
    Edits { version: edits::VERSION, strokes: vec![stroke], hems: Vec::new() }
}

#[test]
fn a_stroke_changes_its_neighbourhood_and_nothing_else() {
    let (person, pose, before, scan) = (person(), Pose::identity(), bare(), dressed(0.01, BLUE));
    let run = |edits: Option<&Edits>| {
        let take = Take { edits, ..take(&person, &scan, &before, &pose) };
        extract(&take, &ExtractSettings::default(), &|_| ()).unwrap()
    };
    let plain = run(None);
    for (mark, y) in [(Mark::DoesNotBelong, 0.75), (Mark::Belongs, 0.82)] {
        let (at, radius) = (Point3::new(0.0, y, RADIUS + 0.005), 0.03);
        let edited = run(Some(&stroke(mark, at, radius)));
        for (v, p) in scan.positions.iter().enumerate() {
            let (was, is) = (plain.labels.garment[v], edited.labels.garment[v]);
            let far = (p - at).norm();
            assert!(far < edits::GROWTH * radius || was == is, "{p} changed, {far} m from the stroke");
            assert!(far > radius || is == (mark == Mark::Belongs), "{p} was touched and did not follow");
        }
        assert!(edited.report.edited_m2 > 0.0005);
        // The mesh is the same surface away from the stroke.
        let bvh = Bvh::new(&plain.garment.positions, &plain.garment.triangles);
        let away = edited.garment.positions.iter().filter(|p| (*p - at).norm() > edits::GROWTH * radius + 0.03);
        let worst = away.map(|p| bvh.closest(p, 1.0).unwrap().distance).fold(0.0, f32::max);
        assert!(worst < 0.0015, "{worst}");
    }
}

#[test]
fn the_garments_mesh_shows_what_strokes_say() {
    let (person, pose, before, scan) = (person(), Pose::identity(), bare(), dressed(0.01, BLUE));
    let run = |edits: Option<&Edits>| {
        let take = Take { edits, ..take(&person, &scan, &before, &pose) };
        extract(&take, &ExtractSettings::default(), &|_| ()).unwrap().garment
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
    let edits = Edits { version: edits::VERSION, strokes: Vec::new(), hems };
    let take = Take { edits: Some(&edits), ..take(&person, &scan, &before, &pose) };
    let found = extract(&take, &ExtractSettings::default(), &|_| ()).unwrap();
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
        let take = Take { edits: Some(&bad), ..take(&person, &scan, &before, &pose) };
        extract(&take, &ExtractSettings::default(), &|_| ()).unwrap_err().to_string()
    };
    assert!(refuse(&|e| e.version = 9).contains("version 9"));
    assert!(refuse(&|e| e.strokes[0].radius = 3.0).contains("stroke 1"));
    assert!(refuse(&|e| e.strokes[0].points.clear()).contains("0 points"));
    assert!(refuse(&|e| e.strokes[0].points[0][1] = f32::NAN).contains("no number"));
    assert!(refuse(&|e| e.strokes[0].points[0][2] = 0.5).contains("off the scan"));
    let line = HemLine { points: vec![[0.0, 0.5, RADIUS]], reach: 0.02 };
    assert!(refuse(&|e| e.hems.push(line.clone())).contains("hem line 1 has 1 points"));
}

/// As `iou`, for truth given by a rule.
fn iou_of(scan: &Mesh, labels: &[bool], truth: impl Fn(&Point3<f32>) -> bool) -> f64 {
    let both = scan.positions.iter().zip(labels).filter(|(p, l)| truth(p) && **l).count();
    let either = scan.positions.iter().zip(labels).filter(|(p, l)| truth(p) || **l).count();
    both as f64 / either.max(1) as f64
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
    let found = extract(&take(&person, &scan, &before, &pose), &ExtractSettings::default(), &|_| ()).unwrap();
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
    let found = extract(&take(&person, &scan, &before, &pose), &ExtractSettings::default(), &|_| ()).unwrap();
    assert!(iou_of(&scan, &found.labels.garment, cloth) > 0.96);
    assert_eq!(found.report.openings_m.len(), 1, "{:?}", found.report);
}

#[test]
fn two_garments_at_once_are_one_layer_with_a_warning() {
    let (person, pose, before) = (person(), Pose::identity(), bare());
    let cloth = |y: f32| (0.08..0.28).contains(&y) || (0.5..0.72).contains(&y);
    let radius = |y: f32, a: f32| RADIUS + noise(y, a) + if cloth(y) { 0.008 } else { 0.0 };
    let scan = column(radius, |y| if cloth(y) { BLUE } else { SKIN });
    let found = extract(&take(&person, &scan, &before, &pose), &ExtractSettings::default(), &|_| ()).unwrap();
    assert_eq!((found.report.pieces, &found.warnings[..]), (2, &[Warning::TwoAtOnce][..]));
    assert_eq!(boundary_loops(&found.garment.triangles).len(), 4);
}

#[test]
fn a_bare_arm_that_touches_the_torso_is_no_cloth() {
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
    let found = extract(&take(&person, &scan, &before, &pose), &ExtractSettings::default(), &|_| ()).unwrap();
    let iou = iou_of(&scan, &found.labels.garment, |p| cloth(p.y, angle(p)));
    assert!(iou > 0.96, "{iou}");
}

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
fn a_coat_that_swings_is_not_new_and_a_scarf_over_it_is() {
    let (person, pose) = (person(), Pose::identity());
    let before = in_open_coat(0.5, false);
    let is_scarf = |p: &Point3<f32>| (0.9..1.0).contains(&p.y);
    for edge in [0.5, 0.4] {
        let run = |has_scarf: bool| {
            let scan = in_open_coat(edge, has_scarf);
            let found = extract(&take(&person, &scan, &before, &pose), &ExtractSettings::default(), &|_| ()).unwrap();
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
    let found = extract(&take(&person, &bare, &dressed, &pose), &ExtractSettings::default(), &|_| ()).unwrap();
    assert!(found.in_take.is_empty() && found.garment.is_empty());
    let [Warning::NothingNew, Warning::TakenOff(area)] = found.warnings[..] else { panic!("{:?}", found.warnings) };
    let cloth = std::f32::consts::TAU * RADIUS * 0.5;
    assert!((area / cloth - 1.0).abs() < 0.15, "{area} m² of {cloth}");
}
