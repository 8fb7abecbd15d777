//! `--device`, opened as a source of frames.

use std::{
    path::{Path, PathBuf},
    str::FromStr,
};

use toile_capture::{Layer, Replay, Source, Subject, files::read_text, subject::BODY};
use toile_driver_kinect1::{self as kinect1, Kinect1};
use toile_driver_kinect2::{self as kinect2, Kinect2};
use toile_driver_realsense::{self as realsense, Realsense};
use toile_driver_stereo::{StereoCamera, StereoSettings};
use toile_driver_synthetic::SyntheticDevice;
use toile_driver_transport::{libusb::LibusbBus, video::kernel::KernelVideo};
use toile_driver_uvc_depth::{self as uvc_depth, UvcDepthCamera};
use toile_synthetic::{GarmentKind, GarmentSettings, SyntheticSettings};

use crate::{DeviceError, LiveError, practice::Practice, stop::Pace};

/// How devices are written.
pub const DEVICES: &str = "kinect1[:SERIAL], kinect2[:SERIAL], realsense[:SERIAL], uvc:NODE,CALIBRATION, stereo:FILE, replay:FILE, \
     synthetic[:SEED], virtual[:SEED]";

/// Where frames come from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Device {
    /// The virtual sensor before a virtual person, who follows from the seed.
    Synthetic(u64),
    /// The same person in front of a camera that does not wait: for practice.
    Virtual(u64),
    /// A recording.
    Replay(PathBuf),
    /// The first Kinect v1, or that with this serial number.
    Kinect1(Option<String>),
    /// The first Kinect v2, or that with this serial number.
    Kinect2(Option<String>),
    /// The first RealSense camera, or that with this serial number.
    Realsense(Option<String>),
    /// A stereo rig: the file of its settings.
    Stereo(PathBuf),
    /// A UVC depth camera: its node, and the file of its calibration.
    Uvc(PathBuf, PathBuf),
}

impl FromStr for Device {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (kind, rest) = text.split_once(':').map_or((text, None), |(kind, rest)| (kind, Some(rest)));
        match (kind, rest) {
            ("synthetic", seed) => seed_of(seed).map(Self::Synthetic),
            ("virtual", seed) => seed_of(seed).map(Self::Virtual),
            ("replay", Some(file)) => Ok(Self::Replay(file.into())),
            ("kinect1", serial) => Ok(Self::Kinect1(serial.map(String::from))),
            ("kinect2", serial) => Ok(Self::Kinect2(serial.map(String::from))),
            ("realsense", serial) => Ok(Self::Realsense(serial.map(String::from))),
            ("stereo", Some(file)) => Ok(Self::Stereo(file.into())),
            ("uvc", Some(rest)) => {
                let (node, file) = rest.split_once(',').ok_or("write uvc:/dev/video2,calibration.toml")?;
                Ok(Self::Uvc(node.into(), file.into()))
            }
            _ => Err(format!("choose of {DEVICES}")),
        }
    }
}

impl Device {
    /// Who sets the pace.
    pub fn pace(&self) -> Pace {
        match self {
            Self::Synthetic(_) | Self::Replay(_) => Pace::OnDemand,
            Self::Virtual(_)
            | Self::Kinect1(_)
            | Self::Kinect2(_)
            | Self::Realsense(_)
            | Self::Stereo(_)
            | Self::Uvc(..) => Pace::Live,
        }
    }

    /// Losses of a recording before it came here (torn or damaged), in words.
    ///
    /// # Errors
    /// [`LiveError`] where it cannot be read at all.
    pub fn damage(&self) -> Result<Option<String>, LiveError> {
        let Self::Replay(file) = self else { return Ok(None) };
        Ok(Replay::open(file)?.lost().map(|lost| format!("{}: {lost}", file.display())))
    }

