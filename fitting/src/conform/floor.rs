//! The floor that a scanned person stands on, found on the scan: skin does not lie below it.

use nalgebra::Point3;
use toile_character::{BodyModel, Region};
use toile_geometry::{Mesh, areas::triangle_area};

use super::elastic::Pull;

/// A triangle belongs to the soles within this height over the lowest of the scan, metres: the noise of a fused scan.
const THICKNESS: f32 = 0.003;
/// Largest vertical part of the normal of a triangle that faces down, −1 to 1.
const DOWN: f32 = -0.9;
/// Area of the soles above which they are flat because something flat was below them, square metres: half of what two
/// small feet touch a floor with.
const SMALLEST: f32 = 0.006;
/// One vertex in this many may be a stray point below the soles.
const STRAY: usize = 5000;
/// Skin deeper below it than this is not the soles', metres: the scan ends at a cut, not at a floor.
const DEEPEST: f32 = 0.02;
/// Pull of the floor on skin below it, against 1 of a scan point.
const WEIGHT: f64 = 10.0;

/// Height of the floor below an upright scan, metres; `None` where its lowest part is not flat.
pub(crate) fn floor_of(scan: &Mesh) -> Option<f32> {
    let mut heights: Vec<f32> = scan.positions.iter().map(|p| p.y).collect();
    heights.sort_by(f32::total_cmp);
    let lowest = *heights.get(heights.len() / STRAY)?;
    let is_sole = |corners: &[Point3<f32>; 3]| {
        let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
        corners.iter().all(|c| c.y < lowest + THICKNESS) && normal.y < DOWN * normal.norm()
    };
    let soles: Vec<[Point3<f32>; 3]> = (0..scan.triangles.len()).map(|t| scan.corners(t)).filter(is_sole).collect();
    let areas = soles.iter().map(|c| triangle_area(*c));
    let (area, moment) = soles.iter().zip(areas).fold((0.0, 0.0), |(area, moment), (corners, a)| {
        (area + a, moment + a * corners.iter().map(|c| c.y).sum::<f32>() / 3.0)
    });
    (area > SMALLEST).then(|| moment / area)
}

/// Draws the soles that lie below the floor up to it, instead of to the scan.
pub(crate) fn draw_up(model: &BodyModel, points: &[Point3<f32>], floor: f32, pulls: &mut [Pull]) {
    for (v, pull) in pulls.iter_mut().enumerate().filter(|(v, _)| is_below(model, points, floor, *v)) {
        *pull = Pull { target: Point3::new(points[v].x, floor, points[v].z), weight: WEIGHT };
    }
}

/// Leaves no sole below the floor: it is pressed flat.
pub(crate) fn press_flat(model: &BodyModel, points: &mut [Point3<f32>], floor: f32) {
    for v in 0..points.len() {
        if is_below(model, points, floor, v) {
            points[v].y = floor;
        }
    }
}

fn is_below(model: &BodyModel, points: &[Point3<f32>], floor: f32, v: usize) -> bool {
    let is_foot = matches!(model.regions[v], Region::LeftFoot | Region::RightFoot);
    is_foot && (floor - DEEPEST..floor).contains(&points[v].y)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_floor_is_found_below_flat_soles_and_not_below_a_ball() {
        let model = BodyModel::load_default().unwrap();
        let mut standing = Mesh::new(model.mean.clone(), model.triangles.clone());
        let lowest = model.mean.iter().map(|p| p.y).fold(f32::INFINITY, f32::min);
        let floor = lowest + 0.006;
        press_flat(&model, &mut standing.positions, floor);
        let found = floor_of(&standing).expect("both soles are flat");
        assert!((found - floor).abs() < 1e-3, "{found} instead of {floor}");
        assert!(standing.positions.iter().all(|p| p.y >= floor));

        let mut ball = Mesh::new(model.mean.clone(), model.triangles.clone());
        let middle = ball.positions.iter().fold(nalgebra::Vector3::zeros(), |s, p| s + p.coords) / 13_380.0;
        ball.positions.iter_mut().for_each(|p| *p = ((p.coords - middle).normalize() * 0.3).into());
        assert_eq!(floor_of(&ball), None);
    }

    #[test]
    fn legs_below_a_cut_are_not_pressed_into_it() {
        let model = BodyModel::load_default().unwrap();
        let mut points = model.mean.clone();
        let lowest = model.mean.iter().map(|p| p.y).fold(f32::INFINITY, f32::min);
        press_flat(&model, &mut points, lowest + 0.9);
        assert_eq!(points, model.mean);
    }
}
