//! `toile synthesize`: a synthetic subject with its truth.

use std::{
    fs,
    io::ErrorKind,
    path::{Path, PathBuf},
};

use clap::ValueEnum;
use serde_json::json;
use toile_capture::{atomic_write, printable_path};
use toile_character::BodyModel;
use toile_fitting::measure_table;
use toile_pipeline::Observer;
use toile_synthetic::{
    GarmentKind, GarmentSettings, Motion, RigSettings, SensorPreset, Sex, Subject, SyntheticError, SyntheticSettings,
    folder::write_subject_folder, record::record_subject,
};

use super::nuisances::NuisanceOptions;
use crate::{StudioError, outcome::Answer, session::Session};

const AFTER: &str = "\
A virtual person on a turning disk, seen by a virtual depth camera; everything follows from the seed.
As a subject it has takes that `toile process` reads, as folders the images that `toile import` reads. The truth is
written beside: under OUT/truth for a subject, in each folder's truth/ otherwise (docs/synthetic.md says what it holds).

Examples:
  toile synthesize --out olga --seed 7 --garments trousers,tshirt,jacket
  toile synthesize --out olga-folders --as folders --sensor kinect1 --sway 0.8
  toile synthesize --out rig --sensors 3 --rig-error 20 --garments \"\"
  toile synthesize --out fixed --sensors 4 --motion still --frames 3 --fps 30
  toile synthesize --out black --garments trousers --dark trousers       # one nuisance; see \"Nuisances\"";

/// Make a synthetic subject with its truth: for training, tests and trials of a rig
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER)]
pub struct Synthesize {
    /// Folder of the subject; its name is the subject's
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// subject: recordings for `toile process`; folders: images for `toile import`
    #[arg(long = "as", value_enum, default_value_t = Kind::Subject)]
    kind: Kind,
    /// Everything random follows from it
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The garments that the takes add, inside to outside (at most five; `--garments ""` for the body alone)
    #[arg(long, value_delimiter = ',', default_value = "trousers,tshirt", value_name = "KINDS")]
    garments: Vec<String>,
    /// Around which mean the person is drawn
    #[arg(long, value_enum, default_value_t = SexChoice::Female)]
    sex: SexChoice,
    /// The camera to imitate: kinect1, kinect2, stereo
    #[arg(long, default_value = SyntheticSettings::default().sensor.name())]
    sensor: String,
    /// Frames of each take
    #[arg(long, default_value_t = SyntheticSettings::default().frames)]
    frames: usize,
    /// Degrees that the disk turns from the first to the last frame
    #[arg(long, default_value_t = SyntheticSettings::default().degrees, allow_negative_numbers = true)]
    degrees: f64,
    /// Frames a second
    #[arg(long, default_value_t = SyntheticSettings::default().fps)]
    fps: f64,
    /// How far the torso sways, degrees
    #[arg(long, default_value_t = 0.0)]
    sway: f64,
    /// How far the chest moves with the breath, millimetres
    #[arg(long, default_value_t = 0.0)]
    breathing: f64,
    /// Camera to axis, metres (default: the distance that suits the camera)
    #[arg(long)]
    distance: Option<f64>,
    /// Depth as the geometry is, without the sensor's noise
    #[arg(long)]
    clean: bool,
    /// How the disk moves: turn, uneven, stop, twice, back-and-forth (each way --degrees), still
    #[arg(long, default_value = Motion::default().name())]
    motion: String,
    /// How far the disk's axis leans, degrees
    #[arg(long, default_value_t = 0.0)]
    tilt: f64,
    #[command(flatten)]
    rig: RigArgs,
    #[command(flatten)]
    nuisances: NuisanceOptions,
}

#[derive(Debug, Clone, Copy, PartialEq, ValueEnum)]
enum Kind {
    Subject,
    Folders,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum SexChoice {
    Female,
    Male,
}

/// Several sensors around the disk.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Rigs")]
struct RigArgs {
    /// Sensors, evenly around the disk, each with a clock of its own
    #[arg(long, default_value_t = RigSettings::default().sensors, value_name = "N")]
    sensors: usize,
    /// How wrong the recorded places of the sensors are at most, millimetres
    #[arg(long, default_value_t = 1e3 * RigSettings::default().error_m, value_name = "MM")]
    rig_error: f64,
    /// How wrong their recorded rotations are at most, degrees
    #[arg(long, default_value_t = RigSettings::default().error_degrees, value_name = "DEGREES")]
    rig_turn_error: f64,
    /// How fast the clock of every second sensor runs away, parts in a million
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true, value_name = "PPM")]
    clock_drift: f64,
    /// Push the last sensor aside by this in the middle of each take, millimetres
    #[arg(long, default_value_t = 0.0, value_name = "MM")]
    knock: f64,
    /// Share of the depth that sensors lose to each other's light, percent
    #[arg(long, default_value_t = 0.0, value_name = "PERCENT")]
    interference: f64,
    /// How far the sensors shake, degrees
    #[arg(long, default_value_t = 0.0, value_name = "DEGREES")]
    shake: f64,
}

impl RigArgs {
    fn settings(&self) -> RigSettings {
        RigSettings {
            sensors: self.sensors,
            error_m: 1e-3 * self.rig_error,
            error_degrees: self.rig_turn_error,
            clock_drift_ppm: self.clock_drift,
            knock_m: 1e-3 * self.knock,
            interference: 1e-2 * self.interference,
            shake_degrees: self.shake,
        }
    }
}

