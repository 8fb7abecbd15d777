//! Size, place and turn of a primitive.

use nalgebra::{UnitQuaternion, Vector3};

/// The nine parameters of a primitive, in the frame of its joint: G = {a, b, c, Ox, Oy, Oz, φx, φy, φz} (§3.2).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    /// Half axes a, b, c of the surface that the primitive has alone, metres; above 0.
    pub axes: Vector3<f64>,
    /// Centre O from the joint, metres, along the axes of the rest pose.
    pub center: Vector3<f64>,
    /// Turn φ about x, then y, then z, radians.
    pub turn: Vector3<f64>,
}

impl State {
    /// The orientation that `turn` stands for.
    pub fn rotation(&self) -> UnitQuaternion<f64> {
        UnitQuaternion::from_euler_angles(self.turn.x, self.turn.y, self.turn.z)
    }

    /// The same primitive turned as `rotation` says.
    #[must_use]
    pub fn turned(self, rotation: &UnitQuaternion<f64>) -> Self {
        let (x, y, z) = rotation.euler_angles();
        Self { turn: Vector3::new(x, y, z), ..self }
    }

    /// The state at `share` of the way to `other`, number by number.
    #[must_use]
    pub fn toward(&self, other: &Self, share: f64) -> Self {
        Self {
            axes: self.axes.lerp(&other.axes, share),
            center: self.center.lerp(&other.center, share),
            turn: self.turn.lerp(&other.turn, share),
        }
    }
}
