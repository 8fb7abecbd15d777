//! Trajectories in TUM's text format: one line `t tx ty tz qx qy qz qw` a frame, `#` starts a comment.
//!
//! t is a device time in seconds (nine decimals here, so that nanoseconds survive), then metres and a unit quaternion.

use std::{fmt::Write, path::Path};

use nalgebra::{Quaternion, Translation3, UnitQuaternion};
use toile_geometry::Rigid;

use crate::{CaptureError, atomic_write, files::read_text};

/// A pose at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimedPose {
    /// Device time, nanoseconds.
    pub time_ns: i64,
    /// The pose; in trajectories of Toile's `scan_from_camera`.
    pub pose: Rigid,
}

/// Reads a trajectory file.
///
/// # Errors
/// [`CaptureError::Io`] where the file cannot be read, [`CaptureError::Format`] with the line that is wrong.
pub fn read(path: &Path) -> Result<Vec<TimedPose>, CaptureError> {
    let text = read_text(path)?;
    parse(&text).map_err(|reason| CaptureError::format(path, reason))
}

/// Writes a trajectory file, whole or not at all.
///
/// # Errors
/// [`CaptureError`] where it cannot be written.
pub fn write(path: &Path, poses: &[TimedPose]) -> Result<(), CaptureError> {
    atomic_write(path, to_text(poses).as_bytes())
}

/// The lines of a trajectory file.
pub fn to_text(poses: &[TimedPose]) -> String {
    let mut text = String::new();
    for TimedPose { time_ns, pose } in poses {
        let (t, q) = (pose.translation.vector, pose.rotation.coords);
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "{} {:.9} {:.9} {:.9} {:.9} {:.9} {:.9} {:.9}",
            format_seconds(*time_ns),
            t.x,
            t.y,
            t.z,
            q.x,
            q.y,
            q.z,
            q.w
        );
    }
    text
}

/// Reads the lines of a trajectory file.
///
/// # Errors
/// A sentence that names the line.
pub fn parse(text: &str) -> Result<Vec<TimedPose>, String> {
    let mut poses = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or("").trim();
        if !line.is_empty() {
            poses.push(parse_line(line).map_err(|reason| format!("line {}: {reason}", number + 1))?);
        }
    }
    Ok(poses)
}

fn parse_line(line: &str) -> Result<TimedPose, String> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let [time, numbers @ ..] = words.as_slice() else { return Err("is empty".into()) };
    let time_ns = parse_seconds(time).ok_or_else(|| format!("`{time}` is not a time in seconds"))?;
    let number = |word: &&str| {
        let value = word.parse().ok().filter(|x: &f64| x.is_finite());
        value.ok_or_else(|| format!("`{word}` is not a finite number"))
    };
    let numbers: Vec<f64> = numbers.iter().map(number).collect::<Result<_, _>>()?;
    let [tx, ty, tz, qx, qy, qz, qw] = numbers[..] else {
        return Err(format!("has {} values, not the eight `t tx ty tz qx qy qz qw`", words.len()));
    };
    let rotation = Quaternion::new(qw, qx, qy, qz);
    if (rotation.norm() - 1.0).abs() > 0.01 {
        return Err(format!("the rotation qx qy qz qw has length {:.3}, not 1", rotation.norm()));
    }
    let rotation = UnitQuaternion::from_quaternion(rotation);
    Ok(TimedPose { time_ns, pose: Rigid::from_parts(Translation3::new(tx, ty, tz), rotation) })
}

/// Nanoseconds from decimal seconds, exact to the nanosecond (a f64 would lose them for Unix times).
pub(crate) fn parse_seconds(word: &str) -> Option<i64> {
    let (sign, digits) = match word.strip_prefix('-') {
        Some(rest) => (-1_i128, rest),
        None => (1, word),
    };
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let all_digits = |text: &str| text.bytes().all(|b| b.is_ascii_digit());
    if whole.is_empty() || whole.len() > 18 || !all_digits(whole) || !all_digits(fraction) {
        let seconds: f64 = word.parse().ok().filter(|x: &f64| x.abs() < 9.0e9)?;
        return Some((seconds * 1e9).round() as i64);
    }
    let nanoseconds = format!("{:0<9}", fraction.get(..9.min(fraction.len()))?);
    let total = whole.parse::<i128>().ok()? * 1_000_000_000 + nanoseconds.parse::<i128>().ok()?;
    i64::try_from(sign * total).ok()
}

fn format_seconds(time_ns: i64) -> String {
    let sign = if time_ns < 0 { "-" } else { "" };
    let magnitude = time_ns.unsigned_abs();
    format!("{sign}{}.{:09}", magnitude / 1_000_000_000, magnitude % 1_000_000_000)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    #[test]
    fn round_trip_keeps_nanoseconds() {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.1, -2.0, 0.3));
        let times = [0, 1, -1_500_000_000, 1_305_031_102_160_407_123];
        let poses: Vec<_> = times
            .iter()
            .map(|&time_ns| TimedPose { time_ns, pose: Rigid::from_parts(Translation3::new(0.5, -1.25, 2.0), turn) })
            .collect();
        let back = parse(&to_text(&poses)).unwrap();
        assert_eq!(back.len(), poses.len());
        for (a, b) in back.iter().zip(&poses) {
            assert_eq!(a.time_ns, b.time_ns);
            assert!((a.pose.inverse() * b.pose).to_homogeneous().relative_eq(
                &nalgebra::Matrix4::identity(),
                1e-8,
                1e-8
            ));
        }
    }

    #[test]
    fn wrong_lines_are_named_with_the_reason() {
        let good = "# comment\n1.5 0 0 0 0 0 0 1\n";
        let wrong = [
            ("2.5 0 0 0 0 0 1", "line 3: has 7 values, not the eight"),
            ("2.5 0 0 0 0 0 0 1 9", "line 3: has 9 values"),
            ("2.5", "line 3: has 1 values"),
            ("2.5 0 0 0 0 0 0 0", "line 3: the rotation qx qy qz qw has length 0.000, not 1"),
            ("2.5 0 0 NaN 0 0 0 1", "line 3: `NaN` is not a finite number"),
            ("2.5 0 0,1 0 0 0 0 1", "line 3: `0,1` is not a finite number"),
            ("x 0 0 0 0 0 0 1", "line 3: `x` is not a time in seconds"),
        ];
        for (line, reason) in wrong {
            let error = parse(&format!("{good}{line}\n")).unwrap_err();
            assert!(error.contains(reason), "{line}: {error}");
        }
        assert_eq!(parse("1e-3 0 0 0 0 0 0 1").unwrap()[0].time_ns, 1_000_000);
        assert_eq!(parse("").unwrap(), []);
    }
}
