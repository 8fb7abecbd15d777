//! Straight-hanging cloth: convex tubes down from the widest part above.

use nalgebra::{Point2, Point3};
use toile_geometry::hull::convex_hull;

use crate::{
    field::Grid,
    person::Person,
    tailoring::{Limb, Tailoring},
};

/// The support that cloth hangs down from: for each level of the grid the convex hull of everything above it (below `drape_from`).
pub(crate) struct Tubes {
    hulls: Vec<Vec<Point2<f64>>>,
}

impl Tubes {
    /// Builds the hulls level by level, from the top down.
    pub fn new(person: &Person, grid: &Grid, cut_to: &Tailoring) -> Self {
        let mut hulls = vec![Vec::new(); grid.dims[1]];
        if cut_to.drape <= 0.0 {
            return Self { hulls };
        }
        let trunk = |v: &usize| Limb::of(person.regions[*v]) == Limb::Trunk;
        let body = &person.body.mesh.positions;
        let points: Vec<&Point3<f32>> = (0..body.len()).filter(trunk).map(|v| &body[v]).collect();
        let mut hull: Vec<Point2<f64>> = Vec::new();
        for level in (0..grid.dims[1]).rev() {
            let y = grid.position([0, level, 0]).y;
            if y > cut_to.drape_from {
                continue;
            }
            let new = points.iter().filter(|p| (p.y - y).abs() <= 0.75 * grid.cell);
            hull.extend(new.map(|p| Point2::new(f64::from(p.x), f64::from(p.z))));
            hull = convex_hull(std::mem::take(&mut hull));
            hulls[level].clone_from(&hull);
        }
        Self { hulls }
    }

    /// Signed distance in the plane to the tube at a level; infinite where there is none.
    pub fn distance(&self, level: usize, p: &Point3<f32>) -> f32 {
        let hull = &self.hulls[level];
        if hull.len() < 3 {
            return f32::INFINITY;
        }
        let p = Point2::new(f64::from(p.x), f64::from(p.z));
        let (mut inside, mut outside) = (f64::NEG_INFINITY, f64::INFINITY);
        for (a, b) in hull.iter().zip(hull.iter().cycle().skip(1)) {
            let side = b - a;
            let length = side.norm().max(1e-9);
            inside = inside.max((p - a).perp(&side) / length);
            let along = ((p - a).dot(&side) / (length * length)).clamp(0.0, 1.0);
            outside = outside.min((p - (a + side * along)).norm());
        }
        (if inside <= 0.0 { inside } else { outside }) as f32
    }
}
