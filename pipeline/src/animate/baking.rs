//! The frames of a motion, one after the other into the caches; an earlier run that was killed is gone on with.

use std::time::Instant;

use nalgebra::Point3;
use toile_animation::blend::{Blend, Outfit, OutfitLayer};
use toile_avatar::{Avatar, AvatarLayer};
use toile_cloth::Fabric;
use toile_geometry::{bvh::Bvh, intersection::self_crossings};

use super::{
    caches::{Cache, Caches, Written},
    checkpoint::{self, Checkpoints, Key, Left},
    endless::LeadIn,
    inputs::Baking,
    mover::Mover,
    options::Profile,
    pictures::Pictures,
    playable,
    report::{AnimationReport, FrameReport},
    variants,
};
use crate::PipelineError;

impl Baking<'_> {
    /// Writes all files of the motion. Returns the report, and what the operator should know beside it.
    ///
    /// # Errors
    /// [`PipelineError`] where a layer cannot be moved or a file not be written; what was begun is gone on with by the next run.
    pub fn run(&self) -> Result<(AnimationReport, Vec<String>), PipelineError> {
        let wrong = |e: &dyn std::fmt::Display| PipelineError::refused(self.folder, e.to_string());
        let outfit = outfit(self.avatar, self.fabrics).map_err(|e| wrong(&e))?;
        let mut mover = Mover::new(&outfit, self.options).map_err(|e| wrong(&e))?;
        let key = Key::new(self.avatar, self.fabrics, self.motion, self.options)?;
        let mut checkpoints = Checkpoints::new(self.folder, key.clone(), self.options.checkpoint_every);
        let (begun, mut said) = self.unfinished(&mut mover, &key)?;
        said.extend(self.tangled());
        let lead_in = LeadIn::of(self.motion, &self.avatar.skeleton);
        let (mut caches, done) = if let Some(begun) = begun {
            begun
        } else {
            checkpoints.clear()?;
            mover.start(&self.avatar.pose0, self.motion, lead_in.as_ref()).map_err(|e| wrong(&e))?;
            (Caches::begin(self.folder, &self.cached(), self.motion.poses.len())?, Vec::new())
        };
        let mut report = AnimationReport::new(self.motion, self.options, self.garments);
        report.physical_shares = (self.options.blend == Blend::Seed).then(|| outfit.physical_shares());
        report.frames = done;
        let (poses, count) = (&self.motion.poses, self.motion.poses.len());
        for k in report.frames.len()..count {
            let begun = Instant::now();
            let moved = mover.frame(&poses[k.saturating_sub(1)], &poses[k], self.motion.frame_time);
            moved.map_err(|e| wrong(&e))?;
            let milliseconds = begun.elapsed().as_secs_f64() * 1e3;
            self.check(mover.layers(), k)?;
            mover.look();
            caches.add(mover.layers())?;
            let of_frame = FrameReport::of(&outfit, mover.layers(), mover.crossing(), milliseconds);
            report.frames.push(FrameReport { jumped: mover.jumped(), ..of_frame });
            // In real time frames are made sooner than they are kept.
            if self.options.profile == Profile::Bake {
                checkpoints.at(&mut caches, &mover, &report.frames, k + 1 == count)?;
            }
            self.observer.at((k + 1) as f32 / count as f32);
        }
        report.sum_up();
        self.finish(caches.written()?, &outfit, &mut report, lead_in.as_ref())?;
        checkpoints.clear()?;
        Ok((report, said))
    }

    /// The caches and frames of an earlier run that was killed, its state taken over; and what is to be said of it.
    #[allow(clippy::type_complexity)] // two answers, each said above
    fn unfinished(
        &self,
        mover: &mut Mover,
        key: &Key,
    ) -> Result<(Option<(Caches, Vec<FrameReport>)>, Vec<String>), PipelineError> {
        let (name, count) = (&self.motion.name, self.motion.poses.len());
        let useless = |why: &str| {
            Ok((
                None,
                vec![format!("motion {name}: what an unfinished run left is not used: {why}; all frames are made")],
            ))
        };
        let (frames, state) = match checkpoint::left(self.folder, key)? {
            Left::Nothing => return Ok((None, Vec::new())),
            Left::Useless(why) => return useless(&why),
            Left::Unfinished(frames, state) => (frames, state),
        };
        let caches = Caches::go_on(self.folder, &self.cached(), count, frames.len())?;
        let Some(caches) = caches.filter(|_| frames.len() <= count && mover.restore(&state).is_ok()) else {
            return useless("its caches are not whole");
        };
        let said =
            format!("motion {name}: an unfinished run is gone on with: {} of {count} frames were there", frames.len());
        Ok((Some((caches, frames)), vec![said]))
    }

    /// What is to be said of garments that cross themselves before they are moved.
    fn tangled(&self) -> Option<String> {
        let pairs = |l: &AvatarLayer| self_crossings(&l.mesh, &Bvh::new(&l.mesh.positions, &l.mesh.triangles)).len();
        let garments = self.avatar.layers.iter().skip(1).map(|l| (l.name.as_str(), pairs(l)));
        let tangled: Vec<String> =
            garments.filter(|(_, pairs)| *pairs > 0).map(|(name, pairs)| format!("{name} ({pairs})")).collect();
        let (which, motion) = (tangled.join(", "), &self.motion.name);
        (!tangled.is_empty()).then(|| {
            format!(
                "motion {motion}: garments cross themselves as they were scanned, at so many pairs of triangles: {which}; they \
                 are parted where there is room, and what is left moves as one"
            )
        })
    }

    /// Refuses a frame with places that are no numbers: no file must hold them.
    fn check(&self, layers: &[Vec<Point3<f32>>], frame: usize) -> Result<(), PipelineError> {
        let broken = |layer: &Vec<Point3<f32>>| !layer.iter().all(|p| p.coords.iter().all(|c| c.is_finite()));
        let Some(k) = layers.iter().position(broken) else { return Ok(()) };
        let (name, motion) = (&self.avatar.layers[k].name, &self.motion.name);
        let reason = format!(
            "in frame {frame} of the motion {motion} the layer {name} has no place any more; try another fabric, a slower \
             motion or `--blend skinning`"
        );
        Err(PipelineError::refused(self.folder, reason))
    }

    /// The layers as their caches have them.
    fn cached(&self) -> Vec<Cache<'_>> {
        fn of_layer(l: &AvatarLayer) -> Cache<'_> {
            let vertices = l.mesh.positions.len();
            Cache { name: &l.name, vertices, again: l.texture.as_ref().map_or(&[], |t| &t.source[vertices..]) }
        }
        self.avatar.layers.iter().map(of_layer).collect()
    }

    /// Writes what is made from the caches, and puts all files in their place.
    fn finish(
        &self,
        written: Written,
        outfit: &Outfit,
        report: &mut AnimationReport,
        lead_in: Option<&LeadIn>,
    ) -> Result<(), PipelineError> {
        let mut cached = written.open(&self.cached())?;
        if let Some(lead_in) = lead_in {
            report.endless = Some(lead_in.closed(&mut cached, self.motion)?);
        }
        let glb = playable::glb(self.avatar, self.motion, &mut cached, self.folder)?;
        let (avatar, motion, folder) = (self.avatar, self.motion, self.folder);
        let pictures = Pictures { avatar, motion, cached: &mut cached, folder }.files(report)?;
        let mut files: Vec<(&str, Vec<u8>)> = [("motion.glb", glb)].into_iter().chain(pictures).collect();
        if self.options.compare {
            let (variants, drawn) = variants::compare(self, outfit, lead_in, &mut cached, report)?;
            report.variants = Some(variants);
            files.extend(drawn);
        }
        written.finish(&files, report)
    }
}

/// The avatar's layers, made of these `fabrics`.
///
/// # Errors
/// [`toile_animation::AnimationError`] where a layer cannot be simulated.
pub(super) fn outfit(avatar: &Avatar, fabrics: &[Fabric]) -> Result<Outfit, toile_animation::AnimationError> {
    let of_layer = |(l, fabric): (&AvatarLayer, &Fabric)| {
        let (name, mesh, weights) = (l.name.clone(), l.mesh.clone(), l.weights.clone());
        OutfitLayer { name, mesh, weights, fabric: *fabric }
    };
    let layers = avatar.layers.iter().zip(fabrics).map(of_layer).collect();
    Outfit::new(avatar.skeleton.clone(), avatar.pose0.clone(), layers)
}
