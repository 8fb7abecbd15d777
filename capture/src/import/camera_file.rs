//! Calibration files: `camera.json` and its relatives.
//!
//! Read are: `width`, `height`, `fx`, `fy`, `cx`, `cy` (or `intrinsic_matrix`, 9 numbers column by column as Open3D
//! writes them, or row by row); optional `distortion` (k1 k2 p1 p2 k3, and k4 k5 k6 of a rational lens), `depth_scale` (metres a unit, or units a metre where it is 1 or more), `fps`;
//! optional `color` (the same fields, of a colour camera that is not registered to depth) with `color_from_depth`
//! (4×4, 16 numbers row by row, metres).

use std::{
    fmt,
    ops::RangeInclusive,
    path::{Path, PathBuf},
};

use nalgebra::Matrix4;
use serde::de::{Deserialize, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Value};
use toile_geometry::{Rigid, camera::PinholeCamera};

use super::{
    inventory::{Listing, has_extension},
    rigid::rigid_from_matrix,
};
use crate::{CaptureError, DeviceIdentity, Rig, Sensor, depth_codec::MAX_PIXELS, files::read_text};

/// Focal lengths as shares of the picture's longer side: from a fisheye's to a long telephoto lens's.
const FOCAL_LENGTHS: RangeInclusive<f64> = 0.05..=50.0;
/// Metres a depth unit, from a micrometre to a decimetre.
const DEPTH_SCALES: RangeInclusive<f64> = 1e-6..=0.1;
/// Frames a second.
const FRAME_RATES: RangeInclusive<f64> = 0.01..=1e4;
/// The largest coefficient of distortion.
const MAX_DISTORTION: f64 = 100.0;

/// The content of a calibration file.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct CameraFile {
    pub(super) depth: PinholeCamera,
    /// Metres a depth unit.
    pub(super) depth_scale: Option<f64>,
    pub(super) fps: Option<f64>,
    /// A colour camera that is not registered to depth.
    pub(super) color: Option<(PinholeCamera, Rigid)>,
    /// No file gave it.
    pub(super) is_assumed: bool,
}

impl CameraFile {
    /// An ideal camera without more.
    pub(super) fn ideal(depth: PinholeCamera) -> Self {
        Self { depth, depth_scale: None, fps: None, color: None, is_assumed: false }
    }

    /// A rig of this one sensor.
    pub(super) fn rig(&self, format: &str, depth_scale: f64, fps: f64, has_color: bool) -> Rig {
        let (color, color_from_depth) = match self.color {
            Some((camera, pose)) => (camera, pose),
            None => (self.depth, Rigid::identity()),
        };
        Rig {
            sensors: vec![Sensor {
                name: "camera".to_string(),
                identity: DeviceIdentity {
                    model: format!("import:{format}"),
                    calibration_assumed: self.is_assumed,
                    ..DeviceIdentity::default()
                },
                depth: self.depth,
                depth_scale: self.depth_scale.unwrap_or(depth_scale),
                color: has_color.then_some(color),
                color_from_depth,
                rig_from_depth: Rigid::identity(),
                fps,
            }],
        }
    }
}

/// The calibration file of a folder: in it, or in the folder above.
pub(super) fn find(folder: &Path) -> Result<Option<PathBuf>, CaptureError> {
    let here = find_in(folder)?;
    match (here, folder.parent()) {
        (None, Some(above)) if !above.as_os_str().is_empty() => find_in(above),
        (here, _) => Ok(here),
    }
}

fn find_in(folder: &Path) -> Result<Option<PathBuf>, CaptureError> {
    let listing = Listing::read(folder)?;
    let named = |name: &&String| name.as_str() == "camera.json";
    let similar =
        |name: &&String| has_extension(name, &["json"]) && (name.contains("camera") || name.contains("intrinsic"));
    let found = listing.files.iter().find(named).or_else(|| listing.files.iter().find(similar));
    Ok(found.map(|name| folder.join(name)))
}

