//! Fits the shipped body to a mesh: `fit_scan SCAN.ply OUT_FOLDER [dressed]`; writes body.ply, model.ply, rigged weights' check.

use std::{path::Path, time::Instant};

use toile_character::BodyModel;
use toile_fitting::{FitSettings, fit_body};
use toile_geometry::ply;

#[allow(clippy::print_stdout)]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [scan, out, others @ ..] = &arguments[..] else {
        return Err("usage: fit_scan SCAN.ply OUT_FOLDER [dressed]".into());
    };
    let settings = FitSettings { dressed: others.iter().any(|o| o == "dressed"), ..FitSettings::default() };
    let model = BodyModel::load_default()?;
    let scan = ply::read(Path::new(scan))?;
    let start = Instant::now();
    let fit = fit_body(&model, &scan, &settings, &|p| println!("{:.2} s: {p}", start.elapsed().as_secs_f64()))?;
    println!("{:.2} s, {} triangles", start.elapsed().as_secs_f64(), scan.triangles.len());
    println!("{}", serde_json::to_string_pretty(&fit.report)?);
    println!("{:?}", fit.measurements);
    let out = Path::new(out);
    std::fs::create_dir_all(out)?;
    ply::write(&out.join("body.ply"), &fit.posed_body())?;
    ply::write(&out.join("model.ply"), &fit.model_mesh)?;
    ply::write(&out.join("rest.ply"), &fit.body.mesh)?;
    std::fs::write(out.join("body.json"), serde_json::to_string_pretty(&fit.summary())?)?;
    Ok(())
}
