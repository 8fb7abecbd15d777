//! The further sensors' frames into the leading sensor's model.

use nalgebra::Point3;
use rayon::prelude::*;
use toile_geometry::Rigid;

use super::{
    alignment::{Seen, align},
    clocks::ClockMap,
    found::FoundSensor,
    member::Member,
    moved::find_push,
    path::Path,
    place::Subject,
    sighting::{Look, anywhere, few, near},
};
use crate::{
    FusionError,
    drop_reason::DropReason,
    finish::settle_poses,
    report::DroppedFrame,
    take::Fuser,
    tracking::{DEGENERATE, KeptFrame, Located, Tracked, samples},
};

/// Frames, and points of each, from which a place is refined.
const ALIGNED: usize = 48;
const POINTS: usize = 1500;

/// Fuses the frames of all further sensors. Those whose place is not found are named in the log.
///
/// # Errors
/// [`FusionError::TooLarge`] where the model outgrows its index.
pub(crate) fn join(fuser: &mut Fuser, mut waiting: Vec<Member>, arrivals: &[(i64, i64)]) -> Result<(), FusionError> {
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
        for member in std::mem::take(&mut waiting) {
            match locate(fuser, &member, &path) {
                Some(place) => fuse_at(fuser, member, &path, &place)?,
                None => left.push(member),
            }
        }
        waiting = left;
        if waiting.is_empty() || waiting.len() == before {
            break;
        }
    }
    for member in waiting {
        fuser.log.seen += member.frames.len() + member.dropped.len();
        fuser.log.dropped.extend(member.dropped);
        let lost = member.frames.iter().map(|p| dropped(&p.frame, DropReason::SensorNotPlaced));
        fuser.log.dropped.extend(lost);
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
    Subject { center: crate::tracking::centroid(&points, &leading.model_from_camera) }
}

/// Where a sensor stands in the room, roughly: near where the recording says, or anywhere around.
fn locate(fuser: &Fuser, member: &Member, path: &Path) -> Option<Rigid> {
    let look = |p| Look { frame: p, view: member.view(p), turn: path.at(p.time_ns) };
    let looks: Vec<Look> = few(&member.frames).collect::<Vec<_>>().into_par_iter().map(look).collect();
    let leading = &fuser.kept.frames[0];
    let camera_from_rig = fuser.sensors[leading.sensor].rig_from_depth.inverse();
    let told = leading.model_from_camera * camera_from_rig * fuser.sensors[member.sensor].rig_from_depth;
    let (field, subject) = (&fuser.model.field, subject_of(fuser));
    near(field, &looks, &told, &subject).or_else(|| {
        let found = anywhere(field, &looks, member.upright.as_ref()?, &subject)?;
        near(field, &looks, &found, &subject)
    })
}

/// Registers and fuses the frames of a sensor that stands at about `place`.
fn fuse_at(fuser: &mut Fuser, member: Member, path: &Path, place: &Rigid) -> Result<(), FusionError> {
    let field = &fuser.model.field;
    let one = |p| {
        let look = Look { frame: p, view: member.view(p), turn: path.at(p.time_ns) };
        look.register(field, place).ok_or(look.turn * place)
    };
    let tracked: Vec<Result<Tracked, Rigid>> =
        fuser.clock.time("track rig", || member.frames.par_iter().map(one).collect());
    let found = describe(fuser, &member, path, &tracked, place);
    fuser.rig.sensors.push(found);
    fuser.log.seen += member.frames.len() + member.dropped.len();
    fuser.log.dropped.extend(member.dropped);
    fuser.model.noise = fuser.model.noise.max(member.noise);
    for (prepared, tracked) in member.frames.into_iter().zip(tracked) {
        let Ok(tracked) = tracked else {
            fuser.log.dropped.push(dropped(&prepared.frame, DropReason::OffItsPlace));
            continue;
        };
        let view = prepared.depth.view(member.window);
        fuser.model.integrate(&view, &tracked.model_from_camera, &mut fuser.clock)?;
        let located = Located { model_from_camera: tracked.model_from_camera, tracked: Some(tracked) };
        let mut kept = KeptFrame::new(&prepared.frame, prepared.depth, member.window, &located);
        kept.time_ns = prepared.time_ns;
        fuser.kept.frames.push(kept);
    }
    Ok(())
}

/// The place of a sensor by all its frames together, and whether it was pushed aside.
fn describe(
    fuser: &Fuser,
    member: &Member,
    path: &Path,
    tracked: &[Result<Tracked, Rigid>],
    place: &Rigid,
) -> FoundSensor {
    let subject = subject_of(fuser);
    let fitting: Vec<usize> =
        (0..tracked.len()).filter(|&i| tracked[i].as_ref().is_ok_and(|t| t.conditioning > DEGENERATE)).collect();
    let turn = |i: usize| path.at(member.frames[i].time_ns);
    let places: Vec<Rigid> = fitting
        .iter()
        .filter_map(|&i| tracked[i].as_ref().ok().map(|t| turn(i).inverse() * t.model_from_camera))
        .collect();
    let push = find_push(&places, &subject);
    // The place that a push left is not the one that the next take begins with: the longer part counts.
    let rested = match push {
        Some(p) if 2 * p.at >= places.len() => 0..p.at,
        Some(p) => p.at..places.len(),
        None => 0..places.len(),
    };
    let still = &fitting[rested.clone()];
    let seen = |&i: &usize| Seen { turn: turn(i), points: samples(&member.view(&member.frames[i]), POINTS) };
    let frames: Vec<Seen> = still
        .iter()
        .step_by(still.len().div_ceil(ALIGNED).max(1))
        .collect::<Vec<_>>()
        .into_par_iter()
        .map(seen)
        .collect();
    let start = subject.mean(&places[rested]).unwrap_or(*place);
    let aligned = align(&fuser.model.field, &frames, &start);
    let room_from_camera = if aligned.conditioning > DEGENERATE { aligned.room_from_camera } else { start };
    tracing::debug!(sensor = member.name, ?aligned, ?start, "place");
    let first = member.frames.first().map_or(0, |p| p.time_ns);
    let seconds = |at: usize| (member.frames[fitting[at]].time_ns - first) as f64 * 1e-9;
    FoundSensor {
        sensor: member.sensor,
        frames_seen: member.frames.len() + member.dropped.len(),
        noise: member.noise,
        drift_ppm: -member.clock.drift * 1e6,
        by_arrival: member.clock.by_arrival,
        room_from_camera,
        push: push.map(|p| (p, seconds(p.at))),
    }
}

fn dropped(frame: &toile_capture::Frame, reason: DropReason) -> DroppedFrame {
    DroppedFrame { index: frame.index, device_time_ns: frame.device_time_ns, reason }
}
