//! Levels of detail: how many contours, and how many points on each (paper 002 §4.3).

/// A level of detail.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Level {
    /// Points on half a contour of the trunk, a multiple of 4; all other numbers follow from it.
    pub half_trunk: usize,
}

/// The levels, finest first.
pub const LEVELS: [Level; 4] =
    [Level { half_trunk: 24 }, Level { half_trunk: 16 }, Level { half_trunk: 12 }, Level { half_trunk: 8 }];

/// Half of the girth of an average trunk, metres (ANSUR II: waist 0.94 m, chest 1.06 m, men): contours lie as far apart as their points
/// do on it.
const HALF_GIRTH: f64 = 0.48;

impl Level {
    /// The level for a body seen from `distance` metres: the coarsest whose points lie less than `pixels` apart on a picture
    /// with `focal` pixels of focal length.
    pub fn at_distance(distance: f64, focal: f64, pixels: f64) -> Self {
        let apart = |level: &Self| level.spacing() * focal / distance.max(1e-3);
        LEVELS.into_iter().rev().find(|level| apart(level) <= pixels).unwrap_or(LEVELS[0])
    }

    /// How far contours lie apart, metres.
    pub fn spacing(self) -> f64 {
        HALF_GIRTH / self.half_trunk as f64
    }

    /// Rows of the chest between armpit and shoulder; a contour of an arm has twice as many points.
    pub fn arm_rows(self) -> usize {
        self.half_trunk / 2
    }

    /// Edges of the seam between the legs; a contour of a leg has half a trunk's besides.
    pub fn seam(self) -> usize {
        self.half_trunk / 2
    }

    /// Edges of a shoulder's ridge.
    pub fn ridge(self) -> usize {
        self.half_trunk / 4
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_farther_the_coarser() {
        let levels: Vec<usize> = [0.5, 3.0, 6.0, 60.0].map(|d| Level::at_distance(d, 1000.0, 8.0).half_trunk).to_vec();
        assert!(levels.windows(2).all(|w| w[0] >= w[1]) && levels[0] == 24 && levels[3] == 8, "{levels:?}");
    }
}
