//! Generalised winding numbers (Jacobson et al. 2013), far boxes as dipoles (Barill et al. 2018).

use std::ops::Range;

use nalgebra::Point3;

use super::{traverse::Query, tree::Node, triangles::Bvh};

/// A box further away than this many of its radii is taken as one dipole.
const OPENING_RATIO: f32 = 2.0;

impl Bvh {
    /// Generalised winding number at `p`: about 1 inside a closed outward surface, 0 outside, in between near holes.
    pub fn winding_number(&self, p: &Point3<f32>) -> f32 {
        let mut winding = Winding { bvh: self, p: *p, solid_angle: 0.0 };
        self.tree.traverse(&mut winding);
        (winding.solid_angle / (4.0 * std::f64::consts::PI)) as f32
    }

    /// True where the winding number says that `p` lies inside.
    pub fn contains(&self, p: &Point3<f32>) -> bool {
        self.winding_number(p) > 0.5
    }
}

struct Winding<'a> {
    bvh: &'a Bvh,
    p: Point3<f32>,
    solid_angle: f64,
}

impl Query for Winding<'_> {
    /// Every box counts, in the tree's order.
    #[inline(always)]
    fn rank(&self, _: &Node) -> f32 {
        0.0
    }

    #[inline(always)]
    fn wants(&self, _: f32) -> bool {
        true
    }

    #[inline(always)]
    fn takes_whole(&mut self, index: usize) -> bool {
        let far = &self.bvh.far_fields[index];
        let to_center = far.center - self.p;
        let distance = to_center.norm();
        let is_far = distance > OPENING_RATIO * far.radius;
        if is_far {
            self.solid_angle += f64::from(far.dipole.dot(&to_center)) / f64::from(distance).powi(3);
        }
        is_far
    }

    #[inline(always)]
    fn visit(&mut self, places: Range<usize>) {
        self.solid_angle += solid_angle(self.bvh.corners[places].iter().map(|c| HalfAngle::of(&self.p, c)));
    }
}

/// Half the signed solid angle of a triangle, by its sine and cosine times a positive factor.
#[derive(Clone, Copy)]
struct HalfAngle {
    sine: f64,
    cosine: f64,
}

impl HalfAngle {
    /// Seen from `p` (van Oosterom and Strackee 1983).
    #[inline(always)]
    fn of(p: &Point3<f32>, corners: &[Point3<f32>; 3]) -> Self {
        let [a, b, c] = corners.map(|q| (q - p).cast::<f64>());
        let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
        let cosine = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
        Self { sine: a.dot(&b.cross(&c)), cosine }
    }

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        Self {
            sine: self.sine * other.cosine + self.cosine * other.sine,
            cosine: self.cosine * other.cosine - self.sine * other.sine,
        }
    }
}

/// The sum of all solid angles. Two halves below a right angle stay below a half turn together, so that they need one
/// arc tangent, not two.
#[inline(always)]
fn solid_angle(halves: impl Iterator<Item = HalfAngle>) -> f64 {
    let (mut sum, mut open) = (0.0, None::<HalfAngle>);
    for half in halves {
        match open.take() {
            _ if half.cosine <= 0.0 => sum += half.sine.atan2(half.cosine),
            None => open = Some(half),
            Some(first) => {
                let both = first.plus(half);
                sum += both.sine.atan2(both.cosine);
            }
        }
    }
    2.0 * (sum + open.map_or(0.0, |o| o.sine.atan2(o.cosine)))
}
