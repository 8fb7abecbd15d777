//! One run over one subject, or over a single file.

use std::path::Path;

use toile_capture::{
    LockedSubject, printable,
    subject::{BODY, Layer},
};
use toile_garments::GarmentType;

use crate::{
    Observer, PipelineError, Record, Settings, body_edits::BodyEdits, folders::Folders, resume::run_step, step::Step,
};

/// One run: where things are, what the layers are, how the stages are set, and who listens.
pub struct Run<'a> {
    /// Where the files lie.
    pub folders: Folders,
    /// Folder names of the takes in their order, such as `00-body`.
    pub layers: Vec<String>,
    /// Settings of all stages.
    pub settings: Settings,
    observer: &'a dyn Observer,
    /// The subject, or `None` for a single recording or scan.
    /// Locked: nothing else writes into the subject's folder meanwhile.
    subject: Option<LockedSubject>,
    /// The type of the garment that each take added, where it is known; empty for a single file.
    garment_types: Vec<Option<GarmentType>>,
    name: String,
    /// Said by the name of the first layer, or in `edits/body.json`.
    is_first_dressed: bool,
}

impl<'a> Run<'a> {
    /// Over the subject at `root`, up to the layer called `last` (or with that folder name).
    ///
    /// # Errors
    /// [`PipelineError`] where there is no subject, it has no such layer, or another run works on it.
    pub fn open(
        root: &Path,
        last: Option<&str>,
        settings: Settings,
        observer: &'a dyn Observer,
    ) -> Result<Self, PipelineError> {
        let subject = LockedSubject::open(root)?;
        if let Some(why) = subject.withheld() {
            let reason =
                format!("{why} (subject.toml), so that it is not processed; `toile archive forget` removes the person");
            return Err(PipelineError::refused(root, reason));
        }
        let garment_types = garment_types(root, subject.layers())?;
        let mut layers: Vec<String> = subject.layers().iter().map(Layer::label).collect();
        if layers.is_empty() {
            let reason =
                "the subject has no take yet; bring one in with `toile import FOLDER --subject DIR --layer body`";
            return Err(PipelineError::refused(root, reason));
        }
        if let Some(last) = last {
            let found = layers.iter().position(|l| l == last || l.split_once('-').is_some_and(|p| p.1 == last));
            let has = || layers.join(", ");
            let missing = || PipelineError::NoLayer { path: root.into(), layer: last.into(), has: has() };
            let count = found.ok_or_else(missing)? + 1;
            layers.truncate(count);
        }
        let name = subject.name().to_string();
        let folders = Folders::new(root);
        let is_first_dressed = is_named_dressed(subject.layers()) || BodyEdits::of_subject(&folders)?.dressed;
        Ok(Self { folders, layers, settings, observer, subject: Some(subject), garment_types, name, is_first_dressed })
    }

    /// Over a single file; records name paths relative to `root`.
    pub fn single(root: &Path, name: &str, settings: Settings, observer: &'a dyn Observer) -> Self {
        let (folders, name) = (Folders::new(root), name.to_string());
        Self {
            folders,
            layers: Vec::new(),
            settings,
            observer,
            subject: None,
            garment_types: Vec::new(),
            name,
            is_first_dressed: false,
        }
    }

    /// Runs a step where its record does not hold any more.
    ///
    /// # Errors
    /// The error of the step, or a file that cannot be read or written.
    pub fn step<S: Step>(&self, step: &S) -> Result<Record<S::Report>, PipelineError> {
        run_step(step, &self.folders.root, self.observer)
    }

    /// The name of a step while it runs.
    pub fn label(&self, layer: &str, stage: &str) -> String {
        // Names come from outside: nothing in them may steer the terminal that this is shown on.
        let name = printable(&self.name);
        if self.name == layer { format!("{name}: {stage}") } else { format!("{name} {}: {stage}", printable(layer)) }
    }

    /// What the operator should know of the subject's folder itself, a sentence each.
    pub fn remarks(&self) -> Vec<String> {
        self.subject.as_ref().map_or_else(Vec::new, |subject| subject.remarks())
    }

    /// A sentence where the first take is known not to be the body.
    pub fn wrong_order(&self) -> Option<String> {
        self.subject.as_ref().and_then(|subject| subject.wrong_order())
    }

    /// Folder name of the body take.
    pub fn first_layer(&self) -> &str {
        self.layers.first().map_or("00-body", String::as_str)
    }

    /// True where the run goes over all takes of the subject.
    pub fn is_whole(&self) -> bool {
        self.subject.as_ref().is_none_or(|subject| subject.layers().len() == self.layers.len())
    }

    /// Whether the first take shows the person dressed: its layer is not called `body`, or `edits/body.json` says so.
    pub fn is_first_dressed(&self) -> bool {
        self.is_first_dressed
    }

    /// Number of the first take that gives a garment.
    pub fn first_garment(&self) -> usize {
        usize::from(!self.is_first_dressed)
    }

    /// Notes in `edits/body.json` that the first take shows the person dressed, for this run and all later ones.
    ///
    /// # Errors
    /// [`PipelineError`] where the file cannot be read or written.
    pub fn say_dressed(&mut self) -> Result<(), PipelineError> {
        BodyEdits::say_dressed(&self.folders)?;
        self.is_first_dressed = true;
        Ok(())
    }

    /// The name of the subject.
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
        self.garment_types.get(n).copied().flatten()
    }

    /// Thickness of the cloth of the garment that take `n` added, millimetres, where `subject.toml` gives it.
    pub fn thickness_mm(&self, n: usize) -> Option<f32> {
        self.subject.as_ref()?.layers().get(n)?.thickness_mm
    }
}

/// Whether the first layer's name says that its take is dressed: only an undressed one is called `body`.
fn is_named_dressed(layers: &[Layer]) -> bool {
    layers.first().is_some_and(|layer| layer.name != BODY)
}

/// The types of all garments, by `subject.toml` or else by the layer's name; the body has none. A wrong one is found
/// before any work is done.
fn garment_types(root: &Path, layers: &[Layer]) -> Result<Vec<Option<GarmentType>>, PipelineError> {
    let of_layer = |(n, layer): (usize, &Layer)| {
        let stated = layer.garment.as_deref().map(str::parse::<GarmentType>).transpose().map_err(|reason| {
            PipelineError::format(&root.join("subject.toml"), format!("layer {}: {reason}", layer.label()))
        })?;
        Ok(stated.or_else(|| GarmentType::from_layer_name(&layer.name)).filter(|_| n > 0 || is_named_dressed(layers)))
    };
    layers.iter().enumerate().map(of_layer).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observer::Silent;

    #[test]
    fn names_are_shown_without_what_steers_a_terminal() {
        for name in ["a\u{1b}[2Jb", "a\nb", "a\u{202e}b"] {
            let run = Run::single(Path::new("."), name, Settings::default(), &Silent);
            for layer in [name, "00-body"] {
                let label = run.label(layer, "fuse");
                assert!(label.contains("\\u{") && !label.contains(['\u{1b}', '\n', '\u{202e}']), "{label}");
            }
        }
    }
}
