//! The path of one foot through a gait cycle: heel strike, flat sole, heel off, swing.
//!
//! Phases follow the usual division (Perry, Gait Analysis, 1992): 60 % stance, 40 % swing. The foot rolls over
//! its heel, stands flat, then rolls over its ball while the toes stay flat.

use nalgebra::Vector3;

/// Share of the cycle during which the foot is on the ground.
pub(crate) const STANCE: f64 = 0.61;
/// Phase at which the sole is flat after heel strike.
const FLAT: f64 = 0.09;
/// Phase at which the heel leaves the ground.
const HEEL_OFF: f64 = 0.36;
/// Pitch of the foot at heel strike (toes up is negative) and at toe-off, radians.
const STRIKE_PITCH: f64 = -0.3;
const TOE_OFF_PITCH: f64 = 0.85;
/// How much higher the ankle is carried in mid-swing than its straight path, metres.
const CLEARANCE: f64 = 0.045;
/// Ankle above the ground when the sole is flat, metres.
const ANKLE_HEIGHT: f64 = 0.08;
/// Heel seen from the ankle with a flat sole, metres.
const HEEL: Vector3<f64> = Vector3::new(0.0, -ANKLE_HEIGHT, -0.05);

/// A foot at one moment, hips above z = 0.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Foot {
    /// Ankle: x from the walking line, y from the ground, z ahead of the hips, metres.
    pub ankle: Vector3<f64>,
    /// Turn of the foot about the left axis, heel up positive, radians.
    pub pitch: f64,
    /// The same of the toes.
    pub toe_pitch: f64,
}

impl Foot {
    /// Joint of the ball of the foot seen from the ankle with a flat sole, metres.
    pub const BALL: Vector3<f64> = Vector3::new(0.0, -0.06, 0.13);
    /// How far feet point outward, radians.
    pub const TOE_OUT: f64 = 0.1;

    /// The ankle of the left (1) or right (-1) foot.
    pub fn ankle_on(&self, side: f64) -> Vector3<f64> {
        Vector3::new(self.ankle.x * side, self.ankle.y, self.ankle.z)
    }
}

/// The gait of a walker with a given stride (two steps, metres).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Gait {
    pub stride: f64,
}

impl Gait {
    pub fn new(stride: f64) -> Self {
        Self { stride }
    }

    /// The left foot at `phase` of the cycle (0 is its heel strike), as seen from the walker.
    pub fn foot(self, phase: f64) -> Foot {
        let phase = phase.rem_euclid(1.0);
        if phase <= STANCE { self.planted(phase) } else { self.swing(phase) }
    }

    /// On the ground: the sole stays where it is while the walker passes.
    fn planted(self, phase: f64) -> Foot {
        // the flat ankle is below the hips somewhat before the middle of stance
        let planted = self.stride * (0.25 - phase);
        let flat = Vector3::new(0.075, ANKLE_HEIGHT, planted);
        if phase < FLAT {
            let left = 1.0 - phase / FLAT;
            let pitch = STRIKE_PITCH * left * left;
            return Foot { ankle: flat + rolled(HEEL, pitch), pitch, toe_pitch: pitch };
        }
        let off = ((phase - HEEL_OFF) / (STANCE - HEEL_OFF)).clamp(0.0, 1.0);
        let pitch = TOE_OFF_PITCH * off * off;
        // the toes stay flat until the end of stance, then follow
        Foot { ankle: flat + rolled(Foot::BALL, pitch), pitch, toe_pitch: 0.0 }
    }

    /// In the air: a smooth path from toe-off to the next heel strike, velocities continuous.
    fn swing(self, phase: f64) -> Foot {
        const STEP: f64 = 1e-4;
        let (from, to) = (self.planted(STANCE), self.planted(0.0));
        let (before, after) = (self.planted(STANCE - STEP), self.planted(STEP));
        let (span, at) = (1.0 - STANCE, (phase - STANCE) / (1.0 - STANCE));
        let leaving = (from.ankle - before.ankle) * (span / STEP);
        let landing = (after.ankle - to.ankle) * (span / STEP);
        let lift = Vector3::y() * CLEARANCE * (std::f64::consts::PI * at).sin().powi(2);
        // Pitch rises a little on after toe-off, then falls to the strike.
        let rate = (from.pitch - before.pitch) * (span / STEP);
        let strike_rate = (after.pitch - to.pitch) * (span / STEP);
        let pitch = hermite(from.pitch, to.pitch, rate, strike_rate, at);
        let toes = hermite(0.0, to.toe_pitch, 0.0, strike_rate, at) + 0.5 * pitch.max(0.0) * at * (1.0 - at) * 4.0;
        let axis = |k: usize| hermite(from.ankle[k], to.ankle[k], leaving[k], landing[k], at);
        Foot { ankle: Vector3::new(axis(0), axis(1), axis(2)) + lift, pitch, toe_pitch: toes }
    }
}

/// How the ankle moves when the foot turns by `pitch` about the point `pivot` of the sole.
fn rolled(pivot: Vector3<f64>, pitch: f64) -> Vector3<f64> {
    let (sin, cos) = pitch.sin_cos();
    let turned = Vector3::new(pivot.x, cos * pivot.y - sin * pivot.z, sin * pivot.y + cos * pivot.z);
    pivot - turned
}

/// Cubic from `a` to `b` with slopes `da` and `db`, at 0 to 1.
fn hermite(a: f64, b: f64, da: f64, db: f64, at: f64) -> f64 {
    let (s, t) = (at * at, at * at * at);
    a * (2.0 * t - 3.0 * s + 1.0) + b * (3.0 * s - 2.0 * t) + da * (t - 2.0 * s + at) + db * (t - s)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_path_is_continuous_and_above_the_ground() {
        let gait = Gait::new(1.2);
        let mut before = gait.foot(0.0);
        for i in 1..=2000 {
            let foot = gait.foot(f64::from(i) / 2000.0);
            assert!((foot.ankle - before.ankle).norm() < 0.003, "at {i}: {foot:?} after {before:?}");
            assert!((foot.pitch - before.pitch).abs() < 0.02);
            let ball = foot.ankle + Foot::BALL - rolled(Foot::BALL, foot.pitch);
            assert!(ball.y > 0.015, "ball of the foot at {} m, phase {i}", ball.y);
            let heel = foot.ankle + HEEL - rolled(HEEL, foot.pitch);
            assert!(heel.y > -0.001, "heel at {} m, phase {i}", heel.y);
            before = foot;
        }
    }

    #[test]
    fn the_sole_does_not_slide_while_it_stands() {
        let gait = Gait::new(1.2);
        for i in 0..100 {
            let phase = STANCE * f64::from(i) / 100.0;
            let foot = gait.foot(phase);
            let pivot = if phase < FLAT { HEEL } else { Foot::BALL };
            let on_ground = foot.ankle + pivot - rolled(pivot, foot.pitch) + Vector3::z() * gait.stride * phase;
            let expected = 0.25 * gait.stride + pivot.z;
            assert!((on_ground.z - expected).abs() < 1e-9, "phase {phase}: {on_ground}");
        }
    }
}
