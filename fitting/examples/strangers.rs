//! How sure the fit and its verdict are: `strangers PEOPLE.bin [CASE] [FIRST] [COUNT] [OUT]` fits scans of people with
//! other sliders than the model's own (`python -m toile_body.strangers` writes them; same family of shapes, so easier than
//! real people) and prints a line for each and the quantiles. Fits that miss are written to the folder OUT.
//!
//! Cases: `patchy` (a fifth of the surface missing, 2 mm of noise), `full`, `half` (missing), `front` (one Kinect v2
//! view), `wild` (as patchy, in poses twice as varied), `wilder` (three times), `chair` (one attached), `two` (people).

use std::{path::Path, time::Instant};

use nalgebra::Isometry3;
use toile_character::{BodyModel, Joint};
use toile_fitting::{FitSettings, Verdict, fit_body, measure_table, stature};
use toile_geometry::{Mesh, ply};

#[path = "../tests/common/mod.rs"]
mod common;
use common::{Numbers, cuboid, finer, joined, joint_distance, strangers};

/// A chair that stands close behind a person.
fn chair(person: &Mesh) -> Mesh {
    let (low, high) = person.bounds().unwrap_or_default();
    let (x, z) = (0.5 * (low.x + high.x), 0.5 * (low.z + high.z) - 0.25);
    let part = |from: [f32; 3], to: [f32; 3]| {
        let at = |c: [f32; 3]| [x + c[0], low.y + c[1], z + c[2]];
        finer(&cuboid(at(from), at(to)), 3)
    };
    let leg = |x: f32, z: f32| part([x - 0.02, 0.0, z - 0.02], [x + 0.02, 0.43, z + 0.02]);
    let (seat, back) = (part([-0.22, 0.43, -0.22], [0.22, 0.47, 0.22]), part([-0.22, 0.47, -0.22], [0.22, 0.9, -0.18]));
    joined(&[seat, back, leg(-0.2, -0.2), leg(0.2, -0.2), leg(-0.2, 0.2), leg(0.2, 0.2)])
}

#[allow(clippy::print_stdout)]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some(path) = arguments.first() else { return Err("usage: strangers PEOPLE.bin [CASE] [FIRST] [COUNT]".into()) };
    let case = arguments.get(1).map_or("patchy", String::as_str);
    let (missing, wild) = match case {
        "full" | "front" => (0.0, 1.0),
        "half" => (0.5, 1.0),
        "wild" => (0.2, 2.0),
        "wilder" => (0.2, 3.0),
        _ => (0.2, 1.0),
    };
    let first: usize = arguments.get(2).map_or(Ok(0), |a| a.parse())?;
    let count: usize = arguments.get(3).map_or(Ok(usize::MAX), |a| a.parse())?;
    let limit = if case == "front" { 15.0 } else { 4.0 };
    let model = BodyModel::load_default()?;
    let people = strangers::read(&model, &std::fs::read(path)?);
    let (mut errors, mut seen, mut failures, mut doubted) = (Vec::new(), 0, 0, 0);
    for (k, body) in people.iter().enumerate().skip(first).take(count) {
        let mut numbers = Numbers(k as u64 * 7919 + 1);
        let pose = strangers::random_pose(body, &mut numbers, wild);
        let truth = body.posed_mesh(&pose);
        let scan = if case == "front" {
            let front = pose.rotation(Joint::Hips) * nalgebra::Vector3::z();
            strangers::one_view(&truth, front.x.atan2(front.z), &mut numbers)
        } else {
            let scan = strangers::scanned(&model, &truth, missing, 0.002, &mut numbers);
            match case {
                "chair" => joined(&[scan, chair(&truth)]),
                "two" => joined(&[scan.clone(), scan.transformed(&Isometry3::translation(0.35, 0.0, 0.2))]),
                _ => scan,
            }
        };
        let start = Instant::now();
        let fit = fit_body(&model, &scan, &FitSettings::default(), &|_| {})?;
        let seconds = start.elapsed().as_secs_f64();
        let mm = 1e3 * strangers::surface_distance(&model, &truth, &fit.posed_body());
        let joints =
            1e3 * joint_distance(&fit.pose.joint_positions(&fit.skeleton), &pose.joint_positions(&body.skeleton));
        let standing = measure_table(&model, body)?.standing;
        let tall = 1e3 * (fit.measurements.stature_m - stature(&standing, &model.inner));
        let r = &fit.report;
        println!(
            "{k}: {mm:.2} mm, joints {joints:.1}, stature {tall:+.0}, {seconds:.2} s {:?} model {:.2}/{:.1} body {:.2}/{:.1} covered {:.3} explained {:.3} rms {:.2} {:?}",
            r.verdict,
            r.scan_to_model.mean_mm,
            r.scan_to_model.p95_mm,
            r.scan_to_body.mean_mm,
            r.scan_to_body.p95_mm,
            r.body_covered,
            r.scan_explained,
            r.shape_rms,
            r.reasons
        );
        if let (Some(out), true) = (arguments.get(4), mm > limit || r.verdict != Verdict::Trusted) {
            let out = Path::new(out);
            std::fs::create_dir_all(out)?;
            ply::write(&out.join(format!("{case}-{k}-scan.ply")), &scan)?;
            ply::write(&out.join(format!("{case}-{k}-body.ply")), &fit.posed_body())?;
        }
        let (bad, doubt) = (mm > limit, r.verdict != Verdict::Trusted);
        failures += usize::from(bad);
        seen += usize::from(bad && doubt);
        doubted += usize::from(!bad && doubt);
        errors.push((mm, joints, tall.abs()));
    }
    let n = errors.len();
    let quantile = |q: usize, of: &dyn Fn(&(f64, f64, f64)) -> f64| {
        let mut sorted: Vec<f64> = errors.iter().map(of).collect();
        sorted.sort_by(f64::total_cmp);
        sorted.get((n * q / 100).min(n.saturating_sub(1))).copied().unwrap_or_default()
    };
    println!("{case}, {n} people, quantiles 50 / 95 / 100 %:");
    for (name, of) in [
        ("mm", &(|e: &(f64, f64, f64)| e.0) as &dyn Fn(&(f64, f64, f64)) -> f64),
        ("joints mm", &|e| e.1),
        ("stature mm", &|e| e.2),
    ] {
        println!("  {name}: {:.2} / {:.2} / {:.2}", quantile(50, of), quantile(95, of), quantile(100, of));
    }
    println!("  beyond {limit} mm: {failures}, of them not trusted: {seen}; good ones doubted: {doubted}");
    Ok(())
}
