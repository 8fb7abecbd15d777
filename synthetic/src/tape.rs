//! Height and scored girths of a body: perimeters of the convex hulls of the trunk's sections.

use nalgebra::{Point2, Point3, Vector3};
use serde::Serialize;
use toile_character::Region;
use toile_geometry::{
    Mesh,
    hull::{area_and_perimeter, convex_hull},
    section::section_pieces,
};

/// Distance between two sections that are tried, as a share of stature.
const STEP: f64 = 0.001;

/// A girth and where it was taken.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Girth {
    /// Height over the soles, metres.
    pub height_m: f64,
    /// Length of the tape, metres.
    pub girth_m: f64,
}

/// The three girths that subjects are described by.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Girths {
    /// The largest at 70–73.5 % of stature.
    pub chest: Girth,
    /// The smallest at 57–66 %.
    pub waist: Girth,
    /// The largest at 47–55 %.
    pub hip: Girth,
}

/// Height of a standing body, metres.
pub fn stature(body: &Mesh) -> f64 {
    body.bounds().map_or(0.0, |(lo, hi)| f64::from(hi.y - lo.y))
}

/// Girths of a body standing on y = 0, arms excluded; `None` where a section is empty.
pub fn girths(body: &Mesh, regions: &[Region]) -> Option<Girths> {
    use Region::*;
    let height = stature(body);
    let trunk = |v: &u32| matches!(regions[*v as usize], Torso | LeftLeg | RightLeg);
    let (body, _) = body.filter_triangles(|t| body.triangles[t].iter().all(trunk));
    let scan = |low: f64, high: f64, sign: f64| {
        let steps = ((high - low) / STEP).round() as usize;
        let sections = (0..=steps).map(|i| (low + STEP * i as f64) * height);
        let taken = sections.filter_map(|y| Some(Girth { height_m: y, girth_m: girth_at(&body, y)? }));
        taken.max_by(|a, b| (sign * a.girth_m).total_cmp(&(sign * b.girth_m)))
    };
    Some(Girths { chest: scan(0.70, 0.735, 1.0)?, waist: scan(0.57, 0.66, -1.0)?, hip: scan(0.47, 0.55, 1.0)? })
}

/// Perimeter of the convex hull of the largest piece of the section at height `y`: below the crotch that is one leg.
fn girth_at(body: &Mesh, y: f64) -> Option<f64> {
    let flat = |piece: &Vec<Point3<f64>>| piece.iter().map(|p| Point2::new(p.x, p.z)).collect();
    let pieces = section_pieces(&body.positions, &body.triangles, &Point3::new(0.0, y, 0.0), &Vector3::y());
    let hulls = pieces.iter().map(|piece| area_and_perimeter(&convex_hull(flat(piece))));
    hulls.filter(|(area, _)| *area > 0.0).reduce(|a, b| if b.0 > a.0 { b } else { a }).map(|(_, perimeter)| perimeter)
}