/// A field that is missing or impossible, or another problem of the whole file.
#[derive(Debug)]
pub(super) struct Fault {
    field: Option<String>,
    reason: String,
}

impl Fault {
    fn at(prefix: &str, name: &str, reason: impl Into<String>) -> Self {
        Self { field: Some(format!("{prefix}{name}")), reason: reason.into() }
    }

    fn of_file(reason: impl Into<String>) -> Self {
        Self { field: None, reason: reason.into() }
    }
}

/// Reads a calibration file.
pub(super) fn read(path: &Path) -> Result<CameraFile, CaptureError> {
    let text = read_text(path)?;
    parse(&text).map_err(|fault| match fault.field {
        Some(field) => CaptureError::field(path, field, fault.reason),
        None => CaptureError::format(path, fault.reason),
    })
}

pub(super) fn parse(text: &str) -> Result<CameraFile, Fault> {
    let Unique(value) = serde_json::from_str(text).map_err(|error: serde_json::Error| {
        Fault::of_file(if error.is_data() { error.to_string() } else { format!("is not readable JSON: {error}") })
    })?;
    let object = value.as_object();
    let object = object.ok_or_else(|| Fault::of_file("must be a JSON object with width, height, fx, fy, cx, cy"))?;
    let depth = parse_camera(object, "")?;
    let depth_scale = optional_positive(object, "depth_scale")?;
    let depth_scale = depth_scale.map(|scale| if scale >= 1.0 { 1.0 / scale } else { scale });
    if let Some(scale) = depth_scale.filter(|scale| !DEPTH_SCALES.contains(scale)) {
        let given = &object["depth_scale"];
        let reason = format!("is {given}, which makes a depth unit {scale:e} m long; 0.001 are millimetres");
        return Err(Fault::at("", "depth_scale", reason));
    }
    let fps = optional_positive(object, "fps")?;
    if let Some(fps) = fps.filter(|fps| !FRAME_RATES.contains(fps)) {
        return Err(Fault::at("", "fps", format!("is {fps}; it must be from 0.01 to 10000 frames a second")));
    }
    let color = match object.get("color") {
        None | Some(Value::Null) => None,
        Some(Value::Object(color)) => Some((parse_camera(color, "color.")?, parse_pose(object, "color_from_depth")?)),
        Some(_) => return Err(Fault::at("", "color", "must be an object with the colour camera's fields")),
    };
    Ok(CameraFile { depth, depth_scale, fps, color, is_assumed: false })
}

fn parse_camera(object: &Map<String, Value>, prefix: &str) -> Result<PinholeCamera, Fault> {
    let width = pixels(object, prefix, "width")?;
    let height = pixels(object, prefix, "height")?;
    let [fx, fy, cx, cy] = if let Some(matrix) = object.get("intrinsic_matrix") {
        let m: [f64; 9] =
            numbers(matrix).ok_or_else(|| Fault::at(prefix, "intrinsic_matrix", "must be a list of 9 numbers"))?;
        // Below the diagonal a camera matrix is zero, which shows the order that it is written in.
        let is_by_row = m[6] == 0.0 && m[7] == 0.0 && (m[2] != 0.0 || m[5] != 0.0);
        if is_by_row { [m[0], m[4], m[2], m[5]] } else { [m[0], m[4], m[6], m[7]] }
    } else {
        let number = |name: &str| required(object, prefix, name);
        [number("fx")?, number("fy")?, number("cx")?, number("cy")?]
    };
    let longest = f64::from(width.max(height));
    for (name, focal) in [("fx", fx), ("fy", fy)] {
        if focal <= 0.0 {
            return Err(Fault::at(prefix, name, format!("is {focal}; a focal length in pixels is above 0")));
        }
        if !FOCAL_LENGTHS.contains(&(focal / longest)) {
            let least = longest * FOCAL_LENGTHS.start();
            let largest = longest * FOCAL_LENGTHS.end();
            let reason =
                format!("is {focal}; a focal length is in pixels, of this picture from {least:.0} to {largest:.0}");
            return Err(Fault::at(prefix, name, reason));
        }
    }
    for (name, centre, size) in [("cx", cx, width), ("cy", cy, height)] {
        if !(0.0..=f64::from(size)).contains(&centre) {
            return Err(Fault::at(
                prefix,
                name,
                format!("is {centre}: that is outside of the picture's {size} pixels"),
            ));
        }
    }
    if u64::from(width) * u64::from(height) > MAX_PIXELS {
        let reason = format!("and `{prefix}height` give {width} x {height} pixels, which are too many");
        return Err(Fault::at(prefix, "width", reason));
    }
    let (distortion, rational) = lens(object, prefix)?;
    if let Some(wild) = distortion.iter().chain(&rational).find(|k| k.abs() > MAX_DISTORTION) {
        let reason = format!("has {wild}; no lens bends more than {MAX_DISTORTION}");
        return Err(Fault::at(prefix, "distortion", reason));
    }
    Ok(PinholeCamera { distortion, rational, ..PinholeCamera::ideal(width, height, fx, fy, cx, cy) })
}

