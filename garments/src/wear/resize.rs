//! Cloth resized as the skin around it differs between two bodies: each point moves by the similarity that takes the skin near it on
//! the one body nearest to the same skin on the other (moving least squares: Schaefer et al. 2006, in space).
//!
//! A similarity turns and scales the offset from the skin as it turns and scales the skin itself, so that a coat keeps its ease in
//! proportion; and it cannot shear, so that pockets and collars keep their shape.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use toile_geometry::{Mesh, areas::vertex_areas};

use super::similarity::Sums;

/// Skin nearer than this counts alike, metres: folds of cloth are some centimetres wide and keep their shape.
const NEAR: f32 = 0.03;

/// The same skin on two bodies, in one pose.
pub(super) struct Skin {
    patches: Vec<Patch>,
}

/// A vertex of both bodies.
struct Patch {
    at: Point3<f32>,
    from: Vector3<f64>,
    to: Vector3<f64>,
    area: f32,
}

impl Skin {
    /// Of the body `before`, whose vertices are at `after` on the other one.
    pub fn new(before: &Mesh, after: &[Point3<f32>]) -> Self {
        let all = before.positions.iter().zip(after).zip(vertex_areas(before));
        let patch = |((at, to), area): ((&Point3<f32>, &Point3<f32>), f32)| Patch {
            at: *at,
            from: at.coords.cast(),
            to: to.coords.cast(),
            area,
        };
        Self { patches: all.filter(|(_, area)| *area > 0.0).map(patch).collect() }
    }

    /// Sums over all skin for a point at `p`: by area, and by the inverse sixth power of the distance.
    fn around(&self, p: &Point3<f32>) -> Sums {
        let mut sums = Sums::default();
        for patch in &self.patches {
            let near = (NEAR * NEAR) / ((patch.at - p).norm_squared() + NEAR * NEAR);
            sums.add(&patch.from, &patch.to, f64::from(patch.area * near * near * near));
        }
        sums
    }
}

/// Where cloth at `points` comes, each of them by itself.
pub(super) fn resized(points: &[Point3<f32>], skin: &Skin) -> Vec<Point3<f32>> {
    points.par_iter().map(|p| skin.around(p).similarity().moved(p)).collect()
}

/// The same for stiff things: all points of a piece move by one similarity, the one for all of them together.
pub(super) fn resized_in_pieces(points: &[Point3<f32>], piece: &[u32], count: usize, skin: &Skin) -> Vec<Point3<f32>> {
    let around: Vec<Sums> = points.par_iter().map(|p| skin.around(p)).collect();
    let mut of_piece = vec![Sums::default(); count];
    around.iter().zip(piece).for_each(|(sums, &k)| of_piece[k as usize].add_mean(sums));
    let moves: Vec<_> = of_piece.iter().map(Sums::similarity).collect();
    points.iter().zip(piece).map(|(p, &k)| moves[k as usize].moved(p)).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::{Rotation3, Vector3};

    use super::*;

    /// A closed-in-the-round tube about +Y, 0.8 m long.
    fn tube(radius: f32) -> Mesh {
        const SIDES: u32 = 40;
        const RINGS: u32 = 41;
        let at = |k: u32| {
            let angle = std::f32::consts::TAU * (k % SIDES) as f32 / SIDES as f32;
            Point3::new(radius * angle.sin(), 0.02 * (k / SIDES) as f32, radius * angle.cos())
        };
        let quad = |k: u32| {
            let next = k / SIDES * SIDES + (k + 1) % SIDES;
            [[k, next, k + SIDES], [next, next + SIDES, k + SIDES]]
        };
        Mesh::new((0..SIDES * RINGS).map(at).collect(), (0..SIDES * (RINGS - 1)).flat_map(quad).collect())
    }

    #[test]
    fn a_body_that_is_turned_moved_and_larger_takes_its_cloth_along() {
        let (body, cloth) = (tube(0.1), tube(0.13));
        let turn = Rotation3::from_euler_angles(0.4, -1.0, 0.2);
        let other = |p: &Point3<f32>| turn * (p * 1.2) + Vector3::new(0.3, -0.1, 0.7);
        let after: Vec<Point3<f32>> = body.positions.iter().map(other).collect();
        let skin = Skin::new(&body, &after);
        for (p, q) in cloth.positions.iter().zip(resized(&cloth.positions, &skin)) {
            assert!((q - other(p)).norm() < 1e-5, "{p} came to {q}");
        }
    }

    #[test]
    fn the_ease_of_a_wider_body_grows_with_it_and_detail_of_the_skin_does_not_print_through() {
        let (body, cloth) = (tube(0.1), tube(0.13));
        let mut after: Vec<Point3<f32>> =
            body.positions.iter().map(|p| Point3::new(1.3 * p.x, p.y, 1.3 * p.z)).collect();
        after[40 * 20].z += 0.01;
        let worn = resized(&cloth.positions, &Skin::new(&body, &after));
        let radii = worn.iter().filter(|p| (0.2..0.6).contains(&p.y)).map(|p| p.x.hypot(p.z));
        let (low, high) = radii.fold((f32::MAX, 0.0f32), |(low, high), r| (low.min(r), high.max(r)));
        // 130 mm, 30 mm off the skin: 160 mm where the ease stays, 169 mm where it is scaled as the girth is.
        assert!(0.16 < low && high < 0.169 && high - low < 0.002, "{low} to {high}");
    }

    #[test]
    fn stiff_pieces_keep_their_shape() {
        let body = tube(0.1);
        let after: Vec<Point3<f32>> =
            body.positions.iter().map(|p| Point3::new((1.0 + 0.8 * p.y) * p.x, p.y, 1.2 * p.z)).collect();
        let hat = tube(0.11).positions;
        let piece: Vec<u32> = hat.iter().map(|p| u32::from(p.y > 0.41)).collect();
        let worn = resized_in_pieces(&hat, &piece, 2, &Skin::new(&body, &after));
        let scale = |a: usize, b: usize| (worn[a] - worn[b]).norm() / (hat[a] - hat[b]).norm();
        let last = hat.len() - 1;
        for (one, other) in [((0, 20), (10, 200)), ((last, last - 20), (last - 10, last - 200))] {
            let scales = [scale(one.0, one.1), scale(other.0, other.1)];
            assert!((scales[0] - scales[1]).abs() < 1e-4 && scales[0] > 1.05, "{scales:?}");
        }
    }
}
