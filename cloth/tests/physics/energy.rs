//! Energy.

use nalgebra::Vector3;
use toile_cloth::Surroundings;

use crate::sheets::{Grid, exact, fabric, trials};

#[test]
fn energy_never_grows_without_work() {
    for (cells, diagonal) in trials() {
        let grid = Grid::new(0.2, 0.4, cells * 2, diagonal);
        let mut sheet = grid.sheet(fabric(0.15, 300.0, 8e-6), |row| row == 0);
        let anchors = grid.places();
        let total = |sheet: &toile_cloth::Sheet| {
            let [elastic, moving] = sheet.energy();
            let high: f64 = sheet.masses().iter().zip(&sheet.positions).map(|(m, p)| m * 9.81 * p.y).sum();
            let held = sheet.positions.iter().zip(&anchors).take(grid.across as usize);
            let springs: f64 = held.map(|(p, a)| 0.5 * 1e5 * (p - a).norm_squared()).sum();
            elastic + moving + high + springs
        };
        let mut before = total(&sheet);
        let start = before;
        for step in 0..180 {
            let around = Surroundings { anchors: &anchors, ..Surroundings::default() };
            sheet.advance(1.0 / 60.0, &around, &exact()).unwrap();
            let now = total(&sheet);
            assert!(
                now <= before + 1e-6 * start.abs().max(0.01),
                "{cells} {diagonal:?}, step {step}: {before} J to {now} J"
            );
            before = now;
        }
        assert!(before < start, "it fell and lost nothing");
        assert!(sheet.velocities.iter().map(Vector3::norm).fold(0.0, f64::max) < 3.0);
    }
}
