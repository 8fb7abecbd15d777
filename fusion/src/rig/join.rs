//! The further sensors' frames into the leading sensor's model.

use nalgebra::Point3;
use rayon::prelude::*;
use toile_capture::Rig;
use toile_geometry::Rigid;

use super::{
    alignment::{Seen, align},
    clocks::ClockMap,
    found::FoundSensor,
    member::{Member, volume_at},
    moved::find_push,
    path::Path,
    place::Subject,
    sighting::{Agreed, Look, anywhere, few, near, pushed},
};
use crate::{
    FusionError,
    drop_reason::DropReason,
    finish::settle_poses,
    frame::CutDepth,
    take::Fuser,
    tracking::{DEGENERATE, KeptFrame, Located, Tracked, centroid, samples},
};

/// Frames, and points of each, from which a place is refined.
const ALIGNED: usize = 48;
const POINTS: usize = 1500;
/// Frames that do not fit, from which a sensor that was pushed is searched for.
const FEWEST_PUSHED: usize = 5;
/// The floor stays this far below what is registered while a place is known roughly, and while it is not known where a
/// camera was pushed to: a degree, and three and more, at the distance of a person.
const RAISED: f64 = 0.08;
const RAISED_FAR: f64 = 0.25;

/// A frame at its place.
type Registered = Option<(CutDepth, Tracked)>;

/// Fuses the frames of all further sensors. Those whose place is not found are named in the log.
///
/// # Errors
/// [`FusionError::TooLarge`] where the model outgrows its index.
pub(crate) fn join(
    fuser: &mut Fuser,
    rig: &Rig,
    mut waiting: Vec<Member>,
    arrivals: &[(i64, i64)],
) -> Result<(), FusionError> {
    let map = ClockMap::new(arrivals);
    fuser.rig.leading_ppm = -map.drift * 1e6;
    for k in &mut fuser.kept.frames {
        let arrival = arrivals.iter().find(|a| a.0 == k.device_time_ns).map_or(k.device_time_ns, |a| a.1);
        k.time_ns = map.host_ns(k.device_time_ns, arrival);
    }
    settle_poses(fuser)?;
    let path = Path::new(fuser.kept.frames.iter().map(|k| (k.time_ns, k.model_from_camera)));
    // One that sees little of what the leading sensor sees may see more of what the next one does.
    loop {
        let before = waiting.len();
        let mut left = Vec::new();
        for mut member in std::mem::take(&mut waiting) {
            match locate(fuser, rig, &mut member, &path) {
                Some(place) => fuse_at(fuser, &member, &path, &place)?,
                None => left.push(member),
            }
        }
        waiting = left;
        if waiting.is_empty() || waiting.len() == before {
            break;
        }
    }
    for member in waiting {
        fuser.log.seen += member.len();
        fuser.log.dropped.extend((0..member.len()).map(|i| member.dropped(i, DropReason::SensorNotPlaced)));
        fuser.log.sensors_not_used.push(member.name);
    }
    Ok(())
}

/// The point of the room that places are compared at.
fn subject_of(fuser: &Fuser) -> Subject {
    if fuser.volume.is_some() {
        return Subject { center: Point3::new(0.0, 0.9, 0.0) };
    }
    let leading = &fuser.kept.frames[0];
    let points = samples(&leading.view(), POINTS);
    Subject { center: centroid(&points, &leading.model_from_camera) }
}

/// Where a sensor stands in the room: near where the recording says, or anywhere around.
fn locate(fuser: &Fuser, rig: &Rig, member: &mut Member, path: &Path) -> Option<Rigid> {
    let leading = &fuser.kept.frames[0];
    let camera_from_rig = fuser.sensors[leading.sensor].rig_from_depth.inverse();
    let told = leading.model_from_camera * camera_from_rig * fuser.sensors[member.sensor].rig_from_depth;
    let (field, subject) = (&fuser.model.field, subject_of(fuser));
    let all: Vec<usize> = (0..member.len()).collect();
    let chosen: Vec<usize> = few(&all).copied().collect();
    let within = volume_at(fuser.volume.as_ref(), &told, RAISED);
    let first = chosen.iter().find_map(|&i| member.depth(i, within.as_ref()).ok());
    if let Some(depth) = first {
        member.adapt(&depth);
        let looks = member.looks(&chosen, path, within.as_ref());
        if let Some(agreed) = near(field, &looks, &told, &subject) {
            return Some(refined(fuser, &looks, &agreed));
        }
    }
    let volume = member.survey(rig, &fuser.settings).ok()??;
    let depth = chosen.iter().find_map(|&i| member.depth(i, Some(&volume)).ok())?;
    member.adapt(&depth);
    let looks = member.looks(&chosen, path, Some(&volume));
    let found = anywhere(field, &looks, &volume.model_from_camera, &subject)?;
    near(field, &looks, &found.0, &subject).map(|agreed| refined(fuser, &looks, &agreed))
}

/// A place refined over the frames that agree on it.
fn refined(fuser: &Fuser, looks: &[Look], (place, near): &Agreed) -> Rigid {
    let seen = |&i: &usize| Seen { turn: looks[i].turn, points: samples(&looks[i].view, POINTS) };
    let seen: Vec<Seen> = near.par_iter().map(seen).collect();
    let aligned = align(&fuser.model.field, &seen, place);
    if aligned.conditioning > DEGENERATE { aligned.room_from_camera } else { *place }
}

