//! What decides the result of a whole run beside its takes: program, versions of the steps, settings, layers and edits.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};
use serde_json::Value;
use toile_capture::{Subject, subject::Layer};

use crate::{
    PipelineError, Settings,
    folders::Folders,
    hash, json,
    options::Options,
    resume::PROGRAM,
    settings::{self, FILE_NAME},
    steps::STEPS,
};

/// Everything but the takes that decides the result of a run to the page. Two runs that were asked the same about the same
/// takes give the same bytes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Asked {
    /// Name and version of the program.
    pub program: String,
    /// The version of every step.
    pub steps: BTreeMap<String, u32>,
    /// The resolved settings of all stages.
    pub settings: Value,
    /// Folder names of the takes.
    pub layers: Vec<String>,
    /// SHA-256 of `subject.toml`.
    pub subject: String,
    /// SHA-256 of every file below `edits/`, by its path in the subject's folder.
    pub edits: BTreeMap<String, String>,
    /// SHA-256 of every file below `worn/`, the same way.
    #[serde(default)]
    pub worn: BTreeMap<String, String>,
}

impl Asked {
    /// What a run over the subject at `root` with `options` would be asked now.
    ///
    /// # Errors
    /// [`PipelineError`] where there is no subject, or settings or edits cannot be read.
    pub fn now(root: &Path, options: &Options) -> Result<Self, PipelineError> {
        let settings = settings::read(Some(root), options.settings.as_deref())?;
        let settings = Settings { fusion: options.fusion.over(&settings.fusion), ..settings };
        let layers = Subject::open(root)?.layers().iter().map(Layer::label).collect();
        Self::of(&Folders::new(root), &settings, layers)
    }

    /// What a run with these settings over these layers is asked.
    ///
    /// # Errors
    /// [`PipelineError`] where `subject.toml` or edits cannot be read.
    pub fn of(folders: &Folders, settings: &Settings, layers: Vec<String>) -> Result<Self, PipelineError> {
        Ok(Self {
            program: PROGRAM.into(),
            steps: STEPS.iter().map(|step| (step.name.to_string(), step.version)).collect(),
            settings: json::plain(settings)?,
            layers,
            subject: hash::file(&folders.subject_toml())?,
            edits: hashes_below(&folders.root.join("edits"), folders)?,
            worn: hashes_below(&folders.all_worn(), folders)?,
        })
    }

    /// The steps whose result another question changes, as ranks in [`STEPS`], with the layer where only one is concerned,
    /// and why.
    pub(crate) fn differences(&self, now: &Self) -> Vec<(usize, Option<usize>, String)> {
        if self.program != now.program {
            return vec![(0, None, format!("{} made it, and this is {}", self.program, now.program))];
        }
        let mut found = Vec::new();
        if self.layers != now.layers {
            found.push((0, None, "its takes are other ones".to_string()));
        }
        for (rank, step) in STEPS.iter().enumerate() {
            let was = self.steps.get(step.name);
            if was != Some(&step.version) {
                let was = was.map_or_else(|| "missing".to_string(), |was| format!("of version {was}"));
                found.push((
                    rank,
                    None,
                    format!("its step {} is {was}, and there is version {}", step.name, step.version),
                ));
            }
        }
        for (section, settings) in now.settings.as_object().into_iter().flatten() {
            if self.settings.get(section) != Some(settings) {
                let step = SETTINGS.iter().find(|of| of.0 == section).map_or("", |of| of.1);
                found.push((rank_of(step), None, format!("[{section}] of its settings ({FILE_NAME}) changed")));
            }
        }
        found.extend(self.changed_edits(now));
        if self.worn != now.worn {
            found.push((rank_of("wear"), None, "what is worn without a scan changed".to_string()));
        }
        if self.subject != now.subject && found.is_empty() {
            found.push((STEPS.len(), None, "subject.toml changed".to_string()));
        }
        found
    }

    fn changed_edits(&self, now: &Self) -> Vec<(usize, Option<usize>, String)> {
        let mut found = Vec::new();
        let names = self.edits.keys().chain(now.edits.keys()).collect::<BTreeSet<_>>();
        for name in names.into_iter().filter(|name| self.edits.get(*name) != now.edits.get(*name)) {
            let layer =
                now.layers.iter().position(|layer| name.strip_prefix("edits/") == Some(&format!("{layer}.json")));
            let step = match layer {
                Some(_) => "cut",
                None if name.ends_with("body.json") || name.ends_with("landmarks.json") => "fit",
                None => "export",
            };
            found.push((rank_of(step), layer, format!("{name} changed")));
        }
        found
    }
}

/// Which step the sections of the settings decide first; a section that is not here decides all.
const SETTINGS: [(&str, &str); 7] = [
    ("fusion", "fuse"),
    ("texture", "texture"),
    ("fit", "fit"),
    ("under_clothes", "pose"),
    ("extract", "cut"),
    ("stack", "stack"),
    ("motion", "export"),
];

/// The place of a step in the order of [`STEPS`]; an unknown one counts as the first.
pub(crate) fn rank_of(step: &str) -> usize {
    STEPS.iter().position(|s| s.name == step).unwrap_or(0)
}

/// SHA-256 of every file below `folder`, by its path in the subject's folder.
fn hashes_below(folder: &Path, folders: &Folders) -> Result<BTreeMap<String, String>, PipelineError> {
    let mut files = Vec::new();
    list(folder, &mut files)?;
    let name = |path: &Path| path.strip_prefix(&folders.root).unwrap_or(path).to_string_lossy().into_owned();
    files.iter().map(|path| Ok((name(path), hash::file(path)?))).collect()
}

/// Every regular file below `folder`; links are not followed.
fn list(folder: &Path, files: &mut Vec<PathBuf>) -> Result<(), PipelineError> {
    let entries = match fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(PipelineError::io(folder, error)),
    };
    for entry in entries {
        let entry = entry.map_err(|error| PipelineError::io(folder, error))?;
        let kind = entry.file_type().map_err(|error| PipelineError::io(&entry.path(), error))?;
        if kind.is_dir() {
            list(&entry.path(), files)?;
        } else if kind.is_file() {
            files.push(entry.path());
        }
    }
    Ok(())
}
