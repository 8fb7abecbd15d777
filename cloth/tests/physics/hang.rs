//! Hanging and swinging.

use nalgebra::Vector3;
use toile_cloth::Surroundings;

use crate::sheets::{Grid, exact, fabric, trials};

/// Sag of a chain of length `l` over a span `s`: a catenary y = a cosh(x / a) with 2 a sinh(s / 2a) = l.
fn sag(l: f64, s: f64) -> f64 {
    let (mut low, mut high) = (s / 50.0, s * 50.0);
    for _ in 0..200 {
        let a = (low * high).sqrt();
        if 2.0 * a * (s / (2.0 * a)).sinh() > l { low = a } else { high = a }
    }
    low * ((s / (2.0 * low)).cosh() - 1.0)
}

#[test]
fn a_chain_of_cloth_hangs_in_a_catenary() {
    for (cells, diagonal) in trials() {
        let length = 0.6;
        let grid = Grid::new(0.04, length, cells, diagonal);
        let last = grid.rows - 1;
        let mut sheet = grid.sheet(fabric(0.2, 3000.0, 0.0), |row| row == 0 || row == last);
        // The far end comes nearer, to two thirds of the length.
        let span = length * 2.0 / 3.0;
        let mut anchors = grid.places();
        for step in 0..240 {
            let far = length + (span - length) * (f64::from(step) / 60.0).min(1.0);
            for (v, a) in anchors.iter_mut().enumerate().filter(|(v, _)| grid.row(*v) == last) {
                *a = Vector3::new(grid.rest[v].x, 0.0, far);
            }
            let around = Surroundings { anchors: &anchors, ..Surroundings::default() };
            sheet.advance(1.0 / 30.0, &around, &exact()).unwrap();
            sheet.velocities.iter_mut().for_each(|v| *v *= 0.9);
        }
        let lowest = (0..grid.rows).map(|row| -grid.mean_of_row(&sheet, row).y).fold(0.0, f64::max);
        let off = lowest / sag(length, span) - 1.0;
        println!("{cells} {diagonal:?}: sag {:.2} mm, {:+.2} %", lowest * 1e3, off * 100.0);
        assert!(off.abs() < 0.01, "{cells} cells, {diagonal:?}: {lowest} m against {} m", sag(length, span));
    }
}

#[test]
fn a_hanging_strip_swings_with_its_period() {
    for (cells, diagonal) in trials() {
        let (length, gravity) = (0.4, 9.81);
        let grid = Grid::new(0.06, length, cells, diagonal);
        let mut sheet = grid.sheet(fabric(0.2, 3000.0, 0.0), |row| row == 0);
        // Hung up along gravity, which then turns by two degrees: it swings about the new direction.
        let turn: f64 = 2f64.to_radians();
        let down = Vector3::new(0.0, -turn.sin(), turn.cos()) * gravity;
        let anchors = grid.places();
        let (mut crossings, mut before) = (Vec::new(), 1.0);
        let h = 1.0 / 480.0;
        for step in 0..1200 {
            let around = Surroundings { anchors: &anchors, gravity: down, ..Surroundings::default() };
            // Friction with the air is not part of the figure.
            let wind = sheet.velocities.iter().sum::<Vector3<f64>>() / sheet.len() as f64;
            sheet.advance(h, &Surroundings { wind, ..around }, &exact()).unwrap();
            let tip = grid.mean_of_row(&sheet, grid.rows - 1);
            let side = tip.y + tip.z * turn.tan();
            if before > 0.0 && side <= 0.0 || before < 0.0 && side >= 0.0 {
                crossings.push((f64::from(step) + before / (before - side)) * h);
            }
            before = side;
        }
        // The first mode of a hanging chain: J₀(2 ω √(L / g)) = 0.
        let expected = std::f64::consts::TAU / (2.404_826 / 2.0 * (gravity / length).sqrt());
        let halves = crossings.len() - 2;
        let period = 2.0 * (crossings[halves + 1] - crossings[1]) / halves as f64;
        println!("{cells} {diagonal:?}: period {period:.4} s, {:+.2} %", (period / expected - 1.0) * 100.0);
        assert!((period / expected - 1.0).abs() < 0.03, "{cells} cells, {diagonal:?}: {period} s against {expected} s");
    }
}
