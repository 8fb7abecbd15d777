//! `--color`: the colour of another camera beside a depth camera's frames.

use std::{path::PathBuf, str::FromStr};

use toile_capture::{Replay, Source};
use toile_driver_webcam::{ColorBeside, ColorCalibration, Webcam};

use crate::{DeviceError, LiveError, stop::Pace};

/// A camera whose colour is put beside a depth camera's frames, and the file of its calibration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Color {
    camera: Camera,
    calibration: PathBuf,
}

#[derive(Debug, Clone, PartialEq, Eq)]
enum Camera {
    /// A webcam by its index, as `toile devices` lists it.
    Webcam(u32),
    /// A recording whose first sensor has colour.
    Replay(PathBuf),
}

impl FromStr for Color {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let usage = "write webcam:INDEX,CALIBRATION or replay:FILE,CALIBRATION";
        let (kind, rest) = text.split_once(':').ok_or(usage)?;
        let (camera, file) = rest.rsplit_once(',').unwrap_or((rest, ""));
        let camera = match kind {
            "webcam" => {
                Camera::Webcam(camera.parse().map_err(|_| format!("`{camera}` is not a webcam's number; {usage}"))?)
            }
            "replay" => Camera::Replay(camera.into()),
            _ => return Err(usage.into()),
        };
        if file.is_empty() {
            return Err(format!(
                "colour beside a depth camera needs a calibration, which says its lens and where the depth camera stands: \
                 {usage} (docs/devices.md has the file)"
            ));
        }
        Ok(Self { camera, calibration: file.into() })
    }
}

impl Color {
    /// Who sets the pace.
    pub fn pace(&self) -> Pace {
        match self.camera {
            Camera::Webcam(_) => Pace::Live,
            Camera::Replay(_) => Pace::OnDemand,
        }
    }

    /// Opens the camera and puts its colour beside the depth of `depth`, whose pace is `pace`.
    ///
    /// # Errors
    /// [`LiveError`] where the calibration or the camera cannot be used, where the two do not go together, or where one
    /// of them is a camera and the other is not.
    pub fn beside(&self, depth: Box<dyn Source>, pace: Pace) -> Result<Box<dyn Source>, LiveError> {
        if pace != self.pace() {
            let reason =
                "--color: a camera does not wait for a recording or the virtual sensor; take both live or neither";
            return Err(LiveError::Usage(reason.into()));
        }
        let calibration = ColorCalibration::read(&self.calibration).map_err(LiveError::Color)?;
        let size = (calibration.camera.width, calibration.camera.height);
        let color: Box<dyn Source> = match &self.camera {
            Camera::Webcam(index) => Box::new(Webcam::open(*index, Some(size)).map_err(DeviceError::from)?),
            Camera::Replay(file) => Box::new(Replay::open(file)?),
        };
        Ok(Box::new(ColorBeside::new(depth, color, &calibration, pace == Pace::Live).map_err(LiveError::Color)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_by_their_names() {
        let color = |camera, file: &str| Ok(Color { camera, calibration: file.into() });
        assert_eq!("webcam:0,c.toml".parse(), color(Camera::Webcam(0), "c.toml"));
        assert_eq!("replay:a,b.mcap,c.toml".parse(), color(Camera::Replay("a,b.mcap".into()), "c.toml"));
        for (wrong, words) in [
            ("webcam:0", "needs a calibration"),
            ("webcam:0,", "needs a calibration"),
            ("replay:a.mcap", "needs a calibration"),
            ("webcam:x,c.toml", "not a webcam's number"),
            ("kinect1,c.toml", "write webcam:"),
            ("kinect1:0,c.toml", "write webcam:"),
            ("", "write webcam:"),
        ] {
            let error = wrong.parse::<Color>().unwrap_err();
            assert!(error.contains(words), "{wrong}: {error}");
        }
    }
}
