//! Nothing explodes.

#![allow(clippy::unwrap_used)] // all of it is test code

use nalgebra::Vector3;
use toile_cloth::{Effort, Fabric, Surroundings, obstacle::Plane};

use crate::sheets::{Diagonal, Grid};

fn survives(fabric: Fabric, h: f64, jump: f64) {
    let grid = Grid::new(0.3, 0.5, 12, Diagonal::Forward);
    let mut sheet = grid.sheet(fabric, |row| row == 0);
    let mut anchors = grid.places();
    let mut plane = Plane { point: Vector3::new(0.0, -0.2, 0.0), normal: Vector3::y() };
    let steps = (1.0 / h) as usize;
    for step in 0..steps {
        if step == steps / 2 {
            // The person, and the ground with him, is elsewhere at once.
            anchors.iter_mut().for_each(|a| *a += Vector3::new(jump, jump, 0.0));
            plane.point.y += jump;
        }
        let around = Surroundings { anchors: &anchors, obstacles: &[&plane], ..Surroundings::default() };
        sheet.advance(h, &around, &Effort::default()).unwrap();
        assert!(sheet.positions.iter().all(|p| p.iter().all(|c| c.is_finite())), "not finite");
    }
    let middle = Vector3::new(if steps > 1 { jump } else { 0.0 }, if steps > 1 { jump } else { 0.0 }, 0.25);
    let farthest = sheet.positions.iter().map(|p| (p - middle).norm()).fold(0.0, f64::max);
    let fastest = sheet.velocities.iter().map(Vector3::norm).fold(0.0, f64::max);
    assert!(farthest < 0.25 + 0.6 * 1.5 && fastest < 20.0, "{farthest} m away, {fastest} m/s");
}

#[test]
fn any_stiffness_step_and_jump_ends_where_it_should() {
    let cotton = Fabric::named("shirting").unwrap();
    for factor in [0.01, 1.0, 100.0] {
        let f = Fabric {
            stretch: cotton.stretch * factor,
            shear: cotton.shear * factor,
            bending: cotton.bending * factor,
            ..cotton
        };
        for h in [1.0 / 24.0, 1.0 / 240.0] {
            for jump in [0.0, 2.0] {
                survives(f, h, jump);
            }
        }
    }
}
