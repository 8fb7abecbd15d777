//! A subject on disk: one person at one visit.
//!
//! ```text
//! SUBJECT/
//!   subject.toml                 name, date, rig, the layers in order with their types, notes
//!   takes/00-body.mcap           one recording a take; never changed after it is closed
//!   takes/rejected/              takes that were replaced
//!   edits/01-trousers.json       corrections by hand
//!   build/                       everything in here can be deleted and built again
//! ```

use std::{
    fs,
    path::{Path, PathBuf},
    time::{SystemTime, UNIX_EPOCH},
};

use serde::{Deserialize, Serialize};

use crate::{CaptureError, GarmentType, atomic_write, atomic_write::sync_parent};

/// Name of the layer of take 0.
pub const BODY: &str = "body";

/// What a take added, in the order of the takes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Layer {
    /// Number of the take: 0 is the body.
    #[serde(skip)]
    pub number: usize,
    /// Name without the number: `body`, `trousers`.
    pub name: String,
    /// What garment it is; `None` for the body, or where nobody said and the name does not tell.
    #[serde(rename = "type", default, skip_serializing_if = "Option::is_none")]
    pub garment: Option<GarmentType>,
    /// How thick the garment's cloth is, millimetres; `None` where nobody said: then its type tells.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub thickness_mm: Option<f32>,
    /// Free text.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub notes: String,
}

impl Layer {
    /// Name with the number, as files, folders and mesh nodes carry it: `01-trousers`; `00-body`.
    pub fn label(&self) -> String {
        format!("{:02}-{}", self.number, self.name)
    }
}

/// What `subject.toml` says.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
struct About {
    name: String,
    #[serde(default)]
    date: String,
    #[serde(default)]
    rig: String,
    #[serde(default)]
    notes: String,
    #[serde(default)]
    layers: Vec<Layer>,
}

/// A take that is being recorded; [`Subject::accept`] makes it part of the subject.
#[derive(Debug, Clone, PartialEq)]
pub struct PendingTake {
    /// The layer it will be.
    pub layer: Layer,
    /// Where to record to.
    pub path: PathBuf,
    retake: bool,
}

/// A subject's folder.
#[derive(Debug, Clone, PartialEq)]
pub struct Subject {
    folder: PathBuf,
    about: About,
}

impl Subject {
    /// Opens a subject. A take that was recorded but not yet entered in `subject.toml` when the program was killed is
    /// entered; a retake that was interrupted between its two renames is completed.
    ///
    /// # Errors
    /// [`CaptureError`] where there is no subject or its `subject.toml` is not readable.
    pub fn open(folder: &Path) -> Result<Self, CaptureError> {
        let path = folder.join("subject.toml");
        let text = fs::read_to_string(&path).map_err(|error| match error.kind() {
            std::io::ErrorKind::NotFound => {
                CaptureError::format(folder, "is no subject: there is no subject.toml in it")
            }
            _ => CaptureError::io(&path, error),
        })?;
        let mut about: About = toml::from_str(&text).map_err(|error| {
            let line = error.span().map_or(1, |span| 1 + text[..span.start.min(text.len())].matches('\n').count());
            CaptureError::format(&path, format!("line {line}: {}", error.message().replace('\n', "; ")))
        })?;
        about.layers.iter_mut().enumerate().for_each(|(number, layer)| layer.number = number);
        if let Some(layer) = about.layers.iter().find(|layer| check_name(&layer.name).is_err()) {
            return Err(CaptureError::format(&path, format!("`{}` is no layer name", layer.name)));
        }
        let mut subject = Self { folder: folder.to_path_buf(), about };
        subject.complete_retakes()?;
        subject.adopt_takes()?;
        Ok(subject)
    }

    /// Creates a subject that is called like its folder, dated today.
    ///
    /// # Errors
    /// [`CaptureError`] where it exists already or cannot be written.
    pub fn create(folder: &Path) -> Result<Self, CaptureError> {
        if Self::exists(folder) {
            return Err(CaptureError::format(folder, "the subject exists already"));
        }
        let absolute = std::path::absolute(folder).map_err(|error| CaptureError::io(folder, error))?;
        let name = absolute.file_name().map_or_else(|| "subject".into(), |name| name.to_string_lossy().into_owned());
        let subject = Self { folder: folder.to_path_buf(), about: About { name, date: today(), ..About::default() } };
        subject.save()?;
        Ok(subject)
    }

    /// Opens a subject, or creates it where it is missing.
    ///
    /// # Errors
    /// As [`Self::open`] and [`Self::create`].
    pub fn open_or_create(folder: &Path) -> Result<Self, CaptureError> {
        if Self::exists(folder) { Self::open(folder) } else { Self::create(folder) }
    }

