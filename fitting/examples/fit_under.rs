//! Carries a body through the takes, as Toile does it or as the seed does:
//! `fit_under [--seed] BODY_SCAN.ply NEXT_SCAN.ply... OUT_FOLDER`.
//!
//! Writes body.ply and body.json of the first scan, and <n>-body.ply in the frame of each further one. The mesh that is
//! posed is the scan of the take before, rigged.

use std::{path::Path, time::Instant};

use toile_character::BodyModel;
use toile_fitting::{FitSettings, UnderSettings, fit_body, pose_under, rigged_scan, settle_under};
use toile_geometry::ply;

#[allow(clippy::print_stdout)]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments: Vec<String> = std::env::args().skip(1).collect();
    let is_seed = arguments.first().is_some_and(|a| a == "--seed");
    let arguments = arguments.split_off(usize::from(is_seed));
    let [first, next @ .., out] = &arguments[..] else {
        return Err("usage: fit_under [--seed] SCAN0 SCAN1... OUT".into());
    };
    let (fit_settings, under_settings) = if is_seed {
        (FitSettings::seed(), UnderSettings::seed())
    } else {
        (FitSettings::default(), UnderSettings::default())
    };
    let out = Path::new(out);
    std::fs::create_dir_all(out)?;
    let model = BodyModel::load_default()?;
    let scan = ply::read(Path::new(first))?;
    let start = Instant::now();
    let fit = fit_body(&model, &scan, &fit_settings, &|_| {})?;
    println!("{first}: {:.2} s {}", start.elapsed().as_secs_f64(), serde_json::to_string(&fit.report)?);
    ply::write(&out.join("body.ply"), &fit.posed_body())?;
    std::fs::write(out.join("body.json"), serde_json::to_string_pretty(&fit.summary())?)?;
    let mut dressed = rigged_scan(&scan, &fit.body, &fit.pose);
    for (n, path) in next.iter().enumerate() {
        let scan = ply::read(Path::new(path))?;
        let start = Instant::now();
        let under = pose_under(&dressed, &[], &fit.pose, &scan, &under_settings, &|_| {})?;
        println!("{path}: {:.2} s {}", start.elapsed().as_secs_f64(), serde_json::to_string(&under.report)?);
        let start = Instant::now();
        let settled = settle_under(&model, &fit.body, &under.pose, &scan, &under_settings)?;
        println!("  {:.2} s {:?}", start.elapsed().as_secs_f64(), settled.report);
        ply::write(&out.join(format!("{}-body.ply", n + 1)), &settled.mesh)?;
        dressed = rigged_scan(&scan, &fit.body, &settled.pose);
    }
    Ok(())
}
