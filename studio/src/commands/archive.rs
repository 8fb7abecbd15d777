//! `toile archive`: checking, packing, unpacking, forgetting.

use std::path::{Path, PathBuf};

use serde::Serialize;
use toile_archive::{
    anonymize,
    keep::{check, forget, pack, unpack},
};
use toile_capture::printable_path;
use toile_pipeline::json::plain;

use super::reach::must_exist;
use crate::{StudioError, outcome::Answer, session::Session};

const AFTER: &str = "\
Examples:
  toile archive check archive                       # every take read, every hash compared
  toile archive pack archive --out packs            # one file a subject; goes on where it was
  toile archive unpack packs --into archive
  toile archive anonymize archive/anna --to public/s-001
  toile archive forget archive anna --also packs    # removes a person everywhere";

/// Keep an archive: check it, move it, remove a person from it
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER)]
pub struct Archive {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, clap::Subcommand)]
enum What {
    /// Read every take and compare every file with its hash
    Check {
        /// Folder that holds subjects
        archive: PathBuf,
    },
    /// Write one file a subject: tar in zstd, with hashes
    Pack {
        /// Folder that holds subjects
        archive: PathBuf,
        /// Folder for the packs
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
        /// Without results, which can be built again
        #[arg(long)]
        takes_only: bool,
    },
    /// Bring packs back; a subject appears whole or not at all
    Unpack {
        /// A pack, or a folder of packs
        packs: PathBuf,
        /// Folder that holds subjects
        #[arg(long, value_name = "ARCHIVE")]
        into: PathBuf,
    },
    /// Copy a processed subject so that nobody is recognised: no colour, a smooth head, no name, date or notes
    Anonymize {
        /// The subject's folder
        subject: PathBuf,
        /// The new folder
        #[arg(long, value_name = "DIR")]
        to: PathBuf,
        /// The new name (without: that of the new folder)
        #[arg(long)]
        name: Option<String>,
    },
    /// Remove a person everywhere; a tombstone without a name stays
    Forget {
        /// Folder that holds subjects
        archive: PathBuf,
        /// The subject's path in the archive
        subject: PathBuf,
        /// Folders of packs, or copies of the archive, that the subject is removed from too
        #[arg(long, value_name = "DIR", num_args = 1..)]
        also: Vec<PathBuf>,
    },
}

impl Archive {
    /// Runs the command.
    ///
    /// # Errors
    /// [`StudioError`] where the archive cannot be read or written; what fails of a subject is named in the answer.
    pub fn run(&self, _: &Session) -> Result<Answer, StudioError> {
        match &self.what {
            What::Check { archive } => checked(archive),
            What::Pack { archive, out, takes_only } => packed(archive, out, *takes_only),
            What::Unpack { packs, into } => unpacked(packs, into),
            What::Anonymize { subject, to, name } => anonymized(subject, to, name.as_deref()),
            What::Forget { archive, subject, also } => forgotten(archive, subject, also),
        }
    }
}

fn checked(archive: &Path) -> Result<Answer, StudioError> {
    must_exist(archive)?;
    let all = check(archive)?;
    let (takes, frames, same) =
        all.iter().fold((0, 0, 0), |sum, one| (sum.0 + one.takes, sum.1 + one.frames, sum.2 + one.same));
    let text =
        format!("{} subjects, {takes} takes, {frames} frames read; {same} files are as they were noted", all.len());
    let mut answer = answer(text, &all)?;
    for one in &all {
        let named = |sentence: &String| format!("{}: {sentence}", printable_path(&one.subject));
        answer.lost.extend(one.lost.iter().map(named));
        answer.failures.extend(one.changed.iter().map(named));
    }
    Ok(answer)
}

fn packed(archive: &Path, out: &Path, takes_only: bool) -> Result<Answer, StudioError> {
    must_exist(archive)?;
    let all = pack(archive, out, takes_only)?;
    let (bytes, kept) = (all.iter().map(|one| one.bytes).sum::<u64>(), all.iter().filter(|one| one.was_there).count());
    let text = format!("{} subjects in {} MiB of packs ({kept} were there already)", all.len(), bytes >> 20);
    let mut answer = answer(text, &all)?;
    answer.failures = all.iter().filter_map(|one| one.failed.clone()).collect();
    Ok(answer)
}

fn unpacked(packs: &Path, into: &Path) -> Result<Answer, StudioError> {
    must_exist(packs)?;
    let all = unpack(packs, into)?;
    let kept = all.iter().filter(|one| one.was_there).count();
    let mut answer = answer(format!("{} packs ({kept} subjects were there already)", all.len()), &all)?;
    answer.failures = all.iter().filter_map(|one| one.failed.clone()).collect();
    Ok(answer)
}

fn anonymized(subject: &Path, to: &Path, name: Option<&str>) -> Result<Answer, StudioError> {
    must_exist(subject)?;
    let folder = to.file_name().unwrap_or_default().to_string_lossy();
    let done = anonymize(subject, to, name.unwrap_or(&folder))?;
    let (takes, frames, left) = (done.takes, done.frames, done.left_out);
    let to = printable_path(to);
    let text = format!(
        "{takes} takes with {frames} frames are in {to}; {left} frames were left out, since nobody knows where the head is in them\n\
         now `toile process {to}`"
    );
    answer(text, &done)
}

fn forgotten(archive: &Path, subject: &Path, also: &[PathBuf]) -> Result<Answer, StudioError> {
    must_exist(archive)?;
    let gone = forget(archive, subject, also)?;
    let places = gone.places.iter().map(|place| format!("\n  {}", printable_path(place))).collect::<String>();
    answer(format!("{} files with {} MiB were removed:{places}", gone.files, gone.bytes >> 20), &gone)
}

fn answer(text: String, results: &impl Serialize) -> Result<Answer, StudioError> {
    Ok(Answer { text, results: plain(results)?, ..Answer::default() })
}