impl Synthesize {
    /// Runs the command.
    ///
    /// # Errors
    /// [`StudioError`] where a setting is out of its range or a file cannot be written.
    pub fn run(&self, session: &Session) -> Result<Answer, StudioError> {
        let settings = self.settings()?;
        self.claim()?;
        let done = self.make(&settings, session);
        if done.is_err() {
            // Only where nothing is in it.
            drop(fs::remove_dir(&self.out));
        }
        done
    }

    /// Makes the folder. Of two runs that begin at the same time only one can.
    fn claim(&self) -> Result<(), StudioError> {
        if let Some(above) = self.out.parent().filter(|above| !above.as_os_str().is_empty()) {
            fs::create_dir_all(above).map_err(|e| StudioError::io(above, e))?;
        }
        fs::create_dir(&self.out).map_err(|error| match error.kind() {
            ErrorKind::AlreadyExists => {
                StudioError::Usage(format!("{} exists already; choose another --out", printable_path(&self.out)))
            }
            _ => StudioError::io(&self.out, error),
        })
    }

    fn make(&self, settings: &SyntheticSettings, session: &Session) -> Result<Answer, StudioError> {
        let wrong = |e| failed(&self.out, e);
        let progress = &session.progress;
        progress.plan(1.0);
        progress.begin(&format!("{}: synthesize", settings.name), 1.0);
        let mut subject = Subject::new(settings).map_err(wrong)?;
        let measured = self.measured(&mut subject)?;
        let truth = match self.kind {
            Kind::Folders => {
                write_subject_folder(&subject, &self.out, &|x| progress.at(x)).map_err(wrong)?;
                self.out.clone()
            }
            Kind::Subject => {
                let truth = self.out.join("truth");
                record_subject(&subject, &self.out, Some(&truth), &|x| progress.at(x)).map_err(wrong)?;
                truth
            }
        };
        atomic_write(&truth.join("measurements.json"), &measured).map_err(|e| failed(&self.out, e.into()))?;
        progress.end();
        let text = match self.kind {
            Kind::Subject => {
                format!("{0}: now `toile process {0}`; the truth is in {0}/truth\n", printable_path(&self.out))
            }
            Kind::Folders => format!("{}: folders to import, with truth/ in each\n", printable_path(&self.out)),
        };
        Ok(Answer {
            text,
            results: json!({ "out": printable_path(&self.out), "settings": settings }),
            ..Answer::default()
        })
    }

    /// The true measurements, as in a processed subject's `measurements.json`; the true stature is entered into the subject.
    fn measured(&self, subject: &mut Subject) -> Result<Vec<u8>, StudioError> {
        let model = BodyModel::load_default()?;
        let table =
            measure_table(&model, &subject.person.body).map_err(|e| StudioError::refused(&self.out, e.to_string()))?;
        subject.person.stature_m = table.value("stature").unwrap_or(subject.person.stature_m);
        serde_json::to_vec_pretty(&table).map_err(|e| StudioError::refused(&self.out, e.to_string()))
    }

    fn settings(&self) -> Result<SyntheticSettings, StudioError> {
        let kinds = GarmentKind::ALL.map(GarmentKind::name).join(", ");
        let garment = |name: &String| {
            let kind = GarmentKind::from_name(name);
            let unknown = || StudioError::Usage(format!("--garments: there is no `{name}`; choose of {kinds}"));
            kind.map(GarmentSettings::of).ok_or_else(unknown)
        };
        let mut garments =
            self.garments.iter().filter(|n| !n.is_empty()).map(garment).collect::<Result<Vec<_>, _>>()?;
        let nuisances = self.nuisances.resolve(&mut garments)?;
        let sensors = SensorPreset::ALL.map(SensorPreset::name).join(", ");
        let sensor = SensorPreset::from_name(&self.sensor).ok_or_else(|| {
            StudioError::Usage(format!("--sensor: there is no `{}`; choose of {sensors}", self.sensor))
        })?;
        let motion = Motion::from_name(&self.motion).ok_or_else(|| {
            let motions = Motion::ALL.map(Motion::name).join(", ");
            StudioError::Usage(format!("--motion: there is no `{}`; choose of {motions}", self.motion))
        })?;
        let name = self.out.file_name().map_or("subject".into(), |n| n.to_string_lossy().into_owned());
        let sex = match self.sex {
            SexChoice::Female => Sex::Female,
            SexChoice::Male => Sex::Male,
        };
        let settings = SyntheticSettings {
            name,
            seed: self.seed,
            sex,
            garments,
            sensor,
            frames: self.frames,
            degrees: self.degrees,
            fps: self.fps,
            motion,
            tilt_degrees: self.tilt,
            rig: self.rig.settings(),
            sway_degrees: self.sway,
            breathing_m: 1e-3 * self.breathing,
            distance_m: self.distance,
            noise: !self.clean,
            nuisances,
            ..SyntheticSettings::default()
        };
        settings.validate().map_err(|e| StudioError::Usage(e.to_string()))?;
        Ok(settings)
    }
}

fn failed(out: &Path, error: SyntheticError) -> StudioError {
    match error {
        SyntheticError::Capture(error) => error.into(),
        other => StudioError::refused(out, other.to_string()),
    }
}
