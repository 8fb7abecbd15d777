//! Plane sections of a part of the body, and how a tape lies around and along them.

use nalgebra::{Point2, Point3, Vector3};
use toile_geometry::{
    hull::{area_and_perimeter, convex_hull},
    section::section_pieces,
};

/// A plane through `point` with unit `normal`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Plane {
    pub point: Point3<f64>,
    pub normal: Vector3<f64>,
}

/// The surface of one part of the body: some triangles over the vertices of the whole.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Skin<'a> {
    pub positions: &'a [Point3<f32>],
    pub triangles: &'a [[u32; 3]],
}

/// A tape on the body: its length and where it lies.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Tape {
    /// Metres.
    pub length: f64,
    /// Corners in order; a girth comes back to its first.
    pub path: Vec<Point3<f64>>,
}

impl Plane {
    /// The horizontal plane at height `y`.
    pub fn level(y: f64) -> Self {
        Self { point: Point3::new(0.0, y, 0.0), normal: Vector3::y() }
    }

    /// The plane through `point` across `direction`; `None` where that has no length.
    pub fn across(point: Point3<f64>, direction: &Vector3<f64>) -> Option<Self> {
        direction.try_normalize(1e-9).map(|normal| Self { point, normal })
    }

    /// Two unit vectors in the plane; for a horizontal one +X and +Z.
    fn axes(&self) -> (Vector3<f64>, Vector3<f64>) {
        let seed = if self.normal.x.abs() < 0.9 { Vector3::x() } else { Vector3::z() };
        let u = (seed - self.normal * seed.dot(&self.normal)).normalize();
        (u, u.cross(&self.normal))
    }
}

/// Farthest that the surface under a taut tape stands out, in lengths of the tape: beyond it another part of the body is
/// in the plane.
const BULGE: f64 = 0.3;

impl Skin<'_> {
    /// Points of each connected piece of the section by `plane`. A part's own rim is open, so pieces may be too.
    pub fn pieces(&self, plane: &Plane) -> Vec<Vec<Point3<f64>>> {
        section_pieces(self.positions, self.triangles, &plane.point, &plane.normal)
    }

    /// The tape around everything that the plane cuts; `None` where it cuts nothing.
    pub fn girth(&self, plane: &Plane) -> Option<Tape> {
        let points: Vec<Point3<f64>> = self.pieces(plane).concat();
        (points.len() > 2).then(|| around(&points, plane).1)
    }

    /// The tape around the piece with the largest hull; `None` where the plane cuts nothing.
    pub fn largest_girth(&self, plane: &Plane) -> Option<Tape> {
        let tapes = self.pieces(plane).into_iter().map(|piece| around(&piece, plane)).filter(|(area, _)| *area > 0.0);
        tapes.reduce(|a, b| if b.0 > a.0 { b } else { a }).map(|(_, tape)| tape)
    }

    /// The tape around the piece whose middle lies nearest to the plane's point; `None` where the plane cuts nothing.
    pub fn girth_near(&self, plane: &Plane) -> Option<Tape> {
        let distance = |piece: &[Point3<f64>]| (middle(piece) - plane.point).norm();
        let pieces = self.pieces(plane).into_iter().filter(|p| p.len() > 3);
        let near = pieces.reduce(|a, b| if distance(&b) < distance(&a) { b } else { a })?;
        Some(around(&near, plane).1)
    }

    /// The tape pulled taut from `a` to `b` over the surface, lying in the plane of the two and `outward`: it follows the
    /// body where that bulges and bridges its hollows. `None` where the three give no plane.
    pub fn taut(&self, a: &Point3<f64>, b: &Point3<f64>, outward: &Vector3<f64>) -> Option<Tape> {
        let along = (b - a).try_normalize(1e-9)?;
        let out = (outward - along * outward.dot(&along)).try_normalize(1e-6)?;
        let plane = Plane { point: *a, normal: along.cross(&out) };
        let length = (b - a).norm();
        let mut points = vec![Point2::new(0.0, 0.0), Point2::new(length, 0.0)];
        for p in self.pieces(&plane).into_iter().flatten() {
            let flat = Point2::new((p - a).dot(&along), (p - a).dot(&out));
            if flat.x > 0.0 && flat.x < length && flat.y > 0.0 && flat.y < BULGE * length {
                points.push(flat);
            }
        }
        let hull = convex_hull(points);
        // counter-clockwise from the leftmost lowest corner `a`: along the chord to `b`, then back over the top
        let end = hull.iter().position(|p| p.x == length && p.y == 0.0)?;
        let mut path: Vec<Point3<f64>> = hull[end..].iter().map(|p| a + along * p.x + out * p.y).collect();
        path.push(*a);
        path.reverse();
        Some(Tape::along(path))
    }
}

