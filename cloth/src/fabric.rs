//! What a sheet is made of.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::ClothError;

/// The table that ships with the crate; its comments say where the values are from.
const TABLE: &str = include_str!("fabrics.toml");

/// Properties of a cloth, in SI units.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fabric {
    /// Area density, kg/m².
    pub density: f64,
    /// Membrane stiffness along warp and weft, N/m.
    pub stretch: f64,
    /// Shear stiffness, N/m per radian.
    pub shear: f64,
    /// Flexural rigidity per unit width, N·m.
    pub bending: f64,
    /// Thickness, metres.
    pub thickness: f64,
    /// Coulomb's coefficient of friction.
    pub friction: f64,
    /// Rate at which motion against the neighbours dies down, 1/s.
    pub damping: f64,
}

impl Fabric {
    /// A fabric of the table: `shirting`, `jersey`, `denim`, `coating`, `silk`, `leather`.
    ///
    /// # Errors
    /// [`ClothError::Fabric`] names the fabrics that there are.
    pub fn named(name: &str) -> Result<Self, ClothError> {
        let table = read_fabrics(TABLE, "of the table")?;
        table.get(name).copied().ok_or_else(|| {
            let known: Vec<&str> = table.keys().map(String::as_str).collect();
            ClothError::Fabric {
                fabric: name.into(),
                reason: format!("not in the table, which has {}", known.join(", ")),
            }
        })
    }

    /// Peirce's bending length c = (G / w)^(1/3), metres: how far the cloth reaches before it bends under its own weight
    /// (F. T. Peirce 1930; ASTM D1388).
    pub fn bending_length(&self, gravity: f64) -> f64 {
        (self.bending / (self.density * gravity)).cbrt()
    }

    /// Checks that every property is within its range.
    ///
    /// # Errors
    /// [`ClothError::Fabric`] names the first one that is not.
    pub fn check(&self, name: &str) -> Result<(), ClothError> {
        let at_least_zero = [
            ("shear", self.shear),
            ("bending", self.bending),
            ("thickness", self.thickness),
            ("friction", self.friction),
            ("damping", self.damping),
        ];
        let positive = [("density", self.density), ("stretch", self.stretch)];
        let wrong = |reason: String| ClothError::Fabric { fabric: name.into(), reason };
        if let Some((what, v)) = positive.into_iter().find(|(_, v)| !(v.is_finite() && *v > 0.0)) {
            return Err(wrong(format!("{what} is {v}; it must be a positive number")));
        }
        match at_least_zero.into_iter().find(|(_, v)| !(v.is_finite() && *v >= 0.0)) {
            Some((what, v)) => Err(wrong(format!("{what} is {v}; it must be a number of at least 0"))),
            None => Ok(()),
        }
    }
}

/// Reads a table of fabrics (TOML, one table a fabric); `file` is named in errors.
///
/// # Errors
/// [`ClothError::Fabric`] where the text is not such a table, or a property is missing, unknown or outside of its range.
pub fn read_fabrics(text: &str, file: &str) -> Result<BTreeMap<String, Fabric>, ClothError> {
    let table: BTreeMap<String, Fabric> = toml::from_str(text)
        .map_err(|e| ClothError::Fabric { fabric: file.into(), reason: e.to_string().trim().replace('\n', " ") })?;
    table.iter().try_for_each(|(name, fabric)| fabric.check(name))?;
    Ok(table)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fabric_of_the_table_is_within_its_ranges() {
        let table = read_fabrics(TABLE, "table").unwrap();
        assert_eq!(table.len(), 6);
        // Bending lengths of clothing lie between 10 and 60 mm.
        for (name, fabric) in &table {
            let c = fabric.bending_length(9.81);
            assert!((0.010..0.060).contains(&c), "{name}: {c}");
        }
    }

    #[test]
    fn a_wrong_fabric_is_named() {
        let bad = "[felt]\ndensity = 0.3\nstretch = 400.0\nshear = 40.0\nbending = -1e-6\nthickness = 0.002\nfriction = 0.4\ndamping = 1.0\n";
        let error = read_fabrics(bad, "mine.toml").unwrap_err().to_string();
        assert!(error.contains("felt") && error.contains("bending is -0.000001"), "{error}");
        assert!(Fabric::named("tweed").unwrap_err().to_string().contains("denim"));
        assert!(read_fabrics("[x]\ndensity = 1.0\n", "mine.toml").unwrap_err().to_string().contains("mine.toml"));
    }
}
