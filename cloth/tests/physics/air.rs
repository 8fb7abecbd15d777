//! Falling through air.

use nalgebra::Vector3;
use toile_cloth::{Fabric, Surroundings};

use crate::sheets::{Grid, exact, trials};

#[test]
fn a_flat_sheet_reaches_its_terminal_speed() {
    for (cells, diagonal) in trials() {
        let grid = Grid::new(0.3, 0.3, cells * 2, diagonal);
        let fabric = Fabric { bending: 1e-2, ..Fabric::named("silk").unwrap() };
        let mut sheet = grid.sheet(fabric, |_| false);
        for _ in 0..120 {
            sheet.advance(1.0 / 60.0, &Surroundings::default(), &exact()).unwrap();
        }
        // Weight against the drag of a plate, ½ ρ C v² of each square metre: ρ = 1.204 kg/m³, C = 1.17.
        let expected = (2.0f64 * 0.065 * 9.81 / (1.204 * 1.17)).sqrt();
        let speed = -sheet.velocities.iter().sum::<Vector3<f64>>().y / sheet.len() as f64;
        println!("{cells} {diagonal:?}: {speed:.4} m/s");
        assert!((speed / expected - 1.0).abs() < 0.02, "{cells} cells, {diagonal:?}: {speed} against {expected} m/s");
    }
}
