//! `toile capture`: a take from a camera, watched while it is recorded.

use std::{
    path::{Path, PathBuf},
    sync::{Arc, atomic::AtomicBool},
};

use serde_json::json;
use signal_hook::{consts::SIGINT, flag};
use toile_capture::{LockedSubject, PendingTake, Source, Subject, printable_path};
use toile_character::GarmentType;
use toile_live::{Color, Device, Pace, Recorded, RigFile, Stop, record};
use toile_pipeline::Observer;

use crate::{StudioError, outcome::Answer, session::Session};

const AFTER: &str = "\
The subject is created where it is missing; the first take is the body (underwear), each further one adds a garment.
Devices: kinect1[:SERIAL], kinect2[:SERIAL], realsense[:SERIAL], uvc:NODE,CALIBRATION (a UVC depth camera),
stereo:FILE (a stereo rig), replay:FILE, synthetic[:SEED]. --color puts a webcam's colour beside a depth camera; several
sensors record together with --rig. docs/devices.md has all the files.
The take ends after one full turn, after --seconds, or with Ctrl-C; whatever came is kept.

Examples:
  toile capture --subject anna --layer body
  toile capture --subject anna --layer trousers --type trousers --seconds 40
  toile capture --subject anna --layer trousers --retake
  toile capture --subject anna --layer body --device uvc:/dev/video2,depth.toml --color webcam:0,webcam.toml
  toile capture --subject olga --layer body --device synthetic";

/// Record a take from a camera, and see how much of the subject was seen
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER)]
pub struct Capture {
    /// The subject's folder
    #[arg(long, value_name = "DIR")]
    subject: PathBuf,
    /// The addition of the take, without a number: body, trousers, shirt, ...
    #[arg(long, value_name = "NAME")]
    layer: String,
    /// The type of the garment: top, trousers, skirt, dress, jacket, hat, shoes, other
    #[arg(long = "type", value_name = "TYPE")]
    garment: Option<GarmentType>,
    /// Where frames come from
    #[arg(long, value_name = "DEVICE", default_value = "kinect1")]
    device: Device,
    /// Colour of another camera beside the device's depth: webcam:INDEX,CALIBRATION or replay:FILE,CALIBRATION
    #[arg(long, value_name = "COLOR", conflicts_with = "rig")]
    color: Option<Color>,
    /// Several sensors that record together: a file with a [[sensor]] for each
    #[arg(long, value_name = "FILE", conflicts_with = "device")]
    rig: Option<PathBuf>,
    /// Stop after this many seconds
    #[arg(long, value_name = "N", conflicts_with = "one_turn")]
    seconds: Option<f64>,
    /// Stop after one full turn of the subject (what happens when nothing else is said)
    #[arg(long)]
    one_turn: bool,
    /// The first take shows the person dressed, and there is none in underwear: the body is estimated under the clothes
    #[arg(long, conflicts_with = "retake")]
    dressed: bool,
    /// Replace the layer's take; the old one is kept under takes/rejected/
    #[arg(long)]
    retake: bool,
}

impl Capture {
    /// Runs the command.
    ///
    /// # Errors
    /// [`StudioError`] where the device cannot be opened or the take cannot be written; the subject is then as it was.
    pub fn run(&self, session: &Session) -> Result<Answer, StudioError> {
        if self.seconds.is_some_and(|s| !(s.is_finite() && s > 0.0)) {
            return Err(StudioError::Usage("--seconds must be above 0".into()));
        }
        let mut subject = LockedSubject::open_or_create(&self.subject)?;
        let (recorded, take, kept) = match self.capture(&mut subject, session) {
            Ok(captured) => captured,
            Err(error) => {
                subject.give_up();
                return Err(error);
            }
        };
        let mut answer = answer(&recorded, &take, kept.as_deref());
        answer.lost.extend(match &self.rig {
            Some(file) => RigFile::read(file)?.damage()?,
            None => self.device.damage()?.into_iter().collect(),
        });
        Ok(answer)
    }

