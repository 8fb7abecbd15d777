//! Moving layers as files: `SUBJECT/motion/NAME/`, a point cache a layer.

mod caches;
mod options;
mod pictures;
mod playable;
mod report;

use std::{
    path::{Component, Path, PathBuf},
    time::Instant,
};

use toile_animation::{
    AnimationError,
    blend::{Blend, Outfit, OutfitLayer, Wearer},
    resample,
};
use toile_avatar::Avatar;
use toile_capture::printable;
use toile_character::{BodyModel, Motion, Pose};
use toile_cloth::Fabric;
use toile_garments::{Apart, GarmentType};

use self::{caches::Caches, pictures::Pictures, report::FrameReport};
pub use self::{options::AnimateOptions, report::AnimationReport};
use crate::{
    Goal, Observer, Options, PipelineError, Run,
    avatar_choice::AvatarChoice,
    body_file::Body,
    garment::{self, Garment},
    options::MotionChoice,
    process::process,
    settings,
    step::Remarks,
    steps::export,
};

/// Expected seconds a frame of a garment.
const SECONDS: f64 = 0.15;
/// Seconds over which the layers come from the pose of the scan into the motion's first, seconds in which they settle there, and
/// seconds a step: a tenth of the way.
const WARM_UP: (f64, f64, f64) = (1.0, 0.5, 0.1);

/// Layers are kept apart on the way from frame to frame each time that a joint has moved this far against the hips, metres, and at most
/// so often: a walk at 30 frames a second moves a hand by 60 mm.
const LONG_WAY: f64 = 0.12;
const MOST_PARTS: f64 = 8.0;

/// What was written.
#[derive(Debug)]
pub struct Animated {
    /// The folder of the motion.
    pub folder: PathBuf,
    /// The report, as it is in the folder.
    pub report: AnimationReport,
    /// What the operator should know, also of what was built first.
    pub remarks: Remarks,
}

/// Moves the layers of the subject at `root` through a motion and writes their vertices frame by frame; what the avatar lacks
/// is built first. The caches appear when all are whole.
///
/// # Errors
/// [`PipelineError`] where a stage has no answer or a file cannot be read or written; caches of an earlier run stay, and what
/// was begun is called `.part` until the next run replaces it.
pub fn animate(root: &Path, options: &AnimateOptions, observer: &dyn Observer) -> Result<Animated, PipelineError> {
    let building = Options { settings: options.settings.clone(), ..Options::default() };
    let summary = process(root, Goal::Avatar, &building, observer)?;
    let mut remarks = summary.remarks;
    remarks.warnings.extend(summary.notes);
    let settings = settings::read(Some(root), options.settings.as_deref())?;
    let run = Run::open(root, None, settings, observer)?;
    let model = BodyModel::load_default()?;
    let body = Body::load(&run.folders, run.first_layer(), &model)?;
    let choice = AvatarChoice::read(&run.folders)?;
    let garments = garment::stacked(&run)?;
    let export = export::Export { run: &run, body: &body, garments: &garments, choice: &choice };
    let path = match &options.motion {
        MotionChoice::AsBefore => choice.motion_path(&run.folders),
        MotionChoice::Walk => None,
        MotionChoice::File(path) => Some(path.clone()),
    };
    let moved = export.moved(path.as_deref(), &export.dressed()?)?;
    let avatar = export.avatar()?;
    remarks.warnings.extend(moved.report.warnings.iter().map(|w| format!("motion {}: {w}", moved.motion.name)));
    let motion = resample(&moved.motion, options.fps);
    if motion.frame_time * options.fps > 1.01 {
        let (has, wanted) = (1.0 / motion.frame_time, options.fps);
        remarks
            .warnings
            .push(format!("the motion has {has:.1} frames a second; the caches have as many, not {wanted}"));
    }
    let folder = folder(&run, &motion)?;
    observer.begin(&run.label("layers", "animate"), SECONDS * (motion.poses.len() * garments.len().max(1)) as f64);
    let report = bake(&avatar, &garments, &motion, options, &folder, observer)?;
    observer.end();
    remarks.warnings.extend(report.warnings());
    Ok(Animated { folder, report, remarks })
}

/// Where a motion's files lie.
fn folder(run: &Run, motion: &Motion) -> Result<PathBuf, PipelineError> {
    let all = run.folders.root.join("motion");
    // The name comes from a file: it must stay inside.
    match Path::new(&motion.name).components().next() {
        Some(Component::Normal(name)) if name == motion.name.as_str() => Ok(all.join(name)),
        _ => {
            let reason = format!("`{}` is no name for a folder; rename the motion's file", printable(&motion.name));
            Err(PipelineError::refused(&all, reason))
        }
    }
}

/// The cloth that a garment of a type is made of, as far as its type says.
fn fabric(garment: Option<&str>) -> Result<Fabric, toile_cloth::ClothError> {
    let kind = garment.and_then(|g| g.parse::<GarmentType>().ok());
    Fabric::named(match kind {
        Some(GarmentType::Top) => "jersey",
        Some(GarmentType::Trousers) => "denim",
        Some(GarmentType::Jacket) => "coating",
        Some(GarmentType::Shoes | GarmentType::Hat) => "leather",
        _ => "shirting",
    })
}

