//! A subject as recordings, with the truth beside.

use std::path::Path;

use toile_capture::{Recorder, RecorderOptions, RecordingSummary, subject::BODY};
use toile_character::GarmentType;

use crate::{SyntheticError, subject::Subject, take::Take, truth};

/// Records every take of a subject into a new subject folder: subject.toml and takes/NN-layer.mcap. Where `truth` names a
/// folder, what is true of the subject is written there ([`truth`]).
///
/// # Errors
/// [`SyntheticError`] where `folder` is a subject already, or a file cannot be written.
pub fn record_subject(
    subject: &Subject,
    folder: &Path,
    truth: Option<&Path>,
    progress: &(dyn Fn(f32) + Sync),
) -> Result<Vec<RecordingSummary>, SyntheticError> {
    let mut entry = toile_capture::LockedSubject::create(folder)?;
    let mut summaries = Vec::new();
    for n in 0..subject.take_count() {
        let take = subject.take(n)?;
        let kind = n.checked_sub(1).map(|g| subject.garments[g].kind);
        let name = kind.map_or(BODY, |k| k.name());
        let garment = kind.and_then(|k| GarmentType::from_layer_name(k.name()));
        let pending = entry.next_take(name, garment.map(GarmentType::name))?;
        let share = 1.0 / subject.take_count() as f32;
        let options = RecorderOptions { replace_part: true, ..RecorderOptions::default() };
        summaries.push(record_take(&take, &pending.path, options, &|p| progress((n as f32 + p) * share))?);
        entry.accept(pending)?;
        if let Some(truth) = truth {
            truth::write_take(&take, truth)?;
        }
    }
    if let Some(truth) = truth {
        truth::write_person(subject, truth)?;
    }
    entry.set_rig(&format!("synthetic {}", subject.settings.sensor.name()))?;
    Ok(summaries)
}

/// Records every frame of a take into an MCAP file.
///
/// # Errors
/// [`SyntheticError`] names the frame or file at fault.
pub fn record_take(
    take: &Take,
    path: &Path,
    options: RecorderOptions,
    progress: &(dyn Fn(f32) + Sync),
) -> Result<RecordingSummary, SyntheticError> {
    let mut recorder = Recorder::create(path, &take.rig(), options)?;
    for index in 0..take.moments.len() {
        recorder.write(&take.frame(index)?)?;
        progress((index + 1) as f32 / take.moments.len() as f32);
    }
    Ok(recorder.finish()?)
}
