//! One subject with its takes, layers, findings and files.

use std::{fs, path::Path};

use serde::{Deserialize, Serialize};
use serde_json::Value;
use toile_capture::{Layer, Source, Subject};
use toile_garments::Edits;
use toile_pipeline::{Built, Folders, built, json, steps::cut::read_edits};
use utoipa::ToSchema;

use super::{Recordings, State, Summary};

/// Files of a subject that are listed at most.
const MOST_FILES: usize = 5_000;

/// A subject, as its page shows it. Paths are relative to the subject's folder.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
pub struct Detail {
    /// The name of its folder.
    pub id: String,
    /// The subject's name.
    pub name: String,
    /// Date of the visit, `YYYY-MM-DD`.
    pub date: String,
    /// The rig that the takes were recorded with.
    pub rig: String,
    /// Free text.
    pub notes: String,
    /// How it stands.
    pub state: State,
    /// How many warnings, losses and failures there are.
    pub warnings: usize,
    /// Where a picture of it is.
    pub picture: Option<String>,
    /// When anything of it changed last, Unix seconds.
    pub modified: f64,
    /// Why it is damaged.
    pub problem: Option<String>,
    /// The layers in their order, the body first.
    pub layers: Vec<LayerDetail>,
    /// The takes in their order.
    pub takes: Vec<TakeDetail>,
    /// Stature standing straight, metres.
    pub stature_m: Option<f64>,
    /// What the steps have said, and what is to be known of the folder itself.
    pub notices: Vec<Notice>,
    /// Motions that the layers were moved through.
    pub motions: Vec<MotionDetail>,
    /// All regular files, without rejected takes.
    pub files: Vec<String>,
    /// The files that are for other programs and people.
    pub downloads: Vec<Download>,
}

/// A layer.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
pub struct LayerDetail {
    /// Its number, 0 the body.
    pub index: usize,
    /// Its name without the number.
    pub name: String,
    /// The name of its folder in `build/`.
    pub folder: String,
    /// The type of the garment, where somebody said it.
    #[serde(rename = "type")]
    pub garment: Option<String>,
    /// Whether its garment (or the body) was made.
    pub built: bool,
    /// Corrections by hand, where there are any.
    pub edits: Option<EditCount>,
}

/// How many corrections a layer has.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
pub struct EditCount {
    /// Strokes of the brush.
    pub strokes: usize,
    /// Hem lines.
    pub hems: usize,
}

/// A take.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
pub struct TakeDetail {
    /// Its number.
    pub index: usize,
    /// The name of its layer.
    pub name: String,
    /// The name of its folder in `build/`.
    pub folder: String,
    /// The type of the garment that it added.
    #[serde(rename = "type")]
    pub garment: Option<String>,
    /// The recording, or the folder of a finished scan.
    pub file: String,
    /// Its size.
    pub bytes: u64,
    /// Frames that can be read.
    pub frames: u64,
    /// From the first to the last frame, by the device's clock.
    pub seconds: f64,
    /// The names of its sensors.
    pub sensors: Vec<String>,
    /// How it is.
    pub state: TakeState,
    /// What is wrong with it.
    pub problem: Option<String>,
    /// Whether the subject turned once round, where the take was fused.
    pub full_turn: Option<bool>,
    /// Frames that never arrived while recording.
    pub dropped: u64,
    /// Noise of a single depth, millimetres, where the take was fused.
    pub noise_mm: Option<f64>,
}

/// How a take is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum TakeState {
    /// Whole.
    Ok,
    /// A part of it is lost.
    Torn,
    /// A finished scan of another program.
    Scan,
    /// It cannot be read.
    Unreadable,
}

/// A sentence about the subject.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
pub struct Notice {
    /// The sentence.
    pub text: String,
    /// `warning`, `lost` (recorded data) or `failure`.
    pub kind: String,
    /// The layer that it speaks of.
    pub layer: Option<usize>,
    /// The step that said it.
    pub step: String,
}