fn bake(
    avatar: &Avatar,
    garments: &[Garment],
    motion: &Motion,
    options: &AnimateOptions,
    folder: &Path,
    observer: &dyn Observer,
) -> Result<AnimationReport, PipelineError> {
    let wrong = |e: &dyn std::fmt::Display| PipelineError::refused(folder, e.to_string());
    let of_layer = |l: &toile_avatar::AvatarLayer| {
        let (name, mesh, weights) = (l.name.clone(), l.mesh.clone(), l.weights.clone());
        Ok(OutfitLayer { name, mesh, weights, fabric: fabric(l.garment.as_deref())? })
    };
    let layers: Result<Vec<OutfitLayer>, toile_cloth::ClothError> = avatar.layers.iter().map(of_layer).collect();
    let layers = layers.map_err(|e| wrong(&e))?;
    let outfit = Outfit::new(avatar.skeleton.clone(), avatar.pose0.clone(), layers).map_err(|e| wrong(&e))?;
    let mut wearer = Wearer::new(&outfit, options.blend, options.skinning);
    let mut apart = Apart::new(&avatar.layers.iter().map(|l| &l.mesh).collect::<Vec<_>>());
    let mut report = AnimationReport::new(motion, options, garments);
    if options.blend != Blend::Skinning {
        warm_up(&mut wearer, &mut apart, &avatar.pose0, &motion.poses[0]).map_err(|e| wrong(&e))?;
    }
    let names: Vec<(&str, usize)> = avatar.layers.iter().map(|l| (l.name.as_str(), l.mesh.positions.len())).collect();
    let mut caches = Caches::begin(folder, &names, motion.poses.len())?;
    for (k, pose) in motion.poses.iter().enumerate() {
        let begun = Instant::now();
        let is_apart = match options.blend {
            Blend::Skinning => wearer.advance(pose, motion.frame_time).map(|()| false),
            Blend::Anchored => {
                frame(&mut wearer, &mut apart, &motion.poses[k.saturating_sub(1)], pose, motion.frame_time)
            }
        };
        let is_apart = is_apart.map_err(|e| wrong(&e))?;
        let milliseconds = begun.elapsed().as_secs_f64() * 1e3;
        if options.blend == Blend::Skinning {
            apart.look(wearer.layers());
        }
        let crossing = if is_apart { 0 } else { apart.crossing() };
        caches.add(wearer.layers())?;
        report.frames.push(FrameReport::of(&outfit, wearer.layers(), crossing, milliseconds));
        observer.at((k + 1) as f32 / motion.poses.len() as f32);
    }
    report.sum_up();
    let written = caches.written()?;
    let points: Vec<usize> = names.iter().map(|n| n.1).collect();
    let mut cached = written.open(&points)?;
    let glb = playable::glb(avatar, motion, &mut cached, folder)?;
    let pictures = Pictures { avatar, motion, cached: &mut cached, folder }.files(&report)?;
    written.finish(&[("motion.glb", glb)].into_iter().chain(pictures).collect::<Vec<_>>(), &report)?;
    Ok(report)
}

/// Moves the layers on to a pose and keeps them apart there, and on the way where that is long. True where none cross.
fn frame(
    wearer: &mut Wearer,
    apart: &mut Apart,
    from: &Pose,
    pose: &Pose,
    seconds: f64,
) -> Result<bool, AnimationError> {
    let parts = (wearer.way_to(pose) / LONG_WAY).ceil().clamp(1.0, MOST_PARTS) as usize;
    let mut is_apart = false;
    for k in 1..=parts {
        wearer.advance(&from.interpolated(pose, k as f64 / parts as f64), seconds / parts as f64)?;
        let mut layers = wearer.layers().to_vec();
        is_apart = apart.keep(&mut layers) == 0;
        wearer.correct(&layers)?;
    }
    Ok(is_apart)
}

/// Brings the layers from the pose of the scan into the `first` of a motion and lets them settle there.
fn warm_up(wearer: &mut Wearer, apart: &mut Apart, scanned: &Pose, first: &Pose) -> Result<(), AnimationError> {
    let steps = ((WARM_UP.0 + WARM_UP.1) / WARM_UP.2).ceil();
    let mut before = scanned.clone();
    for k in 1..=steps as usize {
        let share = (k as f64 / (steps * WARM_UP.0 / (WARM_UP.0 + WARM_UP.1))).min(1.0);
        let pose = scanned.interpolated(first, share);
        frame(wearer, apart, &before, &pose, WARM_UP.2)?;
        before = pose;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Settings, observer::Silent};

    #[test]
    fn a_motion_stays_inside_its_subject_whatever_its_file_is_called() {
        let run = Run::single(Path::new("/anna"), "anna", Settings::default(), &Silent);
        let named = |name: &str| folder(&run, &Motion { name: name.into(), frame_time: 0.1, poses: Vec::new() });
        assert_eq!(named("dance 2").unwrap(), Path::new("/anna/motion/dance 2"));
        for name in ["..", ".", "", "/etc", "a/b", "../x"] {
            assert!(named(name).unwrap_err().to_string().contains("no name for a folder"), "{name}");
        }
    }
}
