//! `toile demo`: the whole way on the recorded session that ships with Toile.

use std::{
    fs,
    path::{Path, PathBuf},
};
use toile_capture::{
    files::{atomic_write, is_there, read_bytes},
    printable_path,
};
use toile_pipeline::Options;

use crate::{
    StudioError,
    commands::{process, reach::motion_choice, serve},
    outcome::Answer,
    session::Session,
};

const AFTER: &str = "\
Copies the session of recorded/ to demo/ beside it, processes it, and says where to look.

Examples:
  toile demo
  toile demo --out tryout --motion dance.bvh";

/// The whole way on the recorded session that ships with Toile
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER)]
pub struct Demo {
    /// Where to put the copy (default: demo/ beside the folder of recorded sessions)
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Folder of recorded sessions (default: the recorded/ found above the current folder or the program)
    #[arg(long, value_name = "DIR")]
    recorded: Option<PathBuf>,
    /// Motion for the avatar (BVH, or GLB or VRMA with an animation) (without: a walk that ships with Toile)
    #[arg(long, value_name = "FILE")]
    motion: Option<PathBuf>,
}

impl Demo {
    /// Runs the command.
    ///
    /// # Errors
    /// [`StudioError`] where no session is found or it cannot be copied; the error of processing.
    pub fn run(&self, session: &Session) -> Result<Answer, StudioError> {
        let recorded = self.recorded.clone().or_else(find_recorded).ok_or_else(|| {
            StudioError::Usage("the folder recorded/ was not found above the current folder or the program; give it with --recorded DIR".into())
        })?;
        let subjects = subjects_in(&recorded)?;
        let out = self.out.clone().unwrap_or_else(|| recorded.parent().unwrap_or(Path::new(".")).join("demo"));
        let mut copies = Vec::new();
        for subject in &subjects {
            let copy = out.join(subject.file_name().unwrap_or_default());
            copy_subject(subject, &copy)?;
            copies.push(copy);
        }
        let mut answer = process::process(
            &copies,
            &Options { motion: motion_choice(self.motion.as_deref()), ..Options::default() },
            session,
        )?;
        answer.text.push_str("open the report in a browser; drop the GLB into Blender, or any viewer of glTF\n");
        let program = std::env::current_exe().map_or_else(|_| "toile".into(), |path| printable_path(&path).clone());
        answer.text.push_str(&format!(
            "or work on it in the browser: `{program} serve {}` shows it at http://127.0.0.1:{}\n",
            printable_path(&out),
            serve::PORT,
        ));
        Ok(answer)
    }
}

/// The `recorded/` next to or above the current folder, else above the program.
fn find_recorded() -> Option<PathBuf> {
    let starts = [std::env::current_dir().ok(), std::env::current_exe().ok()];
    let has_session = |folder: &PathBuf| subjects_in(folder).is_ok();
    starts.into_iter().flatten().find_map(|start| start.ancestors().map(|a| a.join("recorded")).find(has_session))
}

/// The subjects in a folder, by name.
fn subjects_in(recorded: &Path) -> Result<Vec<PathBuf>, StudioError> {
    let entries = fs::read_dir(recorded).map_err(|e| StudioError::io(recorded, e))?;
    let mut subjects: Vec<PathBuf> =
        entries.flatten().map(|e| e.path()).filter(|p| p.join("subject.toml").is_file()).collect();
    subjects.sort();
    if subjects.is_empty() {
        return Err(StudioError::format(recorded, "it holds no subject: */subject.toml is missing"));
    }
    Ok(subjects)
}

/// Copies what was recorded, not what was built; files that are the same already stay.
fn copy_subject(from: &Path, to: &Path) -> Result<(), StudioError> {
    for name in ["subject.toml", "takes", "worn", "edits"] {
        copy(&from.join(name), &to.join(name))?;
    }
    Ok(())
}

fn copy(from: &Path, to: &Path) -> Result<(), StudioError> {
    if from.is_dir() {
        let entries = fs::read_dir(from).map_err(|e| StudioError::io(from, e))?;
        return entries.flatten().try_for_each(|e| copy(&e.path(), &to.join(e.file_name())));
    }
    if !is_there(from) {
        return Ok(());
    }
    let bytes = read_bytes(from)?;
    if !is_there(to) {
        return Ok(atomic_write(to, &bytes)?);
    }
    match read_bytes(to) {
        Ok(old) if old == bytes => Ok(()),
        _ => Err(StudioError::Usage(format!(
            "{} is there already and is not a copy of {}; choose another --out, nothing recorded is overwritten",
            printable_path(to),
            printable_path(from)
        ))),
    }
}