    /// Opens it for a take of `subject` that will be `layer`.
    ///
    /// # Errors
    /// [`LiveError`] says what is missing and what to do.
    pub fn open(&self, subject: &Subject, layer: &Layer) -> Result<Box<dyn Source>, LiveError> {
        let video = KernelVideo::default();
        match self {
            Self::Synthetic(seed) => {
                let settings = synthetic(*seed, subject, layer)?;
                let opened = SyntheticDevice::open(&settings, layer.number);
                Ok(Box::new(opened.map_err(DeviceError::from)?))
            }
            Self::Virtual(seed) => {
                let opened = Practice::open(&synthetic(*seed, subject, layer)?, layer.number);
                Ok(Box::new(opened.map_err(DeviceError::from)?))
            }
            Self::Replay(file) => Ok(Box::new(Replay::open(file)?)),
            Self::Kinect1(serial) => {
                let bus = LibusbBus::new().map_err(DeviceError::from)?;
                let opened = Kinect1::open(&bus, serial.as_deref(), kinect1::Settings::default());
                Ok(Box::new(opened.map_err(DeviceError::from)?))
            }
            Self::Kinect2(serial) => {
                let bus = LibusbBus::new().map_err(DeviceError::from)?;
                let opened = Kinect2::open(&bus, serial.as_deref(), kinect2::Settings::default());
                Ok(Box::new(opened.map_err(DeviceError::from)?))
            }
            Self::Realsense(serial) => {
                let opened = Realsense::open(&video, serial.as_deref(), realsense::Settings::default());
                Ok(Box::new(opened.map_err(DeviceError::from)?))
            }
            Self::Stereo(file) => {
                let opened = StereoCamera::open(&video, &stereo_settings(file)?);
                Ok(Box::new(opened.map_err(DeviceError::from)?))
            }
            Self::Uvc(node, calibration) => {
                let opened = UvcDepthCamera::open(&video, node, calibration, uvc_depth::Settings::default());
                Ok(Box::new(opened.map_err(DeviceError::from)?))
            }
        }
    }
}

/// The virtual person of this seed; the first one where none is given.
fn seed_of(seed: Option<&str>) -> Result<u64, String> {
    seed.unwrap_or("1").parse().map_err(|_| format!("`{}` is not a seed: give a whole number", seed.unwrap_or("")))
}

/// Settings of a stereo rig (TOML); files that they name are looked for beside them.
fn stereo_settings(file: &Path) -> Result<StereoSettings, LiveError> {
    let text = read_text(file)?;
    let wrong = |e: toml::de::Error| LiveError::settings(file, e.message());
    let mut settings: StereoSettings = toml::from_str(&text).map_err(wrong)?;
    let beside = file.parent().unwrap_or(Path::new(""));
    settings.calibration.iter_mut().for_each(|path| *path = beside.join(&*path));
    Ok(settings)
}

/// The virtual person wears what the subject's layers are called.
fn synthetic(seed: u64, subject: &Subject, layer: &Layer) -> Result<SyntheticSettings, LiveError> {
    let worn = subject.layers().iter().take(layer.number).chain([layer]).filter(|worn| worn.name != BODY);
    let names: Vec<&str> = if layer.name == BODY { Vec::new() } else { worn.map(|l| l.name.as_str()).collect() };
    let garment = |name: &&str| {
        let kinds = GarmentKind::ALL.map(GarmentKind::name).join(", ");
        let unknown = || LiveError::Usage(format!("--layer: the virtual person has no `{name}`; choose of {kinds}"));
        GarmentKind::from_name(name).map(GarmentSettings::of).ok_or_else(unknown)
    };
    let garments = names.iter().map(garment).collect::<Result<_, _>>()?;
    let name = subject.name().to_string();
    Ok(SyntheticSettings { name, seed, garments, ..SyntheticSettings::default() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn devices_by_their_names() {
        assert_eq!("synthetic".parse(), Ok(Device::Synthetic(1)));
        assert_eq!("synthetic:42".parse(), Ok(Device::Synthetic(42)));
        assert_eq!("virtual".parse(), Ok(Device::Virtual(1)));
        assert_eq!("kinect1:A1".parse(), Ok(Device::Kinect1(Some("A1".into()))));
        assert_eq!("kinect2".parse(), Ok(Device::Kinect2(None)));
        assert_eq!("realsense".parse(), Ok(Device::Realsense(None)));
        assert_eq!("stereo:rig.toml".parse(), Ok(Device::Stereo("rig.toml".into())));
        assert_eq!("replay:a:b.mcap".parse(), Ok(Device::Replay("a:b.mcap".into())));
        assert_eq!("uvc:/dev/video2,c.toml".parse(), Ok(Device::Uvc("/dev/video2".into(), "c.toml".into())));
        for wrong in ["kinect9", "synthetic:x", "virtual:", "replay", "uvc:/dev/video2", ""] {
            assert!(wrong.parse::<Device>().is_err(), "{wrong}");
        }
    }
}
