//! Boards with known truth before cameras with known lenses, and real pairs with OpenCV's answer.

use nalgebra::{Point2, Vector3};
use toile_geometry::{Rigid, camera::PinholeCamera};
use toile_outside::data;

use crate::{
    Board, CalibrationError, Corner, Grey, View, calibrate, find_corners,
    homography::{homography, mapped},
    picture::{normal, picture},
};

const BOARD: Board = Board { columns: 9, rows: 6, square_m: 0.08 };

fn lens() -> PinholeCamera {
    let mut lens = PinholeCamera::ideal(640, 480, 575.0, 573.0, 322.0, 236.0);
    lens.distortion = [0.06, -0.12, 0.001, -0.0006, 0.0];
    lens
}

/// A board about 1.8 m away, tilted every way.
fn rig_from_board(k: u64) -> Rigid {
    let r = |j: u64| normal(k * 8 + j).clamp(-1.6, 1.6);
    let at = Vector3::new(-0.32 + 0.15 * r(0), -0.2 + 0.1 * r(1), 1.7 + 0.2 * r(2));
    Rigid::new(at, Vector3::new(0.4 * r(3), 0.4 * r(4), 0.3 * r(5)))
}

/// The second camera stands beside, turned inwards.
fn second_from_first() -> Rigid {
    Rigid::new(Vector3::new(-0.5, 0.03, 0.1), Vector3::new(0.01, 0.28, -0.02))
}

fn seen(lens: &PinholeCamera, camera_from_board: &Rigid) -> Vec<Point2<f64>> {
    BOARD.points().iter().filter_map(|p| lens.project(&(camera_from_board * p))).collect()
}

#[test]
fn corners_are_found_to_a_twentieth_of_a_pixel() {
    let lens = lens();
    let mut squares = Vec::new();
    for k in 0..8 {
        let pose = rig_from_board(k);
        let truth = seen(&lens, &pose);
        if truth.iter().any(|p| p.x < 30.0 || p.y < 30.0 || p.x > 610.0 || p.y > 450.0) {
            continue;
        }
        let found = find_corners(&picture(&lens, &pose, &BOARD, k), &BOARD).expect("the whole board is in view");
        squares.extend(found.iter().zip(&truth).map(|(a, b)| (a - b).norm_squared()));
    }
    let rms = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    assert!(squares.len() >= 4 * BOARD.count(), "{} corners", squares.len());
    assert!(rms < 0.05, "{rms} pixels");
}

#[test]
fn a_board_upside_down_begins_at_the_same_corner() {
    let lens = lens();
    let over = Rigid::new(Vector3::new(0.3, 0.2, 1.7), Vector3::z() * 3.0);
    let found = find_corners(&picture(&lens, &over, &BOARD, 1), &BOARD).unwrap();
    let worst = found.iter().zip(&seen(&lens, &over)).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    assert!(worst < 0.3, "{worst}");
}

#[test]
fn no_board_is_found_where_there_is_none() {
    let noise = Grey::new(200, 150, (0..30_000).map(|i| 128.0 + 30.0 * normal(i) as f32).collect());
    assert!(find_corners(&noise, &BOARD).is_none());
    let other = Board { columns: 8, rows: 5, ..BOARD };
    assert!(find_corners(&picture(&lens(), &rig_from_board(0), &BOARD, 1), &other).is_none());
}

#[test]
fn a_homography_maps_what_it_was_made_from() {
    let camera = PinholeCamera { distortion: [0.0; 5], ..lens() };
    let plane = BOARD.corners();
    let pixels = seen(&camera, &rig_from_board(3));
    let map = homography(&plane, &pixels).unwrap();
    assert!(plane.iter().zip(&pixels).all(|(p, q)| (mapped(&map, p) - q).norm() < 1e-6));
    assert!(homography(&plane[..3], &pixels[..3]).is_none());
}

