//! `toile import`: a recorded folder as a subject's next take.

use std::path::{Path, PathBuf};

use serde_json::json;
use toile_capture::{
    CaptureError, LockedSubject, PendingTake, Recorder, RecorderOptions, Replay, ScanTake, Sensor,
    files::part_path,
    import::{self, Format, ImportReport},
    printable_path,
};
use toile_character::GarmentType;
use toile_pipeline::{Observer, Opened, ScanSurvey};
use toile_scans::{Unit, Up, kind_of, unreadable};

use crate::{StudioError, commands::reach::must_exist, outcome::Answer, session::Session};

const AFTER: &str = "\
The subject is created where it is missing; the first take is the body (underwear), each further one adds a garment.
Where garments were taken off one by one, bring the takes in as they were recorded, each called by the outermost garment
that is worn in it and the last one `body`; `toile reorder SUBJECT --reverse` then puts them in order.
Where nobody was recorded in underwear, --dressed says so: the body is then estimated under the clothes of the first take.
Formats, guessed when not said: toile-folder (depth/, color/, camera.json, timestamps.txt; also Open3D's), tum, uva,
seven-scenes (also 3DMatch), redwood, associated (ICL-NUIM), stray-scanner, freenect (fakenect dumps), record3d (.r3d),
sens (BundleFusion, ScanNet), mkv (k4arecorder), oni (OpenNI), bag (ROS 1, librealsense), ros-mcap (ROS 1 and 2), ros2-bag (its folder, or a
.db3), mcap.

Finished scans become takes, too: PLY, OBJ, GLB, glTF and STL, with pictures or vertex colours, in any unit, any axis up.

Examples:
  toile import scans/body.obj --subject anna --layer body
  toile import takes/body     --subject anna --layer body
  toile import takes/trousers --subject anna --layer trousers --type trousers
  toile import takes/again    --subject anna --layer trousers --retake
  toile import takes/only     --subject ben  --layer clothes --dressed";

/// Import a recorded folder into a subject as its next take
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER)]
pub struct Import {
    /// The folder (or recording) to read
    folder: PathBuf,
    /// The subject's folder
    #[arg(long, value_name = "DIR")]
    subject: PathBuf,
    /// The addition of the take, without a number: body, trousers, shirt, ...
    #[arg(long, value_name = "NAME")]
    layer: String,
    /// Layout of the folder (guessed when not said)
    #[arg(long, value_name = "F")]
    format: Option<Format>,
    /// The type of the garment: top, trousers, skirt, dress, jacket, hat, shoes, other
    #[arg(long = "type", value_name = "TYPE")]
    garment: Option<GarmentType>,
    /// The first take shows the person dressed, and there is none in underwear: the body is estimated under the clothes
    #[arg(long, conflicts_with = "retake")]
    dressed: bool,
    /// Replace the layer's take; the old one is kept under takes/rejected/
    #[arg(long)]
    retake: bool,
    /// The unit of a finished scan: m, cm, mm, in, ft (found by its size when not said)
    #[arg(long, value_name = "UNIT")]
    unit: Option<Unit>,
    /// The axis of a finished scan that points up: x, y, z, -x, -y, -z (found when not said)
    #[arg(long, value_name = "AXIS", allow_hyphen_values = true)]
    up: Option<Up>,
}

impl Import {
    /// Runs the command.
    ///
    /// # Errors
    /// [`StudioError`] where the folder cannot be read or the take cannot be written; the subject is then as it was.
    pub fn run(&self, session: &Session) -> Result<Answer, StudioError> {
        must_exist(&self.folder)?;
        if let Some(reason) = unreadable(&self.folder).filter(|_| self.folder.is_file()) {
            return Err(CaptureError::format(&self.folder, reason).into());
        }
        if self.folder.is_file() && kind_of(&self.folder).is_some() {
            return self.import_scan(session);
        }
        if self.unit.is_some() || self.up.is_some() {
            let reason =
                "--unit and --up are of finished scans (PLY, OBJ, GLB, glTF, STL); a recording says its own unit";
            return Err(StudioError::Usage(reason.into()));
        }
        let mut opened = Opened::new(&self.folder, self.format)?;
        let mut subject = LockedSubject::open_or_create(&self.subject)?;
        if let Some(answer) = self.completed(&subject) {
            return Ok(answer);
        }
        match self.import(&mut opened, &mut subject, session) {
            Ok((report, take, kept)) => Ok(self.answer(opened.lost, &report, &take, kept.as_deref())),
            Err(error) => {
                subject.give_up();
                Err(error)
            }
        }
    }

