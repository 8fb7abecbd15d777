//! Layers and their names.

use serde::{Deserialize, Serialize};

use crate::printable;

/// Name of the layer of take 0, unless the person is dressed in it, as soon as the takes are in the order in which garments are
/// put on.
pub const BODY: &str = "body";

/// The addition of a take, in the order of the takes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Layer {
    /// Number of the take: 0 is the body, or where that was never recorded undressed, the first clothes.
    #[serde(skip)]
    pub number: usize,
    /// Name without the number: `body`, `trousers`.
    pub name: String,
    /// Type of the garment, as text (`GarmentType` of the character crate names them); `None` for the body, or where nobody
    /// said.
    #[serde(rename = "type", default, skip_serializing_if = "Option::is_none")]
    pub garment: Option<String>,
    /// How thick the garment's cloth is, millimetres; `None` where nobody said: then its type decides.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub thickness_mm: Option<f32>,
    /// Free text.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub notes: String,
    /// Fields that mean nothing to this program; they are kept.
    #[serde(flatten)]
    pub(super) unknown: toml::Table,
}

impl Layer {
    /// Layer `number` called `name`, of type `garment`; the body is never a garment.
    pub(super) fn new(number: usize, name: &str, garment: Option<&str>) -> Self {
        let garment = garment.filter(|_| name != BODY).map(String::from);
        Self {
            number,
            name: name.to_string(),
            garment,
            thickness_mm: None,
            notes: String::new(),
            unknown: toml::Table::new(),
        }
    }

    /// Name with the number, as files, folders and mesh nodes carry it: `01-trousers`; `00-body`.
    pub fn label(&self) -> String {
        format!("{:02}-{}", self.number, self.name)
    }
}

/// Splits `03-coat` into 3 and `coat`; a name without two digits before it has no number.
pub(super) fn split_number(name: &str) -> (Option<usize>, &str) {
    match name.split_once('-') {
        Some((number, rest)) if number.len() == 2 && number.bytes().all(|b| b.is_ascii_digit()) => {
            (number.parse().ok(), rest)
        }
        _ => (None, name),
    }
}

/// Checks that a name can be part of file names.
///
/// # Errors
/// A sentence that says which names are possible.
pub(super) fn check_name(name: &str) -> Result<(), String> {
    let good = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-' || c == '_';
    if !name.is_empty() && name.len() <= 40 && name.chars().all(good) && !name.starts_with('-') {
        return Ok(());
    }
    Err(format!(
        "`{}` is not a layer name: use 1 to 40 of the characters a-z, 0-9, - and _, such as `trousers`",
        printable(name)
    ))
}
