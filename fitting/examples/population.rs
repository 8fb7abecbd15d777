//! How much people differ in each measurement: `population > uncertainty.json` writes the shipped error models again with
//! `population_mm`, half the interval that holds 95 of 100 people of the body model's own population.

use std::{collections::BTreeMap, f64::consts::TAU};

use toile_character::{BodyModel, SkinnedMesh};
use toile_fitting::{ErrorModels, measure_table, sideless};
use toile_geometry::Mesh;

#[path = "../tests/common/mod.rs"]
mod common;
use common::Numbers;

/// Generated people.
const PEOPLE: u64 = 300;

#[allow(clippy::print_stdout)]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let model = BodyModel::load_default()?;
    let mut values: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for seed in 0..PEOPLE {
        let mut numbers = Numbers(31 + 7919 * seed);
        let beta: Vec<f64> = model.components.iter().map(|_| normal(&mut numbers)).collect();
        let mut mesh = Mesh::new(model.shape(&beta), model.triangles.clone());
        mesh.recompute_normals();
        let body = SkinnedMesh { mesh, skeleton: model.skeleton_at(&beta), weights: model.weights.clone() };
        for m in measure_table(&model, &body)?.measures {
            values.entry(sideless(&m.name).into()).or_default().push(1e3 * m.value_m);
        }
    }
    let mut models = ErrorModels::shipped();
    for (name, of) in values {
        let n = of.len() as f64;
        let mean = of.iter().sum::<f64>() / n;
        let variance = of.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n;
        models.measures.entry(name).or_default().population_mm = (196.0 * variance.sqrt()).round() / 100.0;
    }
    println!("{}", serde_json::to_string_pretty(&models)?);
    Ok(())
}

/// A normal number (Box and Muller).
fn normal(numbers: &mut Numbers) -> f64 {
    let [a, b] = [0.5 + 0.5 * numbers.next(), 0.5 + 0.5 * numbers.next()];
    (-2.0 * a.max(1e-12).ln()).sqrt() * (TAU * b).cos()
}
