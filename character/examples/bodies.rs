//! Writes bodies of the shipped model as PLY files, to look at them:
//! `cargo run --release -p toile-character --example bodies -- FOLDER`.
//!
//! `a.ply`, `t.ply`: the mean in A- and T-pose; `male.ply`, `female.ply`: the mean of each sex; `N-3.ply`, `N+3.ply`:
//! the mean ± 3 standard deviations of component N.

use std::path::Path;

use toile_character::{BodyModel, Pose};
use toile_geometry::{Mesh, ply};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).ok_or("usage: bodies FOLDER")?;
    let model = BodyModel::load_default()?;
    let write = |name: String, positions| {
        ply::write(&Path::new(&folder).join(name), &Mesh::new(positions, model.triangles.clone()))
    };
    let double = |beta: &[f32]| beta.iter().map(|&b| f64::from(b)).collect::<Vec<_>>();
    write("a.ply".into(), model.posed(&[], &Pose::identity()))?;
    write("t.ply".into(), model.posed(&[], &model.t_pose(&[])))?;
    write("male.ply".into(), model.shape(&double(&model.population.beta_male)))?;
    write("female.ply".into(), model.shape(&double(&model.population.beta_female)))?;
    for component in 0..5 {
        for (sign, value) in [("-3", -3.0), ("+3", 3.0)] {
            let mut beta = vec![0.0; component + 1];
            beta[component] = value;
            write(format!("{component}{sign}.ply"), model.shape(&beta))?;
        }
    }
    Ok(())
}