/// k1 k2 p1 p2 k3, and k4 k5 k6 where the list has eight numbers.
fn lens(object: &Map<String, Value>, prefix: &str) -> Result<([f64; 5], [f64; 3]), Fault> {
    let Some(list) = object.get("distortion").filter(|value| !value.is_null()) else { return Ok(Default::default()) };
    if let Some([k1, k2, p1, p2, k3, rational @ ..]) = numbers::<8>(list) {
        return Ok(([k1, k2, p1, p2, k3], rational));
    }
    let wrong = || {
        let reason = "must be a list of 5 numbers, k1 k2 p1 p2 k3, or of 8: those and k4 k5 k6 of a rational lens";
        Fault::at(prefix, "distortion", reason)
    };
    numbers(list).map(|five| (five, [0.0; 3])).ok_or_else(wrong)
}

fn pixels(object: &Map<String, Value>, prefix: &str, name: &str) -> Result<u32, Fault> {
    let value = required(object, prefix, name)?;
    if value.fract() == 0.0 && (1.0..=16384.0).contains(&value) {
        return Ok(value as u32);
    }
    Err(Fault::at(prefix, name, format!("is {value}; it must be a whole number of pixels from 1 to 16384")))
}

fn required(object: &Map<String, Value>, prefix: &str, name: &str) -> Result<f64, Fault> {
    match object.get(name) {
        None => Err(Fault::at(prefix, name, "is missing")),
        Some(value) => value
            .as_f64()
            .filter(|x| x.is_finite())
            .ok_or_else(|| Fault::at(prefix, name, format!("must be a number, but is {value}"))),
    }
}

fn optional_positive(object: &Map<String, Value>, name: &str) -> Result<Option<f64>, Fault> {
    match object.get(name) {
        None | Some(Value::Null) => Ok(None),
        Some(_) => match required(object, "", name)? {
            value if value > 0.0 => Ok(Some(value)),
            value => Err(Fault::at("", name, format!("is {value}; it must be above 0"))),
        },
    }
}

fn parse_pose(object: &Map<String, Value>, name: &str) -> Result<Rigid, Fault> {
    let wrong = || Fault::at("", name, "must be 16 numbers: a 4x4 rigid transform row by row, metres");
    let list: [f64; 16] = object.get(name).and_then(numbers).ok_or_else(wrong)?;
    rigid_from_matrix(&Matrix4::from_row_slice(&list)).ok_or_else(wrong)
}

fn numbers<const N: usize>(value: &Value) -> Option<[f64; N]> {
    let list: Vec<f64> = value.as_array()?.iter().map(Value::as_f64).collect::<Option<_>>()?;
    list.try_into().ok().filter(|list: &[f64; N]| list.iter().all(|x| x.is_finite()))
}

/// A JSON value in which no object has a field twice: which of them is meant is not known.
struct Unique(Value);

impl<'de> Deserialize<'de> for Unique {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(UniqueVisitor).map(Unique)
    }
}

struct UniqueVisitor;

