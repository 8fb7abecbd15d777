//! Calibrates how far measurements may be off: `uncertainty PEOPLE.bin [DRESSED.csv] > src/measure/uncertainty.json`.
//!
//! Fits the people that `python -m toile_body.strangers` writes (other sliders than the model's, a wide stratum of them) to scans
//! with 0.5 to 4 mm of noise, 5 to 50 % of the surface missing, and stances of more or less variety. `DRESSED.csv` has lines of
//! `measurement,error in metres` from dressed people. With `--check PEOPLE.bin` it prints how many errors lie within the shipped intervals.

use std::collections::BTreeMap;

use toile_character::BodyModel;
use toile_fitting::{BodyMeasure, ErrorModel, ErrorModels, FitSettings, fit_body, measure_table, sideless};

#[path = "../tests/common/mod.rs"]
mod common;
use common::{Numbers, strangers};

/// One error of one measurement.
struct Sample {
    error_mm: f64,
    unseen: f64,
    distance_mm: f64,
    claimed_mm: f64,
}

type Samples = BTreeMap<String, Vec<Sample>>;

#[allow(clippy::print_stdout)]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments: Vec<String> = std::env::args().skip(1).collect();
    let is_check = arguments.first().is_some_and(|a| a == "--check");
    if is_check {
        arguments.remove(0);
    }
    let people = arguments.first().ok_or("which people?")?;
    let samples = samples(&std::fs::read(people)?, if is_check { 2 } else { 1 })?;
    if is_check {
        check(&samples);
        return Ok(());
    }
    let dressed = arguments.get(1).map(std::fs::read_to_string).transpose()?.unwrap_or_default();
    let mut measures: BTreeMap<String, ErrorModel> =
        samples.iter().map(|(name, of)| (name.clone(), calibrated(of))).collect();
    for (name, model) in &mut measures {
        let errors = dressed.lines().filter_map(|l| l.split_once(',')).filter(|(n, _)| sideless(n) == name);
        let squares: Vec<f64> = errors.filter_map(|(_, e)| e.parse::<f64>().ok()).map(|e| e * e).collect();
        model.dressed_mm = rounded(1e3 * 1.96 * (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt());
    }
    let source = "fitting/examples/uncertainty.rs: 200 people of other sliders than the model's, 60 % of them of the wide \
                  stratum; dressed: generated men and women in trousers and T-shirt";
    println!("{}", serde_json::to_string_pretty(&ErrorModels { source: source.into(), measures })?);
    Ok(())
}

fn samples(people: &[u8], seed: u64) -> Result<Samples, Box<dyn std::error::Error>> {
    let model = BodyModel::load_default()?;
    let mut samples = Samples::new();
    for (k, body) in strangers::read(&model, people).iter().enumerate() {
        let truth = measure_table(&model, body)?;
        let mut numbers = Numbers(seed * 1_000_003 + k as u64 * 7919);
        let [wild, noise, missing] = [(0.7, 1.4), (0.0005, 0.004), (0.05, 0.5)]
            .map(|(low, high)| low + (high - low) * (0.5 + 0.5 * numbers.next()));
        let pose = strangers::random_pose(body, &mut numbers, wild);
        let scan = strangers::scanned(&model, &body.posed_mesh(&pose), missing, noise, &mut numbers);
        let fit = fit_body(&model, &scan, &FitSettings::default(), &|_| {})?;
        let table = measure_table(&model, &fit.body)?.of_fit(&fit);
        let sample = |t: &BodyMeasure, m: &BodyMeasure| Sample {
            error_mm: 1e3 * (m.value_m - t.value_m),
            unseen: 1.0 - m.seen.unwrap_or(0.0),
            distance_mm: fit.report.scan_to_body.median_mm,
            claimed_mm: 1e3 * m.uncertainty_m.unwrap_or(f64::NAN),
        };
        for (t, m) in truth.measures.iter().zip(&table.measures) {
            samples.entry(sideless(&m.name).to_string()).or_default().push(sample(t, m));
            if let Some(doubt) = &m.doubt {
                eprintln!("person {k}, {:?}: {doubt}", fit.verdict());
            }
        }
        for (t, m) in truth.measures.iter().zip(&table.measures).filter(|(t, m)| (t.value_m - m.value_m).abs() > 0.025)
        {
            eprintln!("person {k}, {:?}: {} {:+.0} mm", fit.verdict(), m.name, 1e3 * (m.value_m - t.value_m));
        }
    }
    Ok(samples)
}

