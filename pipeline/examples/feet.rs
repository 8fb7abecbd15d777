//! How the feet of a subject stand in motions: `feet SUBJECT MOTION...`, a line a motion and rate.
//!
//! A motion is a file, a folder of files, or `walk`. Each is carried onto the subject's fitted body and measured on the
//! body's surface, at the motion's own rate and at 30 poses a second. `--raw` leaves feet as the file has them.
#![allow(clippy::print_stdout)] // printing is what it does

use std::{
    env,
    error::Error,
    path::{Path, PathBuf},
};

use toile_animation::{RetargetSettings, foot_figures};
use toile_character::BodyModel;
use toile_pipeline::{Body, Folders, Settings, motion};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments: Vec<String> = env::args().skip(1).collect();
    let is_raw = arguments.iter().any(|a| a == "--raw");
    arguments.retain(|a| a != "--raw");
    let Some((subject, motions)) = arguments.split_first() else {
        return Err("usage: feet [--raw] SUBJECT MOTION...".into());
    };
    let body = Body::load(&Folders::new(Path::new(subject)), "00-body", &BodyModel::load_default()?)?;
    println!(
        "{:33} {:>5} {:>5} | slide mm a step: mean  p95  most   > 5 | deepest mm | floats | limits | m/s² | first",
        "motion", "Hz", "steps"
    );
    for motion in motions {
        for path in files(Path::new(motion))? {
            for rate in [1000.0, 30.0] {
                let settings = RetargetSettings { max_rate: rate, lift_feet: !is_raw, ..Settings::default().motion };
                line(&path, &body, &settings).unwrap_or_else(|e| println!("{}: {e}", path.display()));
            }
        }
    }
    Ok(())
}

fn files(motion: &Path) -> Result<Vec<PathBuf>, Box<dyn Error>> {
    if !motion.is_dir() {
        return Ok(vec![motion.to_path_buf()]);
    }
    let mut files: Vec<PathBuf> = std::fs::read_dir(motion)?.map(|e| e.map(|e| e.path())).collect::<Result<_, _>>()?;
    files.retain(|f| f.extension().is_some_and(|e| ["bvh", "glb", "vrma"].iter().any(|known| e == *known)));
    files.sort();
    Ok(files)
}

fn line(path: &Path, body: &Body, settings: &RetargetSettings) -> Result<(), Box<dyn Error>> {
    let file = (path != Path::new(motion::WALK)).then_some(path);
    let moved = motion::load(file, &body.skinned, settings)?;
    let figures = foot_figures(&motion::source(file)?.0, &moved, &body.skinned)?;
    let mm = 1e3;
    println!(
        "{:33} {:5.0} {:5} | {:21.2} {:5.2} {:5.2} {:5} | {:10.1} | {:6} | {:6} | {:4.0} | {:.1}",
        moved.motion.name,
        1.0 / moved.motion.frame_time,
        figures.standing,
        figures.slide_mean * mm,
        figures.slide_p95 * mm,
        figures.slide_most * mm,
        figures.sliding,
        figures.deepest * mm,
        figures.floating,
        figures.beyond_limits,
        figures.acceleration_p99,
        figures.first_step,
    );
    Ok(())
}
