//! How the disk turns over a take: at an even rate, unevenly, with a stop, twice round, back and forth, or not at all.

use serde::{Deserialize, Serialize};

/// Share of a take over which the disk comes to rest, and sets off again.
const RAMP: f64 = 0.03;
/// The part of the take in which a stopped disk rests.
const REST: std::ops::Range<f64> = 0.45..0.6;
/// How much an uneven rate swings about its mean, as a share of it.
const SWING: f64 = 0.6;

/// How the disk moves while a take is recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Motion {
    /// One turn, at a rate that varies by a few percent.
    #[default]
    Turn,
    /// One turn at a rate that swings between 0.4 and 1.6 times its mean, as a disk that is pushed by hand.
    Uneven,
    /// One turn in which the disk rests for a seventh of the take.
    Stop,
    /// Two turns.
    Twice,
    /// There, and back again.
    BackAndForth,
    /// The disk rests: for rigs of fixed cameras all around.
    Still,
}

impl Motion {
    /// All of them.
    pub const ALL: [Self; 6] = [Self::Turn, Self::Uneven, Self::Stop, Self::Twice, Self::BackAndForth, Self::Still];

    /// The name on the command line, such as `back-and-forth`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Turn => "turn",
            Self::Uneven => "uneven",
            Self::Stop => "stop",
            Self::Twice => "twice",
            Self::BackAndForth => "back-and-forth",
            Self::Still => "still",
        }
    }

    /// The motion of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|m| m.name() == name)
    }

    /// The rate at a share of the take, 0 to 1, relative to that of an even turn.
    pub(crate) fn rate(self, share: f64) -> f64 {
        match self {
            Self::Turn | Self::Twice => 1.0,
            Self::Uneven => 1.0 + SWING * (2.0 * std::f64::consts::TAU * share).sin(),
            Self::Stop => smooth((REST.start - share) / RAMP) + smooth((share - REST.end) / RAMP),
            Self::BackAndForth => 2.0 * smooth((0.5 - share) / RAMP + 0.5) - 1.0,
            Self::Still => 0.0,
        }
    }

    /// How often the disk goes the whole way that is asked for, added up without signs.
    pub(crate) fn ways(self) -> f64 {
        match self {
            Self::Twice | Self::BackAndForth => 2.0,
            _ => 1.0,
        }
    }
}

/// A smooth step from 0 at 0 to 1 at 1.
fn smooth(x: f64) -> f64 {
    let t = x.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The way over a take of 1000 frames, and its length without signs, in shares of an even turn.
    fn ways(motion: Motion) -> [f64; 2] {
        let rates: Vec<f64> = (0..1000).map(|i| motion.rate((f64::from(i) + 0.5) / 1000.0)).collect();
        [rates.iter().sum::<f64>() / 1000.0, rates.iter().map(|r| r.abs()).sum::<f64>() / 1000.0]
    }

    #[test]
    fn disks_rest_and_turn_back() {
        let [way, length] = ways(Motion::BackAndForth);
        assert!(way.abs() < 1e-9 && length > 0.95, "{way} {length}");
        assert!((0..150).all(|i| Motion::Stop.rate(0.45 + 0.001 * f64::from(i)) == 0.0));
        assert_eq!((Motion::Stop.rate(0.2), Motion::Stop.rate(0.8)), (1.0, 1.0));
        assert!((ways(Motion::Uneven)[0] - 1.0).abs() < 1e-9);
        assert_eq!(ways(Motion::Still), [0.0; 2]);
        assert!(Motion::ALL.iter().all(|m| Motion::from_name(m.name()) == Some(*m)));
    }
}
