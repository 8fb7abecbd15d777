//! What contours are sampled on: rays that leave something.

use nalgebra::{Point3, Vector3};

use crate::group::Group;

/// A ray from the link outward.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// The group whose primitives it sees.
    pub group: Group,
    /// On the link, metres.
    pub origin: Point3<f64>,
    /// Unit vector.
    pub direction: Vector3<f64>,
    /// Nothing farther than this is looked at, metres.
    pub reach: f64,
}

impl Ray {
    /// The point at distance `t`.
    pub fn at(&self, t: f64) -> Point3<f64> {
        self.origin + self.direction * t
    }
}

/// A shape that rays leave.
pub trait Surface: Sync {
    /// How far from its origin the ray leaves the shape for the last time within its reach; the reach itself where the shape goes
    /// on beyond it, and `None` where the ray does not meet the shape.
    fn outermost(&self, ray: &Ray) -> Option<f64>;
}
