//! Matches two rectified pictures and writes the disparities of the left one as PFM (32-bit floats, 0 unknown).
//!
//! ```text
//! cargo run --release -p toile-stereo --example disparity -- LEFT RIGHT OUT.pfm [--disparities N] [--repeats N]
//! ```
#![allow(clippy::print_stdout)]

use std::{error::Error, io::Write};

use toile_capture::RgbImage;
use toile_stereo::{DisparityMap, GrayImage, MatchSettings, luma, match_pair};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |name: &str, default: u32| match arguments.iter().position(|a| a == name) {
        Some(at) => arguments.get(at + 1).ok_or("an option lacks its number")?.parse().map_err(Box::<dyn Error>::from),
        None => Ok(default),
    };
    let [left, right, out, ..] = &arguments[..] else {
        return Err("usage: disparity LEFT RIGHT OUT.pfm [--disparities N] [--repeats N]".into());
    };
    let settings = MatchSettings { disparities: number("--disparities", 64)?, ..MatchSettings::default() };
    let (left, right) = (read(left)?, read(right)?);
    let mut map = match_pair(&left, &right, &settings)?;
    for _ in 1..number("--repeats", 1)? {
        map = match_pair(&left, &right, &settings)?;
    }
    Ok(write_pfm(out, &map)?)
}

fn read(path: &str) -> Result<GrayImage, Box<dyn Error>> {
    let image = ::image::open(path)?.to_rgb8();
    let pixels = image.pixels().map(|p| p.0).collect();
    Ok(luma(&RgbImage { width: image.width(), height: image.height(), pixels }))
}

/// PFM runs from the lowest row to the highest.
fn write_pfm(path: &str, map: &DisparityMap) -> std::io::Result<()> {
    let mut file = std::io::BufWriter::new(std::fs::File::create(path)?);
    write!(file, "Pf\n{} {}\n-1.0\n", map.width, map.height)?;
    for row in map.values.chunks_exact(map.width as usize).rev() {
        for value in row {
            file.write_all(&value.to_le_bytes())?;
        }
    }
    file.flush()
}
