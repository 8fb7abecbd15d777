//! The new subject's `subject.toml`.

use std::{fmt::Write, path::Path};

use toile_capture::{
    Subject,
    files::{atomic_write, read_text},
};

use crate::ArchiveError;

/// Writes it: what the layers are, and what was done; nothing that says who it was or when.
pub(super) fn write(subject: &Subject, to: &Path, name: &str) -> Result<(), ArchiveError> {
    let mut text = format!("name = {}\ndate = \"\"\nrig = {}\n", quoted(name), quoted(subject.rig()));
    text.push_str(
        "notes = \"Made anonymous by Toile: colour removed, head replaced by a smooth one, name, date, notes and the device's serial number removed.\"\n",
    );
    text.push_str(&consent(&read_text(&subject.folder().join("subject.toml"))?));
    for layer in subject.layers() {
        let _ = writeln!(text, "\n[[layers]]\nname = {}", quoted(&layer.name));
        if let Some(garment) = &layer.garment {
            let _ = writeln!(text, "type = {}", quoted(garment));
        }
        if let Some(thickness) = layer.thickness_mm {
            let _ = writeln!(text, "thickness_mm = {thickness:?}");
        }
    }
    Ok(atomic_write(&to.join("subject.toml"), text.as_bytes())?)
}

/// The lines about consent and retention, as they stand.
fn consent(old: &str) -> String {
    let own = old.lines().take_while(|line| !line.trim_start().starts_with('['));
    let kept = ["consent", "consent_until", "retain_until"];
    let key = |line: &str| line.split('=').next().unwrap_or_default().trim().to_string();
    own.filter(|line| kept.contains(&key(line).as_str())).map(|line| format!("{line}\n")).collect()
}

/// A string as TOML writes it: JSON's escapes are a part of TOML's.
fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}
