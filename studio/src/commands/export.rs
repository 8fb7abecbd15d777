//! `toile export`: the avatar's files, or a recording in a plain encoding.

use std::{
    fs,
    path::{Path, PathBuf},
};

use serde_json::json;
use toile_capture::{Replay, export_standard};

use crate::{
    StudioError,
    commands::{must_exist, reach},
    disk,
    outcome::Answer,
    pipeline::{Goal, Options},
    run::Session,
};

const AFTER: &str = "\
A subject's avatar.glb (pose of the first scan, with the motion as a clip) and avatar.vrm (T-pose) are written into its
folder; what is missing before is run. A recording can be converted so that other viewers of MCAP show its depth.

Examples:
  toile export anna --motion dance.bvh
  toile export anna --glb anna-today.glb
  toile export anna/takes/00-body.mcap --mcap plain.mcap";

/// Write the avatar: GLB with a motion, VRM; or a take in a plain encoding
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER)]
pub struct Export {
    /// The subject; with --mcap a recording
    path: PathBuf,
    /// BVH motion for the avatar (without: a walk that ships with Toile)
    #[arg(long, value_name = "FILE")]
    motion: Option<PathBuf>,
    /// Put a copy of the GLB here
    #[arg(long, value_name = "FILE")]
    glb: Option<PathBuf>,
    /// Put a copy of the VRM here
    #[arg(long, value_name = "FILE")]
    vrm: Option<PathBuf>,
    /// Convert a recording: depth as plain 16-bit images (16UC1), which other viewers display
    #[arg(long, value_name = "FILE", conflicts_with_all = ["motion", "glb", "vrm"])]
    mcap: Option<PathBuf>,
}

impl Export {
    /// Runs the command.
    ///
    /// # Errors
    /// [`StudioError`] where a stage has no answer or files cannot be read or written.
    pub fn run(&self, session: &Session) -> Result<Answer, StudioError> {
        must_exist(&self.path)?;
        if let Some(plain) = &self.mcap {
            return convert(&self.path, plain);
        }
        let options = Options { motion: self.motion.clone(), ..Options::default() };
        options.check()?;
        let mut answer = reach(&self.path, Goal::Avatar, &options, session)?;
        for (copy, name) in [(&self.glb, "avatar.glb"), (&self.vrm, "avatar.vrm")] {
            let Some(copy) = copy else { continue };
            let made = self.path.join(name);
            let bytes = fs::read(&made).map_err(|e| StudioError::io(&made, e))?;
            disk::write_whole(copy, &bytes)?;
            answer.text.push_str(&format!("{}\n", copy.display()));
        }
        Ok(answer)
    }
}

fn convert(recording: &Path, plain: &Path) -> Result<Answer, StudioError> {
    let lost = Replay::open(recording)?.lost().map(|l| format!("{}: {l}", recording.display())).into_iter().collect();
    let written = export_standard(recording, plain)?;
    let text = format!("{}: {} frames\n", plain.display(), written.frames);
    let results = json!({ "file": plain, "frames": written.frames, "bytes": written.bytes });
    Ok(Answer { text, results, lost, ..Answer::default() })
}
