//! The rig as a source of frames.

use std::{path::PathBuf, sync::Arc};

use serde::{Deserialize, Serialize};
use toile_capture::{CaptureError, ClockDomain, ColorImage, DeviceIdentity, Frame, Rig, Sensor, Source};
use toile_driver_transport::video::Video;
use toile_geometry::Rigid;
use toile_stereo::{DepthFromPair, DepthSettings, StereoCalibration, read_calibration, rectify};

use crate::{
    StereoDriverError,
    pairing::{Moment, Picture, Side},
    pairs::{Pairs, SideBySide, TwoCameras},
    stream::{FolderPictures, NodePictures},
};

/// Where the pictures come from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Cameras {
    /// One UVC camera that sends both views side by side.
    SideBySide {
        /// Its V4L2 node, such as `/dev/video2`.
        node: PathBuf,
    },
    /// Two UVC cameras.
    Two {
        /// V4L2 node of the left one.
        left: PathBuf,
        /// V4L2 node of the right one.
        right: PathBuf,
    },
    /// A folder with the pictures `left01.png`, `right01.png`, and so on.
    Folder {
        /// The folder.
        path: PathBuf,
    },
}

/// Columns and rows that no camera's view exceeds.
const MAX_PIXELS: u32 = 16_384;

/// A stereo rig.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StereoSettings {
    /// Short name of the sensor.
    pub name: String,
    /// Where the pictures come from.
    pub cameras: Cameras,
    /// Columns of one view, pixels.
    pub width: u32,
    /// Rows of one view, pixels.
    pub height: u32,
    /// Frames a second.
    pub fps: f64,
    /// Files of the calibration: one, or intrinsics and extrinsics.
    pub calibration: Vec<PathBuf>,
    /// Metres a unit of the calibration's translation; 0.001 for millimetres.
    pub metres_per_unit: f64,
    /// How much of the cameras' view is kept, 0 (only what both see without gaps) to 1 (everything); default 0.
    #[serde(default)]
    pub alpha: f64,
    /// Range of depth and matching.
    #[serde(default)]
    pub depth: DepthSettings,
}

/// Counts of the pictures so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct PairCounts {
    /// Pairs that gave a depth frame.
    pub paired: u64,
    /// Left pictures without a right one: given as frames with colour alone.
    pub left_alone: u64,
    /// Right pictures without a left one: counted here only, since nothing can be shown in the left camera's place.
    pub right_alone: u64,
    /// Pictures that were not whole, each reported as an error.
    pub torn: u64,
}

/// Two cameras as one depth camera: depth and colour are those of the rectified left view.
pub struct StereoCamera {
    pairs: Box<dyn Pairs>,
    depth: DepthFromPair,
    rig: Rig,
    counts: PairCounts,
    next_index: u64,
    last_left: Option<u64>,
    /// A camera failed: that was reported, and nothing comes after it.
    ended: bool,
}

impl StereoCamera {
    /// Opens the rig that `settings` describe, its cameras among the nodes of `video`.
    ///
    /// # Errors
    /// [`StereoDriverError`] names the node, file or setting.
    pub fn open(video: &dyn Video, settings: &StereoSettings) -> Result<Self, StereoDriverError> {
        let StereoSettings { width, height, fps, .. } = *settings;
        if width.max(height) > MAX_PIXELS {
            return Err(StereoDriverError::Size { width, height });
        }
        let calibration = read_calibration(&settings.calibration, settings.metres_per_unit)?;
        let pairs: Box<dyn Pairs> = match &settings.cameras {
            Cameras::SideBySide { node } => {
                Box::new(SideBySide::new(NodePictures::open(video, node, Side::Left, (2 * width, height))?))
            }
            Cameras::Two { left, right } => Box::new(TwoCameras::new(
                NodePictures::open(video, left, Side::Left, (width, height))?,
                NodePictures::open(video, right, Side::Right, (width, height))?,
                fps,
            )),
            Cameras::Folder { path } => Box::new(TwoCameras::new(
                FolderPictures::open(path, "left", Side::Left, fps)?,
                FolderPictures::open(path, "right", Side::Right, fps)?,
                fps,
            )),
        };
        let mut rig = Self::new(pairs, &calibration, settings)?;
        if !matches!(settings.cameras, Cameras::Folder { .. }) {
            // Video nodes stamp pictures by the kernel's clock.
            rig.rig.sensors[0].identity.clock = ClockDomain::HostMonotonic;
        }
        Ok(rig)
    }

