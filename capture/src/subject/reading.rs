//! A subject as it is read.

use std::{
    fs,
    path::{Path, PathBuf},
};

use super::{
    about::{self, About},
    date::today,
    layer::{BODY, Layer, check_name},
    pending::Note,
    reorder_plan::is_reordering,
    scan_take::EXTENSION as SCAN,
};
use crate::{
    CaptureError,
    files::{is_there, open_regular},
    printable_path,
};

/// The extension of recordings.
pub(super) const RECORDING: &str = "mcap";

/// A subject's folder. Reading it changes nothing on disk; [`LockedSubject`](super::LockedSubject) can write.
#[derive(Debug, Clone, PartialEq)]
pub struct Subject {
    pub(super) folder: PathBuf,
    pub(super) about: About,
}

impl Subject {
    /// Opens a subject. A take that was recorded but not yet entered in `subject.toml` when the program was killed
    /// counts as one of its takes.
    ///
    /// # Errors
    /// [`CaptureError`] where the folder is not a subject or its `subject.toml` is not readable.
    pub fn open(folder: &Path) -> Result<Self, CaptureError> {
        let mut subject = Self { folder: folder.to_path_buf(), about: About::read(folder)? };
        subject.adopt_takes();
        Ok(subject)
    }

    /// True where a folder is a subject.
    pub fn exists(folder: &Path) -> bool {
        folder.is_dir() && is_there(&about::path(folder))
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

    /// The name of the rig; empty until it is known.
    pub fn rig(&self) -> &str {
        &self.about.rig
    }

    /// Free text.
    pub fn notes(&self) -> &str {
        &self.about.notes
    }

    /// The layers in the order of their takes.
    pub fn layers(&self) -> &[Layer] {
        &self.about.layers
    }

    /// The layer of that name (with or without its number).
    pub fn layer(&self, name: &str) -> Option<&Layer> {
        self.about.layers.iter().find(|layer| layer.name == name || layer.label() == name)
    }

    /// The take of a layer: `takes/NN-name.mcap`, or where that is a finished scan, the folder `takes/NN-name.scan`.
    pub fn take_path(&self, layer: &Layer) -> PathBuf {
        self.kept(&layer.label()).unwrap_or_else(|| self.takes_folder().join(format!("{}.{RECORDING}", layer.label())))
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

    /// Why the subject may not be processed today, as `consent`, `consent_until` and `retain_until` of `subject.toml` say;
    /// `None` where it may.
    pub fn withheld(&self) -> Option<String> {
        self.about.consent.withheld(&today())
    }

    /// Until when the subject was to be kept, where that day is over.
    pub fn overdue(&self) -> Option<String> {
        self.about.consent.overdue(&today())
    }

    /// What the operator should know of the folder itself, a sentence each: fields of `subject.toml` that mean nothing,
    /// takes that a killed capture left half recorded, and takes in an order that cannot be processed yet.
    pub fn remarks(&self) -> Vec<String> {
        let (file, folder) = (printable_path(&about::path(&self.folder)), printable_path(&self.folder));
        let unknown = self.about.unknown_fields().into_iter();
        let unknown =
            unknown.map(|field| format!("{file}: the field {field} is not known; it is kept, but means nothing"));
        let left = self.interrupted_takes().into_iter().map(|take| {
            let take = printable_path(&take);
            format!(
                "{take} was left by a recording that was interrupted; `toile inspect` shows what is in it, and `toile \
                 import` makes it a take"
            )
        });
        let renamed = is_reordering(&self.folder).then(|| {
            format!(
                "{folder}: its takes were being renamed when the program was interrupted, so some seem to be missing; \
                 `toile process {folder}` goes on with it, as does every command that writes here"
            )
        });
        unknown.chain(left).chain(self.wrong_order()).chain(self.without_body()).chain(renamed).collect()
    }

    /// A sentence where the body's take is not the first, which it has to be before the subject is processed.
    pub fn wrong_order(&self) -> Option<String> {
        let (first, folder) = (self.dressed_first()?, printable_path(&self.folder));
        let body = self.about.layers.iter().position(|layer| layer.name == BODY)?;
        Some(if body + 1 == self.about.layers.len() {
            format!(
                "{folder}: take 0 is {first} and the last take is the body, as where garments were taken off one by one; \
                 `toile reorder {folder} --reverse` puts the takes in the order in which garments are put on"
            )
        } else {
            format!(
                "{folder}: take 0 is {first}, but the body comes first, and then each garment in the order in which it is put \
                 on; `toile reorder {folder} --order body,...` puts the takes in that order"
            )
        })
    }

    /// A sentence where no take shows the body: the person counts as dressed in the first.
    fn without_body(&self) -> Option<String> {
        let (first, folder) = (self.dressed_first()?, printable_path(&self.folder));
        self.about.layers.iter().all(|layer| layer.name != BODY).then(|| {
            format!(
                "{folder}: no take is called `body`, so the person counts as dressed in {first}; where that take shows the body \
                 in underwear, `toile reorder {folder} --names body,...` calls it so, and where garments were taken off one \
                 by one, bring in the others, the body last, and run `toile reorder {folder} --reverse`"
            )
        })
    }

    /// Folder name of the first take where that is not called `body`.
    fn dressed_first(&self) -> Option<String> {
        self.about.layers.first().filter(|layer| layer.name != BODY).map(Layer::label)
    }

    /// Recordings in `takes/` that were not finished and that no process writes any more, by name.
    fn interrupted_takes(&self) -> Vec<PathBuf> {
        let is_part = |path: &PathBuf| {
            path.to_string_lossy().rsplit_once(".mcap.part").is_some_and(|(_, end)| {
                end.is_empty() || end.strip_prefix('.').is_some_and(|n| n.bytes().all(|b| b.is_ascii_digit()))
            })
        };
        let is_left = |path: &PathBuf| {
            open_regular(path).is_ok_and(|file| !matches!(file.try_lock(), Err(fs::TryLockError::WouldBlock)))
        };
        let files = fs::read_dir(self.takes_folder()).into_iter().flatten().flatten().map(|file| file.path());
        let mut takes: Vec<PathBuf> = files.filter(is_part).filter(is_left).collect();
        takes.sort();
        takes
    }

    pub(super) fn takes_folder(&self) -> PathBuf {
        self.folder.join("takes")
    }

    /// Where a new take of an existing layer is recorded to.
    pub(super) fn retake_path(&self, layer: &Layer) -> PathBuf {
        self.takes_folder().join(format!("{}.retake.{RECORDING}", layer.label()))
    }

    /// A new take of an existing layer that was recorded whole and not yet accepted.
    pub(super) fn whole_retake(&self, layer: &Layer) -> Option<PathBuf> {
        self.kept(&format!("{}.retake", layer.label()))
    }

    /// The recording or scan of that name in `takes/`.
    fn kept(&self, stem: &str) -> Option<PathBuf> {
        let at = |extension: &str| self.takes_folder().join(format!("{stem}.{extension}"));
        Some(at(RECORDING)).filter(|path| is_there(path)).or_else(|| Some(at(SCAN)).filter(|path| path.is_dir()))
    }

    /// Enters recordings that no layer has yet: the one that `pending.toml` names with its type, others by name.
    fn adopt_takes(&mut self) {
        let note = Note::read(&self.folder).filter(|note| !note.retake);
        while let Some(name) = self.recorded_name(self.about.layers.len()) {
            let number = self.about.layers.len();
            let noted = note.as_ref().filter(|note| note.number == number && note.layer.name == name);
            if let Some(note) = noted.filter(|_| self.about.rig.is_empty()) {
                self.about.rig = note.rig.clone();
            }
            self.about.layers.push(noted.map_or_else(|| Layer::new(number, &name, None), |note| note.layer.clone()));
        }
    }

    /// The layer name of the take `takes/NN-name.mcap` (or `.scan`) of that number; the first by name where there are several.
    fn recorded_name(&self, number: usize) -> Option<String> {
        let prefix = format!("{number:02}-");
        let name_of = |file: String| {
            let (stem, extension) = file.rsplit_once('.')?;
            let name = stem.strip_prefix(&prefix).filter(|_| [RECORDING, SCAN].contains(&extension))?;
            Some(name.to_string())
        };
        let files = fs::read_dir(self.takes_folder()).ok()?.flatten();
        let names = files.filter_map(|file| file.file_name().into_string().ok()).filter_map(name_of);
        let free = |name: &String| check_name(name).is_ok() && self.layer(name).is_none();
        names.filter(free).min()
    }
}
