//! ASTM D1388: how far a strip reaches before it bends by 41.5 degrees under its own weight.

use nalgebra::Vector3;
use toile_cloth::Surroundings;

use crate::sheets::{Grid, exact, fabric, trials};

#[test]
fn a_strip_bends_by_its_bending_length() {
    let gravity = 9.81;
    for (cells, diagonal) in trials() {
        let fabric = fabric(0.2, 2000.0, 20e-6);
        let c = fabric.bending_length(gravity);
        // A strip of 25 mm; two cells and a half lie on the platform: the edge where the strip begins to bend has half
        // of its cell on either side.
        let cells = cells * 2;
        let cell = 0.025 / f64::from(cells);
        let grid = Grid::new(0.025, 2.0 * c + 2.0 * cell, cells, diagonal);
        let mut sheet = grid.sheet(fabric, |row| row < 3);
        let anchors = grid.places();
        let around = Surroundings { anchors: &anchors, ..Surroundings::default() };
        for _ in 0..120 {
            sheet.advance(1.0 / 30.0, &around, &exact()).unwrap();
            sheet.velocities.iter_mut().for_each(|v| *v *= 0.8);
        }
        assert!(sheet.velocities.iter().map(Vector3::norm).fold(0.0, f64::max) < 1e-3, "not at rest");
        let edge = grid.mean_of_row(&sheet, 2) - Vector3::z() * (cell / 2.0);
        let tip = grid.mean_of_row(&sheet, grid.rows - 1) - edge;
        let length = grid.rest[grid.rest.len() - 1].z - grid.rest[2 * grid.across as usize].z + cell / 2.0;
        let angle = (-tip.y).atan2(tip.z);
        let measured = length * ((angle / 2.0).cos() / (8.0 * angle.tan())).cbrt();
        let off = measured / c - 1.0;
        println!("{cells} {diagonal:?}: {:.1} degrees, bending length {:+.1} %", angle.to_degrees(), off * 100.0);
        assert!(off.abs() < 0.05, "{cells} cells, {diagonal:?}: {measured} m against {c} m");
    }
}