impl Tape {
    /// The tape through these corners.
    pub fn along(path: Vec<Point3<f64>>) -> Self {
        Self { length: path.windows(2).map(|s| (s[1] - s[0]).norm()).sum(), path }
    }

    /// The same tape from its end to its start.
    pub fn reversed(mut self) -> Self {
        self.path.reverse();
        self
    }

    /// This tape and then `next`, from the end of the one to the start of the other.
    pub fn then(self, next: Self) -> Self {
        Self::along(self.path.into_iter().chain(next.path).collect())
    }
}

/// Middle of the box around points.
fn middle(points: &[Point3<f64>]) -> Point3<f64> {
    let first = points.first().copied().unwrap_or_default();
    let (lo, hi) = points.iter().fold((first, first), |(lo, hi), p| (lo.inf(p), hi.sup(p)));
    nalgebra::center(&lo, &hi)
}

/// Hull of a piece: its area and the tape around it.
fn around(piece: &[Point3<f64>], plane: &Plane) -> (f64, Tape) {
    let (u, v) = plane.axes();
    let flat = piece.iter().map(|p| Point2::new((p - plane.point).dot(&u), (p - plane.point).dot(&v))).collect();
    let hull = convex_hull(flat);
    let (area, length) = area_and_perimeter(&hull);
    let path = hull.iter().chain(hull.first()).map(|p| plane.point + u * p.x + v * p.y).collect();
    (area, Tape { length, path })
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI, TAU};

    use toile_geometry::Mesh;

    use super::*;

    fn skin(mesh: &Mesh) -> Skin<'_> {
        Skin { positions: &mesh.positions, triangles: &mesh.triangles }
    }

    /// A surface of revolution about +Y with radius `r(y)` between two heights.
    fn turned(low: f64, high: f64, r: impl Fn(f64) -> f64) -> Mesh {
        const SIDES: u32 = 240;
        const RINGS: u32 = 240;
        let mut mesh = Mesh::default();
        for k in 0..=RINGS {
            let y = low + (high - low) * f64::from(k) / f64::from(RINGS);
            for s in 0..SIDES {
                let t = TAU * f64::from(s) / f64::from(SIDES);
                mesh.positions.push(Point3::new(r(y) * t.sin(), y, r(y) * t.cos()).cast());
            }
        }
        for (k, s) in (0..RINGS).flat_map(|k| (0..SIDES).map(move |s| (k, s))) {
            let (a, b) = (k * SIDES + s, k * SIDES + (s + 1) % SIDES);
            mesh.triangles.extend([[a, b, a + SIDES], [b, b + SIDES, a + SIDES]]);
        }
        mesh
    }

    fn ball() -> Mesh {
        turned(-0.1999, 0.1999, |y| (0.04 - y * y).max(0.0).sqrt())
    }

    #[test]
    fn a_balls_girth_is_a_circle_whatever_the_planes_tilt() {
        for tilt in [0.0, 0.4, 1.2] {
            let normal = Vector3::new(f64::sin(tilt), f64::cos(tilt), 0.2 * tilt).normalize();
            let plane = Plane { point: Point3::from(normal * 0.05), normal };
            let truth = TAU * f64::sqrt(0.04 - 0.0025);
            let ball = ball();
            let tapes = [skin(&ball).girth(&plane), skin(&ball).largest_girth(&plane), skin(&ball).girth_near(&plane)];
            for tape in tapes.map(Option::unwrap) {
                assert!((tape.length - truth).abs() < 5e-4, "{} against {truth}", tape.length);
                assert!(tape.path.iter().all(|p| (p.coords.norm() - 0.2).abs() < 5e-4));
            }
        }
    }

    #[test]
    fn a_taut_tape_follows_bulges_and_bridges_hollows() {
        let at = |angle: f64| Point3::new(0.0, 0.2 * angle.sin(), 0.2 * angle.cos());
        let over = skin(&ball()).taut(&at(FRAC_PI_2 * 0.5), &at(-FRAC_PI_2 * 0.5), &Vector3::z()).unwrap();
        assert!((over.length - 0.2 * FRAC_PI_2).abs() < 5e-4, "{}", over.length);
        let waist = turned(0.0, 1.0, |y| 0.2 - 0.05 * (PI * y).sin());
        let bridge =
            skin(&waist).taut(&Point3::new(0.0, 0.999, 0.2), &Point3::new(0.0, 0.001, 0.2), &Vector3::z()).unwrap();
        assert!((bridge.length - 0.998).abs() < 1e-3, "{}", bridge.length);
        assert!(skin(&waist).taut(&Point3::origin(), &Point3::origin(), &Vector3::z()).is_none());
    }
}
