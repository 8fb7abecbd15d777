//! Generic garments, and garments on other people, on people that the statistical body generates.
#![allow(clippy::unwrap_used)] // all of it is test code

use toile_character::{BodyModel, GarmentType, Pose, SkinnedMesh};
use toile_garments::{
    Generic, GenericGarment, LayerReport, Person, StackSettings, conform_generic, make_generic, stack, wear,
};
use toile_geometry::{Mesh, bvh::Bvh, topology::boundary_loops};

/// A person whose weight is `sigma` standard deviations from the mean: the strongest components are stature and bulk.
fn person(model: &BodyModel, sigma: f64) -> SkinnedMesh {
    model.skinned(&[0.3 * sigma, sigma, 0.2 * sigma])
}

/// How `garment` of `from` is stacked on `to`, and its mesh there.
fn worn(garment: &Generic, kind: GarmentType, from: &SkinnedMesh, to: &SkinnedMesh) -> (Mesh, LayerReport) {
    let pose = Pose::identity();
    let [from, to] = [from, to].map(|body| Person { body, pose: &pose });
    let mesh = wear(&garment.mesh, &garment.weights, kind, from, to).unwrap();
    let mut layers = [mesh];
    let report = stack(&to.body.mesh, &mut layers, &[0.001], &StackSettings::default(), &|_| {}).unwrap();
    let [mesh] = layers;
    (mesh, report.layers[0].clone())
}

#[test]
fn generic_garments_are_open_where_garments_are_and_the_same_each_time() {
    let model = BodyModel::load_default().unwrap();
    let rims = [4, 4, 4, 3, 3, 3, 3, 2];
    for (kind, rims) in GenericGarment::ALL.into_iter().zip(rims) {
        let made = make_generic(kind, &model);
        made.mesh.validate().unwrap();
        assert_eq!(boundary_loops(&made.mesh.triangles).len(), rims, "{kind}");
        assert_eq!(made.weights.len(), made.mesh.positions.len());
        let body = Bvh::new(&model.mean, &model.triangles);
        let inside = made.mesh.positions.iter().filter(|p| body.contains(p)).count();
        assert!(inside * 100 < made.mesh.positions.len(), "{kind}: {inside} vertices in the body");
    }
    let again = || make_generic(GenericGarment::Shorts, &model).mesh;
    assert_eq!(again(), again());
}

#[test]
fn a_shirt_of_somebody_slim_fits_somebody_heavy_and_the_other_way_round() {
    let model = BodyModel::load_default().unwrap();
    let (slim, heavy) = (person(&model, -3.0), person(&model, 3.0));
    let mean = person(&model, 0.0);
    let volume = |body: &SkinnedMesh| body.mesh.signed_volume();
    let (larger, smaller) = (volume(&heavy).max(volume(&slim)), volume(&heavy).min(volume(&slim)));
    assert!(larger > 1.25 * smaller, "{larger} {smaller}");
    let kind = GenericGarment::Shirt;
    let generic = make_generic(kind, &model);
    for (from, to) in [(&slim, &heavy), (&heavy, &slim)] {
        let (mesh, _) = worn(&generic, kind.garment_type(), &mean, from);
        let own = Generic { mesh, weights: generic.weights.clone() };
        let (there, report) = worn(&own, kind.garment_type(), from, to);
        assert_eq!((report.crossing_pairs, report.cut_triangles), (0, 0), "{kind}");
        // As on the mean person: the way over another body leaves no trace.
        let (direct, _) = worn(&generic, kind.garment_type(), &mean, to);
        let off = there.positions.iter().zip(&direct.positions).map(|(a, b)| (a - b).norm());
        let mean_off = off.sum::<f32>() / there.positions.len() as f32;
        assert!(mean_off < 0.006, "{kind}: {mean_off}");
    }
}

#[test]
fn a_generic_shirt_takes_on_another_shirts_lengths_and_folds() {
    let model = BodyModel::load_default().unwrap();
    let (body, pose) = (person(&model, 1.0), Pose::identity());
    let to = Person { body: &body, pose: &pose };
    let mean = person(&model, 0.0);
    let (jumper, _) = worn(&make_generic(GenericGarment::Jumper, &model), GarmentType::Top, &mean, &body);
    let mut scanned = jumper.clone();
    let normals = jumper.vertex_normals();
    for (p, n) in scanned.positions.iter_mut().zip(&normals) {
        *p += n * 0.004 * (80.0 * p.x).sin() * (70.0 * p.y).cos();
    }
    // Sleeves and hem are shorter by some centimetres.
    let short = |t: usize| scanned.corners(t).iter().all(|p| p.x.abs() < 0.50 && p.y > 0.88);
    let (scanned, _) = scanned.filter_triangles(short);
    let found = conform_generic(&scanned, GarmentType::Top, to, &model).unwrap().unwrap();
    let report = found.report;
    assert!(report.to_scan_m < 0.003 && report.from_scan_m < 0.003, "{report:?}");
    let same = make_generic(report.generic, &model);
    assert_eq!(found.mesh.triangles, same.mesh.triangles);
    assert!(conform_generic(&scanned, GarmentType::Hat, to, &model).unwrap().is_none());
}