    /// The answer where an earlier run of this very command recorded the take, but was killed before it could say so.
    fn completed(&self, subject: &LockedSubject) -> Option<Answer> {
        let layer = subject.completed(&self.layer, &source_name(&self.folder)).filter(|_| !self.retake)?;
        let take = subject.take_path(layer);
        let shown = printable_path(&take);
        let frames = Replay::open(&take).ok()?.len();
        let text = format!("{shown}: {frames} frames; an earlier run had recorded them and was interrupted\n");
        Some(Answer { text, results: json!({ "take": shown, "frames": frames }), ..Answer::default() })
    }

    fn import(
        &self,
        opened: &mut Opened,
        subject: &mut LockedSubject,
        session: &Session,
    ) -> Result<(ImportReport, PathBuf, Option<PathBuf>), StudioError> {
        let mut pending = self.pending(subject)?;
        pending.rig = opened.source.rig().sensors.first().map_or_else(String::new, |s| s.identity.model.clone());
        pending.source = source_name(&self.folder);
        subject.announce(&pending)?;
        session.progress.plan(1.0);
        session.progress.begin(&format!("{}: import", pending.layer.label()), 1.0);
        let report = record(opened, &pending.path, subject.was_importing(&self.layer), session)?;
        let take = subject.take_path(&pending.layer);
        let kept = subject.accept(pending)?;
        session.progress.end();
        subject.remarks().iter().for_each(|remark| session.progress.remark(remark));
        Ok((report, take, kept))
    }

    /// The take that will be imported.
    fn pending(&self, subject: &LockedSubject) -> Result<PendingTake, StudioError> {
        if self.retake {
            return Ok(subject.retake(&self.layer, self.garment.map(GarmentType::name))?);
        }
        let garment = self.garment.or_else(|| GarmentType::from_layer_name(&self.layer));
        let garment = garment.map(GarmentType::name);
        Ok(if self.dressed {
            subject.dressed_take(&self.layer, garment)?
        } else {
            subject.next_take(&self.layer, garment)?
        })
    }

    /// Imports a finished scan: its files are copied as they are, after one look at what they hold.
    fn import_scan(&self, session: &Session) -> Result<Answer, StudioError> {
        session.progress.plan(1.0);
        session.progress.begin("look at the scan", 1.0);
        let survey = ScanSurvey::new(&self.folder, self.unit, self.up)?;
        session.progress.end();
        let mut subject = LockedSubject::open_or_create(&self.subject)?;
        let done = subject.completed(&self.layer, &source_name(&self.folder)).filter(|_| !self.retake);
        if let Some(layer) = done {
            // An earlier run of this very command was killed after the take was whole.
            return Ok(scan_answer(&survey, &subject.take_path(layer), None));
        }
        match self.copy_scan(&mut subject) {
            Ok((take, kept)) => {
                survey.sentences.iter().chain(&subject.remarks()).for_each(|remark| session.progress.remark(remark));
                Ok(scan_answer(&survey, &take, kept.as_deref()))
            }
            Err(error) => {
                subject.give_up();
                Err(error)
            }
        }
    }

    fn copy_scan(&self, subject: &mut LockedSubject) -> Result<(PathBuf, Option<PathBuf>), StudioError> {
        let mut pending = self.pending(subject)?.of_scan();
        pending.rig = "finished scan".into();
        pending.source = source_name(&self.folder);
        subject.announce(&pending)?;
        ScanTake::create(&pending.path, &self.folder, self.unit, self.up)?;
        let layer = pending.layer.clone();
        let kept = subject.accept(pending)?;
        Ok((subject.take_path(&layer), kept))
    }

