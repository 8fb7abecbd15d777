//! Real pairs with true disparity (Middlebury 2003 and 2006), where the private data is at hand.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use std::path::Path;

use toile_capture::RgbImage;
use toile_stereo::{GrayImage, MatchSettings, luma, match_pair};

/// A binary PGM or PPM of 8 bits, as grey.
fn read_pnm(path: &Path) -> GrayImage {
    let bytes = std::fs::read(path).unwrap();
    let mut at = 0;
    let mut word = || {
        while bytes[at].is_ascii_whitespace() || bytes[at] == b'#' {
            at = if bytes[at] == b'#' { at + bytes[at..].iter().position(|&b| b == b'\n').unwrap() } else { at + 1 };
        }
        let start = at;
        at += bytes[at..].iter().position(u8::is_ascii_whitespace).unwrap();
        String::from_utf8_lossy(&bytes[start..at]).into_owned()
    };
    let (kind, width, height, _max) = (word(), word().parse().unwrap(), word().parse().unwrap(), word());
    let pixels = &bytes[at + 1..];
    match kind.as_str() {
        "P5" => GrayImage { width, height, pixels: pixels.to_vec() },
        _ => luma(&RgbImage { width, height, pixels: pixels.as_chunks().0.to_vec() }),
    }
}

fn read_image(path: &Path) -> GrayImage {
    let image = image::open(path).unwrap().to_rgb8();
    luma(&RgbImage { width: image.width(), height: image.height(), pixels: image.pixels().map(|p| p.0).collect() })
}

/// Share of the known pixels that are answered, and share of those that are off by more than two pixels.
fn score(found: &[f32], truth: &[f32]) -> (f64, f64) {
    let known = truth.iter().filter(|&&t| t > 0.0).count();
    let answered: Vec<f32> =
        found.iter().zip(truth).filter(|&(&f, &t)| f > 0.0 && t > 0.0).map(|(f, t)| (f - t).abs()).collect();
    let bad = answered.iter().filter(|&&e| e > 2.0).count();
    (answered.len() as f64 / known as f64, bad as f64 / answered.len() as f64)
}

#[test]
fn cones_and_aloe_are_matched_densely_and_rightly() {
    let Some(data) = toile_outside::data("real/stereo") else { return };
    let (cones, aloe) = (data.join("middlebury_cones"), data.join("opencv_aloe"));
    let quarter: Vec<f32> = read_pnm(&cones.join("disp2.pgm")).pixels.iter().map(|&d| f32::from(d) / 4.0).collect();
    let whole: Vec<f32> = read_image(&aloe.join("aloeGT.png")).pixels.iter().map(|&d| f32::from(d)).collect();
    let cases = [
        ("cones", read_pnm(&cones.join("im2.ppm")), read_pnm(&cones.join("im6.ppm")), quarter, 64),
        ("aloe", read_image(&aloe.join("aloeL.jpg")), read_image(&aloe.join("aloeR.jpg")), whole, 256),
    ];
    for (name, left, right, truth, disparities) in cases {
        let settings = MatchSettings { disparities, ..MatchSettings::default() };
        let found = match_pair(&left, &right, &settings).unwrap();
        let (density, bad) = score(&found.values, &truth);
        println!("{name}: {:.1} % answered, {:.2} % of them off by more than 2 px", 100.0 * density, 100.0 * bad);
        assert!(density >= 0.80, "{name}: only {density:.3} answered");
        assert!(bad <= 0.06, "{name}: {bad:.4} of the answers are wrong");
    }
}
