//! `subject.toml`.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::{
    comments::keep_comments,
    consent::Consent,
    layer::{Layer, check_name},
};
use crate::{
    CaptureError,
    files::{atomic_write, is_there, read_text},
};

/// The content of `subject.toml`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct About {
    pub(super) name: String,
    #[serde(default)]
    pub(super) date: String,
    #[serde(default)]
    pub(super) rig: String,
    #[serde(default)]
    pub(super) notes: String,
    /// Whether and until when the subject may be processed and kept.
    #[serde(flatten)]
    pub(super) consent: Consent,
    /// Fields that mean nothing to this program; they are kept.
    #[serde(flatten)]
    pub(super) unknown: toml::Table,
    #[serde(default)]
    pub(super) layers: Vec<Layer>,
}

impl About {
    /// Reads the file of a subject's folder.
    pub(super) fn read(folder: &Path) -> Result<Self, CaptureError> {
        let path = path(folder);
        if !is_there(&path) {
            return Err(CaptureError::format(folder, "is not a subject folder: it has no subject.toml"));
        }
        Self::parse(&read_text(&path)?).map_err(|reason| CaptureError::format(&path, reason))
    }

    /// Reads the file's text; layers get their numbers.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        let mut about: Self = parse_toml(text)?;
        about.layers.iter_mut().enumerate().for_each(|(number, layer)| layer.number = number);
        for (number, layer) in about.layers.iter().enumerate() {
            check_name(&layer.name)?;
            if about.layers[..number].iter().any(|other| other.name == layer.name) {
                return Err(format!("two layers are called `{}`; every layer needs a name of its own", layer.name));
            }
        }
        Ok(about)
    }

    /// Writes the file, whole or not at all. Comments of the one that it replaces stay.
    pub(super) fn write(&self, folder: &Path) -> Result<(), CaptureError> {
        atomic_write(&path(folder), self.text(folder, Some)?.as_bytes())
    }

    /// The text that takes the place of the file in `folder`, with its comments; `moved` says where a layer of the file went.
    pub(super) fn text(&self, folder: &Path, moved: impl Fn(usize) -> Option<usize>) -> Result<String, CaptureError> {
        let path = path(folder);
        let text = toml::to_string(self).map_err(|error| CaptureError::format(&path, error.to_string()))?;
        let old = if is_there(&path) { read_text(&path)? } else { String::new() };
        Ok(keep_comments(&old, &text, moved))
    }

    /// The fields that mean nothing to this program, such as misspelt ones.
    pub(super) fn unknown_fields(&self) -> Vec<String> {
        let of_layer = |layer: &Layer| {
            let label = layer.label();
            layer.unknown.keys().map(|key| format!("`{key}` of layer {label}")).collect::<Vec<_>>()
        };
        let own = self.unknown.keys().map(|key| format!("`{key}`"));
        own.chain(self.layers.iter().flat_map(of_layer)).collect()
    }
}

/// Where the file stands.
pub(super) fn path(folder: &Path) -> PathBuf {
    folder.join("subject.toml")
}

/// Reads TOML; the error names the line.
pub(super) fn parse_toml<T: serde::de::DeserializeOwned>(text: &str) -> Result<T, String> {
    toml::from_str(text).map_err(|error| {
        let before = error.span().and_then(|span| text.get(..span.start)).unwrap_or("");
        format!("line {}: {}", 1 + before.matches('\n').count(), error.message().replace('\n', "; "))
    })
}