    /// A rig over any source of pairs; of the settings, `cameras`, `calibration` and `metres_per_unit` are not looked at.
    ///
    /// # Errors
    /// [`StereoDriverError::Stereo`] where the cameras cannot be rectified or the range cannot be searched.
    pub fn new(
        pairs: Box<dyn Pairs>,
        calibration: &StereoCalibration,
        settings: &StereoSettings,
    ) -> Result<Self, StereoDriverError> {
        let rectification = rectify(calibration, (settings.width, settings.height), Some(settings.alpha))?;
        let camera = rectification.camera;
        let depth = DepthFromPair::new(rectification, settings.depth)?;
        let sensor = Sensor {
            name: settings.name.clone(),
            identity: DeviceIdentity { model: "stereo rig".into(), ..DeviceIdentity::default() },
            depth: camera,
            depth_scale: settings.depth.depth_scale,
            color: Some(camera),
            color_from_depth: Rigid::identity(),
            rig_from_depth: Rigid::identity(),
            fps: settings.fps,
        };
        let rig = Rig { sensors: vec![sensor] };
        Ok(Self { pairs, depth, rig, counts: PairCounts::default(), next_index: 0, last_left: None, ended: false })
    }

    /// Counts of the pictures so far.
    pub fn counts(&self) -> PairCounts {
        self.counts
    }

    /// How pictures become depth.
    pub fn depth(&self) -> &DepthFromPair {
        &self.depth
    }

    /// A frame of the left picture, with depth where there is a right one.
    fn frame(&mut self, left: &Picture, right: Option<&Picture>) -> Result<Frame, CaptureError> {
        let index = self.next_index;
        let wrong = |reason: String| CaptureError::Frame { index, reason };
        let lost = self.last_left.map_or(0, |last| left.sequence.saturating_sub(last).saturating_sub(1));
        let (depth, color) = match right {
            Some(right) => {
                let found = self.depth.depth(&left.image, &right.image).map_err(|e| wrong(e.to_string()))?;
                (Some(Arc::new(found.depth)), found.left)
            }
            None => (None, self.depth.rectified_left(&left.image).map_err(|e| wrong(e.to_string()))?),
        };
        self.last_left = Some(left.sequence);
        self.next_index += 1;
        Ok(Frame {
            sensor: 0,
            index,
            device_frame: left.sequence,
            lost_before: u32::try_from(lost).unwrap_or(u32::MAX),
            device_time_ns: left.time_ns,
            host_time_ns: left.host_time_ns,
            depth,
            color: Some(ColorImage::Rgb(Arc::new(color))),
        })
    }

    /// Errors of one picture are of one frame; the rest are the device's.
    fn reported(&mut self, error: StereoDriverError) -> CaptureError {
        match error {
            StereoDriverError::Picture { .. } => {
                self.counts.torn += 1;
                CaptureError::Frame { index: self.next_index, reason: error.to_string() }
            }
            StereoDriverError::Recording(error) => error,
            error => {
                self.ended = true;
                CaptureError::Device { device: self.rig.sensors[0].name.clone(), reason: error.to_string() }
            }
        }
    }
}

impl Source for StereoCamera {
    fn rig(&self) -> &Rig {
        &self.rig
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, CaptureError> {
        while !self.ended {
            match self.pairs.next_moment().map_err(|e| self.reported(e))? {
                None => return Ok(None),
                Some(Moment::Pair(left, right)) => {
                    let frame = self.frame(&left, Some(&right))?;
                    self.counts.paired += 1;
                    return Ok(Some(frame));
                }
                Some(Moment::Alone(Side::Left, left)) => {
                    let frame = self.frame(&left, None)?;
                    self.counts.left_alone += 1;
                    return Ok(Some(frame));
                }
                Some(Moment::Alone(Side::Right, _)) => self.counts.right_alone += 1,
            }
        }
        Ok(None)
    }
}
