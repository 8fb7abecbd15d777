//! How well bodies are fitted in any standing pose: `any_pose MOTIONS [HALF] [COUNT] [FIRST] [OUT]` fits scans of the
//! generator's people (2 mm of noise, a fifth unseen) in the poses of the BVH files below MOTIONS in which at least a foot
//! stands, and prints a line for each and the shares. HALF takes every other file: 0 is the half that the fit was made with,
//! 1 the half that it is tried on. Fits that miss are written to the folder OUT.

use std::{path::Path, time::Instant};

use toile_character::{BodyModel, joint::JOINTS};
use toile_fitting::{BodyFit, FitSettings, Verdict, fit_body};
use toile_geometry::{Mesh, ply};

#[path = "../tests/common/mod.rs"]
mod common;
use common::{Numbers, motions, strangers};

/// A fit is right within these, metres: mean distance of the body from the true surface, and of each of 22 joints.
const SURFACE: f64 = 0.006;
const JOINT: f64 = 0.030;

struct Tried {
    surface: f64,
    worst_joint: f64,
    verdict: Verdict,
    seconds: f64,
}

impl Tried {
    fn is_right(&self) -> bool {
        self.surface <= SURFACE && self.worst_joint <= JOINT
    }
}

#[allow(clippy::print_stdout)]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some(folder) = arguments.first() else {
        return Err("usage: any_pose MOTIONS [HALF] [COUNT] [FIRST] [OUT]".into());
    };
    let number = |k: usize, default: usize| arguments.get(k).map_or(Ok(default), |a| a.parse());
    let (half, count, first) = (number(1, 0)?, number(2, 40)?, number(3, 0)?);
    let model = BodyModel::load_default()?;
    let moments = motions::moments(&model, Path::new(folder), half, 10.0);
    let picked = motions::diverse(&model, &moments, first + count);
    println!("{} poses in which a foot stands", moments.len());
    let mut all = Vec::new();
    for (k, &moment) in picked.iter().enumerate().skip(first) {
        let moment = &moments[moment];
        let mut numbers = Numbers(k as u64 * 7919 + 1 + half as u64);
        let body = motions::somebody(&model, (2 * k + half) as u64 / 2 + 1);
        let pose = motions::placed(&body, &moment.pose, &mut numbers);
        let truth = body.posed_mesh(&pose);
        let scan = motions::scanned(&model, &truth, &mut numbers);
        let start = Instant::now();
        let fit = fit_body(&model, &scan, &FitSettings::default(), &|_| {})?;
        let seconds = start.elapsed().as_secs_f64();
        let (found, known) = (fit.pose.joint_positions(&fit.skeleton), pose.joint_positions(&body.skeleton));
        let off: Vec<f64> = found.iter().zip(&known).take(22).map(|(a, b)| (a - b).norm()).collect();
        let tried = Tried {
            surface: strangers::one_way(&model, &fit.posed_body(), &truth),
            worst_joint: off.iter().copied().fold(0.0, f64::max),
            verdict: fit.verdict(),
            seconds,
        };
        let mark = if tried.is_right() { "right" } else { "WRONG" };
        println!("{k} {} {mark}: {}", moment.name, line(&tried, &off, &fit));
        if let (Some(out), false) = (arguments.get(4), tried.is_right() && tried.verdict == Verdict::Trusted) {
            write(Path::new(out), k, &scan, &fit, &truth)?;
        }
        all.push(tried);
    }
    summary(&all);
    Ok(())
}

fn line(tried: &Tried, off: &[f64], fit: &BodyFit) -> String {
    let mean = off.iter().sum::<f64>() / off.len() as f64;
    let r = &fit.report;
    format!(
        "{:.2} mm, joints {:.0} {} (mean {:.1}), {:.2} s, {:?} model {:.2}/{:.1} body {:.2} covered {:.3} explained {:.4} rms {:.2} conv {} it {} {:?}",
        1e3 * tried.surface,
        1e3 * tried.worst_joint,
        (0..off.len()).max_by(|a, b| off[*a].total_cmp(&off[*b])).map_or("", |j| JOINTS[j].name()),
        1e3 * mean,
        tried.seconds,
        tried.verdict,
        r.scan_to_model.mean_mm,
        r.scan_to_model.p95_mm,
        r.scan_to_body.mean_mm,
        r.body_covered,
        r.scan_explained,
        r.shape_rms,
        r.converged,
        r.iterations,
        r.reasons
    )
}

fn write(out: &Path, k: usize, scan: &Mesh, fit: &BodyFit, truth: &Mesh) -> Result<(), Box<dyn std::error::Error>> {
    std::fs::create_dir_all(out)?;
    ply::write(&out.join(format!("{k}-scan.ply")), scan)?;
    ply::write(&out.join(format!("{k}-body.ply")), &fit.posed_body())?;
    ply::write(&out.join(format!("{k}-truth.ply")), truth)?;
    Ok(())
}

#[allow(clippy::print_stdout)]
fn summary(all: &[Tried]) {
    let count =
        |right: bool, verdict: Verdict| all.iter().filter(|t| t.is_right() == right && t.verdict == verdict).count();
    let of = |right: bool| [Verdict::Trusted, Verdict::Doubtful, Verdict::Failed].map(|v| count(right, v));
    let (right, wrong) = (of(true), of(false));
    let mut seconds: Vec<f64> = all.iter().map(|t| t.seconds).collect();
    seconds.sort_by(f64::total_cmp);
    let at = |share: f64| seconds.get((share * seconds.len() as f64) as usize).copied().unwrap_or_default();
    println!("{} scans: right {} (trusted, doubtful, failed {right:?})", all.len(), right.iter().sum::<usize>());
    println!("  wrong {} (trusted, doubtful, failed {wrong:?})", wrong.iter().sum::<usize>());
    println!("  seconds: median {:.2}, 90 % {:.2}, most {:.2}", at(0.5), at(0.9), seconds.last().unwrap_or(&0.0));
}