/// Registers and fuses the frames of a sensor that stands at about `place`.
fn fuse_at(fuser: &mut Fuser, member: &Member, path: &Path, place: &Rigid) -> Result<(), FusionError> {
    let registered = register_all(fuser, member, path, place);
    let found = describe(fuser, member, path, &registered, place);
    fuser.rig.sensors.push(found);
    fuser.log.seen += member.len();
    fuser.model.noise = fuser.model.noise.max(member.noise);
    for (i, registered) in registered.into_iter().enumerate() {
        let Some((depth, tracked)) = registered else {
            let reason = if member.has_depth(i) { DropReason::OffItsPlace } else { DropReason::NoDepth };
            fuser.log.dropped.push(member.dropped(i, reason));
            continue;
        };
        let view = depth.view(member.window);
        fuser.model.integrate(&view, &tracked.model_from_camera, &mut fuser.clock)?;
        let located = Located { model_from_camera: tracked.model_from_camera, tracked: Some(tracked) };
        let mut kept = KeptFrame::new(member.frame(i), depth, member.window, &located);
        kept.time_ns = member.time_ns(i);
        fuser.kept.frames.push(kept);
    }
    Ok(())
}

/// Every frame's registration from a sensor's place, where it can be trusted. Frames that do not fit there may fit where the
/// sensor was pushed to.
fn register_all(fuser: &mut Fuser, member: &Member, path: &Path, place: &Rigid) -> Vec<Registered> {
    let all: Vec<usize> = (0..member.len()).collect();
    let mut registered = register(fuser, member, path, &all, place);
    let lost: Vec<usize> = all.into_iter().filter(|&i| registered[i].is_none()).collect();
    if lost.len() < FEWEST_PUSHED {
        return registered;
    }
    let within = volume_at(fuser.volume.as_ref(), place, RAISED_FAR);
    let chosen: Vec<usize> = few(&lost).copied().collect();
    let looks = member.looks(&chosen, path, within.as_ref());
    let subject = subject_of(fuser);
    if let Some(pushed_to) = pushed(&fuser.model.field, &looks, place, &subject) {
        let pushed_to = refined(fuser, &looks, &pushed_to);
        let again = register(fuser, member, path, &lost, &pushed_to);
        lost.into_iter().zip(again).for_each(|(i, found)| registered[i] = found);
    }
    registered
}

/// The registration of some frames from a place, where it can be trusted.
fn register(fuser: &mut Fuser, member: &Member, path: &Path, frames: &[usize], place: &Rigid) -> Vec<Registered> {
    let within = volume_at(fuser.volume.as_ref(), place, 0.0);
    let field = &fuser.model.field;
    let one = |&i: &usize| {
        let depth = member.depth(i, within.as_ref()).ok()?;
        let look = Look { view: depth.view(member.window), turn: path.at(member.time_ns(i)) };
        look.register(field, place).map(|tracked| (depth, tracked))
    };
    fuser.clock.time("track rig", || frames.par_iter().map(one).collect())
}

/// The place of a sensor by all its frames together, and whether it was pushed aside.
fn describe(fuser: &Fuser, member: &Member, path: &Path, registered: &[Registered], place: &Rigid) -> FoundSensor {
    let subject = subject_of(fuser);
    let turn = |i: usize| path.at(member.time_ns(i));
    let fitting: Vec<(usize, &CutDepth, Rigid)> = (0..registered.len())
        .filter_map(|i| registered[i].as_ref().map(|r| (i, &r.0, &r.1)))
        .filter(|(_, _, tracked)| tracked.conditioning > DEGENERATE)
        .map(|(i, depth, tracked)| (i, depth, turn(i).inverse() * tracked.model_from_camera))
        .collect();
    let places: Vec<Rigid> = fitting.iter().map(|f| f.2).collect();
    let push = find_push(&places, &subject);
    // The place that a push left is not the one that the next take begins with: the longer part counts.
    let rested = match push {
        Some(p) if 2 * p.at >= places.len() => 0..p.at,
        Some(p) => p.at..places.len(),
        None => 0..places.len(),
    };
    let start = subject.mean(&places[rested.clone()]).unwrap_or(*place);
    let still = &fitting[rested];
    let chosen: Vec<_> = still.iter().step_by(still.len().div_ceil(ALIGNED).max(1)).collect();
    let look = |f: &&(usize, &CutDepth, Rigid)| Look { view: f.1.view(member.window), turn: turn(f.0) };
    let looks: Vec<Look> = chosen.par_iter().map(look).collect();
    let first = member.time_ns(0);
    let seconds = |at: usize| (member.time_ns(fitting[at].0) - first) as f64 * 1e-9;
    FoundSensor {
        sensor: member.sensor,
        frames_seen: member.len(),
        noise: member.noise,
        drift_ppm: -member.clock.drift * 1e6,
        by_arrival: member.clock.by_arrival,
        room_from_camera: refined(fuser, &looks, &(start, (0..looks.len()).collect())),
        push: push.map(|p| (p, seconds(p.at))),
    }
}