/// The squares of the three parts by least squares without negative ones, then as wide as holds 95 of 100 errors.
fn calibrated(samples: &[Sample]) -> ErrorModel {
    let factors = |s: &Sample| [1.0, s.unseen, s.distance_mm.powi(2)];
    let mut best = (f64::MAX, [0.0; 3]);
    for kept in 1..8_u32 {
        let columns: Vec<usize> = (0..3).filter(|c| kept & (1 << c) != 0).collect();
        let n = columns.len();
        let mut normal = nalgebra::DMatrix::<f64>::zeros(n, n);
        let mut right = nalgebra::DVector::<f64>::zeros(n);
        for s in samples {
            let f = factors(s);
            let square = s.error_mm.powi(2);
            for (a, &i) in columns.iter().enumerate() {
                right[a] += f[i] * square;
                columns.iter().enumerate().for_each(|(b, &j)| normal[(a, b)] += f[i] * f[j]);
            }
        }
        let Some(solution) = normal.lu().solve(&right).filter(|x| x.iter().all(|&v| v >= 0.0)) else { continue };
        let mut variances = [0.0; 3];
        columns.iter().zip(solution.iter()).for_each(|(&c, &v)| variances[c] = v);
        let variance = |s: &Sample| factors(s).iter().zip(&variances).map(|(f, v)| f * v).sum::<f64>();
        let misfit: f64 = samples.iter().map(|s| (s.error_mm.powi(2) - variance(s)).powi(2)).sum();
        if misfit < best.0 {
            best = (misfit, variances);
        }
    }
    let [base, unseen, distance] = best.1.map(f64::sqrt);
    let model =
        ErrorModel { base_mm: base, unseen_mm: unseen, per_distance: distance, dressed_mm: 0.0, population_mm: 0.0 };
    let mut shares: Vec<f64> = samples
        .iter()
        .map(|s| s.error_mm.abs() / (1e3 * model.half_interval_m(1.0 - s.unseen, s.distance_mm)).max(1e-6))
        .collect();
    shares.sort_by(f64::total_cmp);
    let wide = shares[(shares.len() * 95 / 100).min(shares.len() - 1)];
    let [base_mm, unseen_mm, per_distance] = [base, unseen, distance].map(|v| rounded(wide * v));
    ErrorModel { base_mm, unseen_mm, per_distance, dressed_mm: 0.0, population_mm: 0.0 }
}

fn rounded(mm: f64) -> f64 {
    (100.0 * mm).round() / 100.0
}

#[allow(clippy::print_stdout)]
fn check(samples: &Samples) {
    println!("{:42} {:>6} {:>8} {:>8} {:>8} {:>8}", "", "bias", "95 %", "worst", "claimed", "within %");
    for (name, of) in samples {
        let mut errors: Vec<f64> = of.iter().map(|s| s.error_mm.abs()).collect();
        errors.sort_by(f64::total_cmp);
        let n = of.len() as f64;
        let within = of.iter().filter(|s| s.error_mm.abs() <= s.claimed_mm).count() as f64 / n;
        let claimed = of.iter().map(|s| s.claimed_mm).sum::<f64>() / n;
        let bias = of.iter().map(|s| s.error_mm).sum::<f64>() / n;
        let (high, worst) = (errors[errors.len() * 95 / 100], errors[errors.len() - 1]);
        println!("{name:42} {bias:+6.2} {high:8.2} {worst:8.2} {claimed:8.2} {:8.1}", 100.0 * within);
    }
}
