//! `toile fuse`: takes into scans.

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use serde_json::json;
use toile_capture::{CaptureError, trajectory};
use toile_fusion::{FusionSettings, KnownPose, Prior, Volume};
use toile_pipeline::{Goal, Observer, Options, Run, steps::fuse};

use crate::{
    StudioError,
    commands::reach::{is_subject, must_exist, reach},
    outcome::Answer,
    session::Session,
};

const AFTER: &str = "\
PATH is a subject (all its takes are fused into SUBJECT/build/), one recording, or a folder that import reads.

Examples:
  toile fuse anna
  toile fuse anna/takes/01-trousers.mcap --out trousers-scan
  toile fuse kitchen --volume all --prior none --out kitchen-scan
  toile fuse kitchen --volume all --poses kitchen.tum --voxel 4 --truncation 16 --threads 1";

/// Fuse takes into scans
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER)]
pub struct Fuse {
    /// A subject, a recording, or a folder that import reads
    path: PathBuf,
    /// Folder of the result, for a recording or a folder (default: NAME-scan in the current folder)
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// auto: the person who turns, without floor, disk and wall; all: everything that was seen
    #[arg(long, value_enum, default_value_t = VolumeChoice::Auto)]
    volume: VolumeChoice,
    /// turntable: the person turns evenly before a resting camera; none: a camera held by hand
    #[arg(long, value_enum, default_value_t = PriorChoice::Turntable)]
    prior: PriorChoice,
    /// Known poses instead of tracking: TUM lines `t tx ty tz qx qy qz qw`, t = device time in seconds
    #[arg(long, value_name = "FILE")]
    poses: Option<PathBuf>,
    /// Size of a voxel, millimetres
    #[arg(long, value_name = "MM", default_value_t = 1e3 * FusionSettings::default().voxel_size)]
    voxel: f64,
    /// Truncation of the signed distances, millimetres (default: four voxels); noisy depth widens it
    #[arg(long, value_name = "MM")]
    truncation: Option<f64>,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum VolumeChoice {
    Auto,
    All,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum PriorChoice {
    Turntable,
    None,
}

impl Fuse {
    /// Runs the command.
    ///
    /// # Errors
    /// [`StudioError`] where nothing can be fused or written.
    pub fn run(&self, session: &Session) -> Result<Answer, StudioError> {
        must_exist(&self.path)?;
        let settings = self.settings()?;
        if is_subject(&self.path) {
            if self.out.is_some() {
                return Err(StudioError::Usage("--out is for recordings and folders; a subject has its build/".into()));
            }
            if self.poses.is_some() {
                return Err(StudioError::Usage("--poses are those of one take; give its recording".into()));
            }
            return reach(&self.path, Goal::Scans, &Options { fusion: settings, ..Options::default() }, session);
        }
        self.fuse_single(&settings, session)
    }

    fn settings(&self) -> Result<FusionSettings, StudioError> {
        if !(0.5..=50.0).contains(&self.voxel) {
            return Err(StudioError::Usage(format!("--voxel {} is not between 0.5 and 50 mm", self.voxel)));
        }
        let defaults = FusionSettings::default();
        let truncation = self.truncation.unwrap_or(self.voxel * defaults.truncation / defaults.voxel_size);
        if !(2.0 * self.voxel..1000.0).contains(&truncation) {
            let reason = format!("--truncation {truncation} is not between two voxels and 1000 mm");
            return Err(StudioError::Usage(reason));
        }
        Ok(FusionSettings {
            volume: match self.volume {
                VolumeChoice::Auto => Volume::Auto,
                VolumeChoice::All => Volume::All,
            },
            prior: match self.prior {
                PriorChoice::Turntable => Prior::Turntable,
                PriorChoice::None => Prior::None,
            },
            poses: self.poses.as_deref().map(known_poses).transpose()?,
            truncation: truncation * 1e-3,
            voxel_size: self.voxel * 1e-3,
            ..defaults
        })
    }

    fn fuse_single(&self, settings: &FusionSettings, session: &Session) -> Result<Answer, StudioError> {
        let name = self.path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let out = self.out.clone().unwrap_or_else(|| PathBuf::from(format!("{name}-scan")));
        let root = self.path.parent().unwrap_or(Path::new("."));
        let run = Run::single(root, &name, session.progress.as_ref());
        session.progress.plan(fuse::COST);
        let record = fuse::fuse_recording(&run, &self.path, &out, &name, settings)?;
        let files = ["scan.ply", "trajectory.tum", "report.json", "timings.json"].map(|f| out.join(f));
        Ok(Answer {
            text: format!("{}\n", files[0].display()),
            results: json!({ "files": files, "fusion": record.result }),
            warnings: record.warnings,
            lost: record.lost,
            ..Answer::default()
        })
    }
}

fn known_poses(path: &Path) -> Result<Vec<KnownPose>, StudioError> {
    let poses = trajectory::read(path)?;
    if poses.is_empty() {
        return Err(CaptureError::format(path, "holds no pose; a line is `t tx ty tz qx qy qz qw`").into());
    }
    Ok(poses.iter().map(|p| KnownPose { device_time_ns: p.time_ns, scan_from_camera: p.pose }).collect())
}