    fn answer(&self, torn: Vec<String>, report: &ImportReport, take: &Path, kept: Option<&Path>) -> Answer {
        let mut lost = torn;
        if !report.is_complete() {
            let missing = missing_numbers(take);
            let numbers = if missing.is_empty() { String::new() } else { format!(" ({})", missing.join(", ")) };
            lost.push(format!("{}: {report}{numbers}; everything else is in the take", printable_path(&self.folder)));
        }
        let (take, kept) = (printable_path(take), kept.map(printable_path));
        let mut text = format!("{take}: {} frames\n", report.frames);
        if let Some(kept) = &kept {
            text.push_str(&format!("the old take is kept as {kept}\n"));
        }
        Answer { text, results: json!({ "take": take, "report": report, "kept": kept }), lost, ..Answer::default() }
    }
}

/// The answer where a finished scan became a take.
fn scan_answer(survey: &ScanSurvey, take: &Path, kept: Option<&Path>) -> Answer {
    let (take, kept) = (printable_path(take), kept.map(printable_path));
    let triangles = survey.surface.triangles.len();
    let mut text = format!("{take}: {triangles} triangles, in {}, {} up\n", survey.unit.plural(), survey.up);
    if let Some(kept) = &kept {
        text.push_str(&format!("the old take is kept as {kept}\n"));
    }
    let results = json!({
        "take": take,
        "scan": { "triangles": triangles, "unit": survey.unit, "up": survey.up, "has_colors": survey.surface.has_colors() },
        "kept": kept,
    });
    Answer { text, results, ..Answer::default() }
}

/// Numbers of the frames that are missing between those of a take; of many, the first few.
fn missing_numbers(take: &Path) -> Vec<String> {
    let Ok(replay) = Replay::open(take) else { return Vec::new() };
    let frames: Vec<_> = (0..replay.len()).filter_map(|i| replay.info(i)).collect();
    let mut missing = Vec::new();
    for pair in frames.windows(2) {
        let (before, after, lost) = (pair[0].device_frame, pair[1].device_frame, u64::from(pair[1].lost_before));
        let step = after.saturating_sub(before) / lost.saturating_add(1);
        let numbers = (1..=lost).map_while(|k| before.checked_add(k.checked_mul(step)?));
        missing.extend(numbers.take(NAMED + 1).map(|number| number.to_string()));
    }
    if missing.len() > NAMED {
        missing.truncate(NAMED);
        missing.push("...".into());
    }
    missing
}

/// At most this many missing frames are named.
const NAMED: usize = 12;

/// `repeats`: a half recording that is there is of an import. Of a capture it is kept, since it cannot be made again.
fn record(opened: &mut Opened, path: &Path, repeats: bool, session: &Session) -> Result<ImportReport, StudioError> {
    let options = RecorderOptions { replace_part: repeats, ..RecorderOptions::default() };
    let recorder = Recorder::create(path, opened.source.rig(), options)?;
    if let Some(kept) = recorder.kept_part() {
        let kept = printable_path(kept);
        session.progress.remark(&format!("the half take of a recording that was interrupted is kept as {kept}"));
    }
    let assumed = opened.source.rig().sensors.iter().filter_map(Sensor::assumption);
    assumed.for_each(|sentence| session.progress.remark(&sentence));
    let copied = import::record(opened.source.as_mut(), recorder, &|x| session.progress.at(x));
    Ok(copied.inspect_err(|_| {
        // An import can be repeated, so a half-written recording is of no use.
        drop(std::fs::remove_file(part_path(path)));
    })?)
}

/// The folder that is imported, as an interrupted import remembers it.
fn source_name(folder: &Path) -> String {
    std::path::absolute(folder).unwrap_or_else(|_| folder.to_path_buf()).to_string_lossy().into_owned()
}
