//! Statements by hand about the body: the content of `SUBJECT/edits/body.json`.

use std::path::Path;

use serde::Deserialize;
use serde_json::{Map, Value};
use toile_capture::{
    files::{atomic_write, is_there},
    subject::BODY,
};
use toile_character::JointRegressor;
use toile_fitting::{FitSettings, HandLandmarks};

use crate::{PipelineError, folders::Folders, json};

/// Statements by hand about the body.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BodyEdits {
    /// 1.
    #[serde(rename = "version")]
    _version: Version,
    /// There is no undressed take: the first one shows the person dressed, and the body is estimated.
    #[serde(default)]
    pub dressed: bool,
    /// Landmarks by the template's names: metres, in the frame of the first take's scan.
    #[serde(default)]
    pub landmarks: HandLandmarks,
    /// Shape components used; without, those of the settings.
    #[serde(default)]
    pub components: Option<usize>,
    /// How joints follow the shape; without, as the settings say.
    #[serde(default)]
    pub joints: Option<JointRegressor>,
}

#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[serde(try_from = "u32")]
struct Version;

impl TryFrom<u32> for Version {
    type Error = String;

    fn try_from(version: u32) -> Result<Self, String> {
        if version == 1 { Ok(Self) } else { Err(format!("version {version}, but this program reads version 1")) }
    }
}

impl BodyEdits {
    /// Reads a file of edits.
    ///
    /// # Errors
    /// [`PipelineError::Format`] with the field that is wrong.
    pub fn read(path: &Path) -> Result<Self, PipelineError> {
        json::read(path)
    }

    /// Those of a subject; none where it has no such file.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn of_subject(folders: &Folders) -> Result<Self, PipelineError> {
        let path = folders.edits(BODY);
        if is_there(&path) { Self::read(&path) } else { Ok(Self::default()) }
    }

    /// Notes in a subject's file that its first take is dressed; whatever else it says stays.
    ///
    /// # Errors
    /// [`PipelineError`] where the file is wrong or cannot be written.
    pub fn say_dressed(folders: &Folders) -> Result<(), PipelineError> {
        let path = folders.edits(BODY);
        let mut said: Map<String, Value> = if is_there(&path) { json::read(&path)? } else { Map::new() };
        said.entry("version").or_insert_with(|| 1.into());
        said.insert("dressed".into(), true.into());
        let folder = path.parent().unwrap_or(&folders.root);
        std::fs::create_dir_all(folder).map_err(|error| PipelineError::io(folder, error))?;
        Ok(atomic_write(&path, &json::pretty(&said)?)?)
    }

    /// The settings of the fit, with what was said by hand.
    pub fn over(&self, settings: &FitSettings) -> FitSettings {
        let mut settings = settings.clone();
        settings.dressed |= self.dressed;
        settings.landmarks.extend(self.landmarks.clone());
        settings.components = self.components.unwrap_or(settings.components);
        settings.joints = self.joints.unwrap_or(settings.joints);
        settings
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn saying_that_a_take_is_dressed_keeps_what_else_was_said() {
        let dir = tempfile::tempdir().unwrap();
        let folders = Folders::new(dir.path());
        assert!(!BodyEdits::of_subject(&folders).unwrap().dressed);
        BodyEdits::say_dressed(&folders).unwrap();
        assert!(BodyEdits::of_subject(&folders).unwrap().dressed);
        let path = folders.edits(BODY);
        std::fs::write(&path, r#"{"version": 1, "components": 15, "landmarks": {"navel": [0, 1, 0.1]}}"#).unwrap();
        BodyEdits::say_dressed(&folders).unwrap();
        let said = BodyEdits::of_subject(&folders).unwrap();
        assert!(said.dressed && said.components == Some(15) && said.landmarks.contains_key("navel"), "{said:?}");
    }
}
