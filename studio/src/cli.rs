//! The command line: the commands and their options.

use clap::{Parser, Subcommand};

use crate::{commands, session::Globals};

const AFTER: &str = "\
The usual way, from recordings to a dressed avatar:
  toile import takes/body     --subject anna --layer body
  toile import takes/trousers --subject anna --layer trousers --type trousers
  toile import takes/shirt    --subject anna --layer shirt --type top
  toile process anna
  then open anna/report.html in a browser and anna/avatar.glb in a 3D program

No recordings at hand?  `toile demo` does all this on the session that ships with Toile.

Exit codes: 0 done, 1 failed, 2 the command line is wrong, 3 done, but recorded data was lost.
Without its own `--json`, a command prints for people; progress and warnings go to standard error.";

/// Turns layer-by-layer scans of a person into an animated avatar that wears the person's real garments.
#[derive(Debug, Parser)]
#[command(name = "toile", version, after_help = AFTER, arg_required_else_help = true)]
pub struct Cli {
    /// The options of every command.
    #[command(flatten)]
    pub globals: Globals,
    /// The command.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Import a recorded folder into a subject as its next take
    Import(commands::import::Import),
    /// Record a take from a camera, and see how much of the subject was seen
    Capture(commands::capture::Capture),
    /// Find where the cameras of a rig stand, from a person who turns or from a chessboard
    Calibrate(commands::calibrate::Calibrate),
    /// Show the contents of a recording, a folder or a subject, and whether it is healthy
    Inspect(commands::inspect::Inspect),
    /// Put the takes in the order in which garments are put on: reversed, in any order, under other names
    Reorder(commands::reorder::Reorder),
    /// Fuse takes into scans
    Fuse(commands::fuse::Fuse),
    /// Fit the body to the scan of the undressed person
    Fit(commands::fit::Fit),
    /// Measure the body as a tailor does (ISO 8559-1)
    Measure(commands::measure::Measure),
    /// Extract the garments from the dressed scans and stack them
    Extract(commands::extract::Extract),
    /// Correct a garment by hand: strokes that belong to it or do not, and lines that its hem follows
    Edit(commands::edit::Edit),
    /// Write the avatar: GLB with a motion, VRM; or a take in a plain encoding
    Export(commands::export::Export),
    /// Move the layers through a motion: skinning and cloth, as point caches
    Animate(commands::animate::Animate),
    /// The body as implicit primitives: a compact body that can be edited
    Sculpt(commands::sculpt::Sculpt),
    /// A body by its measures, without a scan; or a subject with other measures
    Shape(commands::shape::Shape),
    /// Put a garment of another subject on this one, resized to its body
    Wear(commands::wear::Wear),
    /// Everything from recorded takes to avatar and report: runs whatever is missing
    Process(commands::process::Process),
    /// Process a whole archive: what is stale, side by side
    Batch(commands::batch::Batch),
    /// Ask an archive: subjects, verdicts, measures, warnings, times
    Catalog(commands::catalog::Catalog),
    /// Keep an archive: check it, move it, remove a person from it
    Archive(commands::archive::Archive),
    /// The whole way on the recorded session that ships with Toile
    Demo(commands::demo::Demo),
    /// Show the settings of all stages, with units, ranges and defaults
    Settings(commands::settings::Settings),
    /// Make a synthetic subject with its truth: for training, tests and trials of a rig
    Synthesize(commands::synthesize::Synthesize),
    /// List the cameras that are plugged in, and their problems
    Devices(commands::devices::Devices),
    /// Serve an archive of subjects to the browser: scan, process, look, correct
    Serve(commands::serve::Serve),
    /// Print completions for a shell
    Completions(commands::completions::Completions),
}
