//! Stacks the garments of a processed subject again: a tool to develop with.
//!
//!     cargo run --release -p toile-garments --example stack_layers -- BUILD OUT
//!
//! BUILD is a subject's build folder with `body/body.ply` and each layer's `unstacked.ply`. OUT gets the body and the
//! garments in the same layout.
#![allow(clippy::print_stdout)] // a developer's tool

use std::{error::Error, path::Path, time::Instant};

use toile_garments::{StackSettings, stack};
use toile_geometry::{Mesh, ply};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [input, output] = &arguments[..] else { return Err("usage: stack_layers BUILD OUT".into()) };
    let (input, output) = (Path::new(input), Path::new(output));
    let mut names: Vec<String> = std::fs::read_dir(input)?
        .filter_map(|e| e.ok()?.file_name().into_string().ok())
        .filter(|n| input.join(n).join("unstacked.ply").exists())
        .collect();
    names.sort();
    let body = ply::read(&input.join("body/body.ply"))?;
    let read = |n: &String| ply::read(&input.join(n).join("unstacked.ply"));
    let mut layers: Vec<Mesh> = names.iter().map(read).collect::<Result<_, _>>()?;
    let clock = Instant::now();
    let report = stack(&body, &mut layers, &StackSettings::default(), &|_| ())?;
    println!("stacked in {:.2} s", clock.elapsed().as_secs_f32());
    report.layers.iter().zip(&names).for_each(|(l, n)| println!("  {n}: {l:?}"));
    std::fs::create_dir_all(output.join("body"))?;
    ply::write(&output.join("body/body.ply"), &body)?;
    for (name, mesh) in names.iter().zip(&layers) {
        std::fs::create_dir_all(output.join(name))?;
        ply::write(&output.join(name).join("garment.ply"), mesh)?;
    }
    Ok(())
}