/// A motion that the layers were moved through.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
pub struct MotionDetail {
    /// Its name.
    pub name: String,
    /// Frames a second.
    pub fps: f64,
    /// How many frames.
    pub frames: u64,
    /// Its point caches, one a layer.
    pub files: Vec<String>,
    /// The same motion for players of glTF.
    pub glb: Option<String>,
}

/// A file for other programs and people.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
pub struct Download {
    /// What it is.
    pub name: String,
    /// Where it is.
    pub file: String,
    /// Its size.
    pub bytes: u64,
}

/// Everything about the subject at `path`, of which `summary` is known already; that it is damaged is told in it.
pub fn detail(path: &Path, summary: Summary, recordings: &Recordings) -> Detail {
    let (folders, records) = (Folders::new(path), built(path));
    let subject = Subject::open(path).ok();
    let layers = subject.as_ref().map_or(&[][..], |subject| subject.layers());
    let takes = subject.iter().flat_map(|s| s.layers().iter().map(|layer| take(s, layer, &records, recordings)));
    let mut files = Vec::new();
    list(path, "", &mut files);
    let body: Option<Value> = json::read(&folders.body_json()).ok();
    Detail {
        rig: subject.as_ref().map_or(String::new(), |s| s.rig().into()),
        notes: subject.as_ref().map_or(String::new(), |s| s.notes().into()),
        layers: layers.iter().map(|layer| layer_detail(&folders, layer)).collect(),
        takes: takes.collect(),
        stature_m: body.and_then(|body| body["stature_m"].as_f64()),
        notices: notices(subject.as_ref(), &records),
        motions: motions(path, &files),
        downloads: downloads(path, &files),
        files,
        id: summary.id,
        name: summary.name,
        date: summary.date,
        state: summary.state,
        warnings: summary.warnings,
        picture: summary.picture,
        modified: summary.modified,
        problem: summary.problem,
    }
}

fn layer_detail(folders: &Folders, layer: &Layer) -> LayerDetail {
    let label = layer.label();
    let count = |edits: Edits| EditCount { strokes: edits.strokes.len(), hems: edits.hems.len() };
    LayerDetail {
        index: layer.number,
        name: layer.name.clone(),
        garment: layer.garment.clone(),
        built: if layer.number == 0 { folders.body_mesh().exists() } else { folders.garment(&label).exists() },
        edits: read_edits(&folders.edits(&label)).ok().map(count),
        folder: label,
    }
}

fn take(subject: &Subject, layer: &Layer, records: &[Built], recordings: &Recordings) -> TakeDetail {
    let (path, label) = (subject.take_path(layer), layer.label());
    let file = path.strip_prefix(subject.folder()).unwrap_or(&path).to_string_lossy().into_owned();
    let fused = records.iter().find(|b| b.folder == label && b.step == "fuse").map(|b| &b.record.result);
    let mut detail = TakeDetail {
        index: layer.number,
        name: layer.name.clone(),
        folder: label,
        garment: layer.garment.clone(),
        file,
        bytes: fs::metadata(&path).map_or(0, |about| about.len()),
        frames: 0,
        seconds: 0.0,
        sensors: Vec::new(),
        state: TakeState::Scan,
        problem: None,
        full_turn: fused.and_then(|report| report["full_turn"].as_bool()),
        dropped: 0,
        noise_mm: fused.and_then(|report| report["noise_mm"].as_f64()),
    };
    if path.is_dir() {
        return detail;
    }
    match recordings.open(&path) {
        Ok(replay) => {
            let infos: Vec<_> = (0..replay.len()).filter_map(|i| replay.info(i)).collect();
            let leading = infos.first().map_or(0, |first| first.sensor);
            let times = || infos.iter().filter(|info| info.sensor == leading).map(|info| info.device_time_ns);
            detail.frames = replay.len();
            detail.seconds = 1e-9 * times().max().zip(times().min()).map_or(0, |(last, first)| last - first) as f64;
            detail.sensors = replay.rig().sensors.iter().map(|sensor| sensor.name.clone()).collect();
            detail.dropped = infos.iter().map(|info| u64::from(info.lost_before)).sum();
            detail.problem = replay.lost().map(ToString::to_string);
            detail.state = if detail.problem.is_some() { TakeState::Torn } else { TakeState::Ok };
        }
        Err(error) => (detail.state, detail.problem) = (TakeState::Unreadable, Some(error.to_string())),
    }
    detail
}

