//! The contents of a recording, a folder or a subject, and whether it is healthy.

mod findings;
mod frames;
mod problems;
mod scan;
mod text;

use std::{fs, path::Path};

use crate::{
    CaptureError, Layer, Replay, Rig, Sensor, Source, Subject,
    import::{self, Format},
};

pub use findings::{Gap, Inspection, ScanInspection, SensorInspection, SubjectInspection, TakeInspection};
use frames::read_frames;
use problems::problems;
use scan::{inspect_scan, is_scan};

/// Looks through a recording, a folder of images, or all takes of a subject. Every image is decoded.
///
/// # Errors
/// [`CaptureError`] where nothing at all can be read.
pub fn inspect(path: &Path) -> Result<Inspection, CaptureError> {
    let (subject, takes) = if Subject::exists(path) {
        let subject = Subject::open(path)?;
        let (name, date) = (subject.name().to_string(), subject.date().to_string());
        let head = SubjectInspection { name, date, remarks: subject.remarks() };
        (Some(head), inspect_layers(&subject))
    } else {
        (None, vec![inspect_take(path)?])
    };
    Ok(Inspection {
        path: path.to_string_lossy().into_owned(),
        subject,
        healthy: takes.iter().all(|take| take.problems.is_empty()),
        data_lost: takes.iter().any(TakeInspection::data_lost),
        takes,
    })
}

fn inspect_layers(subject: &Subject) -> Vec<TakeInspection> {
    let inspect_layer = |layer: &Layer| {
        let path = subject.take_path(layer);
        let mut take = inspect_take(&path).unwrap_or_else(|error| TakeInspection {
            format: Format::Mcap.to_string(),
            unreadable: vec![error.to_string()],
            problems: vec![error.to_string()],
            ..TakeInspection::default()
        });
        take.name = layer.label();
        take.garment = layer.garment.clone();
        take
    };
    subject.layers().iter().map(inspect_layer).collect()
}

/// A sentence for each sensor whose calibration is assumed.
fn assumptions(rig: &Rig) -> Vec<String> {
    rig.sensors.iter().filter_map(Sensor::assumption).collect()
}

fn inspect_take(path: &Path) -> Result<TakeInspection, CaptureError> {
    if is_scan(path) {
        return inspect_scan(path);
    }
    let format = import::guess(path)?;
    let mut take = TakeInspection {
        name: path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned()),
        format: format.to_string(),
        ..TakeInspection::default()
    };
    if format == Format::Mcap {
        let mut replay = Replay::open(path)?;
        take.loss = replay.lost().cloned();
        take.bytes = fs::metadata(path).map_err(|error| CaptureError::io(path, error))?.len();
        read_frames(&mut replay, &mut take);
        take.problems = assumptions(replay.rig());
    } else {
        let mut source = import::open(path, Some(format))?;
        read_frames(source.as_mut(), &mut take);
        take.problems = source.remarks();
        take.problems.extend(assumptions(source.rig()));
    }
    take.problems.extend(problems(&take));
    Ok(take)
}
