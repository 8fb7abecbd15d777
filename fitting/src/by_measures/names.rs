//! Which measures may be given, and under which names.

use crate::{FittingError, MeasureTable, measure::definition::MeasureKind, sideless};

/// A measure that a body shall have.
#[derive(Debug, Clone, PartialEq)]
pub struct Wanted {
    /// A name of the measure table, the same without `left` or `right` for both sides, or one of [`ALIASES`].
    pub name: String,
    /// Metres.
    pub value_m: f64,
}

/// Short names and the measures that they stand for.
pub const ALIASES: [(&str, &str); 13] = [
    ("chest", "chest girth"),
    ("bust", "bust girth"),
    ("waist", "waist girth"),
    ("top hip", "top hip girth"),
    ("hip", "hip girth"),
    ("inseam", "crotch height (inside leg length)"),
    ("neck", "neck girth"),
    ("thigh", "thigh girth"),
    ("calf", "calf girth"),
    ("upper arm", "upper arm girth"),
    ("wrist", "wrist girth"),
    ("head", "head girth"),
    ("foot", "foot length"),
];

/// Measures that follow the skeleton alone.
const BONES: [&str; 9] = [
    "stature",
    "back neck height",
    "crotch height (inside leg length)",
    "knee height",
    "shoulder breadth",
    "arm length",
    "hand length",
    "foot length",
    "head girth",
];

/// What a height or a length of bone may be off, and what a girth or a tape over soft parts may be, metres: ISO 20685-1 for large
/// girths and for heights.
const ALLOWED: (f64, f64) = (0.004, 0.009);

/// A measure of the table with the value that it shall have.
#[derive(Debug, Clone)]
pub(super) struct Row {
    pub name: String,
    pub kind: MeasureKind,
    /// Metres.
    pub wanted: f64,
    /// Not asked for, only held.
    pub is_held: bool,
}

impl Row {
    /// How far value and body may differ, metres.
    pub fn allowed(&self) -> f64 {
        match self.kind {
            MeasureKind::Height | MeasureKind::Breadth => ALLOWED.0,
            MeasureKind::Girth | MeasureKind::Length => ALLOWED.1,
        }
    }

    /// The value in a table that has it, metres.
    pub fn of(&self, table: &MeasureTable) -> f64 {
        table.value(&self.name).unwrap_or(f64::NAN)
    }
}

/// The measures of `table` that are meant.
///
/// # Errors
/// [`FittingError::Measure`] for a name that is none, a value that is no length, and a measure that is given twice.
pub(super) fn rows(wanted: &[Wanted], table: &MeasureTable) -> Result<Vec<Row>, FittingError> {
    let mut rows: Vec<Row> = Vec::new();
    for one in wanted {
        if !(one.value_m.is_finite() && one.value_m > 0.0) {
            let reason = format!("{} of {} is no length; give it in metres, above 0", one.name, one.value_m);
            return Err(FittingError::Measure(reason));
        }
        let asked = one.name.trim();
        let full = ALIASES.iter().find(|(short, _)| *short == asked).map_or(asked, |(_, full)| full);
        let meant = table.measures.iter().filter(|m| m.name == full || sideless(&m.name) == full);
        let before = rows.len();
        for m in meant {
            if rows.iter().any(|r| r.name == m.name) {
                return Err(FittingError::Measure(format!("{} is given twice; give it once", m.name)));
            }
            rows.push(Row { name: m.name.clone(), kind: m.kind, wanted: one.value_m, is_held: false });
        }
        if rows.len() == before {
            return Err(FittingError::Measure(unknown(asked, table)));
        }
    }
    Ok(rows)
}

/// Measures of bones, which stay as `table` has them where only girths are asked for: who gains weight does not grow.
pub(super) fn held(asked: &[Row], table: &MeasureTable) -> Vec<Row> {
    if asked.iter().any(|row| row.kind != MeasureKind::Girth) {
        return Vec::new();
    }
    let is_bone = |name: &str| BONES.contains(&sideless(name)) && asked.iter().all(|row| row.name != name);
    let bones = table.measures.iter().filter(|m| is_bone(&m.name));
    bones.map(|m| Row { name: m.name.clone(), kind: m.kind, wanted: m.value_m, is_held: true }).collect()
}

fn unknown(asked: &str, table: &MeasureTable) -> String {
    let mut known: Vec<&str> = table.measures.iter().map(|m| sideless(&m.name)).collect();
    known.dedup();
    known.sort_unstable();
    known.dedup();
    format!("`{asked}` is no measure; those of `toile measure` are: {}", known.join(", "))
}
