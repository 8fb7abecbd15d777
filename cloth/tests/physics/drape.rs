//! A disc over a stand, as in Cusick's drapemeter (BS 5058): a cloth of 30 cm over a support of 18 cm.

#![allow(clippy::unwrap_used)] // all of it is test code

use nalgebra::{Point3, Vector3};
use toile_cloth::{Anchors, Effort, Fabric, RestShape, Sheet, Surroundings};

/// A disc of rings; its triangles' diagonals run one way or the other.
fn disc(rings: u32, radius: f64, forward: bool) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
    let around = rings * 5;
    let mut points = vec![Point3::origin()];
    for ring in 1..=rings {
        for k in 0..around {
            let angle = std::f64::consts::TAU * f64::from(k) / f64::from(around);
            let r = radius * f64::from(ring) / f64::from(rings);
            points.push(Point3::new(r * angle.cos(), 0.0, r * angle.sin()));
        }
    }
    let at = |ring: u32, k: u32| 1 + (ring - 1) * around + k % around;
    let mut triangles: Vec<[u32; 3]> = (0..around).map(|k| [0, at(1, k + 1), at(1, k)]).collect();
    for ring in 1..rings {
        for k in 0..around {
            let [a, b, c, d] = [at(ring, k), at(ring, k + 1), at(ring + 1, k), at(ring + 1, k + 1)];
            triangles.extend(if forward { [[a, b, c], [b, d, c]] } else { [[a, b, d], [a, d, c]] });
        }
    }
    (points, triangles)
}

/// Share of the ring beyond the stand that the draped cloth still covers, seen from above.
fn drape_coefficient(bending_length: f64, rings: u32, forward: bool) -> f64 {
    let (rest, triangles) = disc(rings, 0.15, forward);
    let density = 0.2;
    let bending = bending_length.powi(3) * density * 9.81;
    let fabric =
        Fabric { density, stretch: 500.0, shear: 40.0, bending, thickness: 0.0005, friction: 0.4, damping: 4.0 };
    let stiffness = rest.iter().map(|p| if p.coords.norm() < 0.0901 { 1e4 } else { 0.0 }).collect();
    let anchors: Vec<Vector3<f64>> = rest.iter().map(|p| p.coords).collect();
    let shape = RestShape { positions: &rest, triangles: &triangles, curved: false, grain: Vector3::x() };
    let mut sheet = Sheet::new(&shape, fabric, Anchors { stiffness }).unwrap();
    // A flat disc cannot choose where to fold: nudge it by a hundredth of a millimetre.
    for (v, p) in sheet.positions.iter_mut().enumerate() {
        p.y += 1e-5 * (v as f64 * 0.731).sin();
    }
    let around = Surroundings { anchors: &anchors, ..Surroundings::default() };
    let effort = Effort { rounds: 1, iterations: 25, tolerance: 1e-6, self_contact: false };
    for _ in 0..150 {
        sheet.advance(1.0 / 30.0, &around, &effort).unwrap();
        sheet.velocities.iter_mut().for_each(|v| *v *= 0.97);
    }
    let rim: Vec<Vector3<f64>> = sheet.positions[sheet.len() - rings as usize * 5..].to_vec();
    let shadow: f64 = (0..rim.len())
        .map(|k| {
            let (a, b) = (rim[k], rim[(k + 1) % rim.len()]);
            0.5 * (a.x * b.z - b.x * a.z).abs()
        })
        .sum();
    let (stand, whole) = (std::f64::consts::PI * 0.09f64.powi(2), std::f64::consts::PI * 0.15f64.powi(2));
    (shadow - stand) / (whole - stand)
}

#[test]
fn a_disc_drapes_as_its_bending_length_says() {
    for forward in [true, false] {
        let stiff: Vec<f64> = [14, 18, 22].into_iter().map(|rings| drape_coefficient(0.030, rings, forward)).collect();
        let limp = drape_coefficient(0.020, 22, forward);
        println!("{forward}: {stiff:.2?} at 30 mm, {limp:.2} at 20 mm");
        assert!(stiff.iter().all(|c| (0.6..0.9).contains(c)), "{stiff:?}");
        let spread = stiff.iter().fold(0.0, |a: f64, c| a.max((c - stiff[0]).abs()));
        assert!(spread < 0.1, "it depends on the mesh: {stiff:?}");
        assert!((0.2..0.7).contains(&limp), "{limp}");
    }
}
