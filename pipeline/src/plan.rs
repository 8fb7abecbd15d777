//! What a run over a subject would have to do, without reading a take.

use std::{collections::BTreeMap, path::Path};

use serde::Serialize;
use serde_json::Value;
use toile_capture::{
    Subject,
    files::is_there,
    subject::{BODY, Layer},
};

use crate::{
    PipelineError,
    asked::{Asked, rank_of},
    body_edits::BodyEdits,
    folders::Folders,
    options::Options,
    record,
    resume::read_timings,
    scan_texture::ScanTexture,
    steps::STEPS,
    ticket::{Ticket, step_folders},
    worn::listed,
};

/// How a subject's results stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Standing {
    /// Nothing needs to be done.
    UpToDate,
    /// Some steps have to run.
    Stale,
    /// A run will see from the files' contents whether anything has to be done.
    Unsure,
    /// Consent or retention forbid a run.
    Withheld,
}

/// What a run over a subject would have to do.
#[derive(Debug, Clone, Serialize)]
pub struct Plan {
    /// How the results stand.
    pub standing: Standing,
    /// Why, a clause each.
    pub why: Vec<String>,
    /// The steps that have to run at most, such as `01-trousers/cut`.
    pub steps: Vec<String>,
    /// Expected seconds, from the last run where there was one.
    pub seconds: f64,
    /// True where `seconds` is a usual value, and not from the last run.
    pub guessed: bool,
    /// The most memory that the last run needed, bytes.
    pub peak_memory_bytes: Option<u64>,
    /// Name and version of the program that made the results; `None` where there are none.
    pub program: Option<String>,
    /// Number of takes.
    pub takes: usize,
}

/// Looks at the subject at `root`: what would a run to the page with `options` have to do?
///
/// Only small files are read. A take or result whose size and time are those of the last run counts as the same; where all
/// times of a subject differ, it was copied, and sizes alone decide.
///
/// # Errors
/// [`PipelineError`] where there is no subject, or what decides its result cannot be read.
pub fn plan(root: &Path, options: &Options) -> Result<Plan, PipelineError> {
    let subject = Subject::open(root)?;
    let asked = Asked::now(root, options)?;
    let ticket = Ticket::read(root);
    let folders = Folders::new(root);
    let steps = expected(&subject, &folders)?;
    let mut plan = Plan {
        standing: Standing::UpToDate,
        why: Vec::new(),
        steps: Vec::new(),
        seconds: 0.0,
        guessed: false,
        peak_memory_bytes: ticket.as_ref().and_then(|ticket| ticket.peak_memory_bytes),
        program: ticket.as_ref().map(|ticket| ticket.asked.program.clone()),
        takes: subject.layers().len(),
    };
    if let Some(sentence) = subject.withheld() {
        (plan.standing, plan.why) = (Standing::Withheld, vec![sentence]);
        return Ok(plan);
    }
    match ticket {
        Some(ticket) => plan.against(&ticket, &asked, &folders, &steps),
        None => plan.without_ticket(&folders, &steps),
    }
    plan.estimate(&folders);
    Ok(plan)
}

/// A step of a subject: its folder in `build/`, its name, and the number of the layer that it first concerns.
struct Expected {
    folder: String,
    name: &'static str,
    layer: usize,
}

impl Expected {
    fn label(&self) -> String {
        format!("{}/{}", self.folder, self.name)
    }
}

/// A reason for steps to run: all from this rank on, of this layer and those over it.
struct Cause {
    rank: usize,
    layer: usize,
}

impl Plan {
    /// True where a run has to look at the subject.
    pub fn is_due(&self) -> bool {
        matches!(self.standing, Standing::Stale | Standing::Unsure)
    }

