//! Friction on a slope.

#![allow(clippy::unwrap_used)] // all of it is test code

use nalgebra::Vector3;
use toile_cloth::{Surroundings, obstacle::Plane};

use crate::sheets::{Diagonal, Grid, exact, fabric, trials};

/// How far a sheet slides down a slope in a second, metres.
fn slide(cells: u32, diagonal: Diagonal, slope: f64) -> f64 {
    let grid = Grid::new(0.2, 0.2, cells * 2, diagonal);
    let mut sheet = grid.sheet(fabric(0.2, 500.0, 10e-6), |_| false);
    let plane = Plane { point: Vector3::zeros(), normal: Vector3::y() };
    // Gravity is turned instead of the plane.
    let gravity = Vector3::new(0.0, -slope.cos(), slope.sin()) * 9.81;
    let start = sheet.positions.iter().sum::<Vector3<f64>>().z / sheet.len() as f64;
    for _ in 0..60 {
        let around = Surroundings { gravity, obstacles: &[&plane], ..Surroundings::default() };
        sheet.advance(1.0 / 60.0, &around, &exact()).unwrap();
    }
    sheet.positions.iter().sum::<Vector3<f64>>().z / sheet.len() as f64 - start
}

#[test]
fn a_sheet_stays_below_the_angle_of_friction_and_slides_above() {
    let limit: f64 = 0.4;
    for (cells, diagonal) in trials() {
        let below = slide(cells, diagonal, (limit * 0.95).atan());
        let above = slide(cells, diagonal, (limit * 1.05).atan());
        println!("{cells} {diagonal:?}: {:.2} mm below, {:.1} mm above", below * 1e3, above * 1e3);
        assert!(below < 0.001, "{cells} cells, {diagonal:?}: slides {below} m below the angle");
        // A block would slide by ½ g (sin − μ cos) t².
        let angle = (limit * 1.05).atan();
        let expected = 0.5 * 9.81 * (angle.sin() - limit * angle.cos());
        assert!((above / expected - 1.0).abs() < 0.25, "{cells} cells, {diagonal:?}: {above} m against {expected} m");
    }
}
