//! A person of two balls on two posts, with everything wrong that files have.

use nalgebra::Vector3;

use super::*;
use crate::{Material, Unit, Up};

/// A closed grid around the axis Y: rings of 24 at heights with radii, closed at both ends.
fn lathe(rings: &[(f32, f32)], middle: [f32; 2]) -> Mesh {
    const AROUND: u32 = 24;
    let mut positions = Vec::new();
    for &(height, radius) in rings {
        positions.extend((0..AROUND).map(|k| {
            let angle = std::f32::consts::TAU * k as f32 / AROUND as f32;
            Point3::new(middle[0] + radius * angle.cos(), height, middle[1] + radius * angle.sin())
        }));
    }
    let mut triangles = Vec::new();
    for ring in 0..rings.len() as u32 - 1 {
        for k in 0..AROUND {
            let (a, b) = (ring * AROUND + k, ring * AROUND + (k + 1) % AROUND);
            triangles.extend([[a, a + AROUND, b], [b, a + AROUND, b + AROUND]]);
        }
    }
    let last = (rings.len() as u32 - 1) * AROUND;
    triangles.extend((1..AROUND - 1).flat_map(|k| [[0, k, k + 1], [last, last + k + 1, last + k]]));
    Mesh::new(positions, triangles)
}

/// A trunk with a head, 1.75 m tall, and a leg apart from it.
fn figure() -> Mesh {
    let mut mesh =
        lathe(&[(0.0, 0.05), (0.8, 0.1), (0.9, 0.2), (1.4, 0.2), (1.5, 0.07), (1.6, 0.12), (1.75, 0.02)], [0.1, 0.0]);
    append(&mut mesh, &lathe(&[(0.0, 0.05), (0.75, 0.08)], [-0.1, 0.0]));
    mesh
}

fn append(mesh: &mut Mesh, other: &Mesh) {
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(&other.positions);
    mesh.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + first)));
}

fn settings(unit: Unit, up: Up) -> CleanSettings {
    CleanSettings { unit: unit.metres(), upright: up.upright(), fill_holes: true, target_triangles: 100_000 }
}

/// The figure as a file in some unit and with some axis up would have it, moved.
fn as_file(mesh: &Mesh, unit: Unit, up: Up) -> Surface {
    let back = up.upright().inverse().cast::<f32>();
    let place = |p: &Point3<f32>| back * (*p + Vector3::new(3.0, 1.0, -2.0)) / unit.metres() as f32;
    Surface::new(mesh.positions.iter().map(place).collect(), mesh.triangles.clone())
}

#[test]
fn units_and_axes_make_no_difference() {
    let figure = figure();
    let volume = figure.signed_volume();
    for (unit, up) in
        [(Unit::Metre, Up::Y), (Unit::Millimetre, Up::Z), (Unit::Inch, Up::MinusX), (Unit::Foot, Up::MinusY)]
    {
        let surface = as_file(&figure, unit, up);
        let (scan, cleaned) = clean(&surface, &settings(unit, up)).unwrap();
        let (low, high) = scan.bounds().unwrap();
        assert!(low.y.abs() < 1e-5 && (high.y - 1.75).abs() < 1e-4, "{unit} {up}: {low} {high}");
        assert!((scan.signed_volume() - volume).abs() < 1e-3 * volume, "{unit} {up}");
        assert!(cleaned.watertight && cleaned.pieces_removed == 0 && cleaned.ground_m.is_none(), "{cleaned:?}");
        let matrix = Matrix4::from_row_slice(&cleaned.scan_from_file);
        let moved = matrix.transform_point(&surface.positions[10].cast());
        let nearest = scan.positions.iter().map(|p| (p.cast::<f64>() - moved).norm()).fold(1.0, f64::min);
        assert!(nearest < 2e-3, "{unit} {up}: {nearest}");
    }
}

#[test]
fn inside_out_twice_there_holes_needles_and_crumbs_are_repaired() {
    let figure = figure();
    let mut broken = figure.filter_triangles(|t| !(150..170).contains(&t)).0;
    broken.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    let reversed: Vec<[u32; 3]> = broken.triangles.iter().take(50).map(|t| [t[2], t[1], t[0]]).collect();
    broken.triangles.extend(reversed);
    broken.triangles.push([0, 0, 1]);
    append(&mut broken, &lathe(&[(1.0, 0.01), (1.02, 0.01)], [0.9, 0.0]));
    let surface = as_file(&broken, Unit::Metre, Up::Y);
    let (scan, cleaned) = clean(&surface, &settings(Unit::Metre, Up::Y)).unwrap();
    assert_eq!((cleaned.dropped, cleaned.pieces_removed, cleaned.holes_filled), ([1, 50], 1, 1));
    assert!(cleaned.turned > 200 && cleaned.watertight && cleaned.filled_percent > 0.1, "{cleaned:?}");
    assert!((scan.signed_volume() - figure.signed_volume()).abs() < 0.02 * figure.signed_volume());
}

#[test]
fn a_floor_and_a_disk_are_cut_away_and_soles_stay_where_they_were() {
    let person = figure();
    for size in [0.4, 1.5] {
        let mut on_ground = person.clone();
        // The ground as scanners give it: one surface with the soles' borders is rare, a sheet through them is usual.
        append(&mut on_ground, &lathe(&[(-0.02, size), (0.0, size)], [0.0, 0.0]));
        let surface = as_file(&on_ground, Unit::Metre, Up::Y);
        let (scan, cleaned) = clean(&surface, &settings(Unit::Metre, Up::Y)).unwrap();
        let (low, high) = scan.bounds().unwrap();
        assert!((high.y - low.y - 1.75).abs() < 2e-3 && high.x - low.x < 0.5, "{low} {high}");
        assert!((cleaned.ground_m.unwrap() - 0.02).abs() < 1e-3 && cleaned.watertight, "{cleaned:?}");
    }
}

#[test]
fn a_picture_finer_than_the_mesh_is_seen_on_the_scan() {
    let figure = figure();
    let mut surface = as_file(&figure, Unit::Metre, Up::Y);
    // Stripes of 5 cm by height: red below, then green, and so on.
    let stripes = image::RgbImage::from_fn(1, 350, |_, y| {
        image::Rgb(if (349 - y) / 10 % 2 == 0 { [200, 0, 0] } else { [0, 200, 0] })
    });
    surface.materials = vec![Material { picture: Some(stripes.into()), ..Material::default() }];
    surface.material_of = vec![0; surface.triangles.len()];
    surface.texture_coordinates =
        figure.triangles.iter().map(|t| t.map(|v| [0.5, 1.0 - figure.positions[v as usize].y / 1.75])).collect();
    let (scan, cleaned) = clean(&surface, &settings(Unit::Metre, Up::Y)).unwrap();
    assert!(cleaned.has_colors);
    let is_right = |v: usize| {
        let within = (scan.positions[v].y / 0.05).fract();
        let red = ((scan.positions[v].y / 0.05) as u32).is_multiple_of(2);
        let color = scan.colors[v];
        !(0.2..0.8).contains(&within) || (color[0] > 150) == red && (color[1] > 150) != red
    };
    let right = (0..scan.positions.len()).filter(|&v| is_right(v)).count();
    assert!(right as f64 > 0.97 * scan.positions.len() as f64, "{right} of {}", scan.positions.len());
    assert!(scan.triangles.len() <= 100_000);
}
