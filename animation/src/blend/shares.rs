//! How much of a garment's motion is physics: Hu et al. 2017, eq. 9.
//!
//! w_p = (mean − min) / (max − min) of the distances between the garment and the naked body, at most ½. A skirt is divided into
//! what lies on the body and what hangs free, each with a weight of its own.

use toile_character::FREE_PART;
use toile_geometry::{Mesh, topology::VertexNeighbors};

use super::{anchors::Closeness, loft::smoothed};

/// Largest weight of the physics.
const MOST: f64 = 0.5;
/// Rounds of smoothing between the two parts of a skirt, so that it does not tear where they meet: the paper says nothing of that.
/// Over edges of 4 mm they reach some 20 mm.
const ROUNDS: usize = 40;

/// The weights w_p of a garment.
pub(crate) struct Shares {
    /// One for the garment, or two for a skirt: on the body, and free.
    pub parts: Vec<f64>,
    /// For each vertex.
    pub of_vertices: Vec<f32>,
}

impl Shares {
    /// Of a `garment` where it was scanned.
    pub fn new(garment: &Mesh, closeness: &Closeness) -> Self {
        let distance = |p| closeness.over(p, 0.0).map_or(0.0, |over| f64::from(over.height.abs()));
        let distances: Vec<f64> = garment.positions.iter().map(distance).collect();
        let n = distances.len();
        let is_free: Vec<bool> = match garment.attributes.get(FREE_PART) {
            Some(part) => part.iter().map(|free| *free > 0.5).collect(),
            None => vec![false; n],
        };
        if is_free.iter().all(|free| *free == is_free[0]) {
            let share = physical(distances.into_iter());
            return Self { parts: vec![share], of_vertices: vec![share as f32; n] };
        }
        let of_part = |free: bool| {
            physical(distances.iter().zip(&is_free).filter(|(_, is_free)| **is_free == free).map(|(d, _)| *d))
        };
        let (on_body, free) = (of_part(false), of_part(true));
        let of_vertices: Vec<f32> = is_free.iter().map(|f| if *f { free as f32 } else { on_body as f32 }).collect();
        let neighbours = VertexNeighbors::new(n, &garment.triangles);
        Self { parts: vec![on_body, free], of_vertices: smoothed(&of_vertices, &neighbours, ROUNDS) }
    }
}

/// Eq. 9 for the distances of one part, metres.
fn physical(distances: impl Iterator<Item = f64>) -> f64 {
    let (mut low, mut high, mut sum, mut count) = (f64::INFINITY, f64::NEG_INFINITY, 0.0, 0.0f64);
    for d in distances {
        (low, high, sum, count) = (low.min(d), high.max(d), sum + d, count + 1.0);
    }
    // All at one distance: the fraction has no value, and the garment lies on the body as a whole.
    if high - low < 1e-9 { 0.0 } else { ((sum / count - low) / (high - low)).min(MOST) }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;

    /// A level sheet of 30 by 30 vertices, 10 mm apart, at `height(x, z)`.
    fn sheet(height: impl Fn(f32, f32) -> f32) -> Mesh {
        let n = 30u32;
        let at = |v: u32| {
            let (x, z) = ((v % n) as f32 * 0.01, (v / n) as f32 * 0.01);
            Point3::new(x, height(x, z), z)
        };
        let cell = |q: u32| q / (n - 1) * n + q % (n - 1);
        let cut = |a: u32| [[a, a + n, a + 1], [a + 1, a + n, a + n + 1]];
        Mesh::new((0..n * n).map(at).collect(), (0..(n - 1) * (n - 1)).map(cell).flat_map(cut).collect())
    }

    #[test]
    fn the_weight_is_that_of_equation_9_and_at_most_a_half() {
        let floor = sheet(|_, _| 0.0);
        let closeness = Closeness::new(&floor);
        let share = |height: &dyn Fn(f32, f32) -> f32| Shares::new(&sheet(height), &closeness).parts;
        // A ramp from 10 to 30 mm: the mean is half way. Squared, it is a third of the way.
        let [ramp, curve] = [share(&|x, _| 0.01 + 0.02 * x / 0.29), share(&|x, _| 0.01 + 0.02 * (x / 0.29).powi(2))];
        assert!((ramp[0] - 0.5).abs() < 1e-3 && (curve[0] - 0.339).abs() < 2e-3, "{ramp:?} {curve:?}");
        // Mostly far: the fraction is above a half.
        assert_eq!(share(&|x, _| if x < 0.05 { 0.01 } else { 0.04 }), [0.5]);
        assert_eq!(share(&|_, _| 0.02), [0.0]);
    }

    #[test]
    fn a_skirt_has_a_weight_for_each_of_its_parts() {
        let floor = sheet(|_, _| 0.0);
        let height = |x: f32| if x < 0.15 { 0.002 + 0.01 * (x / 0.14).powi(4) } else { 0.03 + 0.1 * (x - 0.15) };
        let mut skirt = sheet(|x, _| height(x));
        let free = skirt.positions.iter().map(|p| f32::from(u8::from(p.x > 0.145))).collect();
        skirt.attributes.insert(FREE_PART.into(), free);
        let shares = Shares::new(&skirt, &Closeness::new(&floor));
        let [on_body, hanging] = shares.parts[..] else { panic!("two parts") };
        assert!((on_body - 0.25).abs() < 0.03 && (hanging - 0.5).abs() < 0.01, "{on_body} {hanging}");
        // Each part has its own weight far from the other, and the change between them is no step.
        assert!((shares.of_vertices[0] - on_body as f32).abs() < 1e-3);
        assert!((shares.of_vertices[29] - hanging as f32).abs() < 1e-3);
        let step = shares.of_vertices[..30].windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f32::max);
        assert!(step < 0.3 * (hanging - on_body) as f32, "{step}");
    }
}
