//! `toile fuse`: takes into scans.

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use serde_json::json;
use toile_capture::{CaptureError, printable_path, trajectory};
use toile_fusion::{FusionSettings, KnownPose, Prior, Volume};
use toile_pipeline::{FusionChoice, Goal, Observer, Options, Run, Step, settings, steps::fuse::Fuse as FuseStep};

use crate::{
    StudioError,
    commands::{
        output::check_stage,
        prior::PriorChoice,
        reach::{is_subject, must_exist, reach},
        texture_size::TextureSize,
    },
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
    /// auto (usual): the person who turns, without floor, disk and wall; all: everything that was seen
    #[arg(long, value_enum)]
    volume: Option<VolumeChoice>,
    /// turntable (usual): the person turns evenly before a resting camera; none: a camera held by hand
    #[arg(long, value_enum)]
    prior: Option<PriorChoice>,
    /// Known poses instead of tracking: TUM lines `t tx ty tz qx qy qz qw`, t = device time in seconds
    #[arg(long, value_name = "FILE")]
    poses: Option<PathBuf>,
    /// Size of a voxel, millimetres (usually 4)
    #[arg(long, value_name = "MM")]
    voxel: Option<f64>,
    /// Truncation of the signed distances, millimetres (usually four voxels); noisy depth widens it
    #[arg(long, value_name = "MM")]
    truncation: Option<f64>,
    /// Largest edge of the textures of a subject's scans (usually 4096, smaller where the pictures show less)
    #[arg(long, value_enum, value_name = "SIZE")]
    texture: Option<TextureSize>,
    /// Settings of the stages; they win over those of SUBJECT/toile.toml
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum VolumeChoice {
    Auto,
    All,
}

impl From<VolumeChoice> for Volume {
    fn from(choice: VolumeChoice) -> Self {
        match choice {
            VolumeChoice::Auto => Self::Auto,
            VolumeChoice::All => Self::All,
        }
    }
}

impl Fuse {
    /// Runs the command.
    ///
    /// # Errors
    /// [`StudioError`] where nothing can be fused or written.
    pub fn run(&self, session: &Session) -> Result<Answer, StudioError> {
        must_exist(&self.path)?;
        let fusion = self.choice()?;
        if is_subject(&self.path) {
            if self.out.is_some() {
                return Err(StudioError::Usage("--out is for recordings and folders; a subject has its build/".into()));
            }
            if self.poses.is_some() {
                return Err(StudioError::Usage("--poses are those of one take; give its recording".into()));
            }
            let texture = self.texture.map(Into::into);
            let options = Options { fusion, texture, settings: self.settings.clone(), ..Options::default() };
            return reach(&self.path, Goal::Scans, &options, session);
        }
        if self.texture.is_some() {
            let reason = "--texture is for subjects; import the recording into one with `toile import`";
            return Err(StudioError::Usage(reason.into()));
        }
        self.fuse_single(&fusion, session)
    }

    fn choice(&self) -> Result<FusionChoice, StudioError> {
        if let Some(voxel) = self.voxel.filter(|mm| !(0.5..=50.0).contains(mm)) {
            return Err(StudioError::Usage(format!("--voxel {voxel} is not between 0.5 and 50 mm")));
        }
        let voxel = self.voxel.unwrap_or(1e3 * FusionSettings::default().voxel_size);
        if let Some(truncation) = self.truncation.filter(|mm| !(2.0 * voxel..1000.0).contains(mm)) {
            let reason = format!("--truncation {truncation} is not between two voxels and 1000 mm");
            return Err(StudioError::Usage(reason));
        }
        Ok(FusionChoice {
            volume: self.volume.map(Volume::from),
            prior: self.prior.map(Prior::from),
            poses: self.poses.as_deref().map(known_poses).transpose()?,
            truncation: self.truncation.map(|mm| mm * 1e-3),
            voxel_size: self.voxel.map(|mm| mm * 1e-3),
        })
    }

    fn fuse_single(&self, fusion: &FusionChoice, session: &Session) -> Result<Answer, StudioError> {
        let name = self.path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let out = self.out.clone().unwrap_or_else(|| PathBuf::from(format!("{name}-scan")));
        let root = self.path.parent().unwrap_or(Path::new("."));
        check_stage(&out, FuseStep::NAME, &["scan.ply", "trajectory.tum"], &self.path)?;
        let settings = settings::read(None, self.settings.as_deref())?;
        let run = Run::single(root, &name, settings, session.progress.as_ref());
        session.progress.plan(FuseStep::SECONDS);
        let settings = fusion.over(&run.settings.fusion);
        let (recording, folder) = (self.path.clone(), out.clone());
        let record = run.step(&FuseStep { run: &run, recording, folder, name, settings: &settings })?;
        let files = ["scan.ply", "trajectory.tum", "report.json", "timings.json"].map(|f| printable_path(&out.join(f)));
        Ok(Answer {
            text: format!("{}\n", files[0]),
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
        return Err(CaptureError::format(path, "does not hold a pose; a line is `t tx ty tz qx qy qz qw`").into());
    }
    Ok(poses.iter().map(|p| KnownPose { device_time_ns: p.time_ns, scan_from_camera: p.pose }).collect())
}