    /// True where a folder is a subject.
    pub fn exists(folder: &Path) -> bool {
        folder.join("subject.toml").is_file()
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The subject's name.
    pub fn name(&self) -> &str {
        &self.about.name
    }

    /// Date of the visit, `YYYY-MM-DD`.
    pub fn date(&self) -> &str {
        &self.about.date
    }

    /// What the rig is called; empty until it is known.
    pub fn rig(&self) -> &str {
        &self.about.rig
    }

    /// Free text.
    pub fn notes(&self) -> &str {
        &self.about.notes
    }

    /// Sets what the rig is called and saves.
    ///
    /// # Errors
    /// [`CaptureError`] where `subject.toml` cannot be written.
    pub fn set_rig(&mut self, rig: &str) -> Result<(), CaptureError> {
        self.about.rig = rig.to_string();
        self.save()
    }

    /// The layers in the order of their takes.
    pub fn layers(&self) -> &[Layer] {
        &self.about.layers
    }

    /// The layer of that name (with or without its number).
    pub fn layer(&self, name: &str) -> Option<&Layer> {
        self.about.layers.iter().find(|layer| layer.name == name || layer.label() == name)
    }

    /// `takes/NN-name.mcap`.
    pub fn take_path(&self, layer: &Layer) -> PathBuf {
        self.folder.join("takes").join(format!("{}.mcap", layer.label()))
    }

    /// `edits/NN-name.json`.
    pub fn edits_path(&self, layer: &Layer) -> PathBuf {
        self.folder.join("edits").join(format!("{}.json", layer.label()))
    }

    /// `build/`.
    pub fn build_path(&self) -> PathBuf {
        self.folder.join("build")
    }

    /// `build/NN-name/`.
    pub fn build_folder(&self, layer: &Layer) -> PathBuf {
        self.build_path().join(layer.label())
    }

    /// The next take, to be recorded to [`PendingTake::path`] and then given to [`Self::accept`]. `name` comes without a
    /// number; where `garment` is `None`, the name may tell it (`jeans` are trousers).
    ///
    /// # Errors
    /// [`CaptureError`] where the name is unusable or taken, or the first take is not the body.
    pub fn next_take(&self, name: &str, garment: Option<GarmentType>) -> Result<PendingTake, CaptureError> {
        let name = plain_name(name);
        check_name(name).map_err(|reason| CaptureError::format(&self.folder, reason))?;
        if self.layer(name).is_some() {
            let reason =
                format!("there is a layer `{name}` already; replace its take with --retake or choose another name");
            return Err(CaptureError::format(&self.folder, reason));
        }
        let number = self.about.layers.len();
        if (number == 0) != (name == BODY) {
            let reason =
                "take 0 is the body in underwear: import it first, with --layer body, and only it by that name";
            return Err(CaptureError::format(&self.folder, reason));
        }
        let garment = garment.or_else(|| GarmentType::from_layer_name(name)).filter(|_| number > 0);
        let layer = Layer { number, name: name.to_string(), garment, thickness_mm: None, notes: String::new() };
        let path = self.take_path(&layer);
        Ok(PendingTake { layer, path, retake: false })
    }

    /// A new take of an existing layer, to be recorded to [`PendingTake::path`] and then given to [`Self::accept`]: only
    /// then does the old one move to `takes/rejected/`.
    ///
    /// # Errors
    /// [`CaptureError`] where there is no such layer.
    pub fn retake(&self, name: &str, garment: Option<GarmentType>) -> Result<PendingTake, CaptureError> {
        let Some(layer) = self.layer(name) else {
            let names: Vec<_> = self.about.layers.iter().map(|layer| layer.name.as_str()).collect();
            let reason = format!("there is no layer `{name}` to retake; there are: {}", names.join(", "));
            return Err(CaptureError::format(&self.folder, reason));
        };
        let mut layer = layer.clone();
        layer.garment = garment.filter(|_| layer.number > 0).or(layer.garment);
        let path = self.retake_path(&layer);
        if path.exists() {
            // Recorded, but never accepted (the program ended between): nothing that was captured is lost.
            self.reject(&path, &layer)?;
        }
        Ok(PendingTake { layer, path, retake: true })
    }

    /// Makes a finished recording part of the subject; returns where a replaced take was kept.
    ///
    /// # Errors
    /// [`CaptureError`] where the recording is missing or the files cannot be moved.
    pub fn accept(&mut self, take: PendingTake) -> Result<Option<PathBuf>, CaptureError> {
        if !take.path.is_file() {
            return Err(CaptureError::format(&take.path, "the take was not recorded"));
        }
        let kept = if take.retake { self.replace_take(&take.layer)? } else { None };
        match self.about.layers.get_mut(take.layer.number) {
            Some(layer) => *layer = take.layer,
            None => self.about.layers.push(take.layer),
        }
        self.save()?;
        Ok(kept)
    }

    /// Writes `subject.toml`, whole or not at all.
    ///
    /// # Errors
    /// [`CaptureError`] where it cannot be written.
    pub fn save(&self) -> Result<(), CaptureError> {
        let path = self.folder.join("subject.toml");
        let text = toml::to_string(&self.about).map_err(|error| CaptureError::format(&path, error.to_string()))?;
        atomic_write(&path, text.as_bytes())
    }

    fn retake_path(&self, layer: &Layer) -> PathBuf {
        self.folder.join("takes").join(format!("{}.retake.mcap", layer.label()))
    }

    /// Moves the old take away and the new one to its place.
    fn replace_take(&self, layer: &Layer) -> Result<Option<PathBuf>, CaptureError> {
        let (old, new) = (self.take_path(layer), self.retake_path(layer));
        let kept = if old.exists() { Some(self.reject(&old, layer)?) } else { None };
        fs::rename(&new, &old).map_err(|error| CaptureError::io(&new, error))?;
        sync_parent(&old)?;
        Ok(kept)
    }

    fn reject(&self, old: &Path, layer: &Layer) -> Result<PathBuf, CaptureError> {
        let folder = self.folder.join("takes/rejected");
        fs::create_dir_all(&folder).map_err(|error| CaptureError::io(&folder, error))?;
        let free = (1_u32..).map(|n| folder.join(format!("{}.{n}.mcap", layer.label()))).find(|path| !path.exists());
        let free = free.ok_or_else(|| CaptureError::format(&folder, "there is no free name left"))?;
        fs::rename(old, &free).map_err(|error| CaptureError::io(old, error))?;
        sync_parent(&free)?;
        Ok(free)
    }

    fn complete_retakes(&self) -> Result<(), CaptureError> {
        for layer in &self.about.layers {
            if !self.take_path(layer).exists() && self.retake_path(layer).is_file() {
                self.replace_take(layer)?;
            }
        }
        Ok(())
    }

    fn adopt_takes(&mut self) -> Result<(), CaptureError> {
        let Ok(entries) = fs::read_dir(self.folder.join("takes")) else { return Ok(()) };
        let mut names: Vec<String> =
            entries.flatten().filter_map(|entry| entry.file_name().into_string().ok()).collect();
        names.sort();
        let before = self.about.layers.len();
        for file in names {
            let number = self.about.layers.len();
            let Some(name) = file.strip_suffix(".mcap").and_then(|stem| stem.strip_prefix(&format!("{number:02}-")))
            else {
                continue;
            };
            if check_name(name).is_ok() {
                let garment = GarmentType::from_layer_name(name).filter(|_| number > 0);
                self.about.layers.push(Layer {
                    number,
                    name: name.to_string(),
                    garment,
                    thickness_mm: None,
                    notes: String::new(),
                });
            }
        }
        if self.about.layers.len() > before { self.save() } else { Ok(()) }
    }
}

/// A name without a number before it.
fn plain_name(name: &str) -> &str {
    match name.split_once('-') {
        Some((number, rest)) if number.len() == 2 && number.bytes().all(|b| b.is_ascii_digit()) => rest,
        _ => name,
    }
}

fn check_name(name: &str) -> Result<(), String> {
    let good = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-' || c == '_';
    if !name.is_empty() && name.len() <= 40 && name.chars().all(good) && !name.starts_with('-') {
        return Ok(());
    }
    Err(format!("`{name}` is no layer name: use up to 40 of a-z, 0-9, - and _, such as `trousers`"))
}

/// Today's date, UTC, `YYYY-MM-DD`.
fn today() -> String {
    let seconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
    date_of_day(seconds / 86_400)
}

/// Civil date of a day after 1970-01-01 (Howard Hinnant, "chrono-compatible low-level date algorithms").
fn date_of_day(day: u64) -> String {
    let day = day + 719_468;
    let era = day / 146_097;
    let day_of_era = day % 146_097;
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted = (5 * day_of_year + 2) / 153;
    let date = day_of_year - (153 * shifted + 2) / 5 + 1;
    let month = if shifted < 10 { shifted + 3 } else { shifted - 9 };
    let year = era * 400 + year_of_era + u64::from(month <= 2);
    format!("{year:04}-{month:02}-{date:02}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_of_known_days() {
        assert_eq!(date_of_day(0), "1970-01-01");
        assert_eq!(date_of_day(11_016), "2000-02-29");
        assert_eq!(date_of_day(20_454), "2026-01-01");
    }
}
