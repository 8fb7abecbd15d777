//! `--rig`: a file that names several sensors and where each stands.

use std::path::{Path, PathBuf};

use serde::Deserialize;
use toile_capture::{Layer, Source, Subject, files::read_text};
use toile_geometry::Rigid;

use crate::{LiveError, color::Color, device::Device, stop::Pace, together::Together};

/// Sensors that record together.
#[derive(Debug, Clone, PartialEq)]
pub struct RigFile {
    path: PathBuf,
    sensors: Vec<Placed>,
}

/// One sensor of the file.
#[derive(Debug, Clone, PartialEq)]
struct Placed {
    device: Device,
    name: Option<String>,
    color: Option<Color>,
    rig_from_depth: Rigid,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Text {
    sensor: Vec<SensorText>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SensorText {
    /// As `--device` has it.
    device: String,
    /// Short name, unique in the rig; the device's own where there is none.
    name: Option<String>,
    /// The colour of another camera beside its depth, as `--color` has it.
    color: Option<String>,
    /// Where its depth camera stands in the rig's frame, metres.
    #[serde(default)]
    position: [f64; 3],
    /// How it is turned there: axis times angle, degrees.
    #[serde(default)]
    rotation: [f64; 3],
}

impl RigFile {
    /// Reads the file (TOML): a `[[sensor]]` for each with `device` and, where true, `name`, `position`, `rotation`.
    ///
    /// # Errors
    /// [`LiveError`] names the file and what is wrong with it.
    pub fn read(path: &Path) -> Result<Self, LiveError> {
        let text = read_text(path)?;
        let sensors = parse(&text).map_err(|e| LiveError::settings(path, e))?;
        Ok(Self { path: path.to_path_buf(), sensors })
    }

    /// Who sets the pace: the devices, where one of them does.
    pub fn pace(&self) -> Pace {
        let is_live = self.sensors.iter().any(|s| s.device.pace() == Pace::Live);
        if is_live { Pace::Live } else { Pace::OnDemand }
    }

    /// Losses of its recordings before they came here, a sentence each.
    ///
    /// # Errors
    /// [`LiveError`] where one cannot be read at all.
    pub fn damage(&self) -> Result<Vec<String>, LiveError> {
        let reported = self.sensors.iter().map(|placed| placed.device.damage());
        reported.filter_map(Result::transpose).collect()
    }

    /// Opens all sensors for a take of `subject` that will be `layer`.
    ///
    /// # Errors
    /// [`LiveError`] says which cannot be opened and why.
    pub fn open(&self, subject: &Subject, layer: &Layer) -> Result<Box<dyn Source>, LiveError> {
        let mut sources = Vec::new();
        for placed in &self.sensors {
            let mut source = placed.device.open(subject, layer)?;
            if let Some(color) = &placed.color {
                source = color.beside(source, placed.device.pace())?;
            }
            sources.push((source, placed.name.clone(), placed.rig_from_depth));
        }
        let together = Together::new(sources, self.pace());
        Ok(Box::new(together.map_err(|reason| LiveError::settings(&self.path, reason))?))
    }
}

/// The names of a file's sensors; `None` where a device's own counts.
///
/// # Errors
/// A sentence where the file cannot be used.
pub(crate) fn names(text: &str) -> Result<Vec<Option<String>>, String> {
    Ok(parse(text)?.into_iter().map(|placed| placed.name).collect())
}

fn parse(text: &str) -> Result<Vec<Placed>, String> {
    let file: Text = toml::from_str(text).map_err(|e| e.message().to_string())?;
    if file.sensor.is_empty() {
        return Err("[[sensor]] is missing: it must name at least one".into());
    }
    let placed = |sensor: SensorText| {
        if !sensor.position.iter().chain(&sensor.rotation).all(|v| v.is_finite()) {
            return Err(format!("{}: position and rotation must be finite numbers", sensor.device));
        }
        let rotation = sensor.rotation.map(f64::to_radians);
        let rig_from_depth = Rigid::new(sensor.position.into(), rotation.into());
        let color = sensor.color.map(|color| color.parse()).transpose()?;
        Ok(Placed { device: sensor.device.parse()?, name: sensor.name, color, rig_from_depth })
    };
    let sensors: Vec<Placed> = file.sensor.into_iter().map(placed).collect::<Result<_, _>>()?;
    if sensors.iter().any(|s| s.device.pace() != sensors[0].device.pace()) {
        return Err("cameras do not wait for recordings or the virtual sensor; put them into rigs of their own".into());
    }
    Ok(sensors)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sensors_stand_where_the_file_says() {
        let text = "[[sensor]]\ndevice = \"kinect1:A\"\n[[sensor]]\ndevice = \"realsense\"\nname = \"back\"\n\
                    position = [0.0, 0.0, 4.0]\nrotation = [0.0, 180.0, 0.0]\n";
        let sensors = parse(text).unwrap();
        assert_eq!(
            (sensors[0].device.clone(), sensors[0].rig_from_depth),
            (Device::Kinect1(Some("A".into())), Rigid::identity())
        );
        let seen = sensors[1].rig_from_depth * nalgebra::Point3::new(0.5, 0.0, 1.0);
        assert!((seen - nalgebra::Point3::new(-0.5, 0.0, 3.0)).norm() < 1e-12);
    }

    #[test]
    fn a_pipe_is_refused_without_waiting() {
        let dir = tempfile::tempdir().unwrap();
        let pipe = dir.path().join("rig.toml");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        let told = RigFile::read(&pipe).unwrap_err().to_string();
        assert!(told.contains("not a regular file"), "{told}");
        let device = Device::Stereo(pipe.clone());
        let subject = toile_capture::LockedSubject::create(&dir.path().join("anna")).unwrap();
        let layer = subject.next_take("body", None).unwrap().layer;
        let told = device.open(&subject, &layer).err().unwrap().to_string();
        assert!(told.contains("not a regular file"), "{told}");
    }

    #[test]
    fn what_is_wrong_is_named() {
        for (text, words) in [
            ("", "sensor"),
            ("sensor = []", "[[sensor]] is missing"),
            ("[[sensor]]\ndevice = \"kinect9\"", "choose of"),
            ("[[sensor]]\ndevice = \"kinect1\"\nplace = 1", "place"),
            ("[[sensor]]\ndevice = \"kinect1\"\ncolor = \"webcam:0\"", "needs a calibration"),
            ("[[sensor]]\ndevice = \"kinect1\"\n[[sensor]]\ndevice = \"synthetic\"", "rigs of their own"),
            ("[[sensor]]\ndevice = \"kinect1\"\nposition = [nan, 0.0, 0.0]", "finite"),
        ] {
            assert!(parse(text).unwrap_err().contains(words), "{text}");
        }
    }
}
