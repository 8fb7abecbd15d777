//! Boards that OpenCV drew (`boards/`), before cameras with known lenses.

use nalgebra::Vector3;
use toile_geometry::{Rigid, camera::PinholeCamera};

use super::*;
use crate::{
    View, calibrate,
    picture::{normal, picture_of},
};

/// A board's picture, 48 pixels a square.
fn drawn(name: &str, rows: usize) -> (Charuco, image::GrayImage) {
    let path = format!("{}/boards/{name}.png", env!("CARGO_MANIFEST_DIR"));
    let image = image::open(path).unwrap().to_luma8();
    let dictionary = name.split('_').take(2).collect::<Vec<_>>().join("_").parse().unwrap();
    assert_eq!(image.height() as usize, 48 * rows);
    let (columns, is_legacy) = (image.width() as usize / 48, name.ends_with("legacy"));
    (Charuco { columns, rows, square_m: 0.08, marker_m: 0.06, dictionary, is_legacy }, image)
}

/// A camera as sharp as those of depth cameras mostly are.
fn lens() -> PinholeCamera {
    let mut lens = PinholeCamera::ideal(960, 540, 690.0, 689.0, 481.0, 268.0);
    lens.distortion = [0.06, -0.12, 0.001, -0.0006, 0.0];
    lens
}

/// What the camera sees of a board whose first inner corner is the origin of `camera_from_board`, upon white paper.
fn seen(
    lens: &PinholeCamera,
    camera_from_board: &Rigid,
    (board, image): &(Charuco, image::GrayImage),
    seed: u64,
) -> Grey {
    let size = [board.columns as f64, board.rows as f64];
    picture_of(lens, camera_from_board, seed, |x, y| {
        let at = [x / board.square_m + 1.0, y / board.square_m + 1.0];
        let inside = |margin: f64| (0..2).all(|k| at[k] > -margin && at[k] < size[k] + margin);
        match (inside(0.0), inside(0.5)) {
            (true, _) => 25.0 + 0.78 * f64::from(image.get_pixel((48.0 * at[0]) as u32, (48.0 * at[1]) as u32).0[0]),
            (_, true) => 225.0,
            _ => 110.0,
        }
    })
}

fn distances(corners: &[Corner], lens: &PinholeCamera, pose: &Rigid, board: &Charuco) -> Vec<f64> {
    let points = board.board().points();
    let one = |corner: &Corner| (lens.project(&(pose * points[corner.id])).unwrap() - corner.at).norm();
    corners.iter().map(one).collect()
}

#[test]
fn corners_of_whole_boards_have_their_numbers_whichever_way_up() {
    for (name, rows, turn) in
        [("4x4_50_5x7", 7, 0.2), ("5x5_100_7x10", 10, 1.7), ("5x5_100_7x10_legacy", 10, 3.0), ("6x6_250_8x6", 6, -1.5)]
    {
        let drawing = drawn(name, rows);
        let turned = Vector3::new(0.25, -0.3, 0.0);
        let mut pose = Rigid::new(Vector3::new(0.0, 0.0, 1.3), turned);
        pose.rotation *= nalgebra::UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn);
        // The board's middle before the camera.
        let board = drawing.0.board();
        let middle = nalgebra::Point3::new(board.columns as f64 - 1.0, board.rows as f64 - 1.0, 0.0) * 0.04;
        pose.translation.vector -= (pose.rotation * middle).coords;
        let found = find_charuco(&seen(&lens(), &pose, &drawing, 3), &drawing.0).expect(name);
        let off = distances(&found, &lens(), &pose, &drawing.0);
        let worst = off.iter().copied().fold(0.0, f64::max);
        assert!(found.len() * 10 >= board.count() * 9, "{name}: {} of {}", found.len(), board.count());
        assert!(worst < 0.4, "{name}: {worst} pixels, {off:?}");
    }
}

#[test]
fn a_part_of_a_board_is_enough_and_other_boards_are_not_taken_for_it() {
    let drawing = drawn("5x5_100_7x10", 10);
    let pose = Rigid::new(Vector3::new(0.3, 0.1, 1.0), Vector3::new(0.3, 0.2, 0.4));
    let picture = seen(&lens(), &pose, &drawing, 5);
    let found = find_charuco(&picture, &drawing.0).unwrap();
    let in_view = |p: &&nalgebra::Point3<f64>| {
        let pixel = lens().project(&(pose * **p)).unwrap();
        pixel.x > 20.0 && pixel.y > 20.0 && pixel.x < 940.0 && pixel.y < 520.0
    };
    let points = drawing.0.board().points();
    let possible = points.iter().filter(in_view).count();
    assert!(possible < points.len() && found.len() * 10 >= possible * 7, "{} of {possible}", found.len());
    assert!(distances(&found, &lens(), &pose, &drawing.0).iter().all(|off| *off < 0.4));
    let other = Charuco { dictionary: "6x6_100".parse().unwrap(), ..drawing.0 };
    assert!(find_charuco(&picture, &other).is_none());
    let noise = Grey::new(200, 150, (0..30_000).map(|i| 128.0 + 30.0 * normal(i) as f32).collect());
    assert!(find_charuco(&noise, &drawing.0).is_none());
}

/// Two cameras 1.4 m apart that look inwards, each of which sees the board partly in most moments.
#[test]
fn cameras_that_see_parts_of_a_board_are_placed_to_a_millimetre() {
    let drawing = drawn("5x5_100_7x10", 10);
    let second_from_first = Rigid::new(Vector3::new(-1.2, 0.05, 0.45), Vector3::new(0.02, 0.7, -0.01));
    let (mut views, mut parts) = (Vec::new(), 0);
    // Pictures through an ideal lens are drawn faster.
    let lens = || lens().undistorted();
    for moment in 0..10 {
        let r = |j: u64| normal(moment * 8 + j).clamp(-1.6, 1.6);
        let at = Vector3::new(-0.1 + 0.25 * r(0), -0.3 + 0.15 * r(1), 1.5 + 0.15 * r(2));
        let pose = Rigid::new(at, Vector3::new(0.25 * r(3), 0.35 + 0.25 * r(4), 0.3 * r(5)));
        for (camera, pose) in [pose, second_from_first * pose].into_iter().enumerate() {
            let picture = seen(&lens(), &pose, &drawing, 2 * moment + camera as u64);
            if let Some(corners) = find_charuco(&picture, &drawing.0) {
                parts += usize::from(corners.len() < drawing.0.board().count());
                views.push(View { camera, moment: moment as usize, corners });
            }
        }
    }
    let names = ["a".to_string(), "b".to_string()];
    let (told, unknown) = (Ok(lens()), Err((960, 540)));
    for (lenses, most) in [([told, told], (1e-3, 0.05)), ([unknown, unknown], (4e-3, 0.2))] {
        let found = calibrate(&names, &lenses, &views, &drawing.0.board()).unwrap();
        let off = found.camera_from_first[1].inverse() * second_from_first;
        let (shift, angle) = (off.translation.vector.norm(), off.rotation.angle().to_degrees());
        println!("{} views, {parts} of parts; {shift} m, {angle}°; {:?} px", views.len(), found.rms_px);
        assert!(parts >= 6, "{parts} of {} views show a part", views.len());
        assert!(shift < most.0 && angle < most.1, "{shift} m, {angle}°");
        assert!(found.rms_px.iter().all(|r| *r < 0.2), "{:?}", found.rms_px);
    }
}