impl<'de> Visitor<'de> for UniqueVisitor {
    type Value = Value;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a JSON value")
    }

    fn visit_unit<E: Error>(self) -> Result<Value, E> {
        Ok(Value::Null)
    }

    fn visit_bool<E: Error>(self, value: bool) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_str<E: Error>(self, value: &str) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut access: A) -> Result<Value, A::Error> {
        let mut list = Vec::new();
        while let Some(Unique(value)) = access.next_element()? {
            list.push(value);
        }
        Ok(list.into())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut access: A) -> Result<Value, A::Error> {
        let mut object = Map::new();
        while let Some((key, Unique(value))) = access.next_entry::<String, Unique>()? {
            if object.contains_key(&key) {
                return Err(A::Error::custom(format!("the field `{key}` is there twice; keep the right one")));
            }
            object.insert(key, value);
        }
        Ok(object.into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str =
        r#"{"width": 512, "height": 424, "fx": 365.0, "fy": 366, "cx": 256, "cy": 212, "depth_scale": 0.001}"#;

    #[test]
    fn wrong_fields_are_named() {
        let cases = [
            (GOOD.replace("\"fx\"", "\"focal\""), "`fx` is missing"),
            (GOOD.replace("365.0", "\"wide\""), "`fx` must be a number"),
            (GOOD.replace("365.0", "-3"), "`fx` is -3"),
            (GOOD.replace("512", "0"), "`width` is 0"),
            (GOOD.replace("424", "1e9"), "`height` is"),
            (GOOD.replace("0.001", "0"), "`depth_scale` is 0"),
            (GOOD.replace('}', r#", "distortion": [1, 2]}"#), "`distortion`"),
            (GOOD.replace('}', r#", "color": {"width": 3}}"#), "`color.height` is missing"),
            (GOOD.replace("256", "600"), "`cx` is 600"),
            (GOOD.replace("212", "-1"), "`cy` is -1"),
            (GOOD.replace("365.0", "1e9"), "`fx` is 1000000000"),
            (GOOD.replace("366", "0.5"), "`fy` is 0.5"),
            (GOOD.replace("0.001", "1"), "`depth_scale` is 1"),
            (GOOD.replace("0.001", "1e300"), "`depth_scale` is 1e+300"),
            (GOOD.replace('}', r#", "fps": 1e-9}"#), "`fps` is"),
            (GOOD.replace('}', r#", "distortion": [1e9, 0, 0, 0, 0]}"#), "`distortion` has 1000000000"),
            (GOOD.replace('}', r#", "fx": 900}"#), "`fx` is there twice"),
            (GOOD.replace('}', r#", "color": {"fx": 1, "fx": 2}}"#), "`fx` is there twice"),
            ("[]".to_string(), "JSON object"),
            (GOOD[..40].to_string(), "not readable JSON"),
        ];
        for (text, expected) in cases {
            let Fault { field, reason } = parse(&text).unwrap_err();
            let reason = field.map_or(reason.clone(), |field| format!("`{field}` {reason}"));
            assert!(reason.contains(expected), "{text}\nsaid: {reason}\nexpected: {expected}");
        }
    }

    #[test]
    fn both_ways_of_depth_scale_and_open3d_matrices() {
        assert_eq!(parse(GOOD).unwrap().depth_scale, Some(0.001));
        assert_eq!(parse(&GOOD.replace("0.001", "5000")).unwrap().depth_scale, Some(0.0002));
        let open3d = r#"{"width": 640, "height": 480, "intrinsic_matrix": [525, 0, 0, 0, 524, 0, 319.5, 239.5, 1]}"#;
        let camera = parse(open3d).unwrap().depth;
        assert_eq!(camera, PinholeCamera::ideal(640, 480, 525.0, 524.0, 319.5, 239.5));
        let by_row = open3d.replace("0, 0, 0, 524, 0, 319.5, 239.5, 1", "0, 319.5, 0, 524, 239.5, 0, 0, 1");
        assert_eq!(parse(&by_row).unwrap().depth, camera);
    }
}
