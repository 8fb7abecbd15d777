//! Carries a body through the takes: `fit_under BODY_SCAN.ply NEXT_SCAN.ply... OUT_FOLDER`; writes <n>-body.ply in the
//! frame of each scan. The mesh that is posed is the scan of the take before, rigged.

use std::{path::Path, time::Instant};

use toile_character::BodyModel;
use toile_fitting::{FitSettings, UnderSettings, fit_body, pose_under, rigged_scan, settle_under};
use toile_geometry::ply;

#[allow(clippy::print_stdout)]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [first, next @ .., out] = &arguments[..] else { return Err("usage: fit_under SCAN0 SCAN1... OUT".into()) };
    let out = Path::new(out);
    std::fs::create_dir_all(out)?;
    let model = BodyModel::load_default()?;
    let scan = ply::read(Path::new(first))?;
    let fit = fit_body(&model, &scan, &FitSettings::default(), &|_| {})?;
    let mut dressed = rigged_scan(&scan, &fit.body, &fit.pose);
    for (n, path) in next.iter().enumerate() {
        let scan = ply::read(Path::new(path))?;
        let start = Instant::now();
        let under = pose_under(&dressed, &[], &fit.pose, &scan, &UnderSettings::default(), &|_| {})?;
        println!("{path}: {:.2} s {}", start.elapsed().as_secs_f64(), serde_json::to_string(&under.report)?);
        let start = Instant::now();
        let settled = settle_under(&model, &fit.body, &under.pose, &scan)?;
        println!("  {:.2} s {:?}", start.elapsed().as_secs_f64(), settled.report);
        let pose = settled.pose;
        ply::write(&out.join(format!("{}-body.ply", n + 1)), &settled.mesh)?;
        ply::write(&out.join(format!("{}-dressed.ply", n + 1)), &dressed.posed_mesh(&pose))?;
        let joints: std::collections::BTreeMap<_, [f64; 3]> = toile_character::joint::JOINTS
            .iter()
            .zip(pose.joint_positions(&fit.skeleton))
            .map(|(j, p)| (j.name(), p.into()))
            .collect();
        std::fs::write(out.join(format!("{}-joints.json", n + 1)), serde_json::to_string(&joints)?)?;
        dressed = rigged_scan(&scan, &fit.body, &pose);
    }
    Ok(())
}
