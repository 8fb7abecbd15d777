//! All records of a file, chunk by chunk.

use super::{
    container::{Container, Outline},
    records::{Record, records},
};
use crate::CaptureError;

/// The maximum number of frames of a recording: nine hours at 30 a second. More of them come from a file that was made to
/// fill the memory.
pub(super) const MAX_FRAMES: usize = 1 << 20;

/// Calls `visit` with every record and its chunk's number. Chunks whose checksum does not hold, or whose bytes are not
/// records, count as damaged and are left out.
///
/// # Errors
/// The error of `visit`.
pub(super) fn for_each_record(
    container: &mut Container,
    outline: &mut Outline,
    mut visit: impl FnMut(usize, Record) -> Result<(), CaptureError>,
) -> Result<(), CaptureError> {
    for (number, chunk) in outline.chunks.iter().enumerate() {
        let whole = container.checked_records(chunk).filter(|bytes| records(bytes).all(|record| record.is_some()));
        let Some(bytes) = whole else {
            outline.ending.add_damaged(chunk.length);
            continue;
        };
        records(&bytes).flatten().try_for_each(|record| visit(number, record))?;
    }
    if outline.ending.damaged_chunks == 0 {
        outline.ending.damaged_outside = !container.data_are_intact(outline)?;
    }
    Ok(())
}
