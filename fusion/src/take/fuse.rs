//! A whole take at once: read, survey, push every frame, finish.

use std::collections::BTreeMap;

use toile_capture::{Rig, Source};

use super::{
    fuser::{Fuser, Outcome},
    preparer::usable_sensor,
    survey::survey_sensor,
    waiting::{Waiting, spread},
};
use crate::{
    FusionError, FusionSettings, Scan, Volume,
    drop_reason::DropReason,
    finish::finish,
    report::DroppedFrame,
    rig::{Member, join},
    standing::fuse_standing,
    timings::Stopwatch,
    tracking::MAX_VIEWS,
};

/// Frames after this many wait packed, so that a long take fits in memory.
const UNPACKED: usize = 128;

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
    let ReadFrames { leader, frames, unreadable, others } = clock.time("read", || read_all(source, progress))?;
    let volume = match settings.volume {
        Volume::All => None,
        Volume::Auto => {
            let found = clock.time("survey", || survey_sensor(&rig, leader, &spread(&frames), settings));
            let is_still = matches!(found, Err(FusionError::NobodyInIt { .. }));
            if is_still && settings.poses.is_none() && !others.is_empty() {
                let groups = std::iter::once((leader, frames)).chain(others).collect();
                return stand_still(&rig, groups, unreadable, clock, settings, progress);
            }
            Some(found?)
        }
    };
    let mut fuser = Fuser::led_by(&rig, leader, volume, settings.clone())?;
    fuser.clock = clock;
    fuser.log.seen += unreadable.len();
    fuser.log.dropped.extend(unreadable);
    let arrivals: Vec<(i64, i64)> = frames.iter().map(Waiting::times).collect();
    fuser.log.leading_seen = frames.len();
    push_all(&mut fuser, frames, progress)?;
    join_others(&mut fuser, &rig, others, &arrivals)?;
    finish(fuser, &|x| progress(0.5 + 0.5 * x))
}

/// Fuses a take in which nothing moves before several sensors.
fn stand_still(
    rig: &Rig,
    groups: Vec<(usize, Vec<Waiting>)>,
    unreadable: Vec<DroppedFrame>,
    clock: Stopwatch,
    settings: &FusionSettings,
    progress: &(dyn Fn(f32) + Sync),
) -> Result<Scan, FusionError> {
    let (usable, others): (Vec<_>, Vec<_>) = groups.into_iter().partition(|g| usable_sensor(rig, g.0).is_ok());
    let members = usable.into_iter().map(|(sensor, frames)| Member::new(rig, sensor, frames, settings)).collect();
    let mut fuser = fuse_standing(rig, members, settings, clock)?;
    fuser.log.seen += unreadable.len();
    fuser.log.dropped.extend(unreadable);
    fuser.log.sensors_not_used.extend(others.iter().map(|g| name_of(rig, g.0)));
    finish(fuser, &|x| progress(0.5 + 0.5 * x))
}

fn name_of(rig: &Rig, sensor: usize) -> String {
    rig.sensors.get(sensor).map_or_else(|| format!("number {sensor}"), |s| s.name.clone())
}

/// Fuses the frames of the rig's other sensors.
fn join_others(
    fuser: &mut Fuser,
    rig: &Rig,
    others: Vec<(usize, Vec<Waiting>)>,
    arrivals: &[(i64, i64)],
) -> Result<(), FusionError> {
    // Known poses are those of the leading sensor.
    let joins = fuser.settings.poses.is_none() && !fuser.kept.is_empty();
    let mut members = Vec::new();
    for (sensor, frames) in others {
        if joins && usable_sensor(rig, sensor).is_ok() {
            members.push(Member::new(rig, sensor, frames, &fuser.settings));
        } else {
            fuser.log.sensors_not_used.push(name_of(rig, sensor));
        }
    }
    if members.is_empty() { Ok(()) } else { join(fuser, rig, members, arrivals) }
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

/// The content of a source.
struct ReadFrames {
    /// The sensor that leads: the first one with depth.
    leader: usize,
    /// Its frames.
    frames: Vec<Waiting>,
    /// Frames that could not be read.
    unreadable: Vec<DroppedFrame>,
    /// The frames of the other sensors that gave depth.
    others: Vec<(usize, Vec<Waiting>)>,
}

/// Reads all frames.
fn read_all(source: &mut dyn Source, progress: &(dyn Fn(f32) + Sync)) -> Result<ReadFrames, FusionError> {
    let total = source.frame_count();
    let (mut sensors, mut unreadable): (BTreeMap<usize, Vec<Waiting>>, _) = (BTreeMap::new(), Vec::new());
    let (mut count, mut failures) = (0, 0);
    loop {
        match source.next_frame() {
            Ok(Some(frame)) => {
                let frames = sensors.entry(frame.sensor).or_default();
                frames.push(Waiting::new(frame, count >= UNPACKED));
                count += 1;
            }
            Ok(None) => break,
            Err(error) => {
                failures += 1;
                if failures > 20 && failures > count {
                    return Err(error.into());
                }
                let index = (count + unreadable.len()) as u64;
                let reason = DropReason::Unreadable(error.to_string());
                unreadable.push(DroppedFrame { index, device_time_ns: 0, reason });
            }
        }
        if let Some(total) = total {
            progress(0.1 * (count as f32 / total.max(1) as f32).min(1.0));
        }
    }
    let with_depth = |frames: &[Waiting]| frames.iter().any(Waiting::has_depth);
    let Some(leader) = sensors.iter().find(|s| with_depth(s.1)).map(|s| *s.0) else {
        return Err(FusionError::NoDepth { frames: count });
    };
    let frames = sensors.remove(&leader).unwrap_or_default();
    let others = sensors.into_iter().filter(|s| with_depth(&s.1)).collect();
    Ok(ReadFrames { leader, frames, unreadable, others })
}
