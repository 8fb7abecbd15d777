//! Colours of cloth.

use nalgebra::{Point3, Vector3};

use crate::{noise, settings::Pattern};

/// Colour of each point of a garment at rest.
pub fn colors(points: &[Point3<f32>], pattern: &Pattern, seed: u64) -> Vec<[u8; 3]> {
    points.iter().map(|p| color(p, pattern, seed)).collect()
}

fn color(p: &Point3<f32>, pattern: &Pattern, seed: u64) -> [u8; 3] {
    let blotch = noise::layered(p, Vector3::repeat(0.05), seed ^ 0xc10);
    let (base, variation) = match pattern {
        Pattern::Plain(c) => (float(*c), 0.12),
        Pattern::Stripes(a, b, period) => (mixed(*a, *b, band(p.y, *period)), 0.06),
        Pattern::Plaid(a, b, period) => {
            let (level, upright) = (band(p.y, *period), band(around(p), *period));
            (mixed(*a, *b, 0.5 * (level + upright)), 0.08)
        }
        Pattern::Denim(c) => (float(*c), 0.26),
    };
    let threads = noise::layered(p, Vector3::new(0.02, 0.012, 0.02), seed ^ 0xc11);
    let light = 1.0 + variation * (0.7 * blotch + 0.5 * threads);
    base.map(|c| (c * light).clamp(0.0, 255.0) as u8)
}

fn float(color: [u8; 3]) -> [f32; 3] {
    color.map(f32::from)
}

fn mixed(a: [u8; 3], b: [u8; 3], share: f32) -> [f32; 3] {
    std::array::from_fn(|k| f32::from(a[k]) * (1.0 - share) + f32::from(b[k]) * share)
}

/// Length around the trunk, and out along the sleeves, metres.
fn around(p: &Point3<f32>) -> f32 {
    /// Usual radius of a trunk, metres.
    const TRUNK: f32 = 0.17;
    TRUNK * p.x.atan2(p.z) + (p.x.abs() - 1.3 * TRUNK).max(0.0).copysign(p.x)
}

/// 0 in one half of each period and 1 in the other, with soft edges: cloth has a vertex every centimetre only.
fn band(x: f32, period: f32) -> f32 {
    const EDGE: f32 = 0.006;
    let period = period.max(1e-3);
    let from_middle = ((x / period).rem_euclid(1.0) - 0.5).abs() - 0.25;
    (0.5 + 0.5 * from_middle * period / EDGE).clamp(0.0, 1.0)
}
