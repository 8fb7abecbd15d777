//! The golden data of the decoder's test, which an outside judge decodes: libfreenect2's CPU packet processor, built
//! outside of the tree (docs/kinect2.md says how).
//!
//! `golden_kinect2 scenes FOLDER` writes NAME.packet for each scene and the camera's answers p0.bin and depth.bin;
//! `golden_kinect2 compare FOLDER` compares NAME.depth and NAME.ir of the judge (floats, mirrored) with our images;
//! `golden_kinect2 keep FOLDER TARGET` keeps crops of the judge's depth as pictures in tenths of millimetres.
#![allow(clippy::print_stdout, clippy::unwrap_used)]

#[path = "../tests/common/scenes.rs"]
mod scenes;

use std::{error::Error, fs, path::Path};

use scenes::{COLUMNS, SCENES, Scene, agreement, calibration, crop};
use toile_driver_kinect2::{DecodeSettings, Decoder};

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    match words[..] {
        ["scenes", folder] => write_scenes(Path::new(folder)),
        ["compare", folder] => compare(Path::new(folder)),
        ["keep", folder, target] => keep(Path::new(folder), Path::new(target)),
        _ => Err("scenes FOLDER | compare FOLDER | keep FOLDER TARGET".into()),
    }
}

fn write_scenes(folder: &Path) -> Result<(), Box<dyn Error>> {
    for Scene { name, make, .. } in SCENES {
        let (optics, packet) = make();
        let (answers, _) = calibration(optics);
        fs::write(folder.join(format!("{name}.packet")), packet.as_slice())?;
        fs::write(folder.join(format!("{name}.lens")), &answers[0])?;
        fs::write(folder.join("p0.bin"), &answers[2])?;
    }
    Ok(())
}

/// The judge's image, not mirrored.
fn judged(folder: &Path, name: &str, what: &str) -> Result<Vec<f32>, Box<dyn Error>> {
    let bytes = fs::read(folder.join(format!("{name}.{what}")))?;
    let mut values: Vec<f32> = bytes.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
    values.chunks_exact_mut(COLUMNS).for_each(<[f32]>::reverse);
    Ok(values)
}

fn compare(folder: &Path) -> Result<(), Box<dyn Error>> {
    for Scene { name, make, .. } in SCENES {
        let (optics, packet) = make();
        let (_, calibration) = calibration(optics);
        let ours = Decoder::new(&calibration, DecodeSettings::default()).decode(&packet)?;
        let depth = agreement(&ours.depth_mm, &judged(folder, name, "depth")?);
        let ir = judged(folder, name, "ir")?;
        let off = ours.infrared.iter().zip(&ir).map(|(a, b)| (a - b).abs() / b.max(1.0)).fold(0.0, f32::max);
        println!("{name}: {depth:?}, infrared at most {off:e} off");
    }
    Ok(())
}

fn keep(folder: &Path, target: &Path) -> Result<(), Box<dyn Error>> {
    for &Scene { name, part, .. } in SCENES {
        let depth = crop(&judged(folder, name, "depth")?, part);
        let tenths: Vec<u16> = depth.iter().map(|mm| (10.0 * mm).round() as u16).collect();
        let picture = image::ImageBuffer::<image::Luma<u16>, _>::from_vec(part[2] as u32, part[3] as u32, tenths);
        picture.ok_or("the crop has another size")?.save(target.join(format!("{name}.png")))?;
    }
    Ok(())
}
