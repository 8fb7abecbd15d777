//! Deformable primitives: muscles whose shape follows a joint (paper 002 §3.2).

use std::{fmt, str::FromStr};

use nalgebra::Vector3;
use toile_character::{Joint, Pose, limits::rotation_vector};

use crate::state::State;

/// How far along a muscle is when its joint is at share t of its range.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Blending {
    /// f(t) = t.
    #[default]
    Linear,
    /// f(t) = t²: late.
    Parabolic,
    /// f(t) = √t: early.
    Hyperbolic,
}

impl Blending {
    /// All functions.
    pub const ALL: [Self; 3] = [Self::Linear, Self::Parabolic, Self::Hyperbolic];

    /// The paper's name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Parabolic => "parabolic",
            Self::Hyperbolic => "hyperbolic",
        }
    }

    /// f(t) for t in [0, 1].
    pub fn at(self, t: f64) -> f64 {
        match self {
            Self::Linear => t,
            Self::Parabolic => t * t,
            Self::Hyperbolic => t.sqrt(),
        }
    }
}

impl fmt::Display for Blending {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Blending {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|f| f.name() == name);
        found.ok_or_else(|| format!("`{name}` is no blending function; use linear, parabolic or hyperbolic"))
    }
}

/// How a primitive follows its reference joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deform {
    /// The reference joint J.
    pub reference: Joint,
    /// Unit axis of its turn, in the frame of the joint's parent, which at rest lies along the subject's.
    pub axis: Vector3<f64>,
    /// α_min, α_0, α_max: lowest angle, that of the relaxed state, highest angle; radians, ascending.
    pub limits: [f64; 3],
    /// G_min.
    pub at_min: State,
    /// G_max.
    pub at_max: State,
    /// f.
    pub blending: Blending,
}

impl Deform {
    /// The angle α of the reference joint in `pose`, radians.
    pub fn angle(&self, pose: &Pose) -> f64 {
        rotation_vector(&pose.rotation(self.reference)).dot(&self.axis)
    }

    /// The state at angle `alpha`: G = G₀ + f(t)(G_max − G₀) above the relaxed angle, G₀ + f(t)(G_min − G₀) below it.
    /// Angles beyond the limits count as the limit.
    ///
    /// The paper prints t = (α − α_min)/(α₀ − α_min) for the lower side, which would put the relaxed muscle at its extreme;
    /// here t grows away from the relaxed angle on both sides.
    pub fn state(&self, relaxed: &State, alpha: f64) -> State {
        let [low, rest, high] = self.limits;
        let (extreme, goal) = if alpha >= rest { (high, &self.at_max) } else { (low, &self.at_min) };
        let range = extreme - rest;
        let t = if range.abs() > 1e-9 { ((alpha - rest) / range).clamp(0.0, 1.0) } else { 0.0 };
        relaxed.toward(goal, self.blending.at(t))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;

    fn state(size: f64) -> State {
        State { axes: Vector3::repeat(size), center: Vector3::x() * size, turn: Vector3::z() * size }
    }

    fn biceps(blending: Blending) -> Deform {
        Deform {
            reference: Joint::LeftLowerArm,
            axis: Vector3::y(),
            limits: [-1.0, 0.0, 2.0],
            at_min: state(0.5),
            at_max: state(3.0),
            blending,
        }
    }

    #[test]
    fn each_blending_function_is_its_formula_on_both_sides_of_rest() {
        for (blending, quarter) in
            [(Blending::Linear, 0.25), (Blending::Parabolic, 0.0625), (Blending::Hyperbolic, 0.5)]
        {
            assert_eq!(blending.name().parse(), Ok(blending));
            let muscle = biceps(blending);
            let size = |alpha: f64| muscle.state(&state(1.0), alpha).axes.x;
            assert!((size(0.5) - (1.0 + 2.0 * quarter)).abs() < 1e-12, "{blending}");
            assert!((size(-0.25) - (1.0 - 0.5 * quarter)).abs() < 1e-12, "{blending}");
            for (alpha, expected) in [(0.0, 1.0), (2.0, 3.0), (9.0, 3.0), (-1.0, 0.5), (-4.0, 0.5)] {
                assert!((size(alpha) - expected).abs() < 1e-12, "{blending} {alpha}");
            }
            let half = muscle.state(&state(1.0), 1.0);
            assert_eq!((half.center.x, half.turn.z), (half.axes.x, half.axes.x));
        }
        assert!("cubic".parse::<Blending>().unwrap_err().contains("parabolic"));
    }

    #[test]
    fn the_angle_is_the_turn_about_the_axis() {
        let mut pose = Pose::identity();
        *pose.rotation_mut(Joint::LeftLowerArm) = UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.7, 0.0));
        assert!((biceps(Blending::Linear).angle(&pose) - 0.7).abs() < 1e-12);
    }
}