/// Corners with a tenth of a pixel of noise, three times what the pictures above give.
fn noisy_views(count: u64) -> Vec<View> {
    let noisy = |pose: &Rigid, seed: u64| {
        let off = |j: u64| 0.1 * normal(seed * 1000 + j);
        let add = |(i, p): (usize, Point2<f64>)| Point2::new(p.x + off(2 * i as u64), p.y + off(2 * i as u64 + 1));
        seen(&lens(), pose).into_iter().enumerate().map(add).collect()
    };
    let both = |k: u64| {
        let pose = rig_from_board(k);
        let moment = k as usize;
        let second = second_from_first() * pose;
        [
            View { camera: 0, moment, corners: Corner::all(noisy(&pose, 2 * k)) },
            View { camera: 1, moment, corners: Corner::all(noisy(&second, 2 * k + 1)) },
        ]
    };
    (0..count).flat_map(both).collect()
}

#[test]
fn lenses_and_places_are_found_from_noisy_corners() {
    let names = ["a".to_string(), "b".to_string()];
    let (told, unknown) = (Ok(lens()), Err((640, 480)));
    for (lenses, shift_limit, angle_limit) in [([told, told], 1e-3, 0.05), ([unknown, unknown], 2e-3, 0.1)] {
        let found = calibrate(&names, &lenses, &noisy_views(25), &BOARD).unwrap();
        let off = found.camera_from_first[1].inverse() * second_from_first();
        let (shift, angle) = (off.translation.vector.norm(), off.rotation.angle().to_degrees());
        assert!(shift < shift_limit && angle < angle_limit, "{shift} m, {angle}°");
        assert!(found.rms_px.iter().all(|r| (0.1..0.17).contains(r)), "{:?}", found.rms_px);
        assert!(found.cameras.iter().all(|c| (c.fx - 575.0).abs() < 2.0 && (c.cx - 322.0).abs() < 2.5), "{found:?}");
        assert_eq!((&found.views[..], &found.shared[..]), (&[25, 25][..], &[25, 25][..]));
    }
}

#[test]
fn cameras_that_see_too_little_are_named() {
    let names = ["a".to_string(), "b".to_string()];
    let views = noisy_views(3);
    let told = Ok(lens());
    let few = calibrate(&names, &[told, Err((640, 480))], &views, &BOARD).unwrap_err().to_string();
    assert!(few.contains("`b`") && few.contains("3 pictures"), "{few}");
    let apart: Vec<View> = views.iter().map(|v| View { moment: v.moment + 10 * v.camera, ..v.clone() }).collect();
    let error = calibrate(&names, &[told, told], &apart, &BOARD).unwrap_err();
    assert!(matches!(error, CalibrationError::NotConnected { ref camera } if camera == "b"), "{error}");
    let flat: Vec<View> =
        (0..6).map(|k| View { camera: 0, moment: k, corners: Corner::all(BOARD.corners()) }).collect();
    let error = calibrate(&names[..1], &[Err((640, 480))], &flat, &BOARD).unwrap_err();
    assert!(matches!(error, CalibrationError::Degenerate { .. }), "{error}");
}

/// Thirteen real pairs (Apache-2.0, the samples of OpenCV), whose own calibration has a baseline of 3.33 squares and a root
/// mean square of 0.39 pixels.
#[test]
fn real_pairs_give_what_opencv_finds() {
    let Some(folder) = data("real/stereo/opencv_stereo_chessboard") else { return };
    let board = Board { columns: 9, rows: 6, square_m: 1.0 };
    let mut views = Vec::new();
    for k in (1..=14).filter(|k| *k != 10) {
        for (camera, side) in ["left", "right"].into_iter().enumerate() {
            let image = image::open(folder.join(format!("{side}{k:02}.jpg"))).unwrap().to_luma8();
            let values = image.pixels().map(|p| f32::from(p.0[0])).collect();
            let grey = Grey::new(image.width() as usize, image.height() as usize, values);
            let found = find_corners(&grey, &board);
            let corners = found.unwrap_or_else(|| panic!("{side}{k:02}: the whole board is seen"));
            views.push(View { camera, moment: k, corners: Corner::all(corners) });
        }
    }
    let names = ["left".to_string(), "right".to_string()];
    let found = calibrate(&names, &[Err((640, 480)), Err((640, 480))], &views, &board).unwrap();
    let baseline = found.camera_from_first[1].translation.vector.norm();
    assert!((baseline - 3.33).abs() < 0.03, "{baseline}");
    assert!(found.rms_px.iter().all(|r| *r < 0.42), "{:?}", found.rms_px);
    assert!(found.cameras.iter().all(|c| (c.fx - 535.0).abs() < 6.0), "{:?}", found.cameras);
}
