//! A plane that a particle can hit, of a rough surface below it.

use nalgebra::{Point3, Vector3};
use toile_geometry::bvh::Bvh;

/// Surfaces that a particle can hit at once.
pub(super) const HITS: usize = 3;
/// Surfaces are looked for within this distance, metres: farther than cloth and body come near each other in a frame, deeper than a
/// surface comes through cloth in one.
const REACH: f32 = 0.06;
/// Distance that a particle keeps from rough surfaces, metres, where the scan had as much: what edges of 30 mm cut off a shin.
const GAP: f32 = 0.004;

/// Cosine between normal and way to the nearest place: below that, the particle lies beside the surface's rim and not over it.
const BESIDE: f32 = 0.6;
/// What lies deeper than this under a surface is on its other side, metres: half the thickness of a forearm.
pub(super) const DEEPEST: f32 = 0.03;

/// A plane that a particle cannot pass.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hit {
    /// A point of it at the start of a piece of a frame.
    pub from: Point3<f32>,
    /// How that moves in the piece, metres.
    pub way: Vector3<f32>,
    /// Unit normal, to the side of the particle.
    pub normal: Vector3<f32>,
    /// Distance to keep, metres; not finite where there is no plane.
    pub gap: f32,
}

impl Hit {
    pub const NONE: Self = Self {
        from: Point3::new(0.0, 0.0, 0.0),
        way: Vector3::new(0.0, 0.0, 0.0),
        normal: Vector3::new(0.0, 1.0, 0.0),
        gap: f32::NEG_INFINITY,
    };

    pub fn is_some(&self) -> bool {
        self.gap.is_finite()
    }

    pub fn at(&self, share: f32) -> Point3<f32> {
        self.from + self.way * share
    }
}

/// A rough surface that moves from one place to another.
pub(super) struct Below<'a> {
    pub triangles: &'a [[u32; 3]],
    pub bvh: &'a Bvh,
    pub from: &'a [Point3<f32>],
    pub to: &'a [Point3<f32>],
}

impl Below<'_> {
    /// The plane that the particle at `p` can hit, from which it keeps the distance it had at rest where that was less.
    pub fn hit(&self, p: &Point3<f32>, rest: f32) -> Hit {
        let Some(near) = self.bvh.closest(p, REACH) else { return Hit::NONE };
        let corners = self.triangles[near.triangle as usize].map(|v| v as usize);
        let [a, b, c] = corners.map(|v| self.to[v]);
        let Some(normal) = (b - a).cross(&(c - a)).try_normalize(1e-12) else { return Hit::NONE };
        let height = (p - near.point).dot(&normal);
        if height.abs() < BESIDE * near.distance || height < -DEEPEST {
            return Hit::NONE;
        }
        let mix = |places: &[Point3<f32>]| -> Vector3<f32> {
            (0..3).map(|k| places[corners[k]].coords * near.barycentric[k]).sum()
        };
        let (from, to) = (mix(self.from), mix(self.to));
        Hit { from: from.into(), way: to - from, normal, gap: rest.min(GAP) }
    }

    /// Heights of `points` over the surface, metres; infinite where it is not near.
    pub fn heights(&self, points: &[Point3<f32>]) -> Vec<f32> {
        let height = |p: &Point3<f32>| {
            let hit = self.hit(p, f32::INFINITY);
            if hit.is_some() { (p - hit.at(1.0)).dot(&hit.normal) } else { f32::INFINITY }
        };
        points.iter().map(height).collect()
    }
}