    fn against(&mut self, ticket: &Ticket, asked: &Asked, folders: &Folders, steps: &[Expected]) {
        let mut causes = Vec::new();
        for (rank, layer, why) in ticket.asked.differences(asked) {
            causes.push(Cause { rank, layer: layer.unwrap_or(0) });
            self.why.push(why);
        }
        let changed = ticket.changed(&folders.root);
        let writers = if changed.is_empty() { BTreeMap::new() } else { readers(folders) };
        for (name, change) in changed {
            self.why.push(format!("{name} {change}"));
            causes.extend(writers.get(name).into_iter().flatten().map(|(folder, step)| {
                let layer = asked.layers.iter().position(|layer| layer == folder).unwrap_or(0);
                Cause { rank: rank_of(step), layer }
            }));
        }
        let is_stale = |step: &&Expected| causes.iter().any(|c| rank_of(step.name) >= c.rank && step.layer >= c.layer);
        self.steps = steps.iter().filter(is_stale).map(Expected::label).collect();
        self.standing = match (self.why.is_empty(), self.steps.is_empty()) {
            (true, _) => Standing::UpToDate,
            (false, true) => Standing::Unsure,
            (false, false) => Standing::Stale,
        };
    }

    fn without_ticket(&mut self, folders: &Folders, steps: &[Expected]) {
        let has =
            |step: &&Expected| record::steps_in(&folders.build().join(&step.folder)).iter().any(|s| s == step.name);
        self.steps = steps.iter().filter(|step| !has(step)).map(Expected::label).collect();
        let built = self.steps.len() < steps.len();
        (self.standing, self.why) = match (self.steps.is_empty(), built) {
            (true, _) => (Standing::Unsure, vec!["no whole run noted what it did".to_string()]),
            (false, true) => (Standing::Stale, vec!["a run over it did not end".to_string()]),
            (false, false) => (Standing::Stale, vec!["it was never processed".to_string()]),
        };
    }

    /// Expected seconds of the steps that have to run.
    fn estimate(&mut self, folders: &Folders) {
        for label in &self.steps {
            let Some((folder, name)) = label.split_once('/') else { continue };
            let times = read_timings(&folders.build().join(folder));
            let last = times.get(name).and_then(|times| times.get("seconds")).and_then(Value::as_f64);
            self.guessed |= last.is_none();
            self.seconds += last.unwrap_or(STEPS[rank_of(name)].seconds);
        }
    }
}

/// Which steps, by folder and name, read or wrote a file.
fn readers(folders: &Folders) -> BTreeMap<String, Vec<(String, String)>> {
    let mut all: BTreeMap<String, Vec<(String, String)>> = BTreeMap::new();
    for path in step_folders(folders) {
        let folder = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        for (step, files) in record::files_in(&path) {
            files.into_iter().for_each(|file| all.entry(file).or_default().push((folder.clone(), step.clone())));
        }
    }
    all
}

/// The steps of a subject in their order.
fn expected(subject: &Subject, folders: &Folders) -> Result<Vec<Expected>, PipelineError> {
    let layers: Vec<String> = subject.layers().iter().map(Layer::label).collect();
    let named_dressed = subject.layers().first().is_some_and(|layer| layer.name != BODY);
    let dressed = named_dressed || BodyEdits::of_subject(folders)?.dressed;
    let mut steps = Vec::new();
    let mut add = |folder: &str, name, layer| steps.push(Expected { folder: folder.to_string(), name, layer });
    for (number, layer) in layers.iter().enumerate() {
        let scanned = if folders.scan_take(layer).is_some() { "read" } else { "fuse" };
        add(layer, scanned, number);
        // Only a take with colour pictures has a texture: what it was made into says which.
        if scanned == "fuse" && is_there(&folders.textured(layer)) {
            add(layer, "texture", number);
        }
    }
    add("body", "fit", 0);
    for (number, layer) in layers.iter().enumerate().skip(usize::from(!dressed)) {
        if number > 0 {
            add(layer, "pose", number);
        }
        add(layer, "cut", number);
    }
    let last = layers.len();
    for worn in listed(folders)? {
        add(&worn.label, "wear", last);
    }
    add("layers", "stack", last);
    // Where the take has a texture, so has the layer.
    let mut textured = layers.iter().enumerate().filter(|(_, layer)| ScanTexture::is_there(folders, layer)).peekable();
    if textured.peek().is_some_and(|(number, _)| *number == 0) {
        add("body", "layer-texture", last);
    }
    textured.filter(|(number, _)| dressed || *number > 0).for_each(|(_, layer)| add(layer, "layer-texture", last));
    add("avatar", "export", last);
    add("report", "report", last);
    Ok(steps)
}
