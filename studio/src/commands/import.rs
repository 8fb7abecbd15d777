//! `toile import`: a recorded folder as a subject's next take.

use std::{
    fs,
    path::{Path, PathBuf},
};

use serde_json::json;
use toile_capture::{
    GarmentType, PendingTake, Recorder, RecorderOptions, Replay, Subject,
    import::{self, Format, ImportReport},
};

use crate::{
    StudioError, commands::must_exist, disk::part_path, outcome::Answer, pipeline::opened::Opened, run::Session,
};

const AFTER: &str = "\
The subject is created where it is missing; the first take is the body (underwear), each further one adds a garment.
Formats: toile-folder (depth/, color/, camera.json, timestamps.txt), tum, uva, seven-scenes, mcap; guessed when not said.

Examples:
  toile import takes/body     --subject anna --layer body
  toile import takes/trousers --subject anna --layer trousers --type trousers
  toile import takes/again    --subject anna --layer trousers --retake";

/// Bring a recorded folder into a subject as its next take
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER)]
pub struct Import {
    /// The folder (or recording) to read
    folder: PathBuf,
    /// The subject's folder
    #[arg(long, value_name = "DIR")]
    subject: PathBuf,
    /// What the take adds, without a number: body, trousers, shirt, ...
    #[arg(long, value_name = "NAME")]
    layer: String,
    /// Layout of the folder (guessed when not said)
    #[arg(long, value_name = "F")]
    format: Option<Format>,
    /// What garment it is: top, trousers, skirt, dress, jacket, other
    #[arg(long = "type", value_name = "TYPE")]
    garment: Option<GarmentType>,
    /// Replace the layer's take; the old one is kept under takes/rejected/
    #[arg(long)]
    retake: bool,
}

impl Import {
    /// Runs the command.
    ///
    /// # Errors
    /// [`StudioError`] where the folder cannot be read or the take cannot be written; the subject is then as it was.
    pub fn run(&self, session: &Session) -> Result<Answer, StudioError> {
        must_exist(&self.folder)?;
        let mut opened = Opened::new(&self.folder, self.format)?;
        let is_new = !Subject::exists(&self.subject);
        let mut subject = Subject::open_or_create(&self.subject)?;
        let imported = self.import(&mut opened, &mut subject, session);
        if imported.is_err() && is_new {
            remove_empty(&self.subject);
        }
        let (report, take, kept) = imported?;
        if subject.rig().is_empty()
            && let Some(sensor) = opened.source.rig().sensors.first()
        {
            subject.set_rig(&sensor.identity.model.clone())?;
        }
        Ok(self.answer(opened.lost, &report, &take, kept))
    }

    fn import(
        &self,
        opened: &mut Opened,
        subject: &mut Subject,
        session: &Session,
    ) -> Result<(ImportReport, PathBuf, Option<PathBuf>), StudioError> {
        let pending: PendingTake = if self.retake {
            subject.retake(&self.layer, self.garment)?
        } else {
            subject.next_take(&self.layer, self.garment)?
        };
        session.progress.plan(1.0);
        session.progress.begin(&format!("{}: import", pending.layer.label()), 1.0);
        let report = record(opened, &pending.path, session).inspect_err(|_| {
            // An import can be repeated, so what is half written is of no use.
            drop(fs::remove_file(part_path(&pending.path)));
        })?;
        let take = subject.take_path(&pending.layer);
        let kept = subject.accept(pending)?;
        session.progress.end();
        Ok((report, take, kept))
    }

    fn answer(&self, torn: Vec<String>, report: &ImportReport, take: &Path, kept: Option<PathBuf>) -> Answer {
        let mut lost = torn;
        if !report.is_complete() {
            let missing = missing_numbers(take);
            let numbers = if missing.is_empty() { String::new() } else { format!(" ({})", missing.join(", ")) };
            lost.push(format!("{}: {report}{numbers}; everything else is in the take", self.folder.display()));
        }
        let mut text = format!("{}: {} frames\n", take.display(), report.frames);
        if let Some(kept) = &kept {
            text.push_str(&format!("the old take is kept as {}\n", kept.display()));
        }
        Answer { text, results: json!({ "take": take, "report": report, "kept": kept }), lost, ..Answer::default() }
    }
}

/// Numbers of the frames that are missing between those of a take; of many, the first few.
fn missing_numbers(take: &Path) -> Vec<String> {
    let Ok(replay) = Replay::open(take) else { return Vec::new() };
    let frames: Vec<_> = (0..replay.len()).filter_map(|i| replay.info(i)).collect();
    let mut missing = Vec::new();
    for pair in frames.windows(2) {
        let (before, after, lost) = (pair[0].device_frame, pair[1].device_frame, u64::from(pair[1].lost_before));
        let step = after.saturating_sub(before) / (lost + 1);
        missing.extend((1..=lost).map(|k| (before + k * step).to_string()));
    }
    if missing.len() > NAMED {
        missing.truncate(NAMED);
        missing.push("...".into());
    }
    missing
}

/// So many missing frames are named.
const NAMED: usize = 12;

fn record(opened: &mut Opened, path: &Path, session: &Session) -> Result<ImportReport, StudioError> {
    let options = RecorderOptions { replace_part: true, ..RecorderOptions::default() };
    let recorder = Recorder::create(path, opened.source.rig(), options)?;
    Ok(import::record(opened.source.as_mut(), recorder, &|x| session.progress.at(x))?)
}

/// Takes back a subject that was created for a take that did not come; folders that hold anything stay.
pub(crate) fn remove_empty(subject: &Path) {
    let has_takes = fs::read_dir(subject.join("takes")).is_ok_and(|mut entries| entries.next().is_some());
    if !has_takes {
        drop(fs::remove_file(subject.join("subject.toml")));
        drop(fs::remove_dir(subject.join("takes")));
        drop(fs::remove_dir(subject));
    }
}
