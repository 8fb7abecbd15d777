//! How a primitive's strength falls with distance (paper 002 §1; soft objects and metaballs).

use std::{fmt, str::FromStr};

/// Where the skin lies: the value of the field on the surface.
pub const THRESHOLD: f64 = 0.5;

/// A field function with local support: 1 at the centre, falling smoothly to 0 at the edge of its influence.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum FieldFunction {
    /// Wyvill, McPheeters and Wyvill (1986), "Data structure for soft objects": a polynomial in the squared distance.
    #[default]
    Wyvill,
    /// Nishimura et al. (1985), "Object modeling by distribution function": metaballs, two parabolas.
    Nishimura,
}

impl FieldFunction {
    /// All functions.
    pub const ALL: [Self; 2] = [Self::Wyvill, Self::Nishimura];

    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Wyvill => "wyvill",
            Self::Nishimura => "nishimura",
        }
    }

    /// Radius of influence of a primitive that stands alone, in radii of its surface: the function is [`THRESHOLD`] at
    /// 1 / this. Wyvill's is ½ at half of the influence; Nishimura's, 1½ (1 − r)², at r = 1 − √⅓.
    pub fn influence(self) -> f64 {
        match self {
            Self::Wyvill => 2.0,
            Self::Nishimura => 1.0 / (1.0 - (1.0f64 / 3.0).sqrt()),
        }
    }

    /// Value at squared distance `s`, in units of the squared radius of influence (0 and more).
    #[inline]
    pub fn value(self, s: f64) -> f64 {
        if s >= 1.0 {
            return 0.0;
        }
        match self {
            Self::Wyvill => 1.0 + s * (-22.0 / 9.0 + s * (17.0 / 9.0 - s * (4.0 / 9.0))),
            Self::Nishimura if s <= 1.0 / 9.0 => 1.0 - 3.0 * s,
            Self::Nishimura => 1.5 * (1.0 - s.sqrt()).powi(2),
        }
    }

    /// Derivative of [`Self::value`] by `s`.
    #[inline]
    pub fn slope(self, s: f64) -> f64 {
        if s >= 1.0 {
            return 0.0;
        }
        match self {
            Self::Wyvill => -22.0 / 9.0 + s * (34.0 / 9.0 - s * (12.0 / 9.0)),
            Self::Nishimura if s <= 1.0 / 9.0 => -3.0,
            Self::Nishimura => 1.5 * (1.0 - 1.0 / s.sqrt()),
        }
    }
}

impl fmt::Display for FieldFunction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for FieldFunction {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|f| f.name() == name);
        found.ok_or_else(|| format!("`{name}` is no field function; use wyvill or nishimura"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_functions_fall_from_one_to_zero_and_are_half_on_the_surface() {
        for f in FieldFunction::ALL {
            let at = |r: f64| f.value(r * r);
            assert_eq!((at(0.0), at(1.0), at(1.5)), (1.0, 0.0, 0.0), "{f}");
            assert!((at(1.0 / f.influence()) - THRESHOLD).abs() < 1e-12, "{f}");
            assert!((1..100).all(|k| at(f64::from(k) * 0.01) < at(f64::from(k - 1) * 0.01)), "{f}");
            assert!(at(1.0 - 1e-6) < 1e-10, "{f} ends smoothly");
        }
        // by the formulas as they are printed, at a distance that neither was fitted at
        let r = 0.3f64;
        let wyvill = 1.0 - 4.0 / 9.0 * r.powi(6) + 17.0 / 9.0 * r.powi(4) - 22.0 / 9.0 * r.powi(2);
        assert!((FieldFunction::Wyvill.value(r * r) - wyvill).abs() < 1e-15);
        assert!((FieldFunction::Nishimura.value(r * r) - (1.0 - 3.0 * r * r)).abs() < 1e-15);
        assert!((FieldFunction::Nishimura.value(0.49) - 1.5 * 0.09).abs() < 1e-12);
    }

    #[test]
    fn slopes_are_those_of_finite_differences() {
        for f in FieldFunction::ALL {
            for s in [0.02, 0.1, 0.2, 0.5, 0.9, 0.999] {
                let step = 1e-7;
                let difference = (f.value(s + step) - f.value(s - step)) / (2.0 * step);
                assert!((f.slope(s) - difference).abs() < 1e-6, "{f} {s}");
            }
            assert_eq!(f.slope(1.2), 0.0);
        }
    }

    #[test]
    fn names_are_read_back() {
        for f in FieldFunction::ALL {
            assert_eq!(f.name().parse(), Ok(f));
        }
        assert!("blinn".parse::<FieldFunction>().unwrap_err().contains("wyvill or nishimura"));
    }
}
