//! The metadata record that makes an MCAP file a recording of ours.

use std::{collections::BTreeMap, path::Path};

use super::{bytes::Cursor, depth_codec, options::DepthEncoding};
use crate::{CaptureError, Rig, Sensor};

/// Its name.
pub(super) const NAME: &str = "toile.recording";

/// Its content.
pub(super) fn content(rig: &Rig, depth: DepthEncoding) -> serde_json::Result<BTreeMap<String, String>> {
    let (depth, note) = match depth {
        DepthEncoding::Raw => ("16UC1", "depth is foxglove.RawImage, 16UC1"),
        DepthEncoding::Packed => {
            (depth_codec::NAME, "depth is packed losslessly by toile; `toile export --mcap` converts it to 16UC1")
        }
    };
    let rig = serde_json::to_string(rig)?;
    let entries = [("version", "1"), ("depth_encoding", depth), ("note", note), ("rig", &rig)];
    Ok(entries.map(|(key, value)| (key.to_string(), value.to_string())).into())
}

/// The rig in the record's bytes behind its name.
///
/// # Errors
/// [`CaptureError::Format`] where it is not there or cannot be used.
pub(super) fn read_rig(path: &Path, content: &[u8]) -> Result<Rig, CaptureError> {
    let map = Cursor(content).map();
    let map = map.ok_or_else(|| CaptureError::format(path, "its metadata record `toile.recording` is damaged"))?;
    let rig = map.get("rig").map_or("", String::as_str);
    let rig: Rig = serde_json::from_str(rig).map_err(|error| {
        CaptureError::format(path, format!("the rig in `toile.recording` is not readable: {error}"))
    })?;
    if let Some(sensor) = rig.sensors.iter().find(|sensor| !is_usable(sensor)) {
        let reason = format!("the calibration of sensor `{}` in `toile.recording` is not usable", sensor.name);
        return Err(CaptureError::format(path, reason));
    }
    Ok(rig)
}

/// Checks that a rig can be recorded.
///
/// # Errors
/// [`CaptureError::Format`] with the sensor that cannot.
pub(super) fn check_rig(path: &Path, rig: &Rig) -> Result<(), CaptureError> {
    if rig.sensors.is_empty() {
        return Err(CaptureError::format(path, "a recording needs a rig with at least one sensor"));
    }
    for (index, sensor) in rig.sensors.iter().enumerate() {
        let name = &sensor.name;
        if !sensor.depth.is_valid() || sensor.color.is_some_and(|color| !color.is_valid()) {
            return Err(CaptureError::format(path, format!("the calibration of sensor {name} is not usable")));
        }
        if !(sensor.depth_scale.is_finite() && sensor.depth_scale > 0.0) {
            return Err(CaptureError::format(path, format!("the depth scale of sensor {name} is not above 0")));
        }
        if rig.sensors[..index].iter().any(|other| other.name == *name) {
            return Err(CaptureError::format(path, format!("two sensors of the rig are called {name}")));
        }
    }
    Ok(())
}

fn is_usable(sensor: &Sensor) -> bool {
    sensor.depth.is_valid() && sensor.depth_scale.is_finite() && sensor.depth_scale > 0.0
}
