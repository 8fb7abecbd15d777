//! The frames of resting cameras around a subject that stands still, fused from where the cameras stand.

use rayon::prelude::*;
use toile_capture::Rig;
use toile_geometry::Rigid;

use super::{
    agreed::agreed,
    align::{Sight, align, sights},
    shared::{Shared, shared},
};
use crate::{
    FusionError, FusionSettings,
    drop_reason::DropReason,
    rig::{FoundSensor, Member, volume_at},
    subject::{Eye, SubjectVolume, find_standing},
    take::Fuser,
    timings::Stopwatch,
    tracking::{KeptFrame, Located},
};

/// Cameras that see less of each other's part of the subject than this share do not overlap: of a cylinder, cameras a
/// quarter of a circle apart share a third, of which half is seen less obliquely than 60 degrees; those a third apart a sixth.
const OVERLAP: f64 = 0.03;
/// Cameras that look through more than this share of what others see of the subject are not where they are thought to be.
const CONTRADICTED: f64 = 0.1;

/// Fuses a take of a subject that stands still: a fuser that holds every frame, and need only be finished.
///
/// # Errors
/// [`FusionError::NobodyInIt`] where nobody stands where the sensors look, [`FusionError::NoOverlap`] where their pictures
/// cannot be brought together.
pub(crate) fn fuse_standing(
    rig: &Rig,
    mut members: Vec<Member>,
    settings: &FusionSettings,
    mut clock: Stopwatch,
) -> Result<Fuser, FusionError> {
    let mut eyes: Vec<Eye> = clock.time("agree", || members.par_iter().map(|m| eye(rig, m)).collect());
    let volume = find_standing(&eyes)?;
    let (sights, noise) = sights(&eyes, &volume);
    let mut poses: Vec<Rigid> = eyes.iter().map(|e| e.rig_from_camera).collect();
    clock.time("align", || align(&sights, noise, &volume, &mut poses));
    let used = together(rig, &members, &sights, &poses)?;
    eyes.iter_mut().zip(&poses).for_each(|(eye, pose)| eye.rig_from_camera = *pose);
    let volume = find_standing(&eyes)?;
    let model_from_rig = volume.model_from_camera * poses[0].inverse();
    let mut fuser = Fuser::led_by(rig, members[0].sensor, Some(volume.clone()), settings.clone())?;
    fuser.clock = clock;
    fuser.stands_still = true;
    fuser.log.leading_seen = members[0].len();
    for (k, member) in members.iter_mut().enumerate() {
        fuser.log.seen += member.len();
        if used[k] {
            fuse_member(&mut fuser, member, &volume, &(model_from_rig * poses[k]))?;
        } else {
            fuser.log.dropped.extend((0..member.len()).map(|i| member.dropped(i, DropReason::SensorNotPlaced)));
            fuser.log.sensors_not_used.push(member.name.clone());
        }
    }
    Ok(fuser)
}

/// What a sensor sees, from where the recording says that it stands.
fn eye(rig: &Rig, member: &Member) -> Eye {
    Eye {
        camera: member.camera(),
        seen: agreed(&member.filtered()),
        rig_from_camera: rig.sensors[member.sensor].rig_from_depth,
    }
}

/// The sensors that hang together with the first one.
///
/// # Errors
/// [`FusionError::NoOverlap`] where none does, or where they contradict each other.
fn together(rig: &Rig, members: &[Member], sights: &[Sight], poses: &[Rigid]) -> Result<Vec<bool>, FusionError> {
    let name = |k: usize| rig.sensors[members[k].sensor].name.clone();
    let between = |i: usize, j: usize| shared((&sights[i], &poses[i]), (&sights[j], &poses[j]));
    let pairs: Vec<(usize, usize)> = (0..poses.len()).flat_map(|i| (i + 1..poses.len()).map(move |j| (i, j))).collect();
    let found: Vec<Shared> = pairs.par_iter().map(|&(i, j)| between(i, j)).collect();
    tracing::debug!(?pairs, ?found, "standing subject");
    let mut used = vec![false; poses.len()];
    used[0] = true;
    for _ in 0..poses.len() {
        for (&(i, j), shared) in pairs.iter().zip(&found) {
            if shared.seen > OVERLAP && (used[i] || used[j]) {
                (used[i], used[j]) = (true, true);
            }
        }
    }
    let no_overlap = |sensors: Vec<usize>, reason: &str| FusionError::NoOverlap {
        sensors: sensors.into_iter().map(name).collect::<Vec<String>>().join("`, `"),
        reason: reason.into(),
    };
    let against = |(&(i, j), shared): (&(usize, usize), &Shared)| {
        (used[i] && used[j] && shared.contradicted > CONTRADICTED).then_some(vec![i, j])
    };
    if used.iter().filter(|u| **u).count() < 2 {
        return Err(no_overlap((0..poses.len()).collect(), "see no part of the subject in common"));
    }
    match pairs.iter().zip(&found).find_map(against) {
        Some(sensors) => Err(no_overlap(sensors, "do not agree on where the subject is")),
        None => Ok(used),
    }
}

/// Fuses the frames of a sensor at its place.
fn fuse_member(
    fuser: &mut Fuser,
    member: &mut Member,
    volume: &SubjectVolume,
    place: &Rigid,
) -> Result<(), FusionError> {
    let within = volume_at(Some(volume), place, 0.0);
    let mut fused = false;
    for i in 0..member.len() {
        let depth = match member.depth(i, within.as_ref()) {
            Ok(depth) => depth,
            Err(reason) => {
                fuser.log.dropped.push(member.dropped(i, reason));
                continue;
            }
        };
        if !std::mem::replace(&mut fused, true) {
            member.adapt(&depth);
            if fuser.kept.is_empty() {
                fuser.model.adapt(&depth);
            }
            fuser.model.noise = fuser.model.noise.max(member.noise);
        }
        fuser.model.integrate(&depth.view(member.window), place, &mut fuser.clock)?;
        let located = Located { model_from_camera: *place, tracked: None };
        let mut kept = KeptFrame::new(member.frame(i), depth, member.window, &located);
        kept.time_ns = member.time_ns(i);
        fuser.kept.frames.push(kept);
    }
    let leading = fuser.kept.frames.first().map(|k| k.sensor);
    if leading.is_some_and(|leading| leading != member.sensor) && fused {
        fuser.rig.sensors.push(FoundSensor::resting(member, place));
    }
    Ok(())
}