    fn capture(
        &self,
        subject: &mut LockedSubject,
        session: &Session,
    ) -> Result<(Recorded, PathBuf, Option<PathBuf>), StudioError> {
        let mut pending: PendingTake = if self.retake {
            subject.retake(&self.layer, self.garment.map(GarmentType::name))?
        } else {
            let garment = self.garment.or_else(|| GarmentType::from_layer_name(&self.layer));
            let garment = garment.map(GarmentType::name);
            if self.dressed {
                subject.dressed_take(&self.layer, garment)?
            } else {
                subject.next_take(&self.layer, garment)?
            }
        };
        let (source, pace) = self.open(subject, &pending)?;
        let mut models: Vec<String> = source.rig().sensors.iter().map(|s| s.identity.model.clone()).collect();
        models.dedup();
        pending.rig = models.join(", ");
        subject.announce(&pending)?;
        session.progress.plan(1.0);
        session.progress.begin(&format!("{}: capture", pending.layer.label()), 1.0);
        let stop = self.seconds.map_or(Stop::AfterOneTurn, Stop::After);
        let how = (stop, pace);
        let pressed = interrupted()?;
        let recorded = record(source, &pending.path, how, &pressed, &mut |status| session.progress.show_take(status))?;
        let take = subject.take_path(&pending.layer);
        let kept = subject.accept(pending)?;
        session.progress.end();
        subject.remarks().iter().for_each(|remark| session.progress.remark(remark));
        Ok((recorded, take, kept))
    }

    fn open(&self, subject: &Subject, pending: &PendingTake) -> Result<(Box<dyn Source>, Pace), StudioError> {
        if let Some(file) = &self.rig {
            let rig = RigFile::read(file)?;
            Ok((rig.open(subject, &pending.layer)?, rig.pace()))
        } else {
            let (depth, pace) = (self.device.open(subject, &pending.layer)?, self.device.pace());
            let source = match &self.color {
                Some(color) => color.beside(depth, pace)?,
                None => depth,
            };
            Ok((source, pace))
        }
    }
}

fn answer(recorded: &Recorded, take: &Path, kept: Option<&Path>) -> Answer {
    let Recorded { frames, bytes, lost, unpaired, broken, failed, seen } = recorded;
    let (angle, unseen) = (seen.turn.angle().to_degrees(), seen.turn.unseen());
    let (take, kept) = (printable_path(take), kept.map(printable_path));
    let mut text = format!("{take}: {frames} frames, turned {angle:.0}°\n");
    if let Some(kept) = &kept {
        text.push_str(&format!("the old take is kept as {kept}\n"));
    }
    let mut warnings = Vec::new();
    if let Some(failed) = failed {
        warnings.push(format!("{failed} (the take has every frame that came)"));
    }
    if *lost > 0 {
        warnings.push(format!("{lost} frames were lost between camera and computer; the others are whole"));
    }
    if *unpaired > 0 {
        warnings.push(format!("{unpaired} frames have only depth or only colour"));
    }
    if !seen.turn.came_round() {
        let sides = if unseen.is_empty() { String::new() } else { format!("; not seen: {}", unseen.join(", ")) };
        warnings.push(format!(
            "the preview followed {angle:.0}° of the turn{sides}; record again with --retake where a side is missing"
        ));
    }
    let results = json!({
        "take": take, "frames": frames, "bytes": bytes, "lost": lost, "unpaired": unpaired, "kept": kept,
        "turned_degrees": angle, "unseen": unseen, "ended": failed,
        "preview": { "fused": seen.fused, "unplaced": seen.unplaced, "skipped": seen.skipped },
    });
    Answer { text, results, warnings, lost: broken.clone(), ..Answer::default() }
}

/// True once Ctrl-C was pressed; a second time ends the program at once (the `.part` stays readable).
fn interrupted() -> Result<Arc<AtomicBool>, StudioError> {
    let pressed = Arc::new(AtomicBool::new(false));
    flag::register_conditional_shutdown(SIGINT, 1, pressed.clone())
        .and_then(|_| flag::register(SIGINT, pressed.clone()))
        .map_err(StudioError::Signal)?;
    Ok(pressed)
}
