//! `toile calibrate`: where the cameras of a rig stand, and the calibration of stereo pairs.

use std::path::{Path, PathBuf};

use serde_json::json;
use toile_capture::{Replay, Source, atomic_write, files::read_text, printable_path};
use toile_fusion::{FusionReport, FusionSettings, fuse};
use toile_live::{SensorPlace, with_places};
use toile_pipeline::Observer;

use super::calibrate_board::{BoardChoice, calibrate_pairs, calibrate_take};
use crate::{StudioError, commands::reach::must_exist, outcome::Answer, session::Session};

const AFTER: &str = "\
FILE is the rig file that `toile capture --rig` reads; position and rotation of its sensors are replaced, all else stays.
TAKE is a recording with that rig. Without --board, a person (or anything that is no column) turns once before all cameras. With
--board, a chessboard is held before two and more cameras at a time, still, in 15 and more places, tilted each way; the colour
cameras must see it. COLUMNSxROWS counts inner corners; let one be odd and one even, so that the board has a first corner.
A ChArUco board is named by its squares across and down, the millimetres of a square and of a marker, and the dictionary
(DICT_4X4, DICT_5X5, DICT_6X6 with _50, _100, _250 or _1000). Its corners have numbers, so that a part of it is enough. Boards with an
even number of rows and white in the first corner, as OpenCV made them before 4.6, end with `,legacy`.

With --left and --right, FILE is written for a stereo rig, as OpenCV writes it; lengths in it are metres (metres_per_unit = 1).

Examples:
  toile calibrate rig.toml --take anna/takes/00-body.mcap
  toile calibrate rig.toml --take board.mcap --board 9x6,80
  toile calibrate rig.toml --take board.mcap --board 7x10,80,60,DICT_5X5_100
  toile calibrate stereo.yml --board 9x6,25 --left left*.png --right right*.png";

/// Find where the cameras of a rig stand, from a person who turns, a chessboard or a ChArUco board
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER)]
pub struct Calibrate {
    /// The rig file, or the stereo calibration to write
    file: PathBuf,
    /// A recording with the rig
    #[arg(long, value_name = "TAKE", conflicts_with_all = ["left", "right"], required_unless_present = "left")]
    take: Option<PathBuf>,
    /// The chessboard: inner corners along both sides, and the edge of a square in millimetres; or the ChArUco board: squares
    /// along both sides, the edges of a square and of a marker in millimetres, and the dictionary
    #[arg(long, value_name = "COLUMNSxROWS,MM[,MM,DICTIONARY[,legacy]]")]
    board: Option<BoardChoice>,
    /// Find the colour cameras' lenses too, instead of taking those of the recording
    #[arg(long, requires_all = ["board", "take"])]
    find_lenses: bool,
    /// Pictures of the left camera of a stereo rig
    #[arg(long, value_name = "PICTURES", num_args = 1.., requires_all = ["right", "board"])]
    left: Vec<PathBuf>,
    /// Pictures of the right camera, in the same order
    #[arg(long, value_name = "PICTURES", num_args = 1.., requires = "left")]
    right: Vec<PathBuf>,
}

impl Calibrate {
    /// Runs the command.
    ///
    /// # Errors
    /// [`StudioError`] where the pictures do not tell where the cameras stand, or a file cannot be read or written.
    pub fn run(&self, session: &Session) -> Result<Answer, StudioError> {
        let Some(take) = &self.take else {
            // The command line asks for it with --left.
            let board = self.board.ok_or_else(|| StudioError::Usage("--board is missing".into()))?;
            return calibrate_pairs(&self.file, &board, [&self.left, &self.right]);
        };
        must_exist(take)?;
        // Before long work is done in vain.
        let text = read_text(&self.file)?;
        let (places, mut answer) = match &self.board {
            Some(board) => calibrate_take(take, board, self.find_lenses)?,
            None => by_person(take, session)?,
        };
        let new = with_places(&text, &places).map_err(|e| StudioError::format(&self.file, e))?;
        atomic_write(&self.file, new.as_bytes())?;
        answer.text.push_str(&format!("{}: positions and rotations entered\n", printable_path(&self.file)));
        Ok(answer)
    }
}

/// Where the sensors stand by someone who turns before them.
fn by_person(take: &Path, session: &Session) -> Result<(Vec<SensorPlace>, Answer), StudioError> {
    let mut source = Replay::open(take)?;
    if source.rig().sensors.len() < 2 {
        return Err(StudioError::refused(take, "has one sensor; record with --rig and a file that names several"));
    }
    let progress = &session.progress;
    progress.plan(1.0);
    progress.begin("calibrate", 1.0);
    let scan = fuse(&mut source, &FusionSettings::default(), &|x| progress.at(x))
        .map_err(|e| StudioError::refused(take, e.to_string()))?;
    progress.end();
    let report = scan.report;
    let lost: Vec<&str> = report.sensors.iter().filter(|s| !s.is_placed).map(|s| s.name.as_str()).collect();
    if report.sensors.is_empty() || !lost.is_empty() {
        let names = if lost.is_empty() { report.sensors_not_used.join("`, `") } else { lost.join("`, `") };
        let reason =
            format!("where `{names}` stands was not found: let the person turn once, slowly, in view of all cameras");
        return Err(StudioError::refused(take, reason));
    }
    let places = report.sensors.iter().map(|s| SensorPlace {
        name: s.name.clone(),
        position: s.position_m,
        rotation: s.rotation_deg,
    });
    Ok((places.collect(), answer_of(&report)))
}

fn answer_of(report: &FusionReport) -> Answer {
    let line = |s: &toile_fusion::SensorReport| {
        format!(
            "{}: {:.1} mm and {:.2}° from where it was recorded to be, single frames agree to {:.1} mm\n",
            s.name, s.departs_mm, s.departs_deg, s.spread_mm
        )
    };
    // That a sensor stands elsewhere than recorded is what the command is for.
    let warnings = report.warnings.iter().filter(|w| !w.contains("toile calibrate")).cloned().collect();
    Answer {
        text: report.sensors.iter().map(line).collect(),
        results: json!({ "sensors": report.sensors }),
        warnings,
        ..Answer::default()
    }
}
