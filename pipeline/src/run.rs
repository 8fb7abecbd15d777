//! One run over one subject.

use std::{
    fs,
    path::{Path, PathBuf},
};

use toile_capture::{LockedSubject, subject::Layer};
use toile_garments::GarmentType;
use toile_geometry::{Mesh, obj, ply};

use crate::{Observer, PipelineError, folders::Folders};

/// One run: where things are, what the layers are, where progress is shown.
pub struct Run<'a> {
    /// Where the files lie.
    pub folders: Folders,
    /// Folder names of the takes in their order, such as `00-body`.
    pub layers: Vec<String>,
    /// Where progress is shown.
    pub observer: &'a dyn Observer,
    /// The subject, or `None` for a single recording or scan.
    /// Locked: nothing else writes into the subject's folder meanwhile.
    pub subject: Option<LockedSubject>,
    name: String,
    left_out: Vec<String>,
}

impl<'a> Run<'a> {
    /// Over the subject at `root`, up to the layer called `last` (or with that folder name).
    ///
    /// # Errors
    /// [`PipelineError`] where there is no subject, it has no such layer, or another run works on it.
    pub fn open(root: &Path, last: Option<&str>, observer: &'a dyn Observer) -> Result<Self, PipelineError> {
        let subject = LockedSubject::open(root)?;
        check_types(root, subject.layers())?;
        let mut layers: Vec<String> = subject.layers().iter().map(|l| l.label()).collect();
        if layers.is_empty() {
            let reason =
                "the subject has no take yet; bring one in with `toile import FOLDER --subject DIR --layer body`";
            return Err(PipelineError::stage(root, reason));
        }
        if let Some(last) = last {
            let found = layers.iter().position(|l| l == last || l.split_once('-').is_some_and(|p| p.1 == last));
            let count = found.ok_or_else(|| PipelineError::NoLayer {
                path: root.into(),
                layer: last.into(),
                has: layers.join(", "),
            })?;
            layers.truncate(count + 1);
        }
        let name = subject.name().to_string();
        let folders = Folders::new(root);
        Ok(Self { folders, layers, observer, subject: Some(subject), name, left_out: Vec::new() })
    }

    /// Over a single file; records name paths relative to `root`.
    pub fn single(root: &Path, name: &str, observer: &'a dyn Observer) -> Self {
        let (folders, name) = (Folders::new(root), name.to_string());
        Self { folders, layers: Vec::new(), observer, subject: None, name, left_out: Vec::new() }
    }

    /// What a step is called while it runs.
    pub fn label(&self, layer: &str, stage: &str) -> String {
        if self.name == layer { format!("{layer}: {stage}") } else { format!("{} {layer}: {stage}", self.name) }
    }

    /// Folder name of the body take.
    pub fn first_layer(&self) -> &str {
        self.layers.first().map_or("00-body", String::as_str)
    }

    /// Folder names of the garments in the avatar, inside to outside.
    pub fn garments(&self) -> impl Iterator<Item = &str> {
        self.layers.iter().skip(1).filter(|l| !self.left_out.contains(l)).map(String::as_str)
    }

    /// Their takes' numbers.
    pub fn garment_numbers(&self) -> impl Iterator<Item = usize> {
        (1..self.layers.len()).filter(|&n| !self.left_out.contains(&self.layers[n]))
    }

    /// Leaves a layer in which nothing new was found out of the avatar, with the garment that an earlier run made of it.
    ///
    /// # Errors
    /// [`PipelineError::Io`] where an old file cannot be removed.
    pub fn leave_out(&mut self, layer: &str) -> Result<(), PipelineError> {
        let path = self.folders.garment(layer);
        if path.exists() {
            fs::remove_file(&path).map_err(|e| PipelineError::io(&path, e))?;
        }
        self.left_out.push(layer.to_string());
        Ok(())
    }

    /// What the subject is called.
    pub fn title(&self) -> &str {
        &self.name
    }

    /// Date, rig and number of takes in a line.
    pub fn subtitle(&self) -> String {
        let count = format!("{} takes", self.layers.len());
        let (date, rig) = self.subject.as_ref().map_or(("", ""), |s| (s.date(), s.rig()));
        [date, rig, &count].into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(" · ")
    }

    /// The type of the garment that take `n` added, where it is known.
    pub fn garment_type(&self, n: usize) -> Option<GarmentType> {
        let layer = self.subject.as_ref()?.layers().get(n).filter(|_| n > 0)?;
        let by_name = || toile_character::GarmentType::from_layer_name(&layer.name).map(|garment| garment.name());
        layer.garment.as_deref().or_else(by_name)?.parse().ok()
    }

    /// Thickness of the cloth of the garment that take `n` added, millimetres, where it is told.
    pub fn thickness_mm(&self, n: usize) -> Option<f32> {
        self.subject.as_ref()?.layers().get(n)?.thickness_mm
    }

    /// The recording of a take.
    pub fn take(&self, layer: &str) -> PathBuf {
        self.folders.root.join("takes").join(format!("{layer}.mcap"))
    }

    /// Reads a mesh (PLY, or OBJ by its extension), or says which file cannot be read.
    ///
    /// # Errors
    /// [`PipelineError`] where the file is missing or no mesh.
    pub fn read_mesh(&self, path: &Path) -> Result<Mesh, PipelineError> {
        let is_obj = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("obj"));
        Ok(if is_obj { obj::read(path)? } else { ply::read(path)? })
    }
}

/// Checks the types of all garments, so that a wrong one is found before any work is done.
fn check_types(root: &Path, layers: &[Layer]) -> Result<(), PipelineError> {
    for layer in layers {
        let parsed =
            layer.garment.as_deref().map_or(Ok(()), |text| text.parse::<toile_character::GarmentType>().map(drop));
        parsed.map_err(|reason| {
            PipelineError::format(&root.join("subject.toml"), format!("layer {}: {reason}", layer.label()))
        })?;
    }
    Ok(())
}
