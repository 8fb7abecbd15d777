//! `toile edit`: corrections of a garment by hand.

use std::{
    fs,
    path::{Path, PathBuf},
};

use toile_capture::{
    files::{atomic_write, is_there},
    printable_path,
};
use toile_garments::Edits;
use toile_pipeline::{Folders, Goal, Options, Run, json, process, read_mesh, settings, steps::cut::read_edits};

use crate::{
    StudioError,
    commands::reach::{must_exist, reach},
    outcome::Answer,
    session::Session,
};

const AFTER: &str = "\
FILE is JSON. Points are metres in the frame of SUBJECT/build/LAYER/scan.ply and lie on it:
  { \"version\": 1,
    \"strokes\": [ { \"mark\": \"belongs\", \"points\": [[0.1, 1.2, 0.13]], \"radius\": 0.03 },
                 { \"mark\": \"does-not-belong\", \"points\": [[0, 1.4, 0.1], [0.02, 1.41, 0.1]], \"radius\": 0.01 } ],
    \"hems\": [ { \"points\": [[-0.1, 0.9, 0.1], [0.1, 0.9, 0.1]], \"reach\": 0.02 } ] }
A stroke decides what its radius touches and moves the border up to twice as far; a hem line moves the hem within its
reach onto itself. Nothing else changes. The edits are kept in SUBJECT/edits/ and applied at each rebuild.

Examples:
  toile edit anna trousers --strokes hem.json
  toile edit anna trousers --strokes more.json --add
  toile edit anna trousers --clear";

/// Correct a garment by hand: strokes that belong to it or do not, and lines that its hem follows
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER)]
pub struct Edit {
    /// The subject
    subject: PathBuf,
    /// The layer, such as `trousers` or `01-trousers`
    layer: String,
    /// The edits; they take the place of those that the layer had
    #[arg(long, value_name = "FILE", required_unless_present = "clear")]
    strokes: Option<PathBuf>,
    /// Keep the edits that the layer has, and add these
    #[arg(long, requires = "strokes")]
    add: bool,
    /// Forget the layer's edits
    #[arg(long, conflicts_with = "strokes")]
    clear: bool,
}

impl Edit {
    /// Runs the command.
    ///
    /// # Errors
    /// [`StudioError`] where the edits cannot be used (nothing is stored then), or a stage has no answer.
    pub fn run(&self, session: &Session) -> Result<Answer, StudioError> {
        must_exist(&self.subject)?;
        let edits = self.strokes.as_deref().map(|file| read_edits(file).map(|e| (file, e))).transpose()?;
        let options = Options { last_layer: Some(self.layer.clone()), ..Options::default() };
        process(&self.subject, Goal::Scans, &options, session.progress.as_ref())?;
        self.store(edits, session)?;
        let folders = Folders::new(&self.subject);
        // What was made of the garment before must not stay behind.
        let goal = match (folders.report().exists(), folders.glb().exists()) {
            (true, _) => Goal::Report,
            (_, true) => Goal::Avatar,
            _ => Goal::Garments,
        };
        reach(&self.subject, goal, &Options::default(), session)
    }

    /// Puts the edits where the layer's rebuild finds them.
    fn store(&self, edits: Option<(&Path, Edits)>, session: &Session) -> Result<(), StudioError> {
        let settings = settings::read(Some(&self.subject), None)?;
        let run = Run::open(&self.subject, Some(&self.layer), settings, session.progress.as_ref())?;
        let layer = run.layers.last().map_or("", String::as_str);
        if layer == run.first_layer() {
            return Err(StudioError::Usage(format!("{layer} is the body: only garments have edits")));
        }
        let path = run.folders.edits(layer);
        let Some((file, mut edits)) = edits else {
            return if is_there(&path) {
                fs::remove_file(&path).map_err(|e| StudioError::io(&path, e))
            } else {
                Ok(())
            };
        };
        edits.check_on(&read_mesh(&run.folders.scan(layer))?).map_err(|e| StudioError::format(file, e))?;
        if self.add && is_there(&path) {
            let Edits { strokes, hems, .. } = std::mem::take(&mut edits);
            edits = read_edits(&path)?;
            edits.strokes.extend(strokes);
            edits.hems.extend(hems);
            edits
                .check()
                .map_err(|e| StudioError::format(file, format!("together with {}: {e}", printable_path(&path))))?;
        }
        Ok(atomic_write(&path, &json::pretty(&edits)?)?)
    }
}
