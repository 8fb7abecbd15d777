//! How well people are measured: `measures [COUNT] [PEOPLE.bin]`.
//!
//! Draws people from the body model (and reads those that `python -m toile_body.strangers` writes), and prints for each
//! measurement (1) how far the library's girths are from brute force on the true body, and (2) how far the measurements of
//! a body that was fitted to a patchy scan (a fifth missing, 2 mm of noise) are from those of the true body, millimetres.
//! The mean man and the mean woman come first, centimetres.

use std::collections::BTreeMap;

use toile_character::{BodyModel, SkinnedMesh};
use toile_fitting::{FitSettings, Verdict, fit_body, measure_table};

#[path = "../tests/common/mod.rs"]
mod common;
use common::{Numbers, strangers, tape};

#[allow(clippy::print_stdout)]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let count: usize = arguments.first().map_or(Ok(40), |a| a.parse())?;
    let model = BodyModel::load_default()?;
    print_means(&model)?;
    let mut people: Vec<SkinnedMesh> = (0..count as u64).map(|seed| drawn(&model, seed)).collect();
    if let Some(path) = arguments.get(1) {
        people.extend(strangers::read(&model, &std::fs::read(path)?).into_iter().take(count));
    }
    let (mut brute, mut fitted) = (Errors::default(), Errors::default());
    let (mut doubted, mut worst) = (0, Vec::new());
    for (k, body) in people.iter().enumerate() {
        let truth = measure_table(&model, body)?;
        for (name, girth) in tape::girths(&model, body, &truth) {
            brute.add(&name, truth.value(&name).unwrap_or(f64::NAN) - girth);
        }
        let mut numbers = Numbers(k as u64 * 7919 + 1);
        let pose = strangers::random_pose(body, &mut numbers, 1.0);
        let scan = strangers::scanned(&model, &body.posed_mesh(&pose), 0.2, 0.002, &mut numbers);
        let fit = fit_body(&model, &scan, &FitSettings::default(), &|_| {})?;
        doubted += usize::from(fit.verdict() != Verdict::Trusted);
        for (a, b) in truth.measures.iter().zip(&measure_table(&model, &fit.body)?.measures) {
            fitted.add(&a.name, b.value_m - a.value_m);
            if (b.value_m - a.value_m).abs() > 0.025 {
                let off = 1e3 * (b.value_m - a.value_m);
                worst.push(format!("person {k}: {} {off:+.0} mm, {:?}", a.name, fit.verdict()));
            }
        }
    }
    println!("\n{} people, girths against brute force on the true body, mm:", people.len());
    brute.print();
    println!("\nmeasurements of the fitted body against those of the true one ({doubted} fits doubted), mm:");
    fitted.print();
    worst.iter().for_each(|line| println!("  {line}"));
    Ok(())
}

/// As in `tests/measure_people.rs`.
fn drawn(model: &BodyModel, seed: u64) -> SkinnedMesh {
    let mut numbers = Numbers(1_000_003 * seed + 7);
    let mean = if seed.is_multiple_of(2) { &model.population.beta_female } else { &model.population.beta_male };
    let beta: Vec<f64> = mean.iter().map(|&b| f64::from(b) + 1.3 * numbers.normal()).collect();
    model.skinned(&beta)
}

#[allow(clippy::print_stdout)]
fn print_means(model: &BodyModel) -> Result<(), Box<dyn std::error::Error>> {
    let of = |beta: &[f32]| {
        let beta: Vec<f64> = beta.iter().map(|&b| f64::from(b)).collect();
        measure_table(model, &model.skinned(&beta))
    };
    let (man, woman) = (of(&model.population.beta_male)?, of(&model.population.beta_female)?);
    println!("{:42} {:>8} {:>8}", "mean", "man", "woman");
    for (a, b) in man.measures.iter().zip(&woman.measures) {
        println!("{:42} {:8.1} {:8.1}", a.name, 100.0 * a.value_m, 100.0 * b.value_m);
    }
    Ok(())
}

/// Errors by measurement, left and right together, metres.
#[derive(Default)]
struct Errors(BTreeMap<String, Vec<f64>>);

impl Errors {
    fn add(&mut self, name: &str, error: f64) {
        let name = name.trim_start_matches("left ").trim_start_matches("right ");
        self.0.entry(name.to_string()).or_default().push(error);
    }

    #[allow(clippy::print_stdout)]
    fn print(&mut self) {
        println!("{:42} {:>7} {:>7} {:>7} {:>7}", "", "bias", "median", "95 %", "worst");
        for (name, errors) in &mut self.0 {
            let bias = 1e3 * errors.iter().sum::<f64>() / errors.len() as f64;
            errors.iter_mut().for_each(|e| *e = 1e3 * e.abs());
            errors.sort_by(f64::total_cmp);
            let at = |q: usize| errors[(errors.len() * q / 100).min(errors.len() - 1)];
            println!("{name:42} {bias:+7.2} {:7.2} {:7.2} {:7.2}", at(50), at(95), at(100));
        }
    }
}