/// What steps have said, each sentence once, and what is to be known of the folder.
fn notices(subject: Option<&Subject>, records: &[Built]) -> Vec<Notice> {
    let number = |folder: &str| folder.split_once('-').and_then(|(number, _)| number.parse().ok());
    let mut all: Vec<Notice> = Vec::new();
    for built in records {
        let told = |kind: &'static str, sentences: &[String]| {
            let notice = |text: &String| Notice {
                text: text.clone(),
                kind: kind.into(),
                layer: number(&built.folder),
                step: built.step.clone(),
            };
            sentences.iter().map(notice).collect::<Vec<_>>()
        };
        let record = &built.record;
        all.extend(told("failure", &record.failures));
        all.extend(told("lost", &record.lost));
        all.extend(told("warning", &record.warnings));
    }
    let remarks = subject.map_or_else(Vec::new, Subject::remarks).into_iter();
    all.extend(remarks.map(|text| Notice { text, kind: "warning".into(), layer: None, step: "subject".into() }));
    all
}

/// Regular files below a folder, by their way from the subject's folder; links are left out.
fn list(folder: &Path, way: &str, files: &mut Vec<String>) {
    let mut entries: Vec<_> = fs::read_dir(folder).into_iter().flatten().flatten().collect();
    entries.sort_by_key(fs::DirEntry::file_name);
    for entry in entries {
        let (Ok(name), Ok(kind)) = (entry.file_name().into_string(), entry.file_type()) else { continue };
        let way = if way.is_empty() { name } else { format!("{way}/{name}") };
        if kind.is_dir() && way != "takes/rejected" {
            list(&entry.path(), &way, files);
        } else if kind.is_file() && files.len() < MOST_FILES {
            files.push(way);
        }
    }
}

fn motions(path: &Path, files: &[String]) -> Vec<MotionDetail> {
    let name_of = |file: &String| Some(file.strip_prefix("motion/")?.strip_suffix("/report.json")?.to_string());
    let motion = |name: String| {
        let report: Value = json::read(&path.join(format!("motion/{name}/report.json"))).ok()?;
        let below = format!("motion/{name}/");
        let of = |end: &'static str| files.iter().filter(|f| f.starts_with(&below)).filter(move |f| f.ends_with(end));
        Some(MotionDetail {
            fps: report["fps"].as_f64().unwrap_or(30.0),
            frames: report["frames"].as_array().map_or(0, Vec::len) as u64,
            files: of(".pc2").cloned().collect(),
            glb: of(".glb").next().cloned(),
            name,
        })
    };
    files.iter().filter_map(name_of).filter_map(motion).collect()
}

fn downloads(path: &Path, files: &[String]) -> Vec<Download> {
    let known = [
        ("Avatar (GLB)", "avatar.glb"),
        ("Avatar (VRM)", "avatar.vrm"),
        ("Report", "report.html"),
        ("Measurements (CSV)", "build/body/measurements.csv"),
        ("Measurements (JSON)", "build/body/measurements.json"),
        ("Rigged scan (GLB)", "build/body/rigged_scan.glb"),
    ];
    let named = known.into_iter().map(|(name, file)| (name.to_string(), file.to_string()));
    let garments = files.iter().filter_map(|file| {
        let layer = file.strip_prefix("build/")?.strip_suffix("/garment.ply")?;
        Some((format!("{layer} (PLY)"), file.clone()))
    });
    let moved = files.iter().filter_map(|file| {
        let name = file.strip_prefix("motion/")?.strip_suffix("/motion.glb")?;
        Some((format!("Motion {name} (GLB)"), file.clone()))
    });
    let all = named.chain(garments).chain(moved);
    let bytes = |file: &str| fs::metadata(path.join(file)).ok().filter(fs::Metadata::is_file).map(|about| about.len());
    all.filter_map(|(name, file)| Some(Download { bytes: bytes(&file)?, name, file })).collect()
}
