//! Writes the shipped walk: `cargo run -p toile-animation --example write_walk` from the workspace root.

use toile_animation::{WalkSettings, bvh, walk};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/walk.bvh");
    std::fs::write(path, bvh::write(&walk(&WalkSettings::default())?))?;
    Ok(())
}
