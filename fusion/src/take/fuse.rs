//! A whole take at once: read, survey, push every frame, finish.

use std::{collections::BTreeSet, sync::Arc};

use rayon::prelude::*;
use toile_capture::{DepthImage, Frame, Rig, Source, depth_codec};

use super::{
    fuser::{Fuser, Outcome},
    preparer::{Filter, first_sensor},
};
use crate::{
    FusionError, FusionSettings, Scan, Volume,
    drop_reason::DropReason,
    finish::finish,
    report::DroppedFrame,
    subject::{SURVEY_FRAMES, SubjectVolume, find_volume},
    timings::Stopwatch,
    tracking::MAX_VIEWS,
};

/// Frames after this many wait packed, so that a long take fits in memory.
const UNPACKED: usize = 128;

/// A frame that waits for the volume to be found.
struct Waiting {
    frame: Frame,
    packed: Vec<u8>,
}

impl Waiting {
    fn new(mut frame: Frame, pack: bool) -> Self {
        let packed = frame.depth.as_ref().filter(|_| pack).and_then(|d| depth_codec::encode(d).ok());
        if packed.is_some() {
            frame.depth = None;
        }
        Self { frame, packed: packed.unwrap_or_default() }
    }

    fn has_depth(&self) -> bool {
        self.frame.depth.is_some() || !self.packed.is_empty()
    }

    /// The frame with its depth.
    fn unpacked(&self) -> Frame {
        let mut frame = self.frame.clone();
        if !self.packed.is_empty() {
            frame.depth = depth_codec::decode(&self.packed).ok().map(Arc::<DepthImage>::new);
        }
        frame
    }
}

/// Fuses a whole take: surveys it for the subject's volume, pushes every frame, finishes.
///
/// # Errors
/// Where there is nothing to make a scan of: no depth, nobody who turns, no frames that fit together; and where the
/// source fails altogether. Frames that cannot be read or tracked are dropped and reported.
pub fn fuse(
    source: &mut dyn Source,
    settings: &FusionSettings,
    progress: &(dyn Fn(f32) + Sync),
) -> Result<Scan, FusionError> {
    let rig = source.rig().clone();
    let mut clock = Stopwatch::new();
    let ReadFrames { frames, unreadable, other_sensors } = clock.time("read", || read_all(source, progress))?;
    let volume = match settings.volume {
        Volume::All => None,
        Volume::Auto => Some(clock.time("survey", || survey(&rig, &spread(&frames), settings))?),
    };
    let mut fuser = Fuser::new(&rig, volume, settings.clone())?;
    fuser.clock = clock;
    fuser.log.seen += unreadable.len();
    fuser.log.dropped.extend(unreadable);
    fuser.log.sensors_not_used = other_sensors;
    push_all(&mut fuser, frames, progress)?;
    finish(fuser, &|x| progress(0.5 + 0.5 * x))
}

/// Pushes every frame; a few views are tried again where they could not be placed at once.
fn push_all(fuser: &mut Fuser, frames: Vec<Waiting>, progress: &(dyn Fn(f32) + Sync)) -> Result<(), FusionError> {
    let count = frames.len().max(1) as f32;
    let are_views = frames.len() <= MAX_VIEWS;
    if are_views {
        fuser.expect_few_views();
    }
    let mut dropped = Vec::new();
    for (i, frame) in frames.into_iter().enumerate() {
        let frame = fuser.clock.time("unpack", || frame.unpacked());
        if matches!(fuser.push(&frame)?, Outcome::Dropped { .. }) && are_views {
            dropped.push(frame);
        }
        progress(0.1 + 0.4 * (i + 1) as f32 / count);
    }
    if dropped.is_empty() { Ok(()) } else { fuser.retry(dropped) }
}

/// Frames with depth spread over the take.
fn spread(frames: &[Waiting]) -> Vec<Frame> {
    let with_depth: Vec<&Waiting> = frames.iter().filter(|f| f.has_depth()).collect();
    let step = with_depth.len().div_ceil(SURVEY_FRAMES).max(1);
    with_depth.into_iter().step_by(step).map(Waiting::unpacked).collect()
}

/// The content of a source.
struct ReadFrames {
    /// The frames of the first sensor.
    frames: Vec<Waiting>,
    /// Frames that could not be read.
    unreadable: Vec<DroppedFrame>,
    /// Names of the other sensors that gave depth.
    other_sensors: Vec<String>,
}

/// Reads all frames.
fn read_all(source: &mut dyn Source, progress: &(dyn Fn(f32) + Sync)) -> Result<ReadFrames, FusionError> {
    let total = source.frame_count();
    let (mut frames, mut unreadable): (Vec<Waiting>, _) = (Vec::new(), Vec::new());
    let mut others = BTreeSet::new();
    let mut failures = 0;
    loop {
        match source.next_frame() {
            Ok(Some(frame)) if frame.sensor == 0 => {
                let pack = frames.len() >= UNPACKED;
                frames.push(Waiting::new(frame, pack));
            }
            Ok(Some(frame)) => others.extend(frame.depth.map(|_| frame.sensor)),
            Ok(None) => break,
            Err(error) => {
                failures += 1;
                if failures > 20 && failures > frames.len() {
                    return Err(error.into());
                }
                let index = (frames.len() + unreadable.len()) as u64;
                unreadable.push(DroppedFrame {
                    index,
                    device_time_ns: 0,
                    reason: DropReason::Unreadable(error.to_string()),
                });
            }
        }
        if let Some(total) = total {
            progress(0.1 * (frames.len() as f32 / total.max(1) as f32).min(1.0));
        }
    }
    if !frames.iter().any(Waiting::has_depth) {
        return Err(FusionError::NoDepth { frames: frames.len() });
    }
    let name = |k: usize| source.rig().sensors.get(k).map_or_else(|| format!("number {k}"), |s| s.name.clone());
    Ok(ReadFrames { frames, unreadable, other_sensors: others.into_iter().map(name).collect() })
}

/// Finds the subject's volume in frames spread over the take.
///
/// # Errors
/// [`FusionError::NobodyInIt`], or a calibration that cannot be used.
pub fn survey(rig: &Rig, frames: &[Frame], settings: &FusionSettings) -> Result<SubjectVolume, FusionError> {
    let filter = Filter::new(first_sensor(rig)?, settings);
    let with_depth: Vec<&Frame> = frames.iter().filter(|f| f.depth.is_some()).collect();
    let step = with_depth.len().div_ceil(SURVEY_FRAMES).max(1);
    let chosen: Vec<&Frame> = with_depth.into_iter().step_by(step).collect();
    let depths: Vec<Vec<f32>> = chosen.par_iter().filter_map(|f| filter.apply(f)).collect();
    find_volume(&filter.rectifier.camera, &depths)
}
