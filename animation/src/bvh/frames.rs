//! The motion part of a BVH file: frame time and rows of channel values.

use super::{lines::Lines, model::FRAME_TIMES};
use crate::AnimationError;

/// Maximum number of frames: more than two hours at 120 a second.
const MAX_FRAMES: usize = 1 << 20;
/// Maximum number of channel values, 192 MB of them: half an hour of 120 channels at 120 frames a second.
const MAX_VALUES: usize = 24 << 20;

/// Frame time, rows and warnings.
pub(super) struct Frames {
    pub frame_time: f64,
    pub rows: Vec<Vec<f64>>,
    pub warnings: Vec<String>,
}

/// Reads `Frames:`, `Frame Time:` and the rows of a hierarchy with this number of `channels`.
pub(super) fn read(channels: usize, lines: &mut Lines) -> Result<Frames, AnimationError> {
    let announced = lines.header("Frames:")?;
    if !(1.0..=MAX_FRAMES as f64).contains(&announced) || announced.fract() != 0.0 {
        return Err(lines.error(format!("`Frames:` says {announced}; it must be from 1 to {MAX_FRAMES}")));
    }
    let frame_time = lines.header("Frame Time:")?;
    if !FRAME_TIMES.contains(&frame_time) {
        let (low, high) = FRAME_TIMES.into_inner();
        return Err(lines.error(format!("`Frame Time:` is {frame_time:e} s; it must be from {low:e} to {high} s")));
    }
    if channels == 0 {
        return Err(lines.error("none of the joints has channels: nothing can move"));
    }
    let rows = read_rows(channels, lines)?;
    let warnings = compare(announced as usize, rows.len(), lines)?;
    Ok(Frames { frame_time, rows, warnings: warnings.into_iter().collect() })
}

fn read_rows(channels: usize, lines: &mut Lines) -> Result<Vec<Vec<f64>>, AnimationError> {
    let mut rows: Vec<Vec<f64>> = Vec::new();
    while let Some(line) = lines.next() {
        if rows.len() >= MAX_FRAMES || (rows.len() + 1) * channels > MAX_VALUES {
            return Err(lines.error(format!("the motion is too long: {} frames of {channels} values", rows.len())));
        }
        let mut row = Vec::with_capacity(channels);
        for word in line.split_ascii_whitespace().take(channels + 1) {
            row.push(lines.number(Some(word))?);
        }
        if row.len() != channels {
            let more = if row.len() > channels { "more than ".to_string() } else { format!("{} of ", row.len()) };
            return Err(lines.error(format!("the row has {more}the {channels} numbers that the channels need")));
        }
        rows.push(row);
    }
    Ok(rows)
}

/// Compares the number of frames with what the file announces. Some writers count one too few or one too many: all rows
/// that are there are taken then. A file that lacks more rows is torn.
fn compare(announced: usize, found: usize, lines: &Lines) -> Result<Option<String>, AnimationError> {
    match found {
        _ if found == announced => Ok(None),
        0 => Err(lines.error("the frames are missing: the file is torn")),
        _ if found + 1 < announced => {
            Err(lines.error(format!("the file announces {announced} frames and ends after {found}: it is torn")))
        }
        _ => Ok(Some(format!("the file announces {announced} frames and holds {found}; all {found} are used"))),
    }
}
