//! The private subjects: their true visible skin, fitted to, gives the true body.

mod common;

use toile_character::BodyModel;
use toile_fitting::{FitSettings, Verdict, fit_body};
use toile_geometry::{bvh::Bvh, ply};

#[test]
fn the_true_skin_of_take_0_is_met() {
    let model = BodyModel::load_default().unwrap();
    for name in ["alder", "birch"] {
        let Some(folder) = toile_outside::data(&format!("subjects/{name}")) else { return };
        let truth = ply::read(&folder.join("00-body/truth/body.ply")).unwrap();
        // what a camera at breast height sees: neither soles nor crown
        let top = truth.positions.iter().map(|p| p.y).fold(0.0f32, f32::max);
        let seen =
            |t: usize| truth.triangles[t].iter().all(|&v| (0.01..top - 0.02).contains(&truth.positions[v as usize].y));
        let (scan, _) = truth.filter_triangles(seen);
        let fit = fit_body(&model, &scan, &FitSettings::default(), &|_| {}).unwrap();
        assert_eq!(fit.verdict(), Verdict::Trusted, "{name}: {:?}", fit.report);
        let bvh = Bvh::new(&truth.positions, &truth.triangles);
        let body = fit.posed_body();
        let mean = body.positions.iter().map(|p| bvh.closest(p, 1.0).unwrap().distance).sum::<f32>()
            / body.positions.len() as f32;
        assert!(mean < 0.0015, "{name}: {mean} m");
        let json = std::fs::read_to_string(folder.join("subject.json")).unwrap();
        let json: serde_json::Value = serde_json::from_str(&json).unwrap();
        let stature = json["stature_m"].as_f64().unwrap();
        assert!((fit.measurements.stature_m - stature).abs() < 0.010, "{name}: {:?}", fit.measurements);
        for (girth, mine) in
            [("chest", fit.measurements.chest), ("waist", fit.measurements.waist), ("hip", fit.measurements.hip)]
        {
            let truth = json["girths"][girth]["girth_m"].as_f64().unwrap();
            assert!((mine.girth_m - truth).abs() < 0.009, "{name} {girth}: {} against {truth}", mine.girth_m);
        }
    }
}
