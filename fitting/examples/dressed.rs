//! How well a body is estimated under clothes: `dressed SCAN.ply TRUTH.json ...` (pairs: a dressed scan, and the true
//! `measurements.json` that `toile synthesize` writes). Prints `measurement,error in metres`, and a summary on standard error.

use std::collections::BTreeMap;

use toile_character::BodyModel;
use toile_fitting::{FitSettings, MeasureTable, fit_body, measure_table, sideless};

#[allow(clippy::print_stdout)]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let model = BodyModel::load_default()?;
    let settings = FitSettings { dressed: true, ..FitSettings::default() };
    let mut errors: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    for pair in arguments.chunks_exact(2) {
        let scan = toile_geometry::ply::read(std::path::Path::new(&pair[0]))?;
        let truth: MeasureTable = serde_json::from_str(&std::fs::read_to_string(&pair[1])?)?;
        let fit = fit_body(&model, &scan, &settings, &|_| {})?;
        eprintln!("{}: {:?} {:?}", pair[0], fit.verdict(), fit.report.reasons);
        for m in measure_table(&model, &fit.body)?.measures {
            let Some(true_m) = truth.value(&m.name) else { continue };
            println!("{},{}", m.name, m.value_m - true_m);
            errors.entry(sideless(&m.name).into()).or_default().push(1e3 * (m.value_m - true_m));
        }
    }
    for (name, of) in errors {
        let n = of.len() as f64;
        let (bias, square) = (of.iter().sum::<f64>() / n, of.iter().map(|e| e * e).sum::<f64>() / n);
        eprintln!("{name:42} bias {bias:+7.1} rms {:7.1} mm", square.sqrt());
    }
    Ok(())
}
