//! What a sheet is made of.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use toml::de::{DeTable, DeValue};

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
        let table = read_fabrics(TABLE, "the table", &[])?;
        table.get(name).copied().ok_or_else(|| {
            let known: Vec<&str> = table.keys().map(String::as_str).collect();
            ClothError::Fabric {
                fabric: name.into(),
                reason: format!("not in the table, which has {}", known.join(", ")),
            }
        })
    }

    /// In the order of [`PROPERTIES`].
    fn properties(&self) -> [f64; PROPERTIES.len()] {
        [self.density, self.stretch, self.shear, self.bending, self.thickness, self.friction, self.damping]
    }

    fn of_properties(
        [density, stretch, shear, bending, thickness, friction, damping]: [f64; PROPERTIES.len()],
    ) -> Self {
        Self { density, stretch, shear, bending, thickness, friction, damping }
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

/// The names of a fabric's properties, as they stand in files.
const PROPERTIES: [&str; 7] = ["density", "stretch", "shear", "bending", "thickness", "friction", "damping"];

/// Reads a table of fabrics (TOML, one table a fabric); `file` is named in errors, and the tables called `beside` are passed over.
///
/// A fabric has all properties of [`Fabric`] in SI units, or `like = "NAME"` of a fabric that ships with the crate and those
/// that differ from it.
///
/// # Errors
/// [`ClothError::Fabric`] with the line where the text is not such a table, or a property is missing, unknown or outside of its range.
pub fn read_fabrics(text: &str, file: &str, beside: &[&str]) -> Result<BTreeMap<String, Fabric>, ClothError> {
    let wrong = |fabric: &str, at: usize, reason: String| {
        let line = 1 + text[..at.min(text.len())].matches('\n').count();
        ClothError::Fabric { fabric: fabric.into(), reason: format!("{file}, line {line}: {reason}") }
    };
    let whole = DeTable::parse(text).map_err(|e| {
        wrong("of the file", e.span().map_or(0, |span| span.start), e.message().trim().replace('\n', " "))
    })?;
    let mut table = BTreeMap::new();
    for (name, value) in whole.get_ref().iter().filter(|(name, _)| !beside.contains(&name.get_ref().as_ref())) {
        let fabric_name = name.get_ref().to_string();
        let wrong_here = |at: usize, reason: String| wrong(&fabric_name, at, reason);
        let DeValue::Table(properties) = value.get_ref() else {
            let reason = format!("it is no table; a fabric begins with a line [{fabric_name}]");
            return Err(wrong_here(name.span().start, reason));
        };
        let fabric = fabric_of(properties, name.span().start, &wrong_here)?;
        table.insert(fabric_name, fabric);
    }
    Ok(table)
}

/// The fabric of one table that begins `at` this byte; `wrong` makes an error of a byte and a reason.
fn fabric_of(
    properties: &DeTable,
    at: usize,
    wrong: &impl Fn(usize, String) -> ClothError,
) -> Result<Fabric, ClothError> {
    let known = || PROPERTIES.join(", ");
    let mut values = [None; PROPERTIES.len()];
    for (name, value) in properties {
        let (name, span) = (name.get_ref().as_ref(), value.span());
        if name == "like" {
            let like = value.get_ref().as_str().unwrap_or_default();
            let like = Fabric::named(like).map_err(|e| wrong(span.start, e.to_string()))?.properties();
            values.iter_mut().zip(like).for_each(|(own, like)| *own = own.or(Some(like)));
            continue;
        }
        let Some(k) = PROPERTIES.iter().position(|p| *p == name) else {
            return Err(wrong(span.start, format!("`{name}` is no property of a fabric; there are like, {}", known())));
        };
        let number = match value.get_ref() {
            DeValue::Float(float) => float.as_str().replace('_', "").parse::<f64>().ok(),
            DeValue::Integer(integer) => integer.as_str().replace('_', "").parse::<f64>().ok(),
            _ => None,
        };
        let positive = k < 2;
        match number.filter(|v| v.is_finite() && (*v > 0.0 || !positive && *v == 0.0)) {
            Some(number) => values[k] = Some(number),
            None => {
                let range = if positive { "a positive number" } else { "a number of at least 0" };
                let found = number.map_or("no number".into(), |v| v.to_string());
                return Err(wrong(span.start, format!("{name} is {found}; it must be {range}")));
            }
        }
    }
    if let Some(k) = values.iter().position(Option::is_none) {
        let reason = format!("{} is missing; a fabric has {}, or `like` and what differs", PROPERTIES[k], known());
        return Err(wrong(at, reason));
    }
    Ok(Fabric::of_properties(values.map(Option::unwrap_or_default)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fabric_of_the_table_is_within_its_ranges() {
        let table = read_fabrics(TABLE, "table", &[]).unwrap();
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
        let error = read_fabrics(bad, "mine.toml", &[]).unwrap_err().to_string();
        assert!(error.contains("felt") && error.contains("mine.toml, line 5: bending is -0.000001"), "{error}");
        assert!(Fabric::named("tweed").unwrap_err().to_string().contains("denim"));
        for (text, words) in [
            ("[x]\ndensity = 1.0\n", "line 1: stretch is missing"),
            ("[x]\nlike = \"denim\"\nbend = 1.0\n", "line 3: `bend` is no property"),
            ("[x]\nlike = \"tweed\"\n", "line 2: fabric tweed: not in the table"),
            ("[x]\nlike = \"denim\"\ndensity = 0\n", "line 3: density is 0; it must be a positive number"),
            ("[x]\nlike = \"denim\"\nshear = nan\n", "line 3: shear is NaN; it must be"),
            ("[x]\nlike = \"denim\"\nshear = \"much\"\n", "line 3: shear is no number"),
            ("x = 3\n", "line 1: it is no table"),
            ("[x\n", "line 1"),
        ] {
            let error = read_fabrics(text, "mine.toml", &[]).unwrap_err().to_string();
            assert!(error.contains(&format!("mine.toml, {words}")), "{text}: {error}");
        }
    }

    #[test]
    fn a_fabric_may_be_like_another() {
        let text = "[heavy]\ndensity = 0.5\nlike = \"denim\"\n[garments.skirt]\nfabric = \"heavy\"\n";
        let table = read_fabrics(text, "mine.toml", &["garments"]).unwrap();
        assert_eq!(table["heavy"], Fabric { density: 0.5, ..Fabric::named("denim").unwrap() });
        assert_eq!(table.len(), 1);
    }
}
