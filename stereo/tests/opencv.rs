//! Rectification beside OpenCV's. The golden file was written by `tests/peers/stereo.py --golden`.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use nalgebra::Vector2;
use serde_json::Value;
use toile_stereo::{Rectification, RectifiedView, calibration_of, file_storage, rectify};

/// How far a pixel may lie from OpenCV's.
const TOLERANCE: f64 = 1e-3;

/// Where a pixel of the rectified view comes from.
fn source(made: &Rectification, view: &RectifiedView, u: f64, v: f64) -> (f64, f64) {
    let c = &made.camera;
    let p = view.source(Vector2::new((u - c.cx) / c.fx, (v - c.cy) / c.fy)).expect("the ray runs forward");
    (p.x, p.y)
}

/// Compares one view of a case; what differs most, in pixels.
fn worst(made: &Rectification, golden: &Value) -> f64 {
    let number = |name: &str| golden[name].as_f64().expect("the golden file has numbers");
    let c = &made.camera;
    assert!((made.baseline - number("baseline")).abs() < 1e-6, "baseline {}", made.baseline);
    let mut worst = [c.fx - number("f"), c.fy - number("f"), c.cx - number("cx"), c.cy - number("cy")].map(f64::abs);
    for point in golden["points"].as_array().expect("there are points") {
        let p: Vec<f64> = point.as_array().expect("a list").iter().filter_map(Value::as_f64).collect();
        let (left, right) = (source(made, &made.left, p[0], p[1]), source(made, &made.right, p[0], p[1]));
        let off = [left.0 - p[2], left.1 - p[3], right.0 - p[4], right.1 - p[5]].map(f64::abs);
        worst[0] = off.into_iter().fold(worst[0], f64::max);
    }
    worst.into_iter().fold(0.0, f64::max)
}

#[test]
fn rectified_pixels_come_from_where_opencv_takes_them() {
    let golden: Value = serde_json::from_str(include_str!("golden/opencv.json")).expect("the golden file is JSON");
    for case in golden["cases"].as_array().expect("there are cases") {
        let mut text = case["text"].as_str().expect("a text").to_string();
        if let Some(file) = case["intrinsics"].as_str() {
            let Some(path) = toile_outside::data(&format!("real/stereo/{file}")) else { continue };
            text += &std::fs::read_to_string(path).expect("the intrinsics are text");
        }
        let storage = file_storage::parse(&text).expect("OpenCV's own file is read");
        let calibration = calibration_of(&storage, 1.0).expect("it is whole");
        for view in case["views"].as_array().expect("there are views") {
            let made = rectify(&calibration, (640, 480), view["alpha"].as_f64()).expect("it can be rectified");
            let off = worst(&made, view);
            assert!(off <= TOLERANCE, "{}, alpha {}: {off} px", case["name"], view["alpha"]);
        }
    }
}

#[test]
fn cameras_in_the_wrong_order_or_above_each_other_and_other_sizes_are_named() {
    let golden: Value = serde_json::from_str(include_str!("golden/opencv.json")).expect("the golden file is JSON");
    let text = golden["cases"][0]["text"].as_str().expect("a text");
    let good = calibration_of(&file_storage::parse(text).expect("read"), 1.0).expect("whole");
    let refused = |c: &toile_stereo::StereoCalibration| rectify(c, (640, 480), None).unwrap_err().to_string();
    let mut swapped = good.clone();
    swapped.right_from_left = good.right_from_left.inverse();
    assert!(refused(&swapped).contains("exchange left and right"));
    let mut above = good.clone();
    above.right_from_left.translation.vector.y = 0.4;
    assert!(refused(&above).contains("above each other"));
    let mut together = good.clone();
    together.right_from_left.translation.vector = nalgebra::Vector3::zeros();
    assert!(refused(&together).contains("0.000 m"));
    let mut other = good;
    other.image_size = Some((1280, 720));
    assert!(refused(&other).contains("(1280, 720)"));
}
