//! Layers carried from pose to pose, the way that was chosen.

use nalgebra::Point3;
use toile_animation::{
    AnimationError,
    blend::{Blend, Outfit, Wearer},
    realtime::Live,
};
use toile_character::{Motion, Pose};
use toile_garments::Apart;

use super::{
    endless::LeadIn,
    options::{AnimateOptions, Profile},
};

/// Seconds over which the layers come from the pose of the scan into the motion's first, seconds in which they settle there, and
/// seconds a step: a tenth of the way.
const WARM_UP: (f64, f64, f64) = (1.0, 0.5, 0.1);

/// Layers are kept apart on the way from frame to frame each time that a joint has moved this far against the hips, metres, and at most
/// so often: a walk at 30 frames a second moves a hand by 60 mm.
const LONG_WAY: f64 = 0.12;
const MOST_PARTS: f64 = 8.0;
/// The same for a whole body that travels, metres, and for time, seconds: a motion of a frame a second is moved through in between.
const LONG_TRAVEL: f64 = 0.3;
const LONGEST_PART: f64 = 0.1;
/// Nobody gets faster than this, m/s: a sprinter runs at 12.4. A motion that is faster jumps from one place to another.
const FASTEST: f64 = 15.0;
/// Seconds before the first frame of an endless motion in which the layers are kept apart: twice what corrections last.
const APART_BEFORE: f64 = 0.8;

/// Layers that are carried from pose to pose.
pub(super) struct Mover<'a> {
    wearer: Wearer<'a>,
    /// Moves the layers instead of the wearer in real time.
    live: Option<Live<'a>>,
    apart: Apart,
    blend: Blend,
    /// Pairs of triangles of different layers that cross now.
    crossing: usize,
    jumped: bool,
}

impl<'a> Mover<'a> {
    /// The outfit in its first pose, at rest.
    pub fn new(outfit: &'a Outfit, options: &AnimateOptions) -> Result<Self, AnimationError> {
        let AnimateOptions { profile, blend, skinning, .. } = *options;
        let meshes: Vec<_> = outfit.layers().iter().map(|l| &l.mesh).collect();
        let live = match profile {
            Profile::Bake => None,
            Profile::Realtime => Some(Live::new(outfit, skinning)?),
        };
        let wearer = Wearer::new(outfit, blend, skinning);
        Ok(Self { wearer, live, apart: Apart::new(&meshes), blend, crossing: 0, jumped: false })
    }

    /// Vertices of all layers, where the last frame left them.
    pub fn layers(&self) -> &[Vec<Point3<f32>>] {
        self.live.as_ref().map_or_else(|| self.wearer.layers(), |live| live.layers())
    }

    /// Pairs of triangles of different layers that cross there.
    pub fn crossing(&self) -> usize {
        self.crossing
    }

    /// Moves the layers on to a pose within `seconds`; layers are kept apart there, and on the way where that is long, unless they are to be
    /// shown as they come.
    pub fn frame(&mut self, from: &Pose, pose: &Pose, seconds: f64) -> Result<(), AnimationError> {
        if let Some(live) = &mut self.live {
            return live.advance(seconds, pose);
        }
        if self.blend == Blend::Skinning {
            return self.wearer.advance(pose, seconds);
        }
        self.jumped = self.wearer.travel_to(pose) > FASTEST * seconds;
        let mut from = from.clone();
        if self.jumped {
            self.wearer.carry_to(pose);
            from = self.wearer.pose().clone();
        }
        let way = (self.wearer.way_to(pose) / LONG_WAY).max(self.wearer.travel_to(pose) / LONG_TRAVEL);
        let parts = way.ceil().clamp(1.0, MOST_PARTS.max(seconds / LONGEST_PART)) as usize;
        for k in 1..=parts {
            self.wearer.advance(&from.interpolated(pose, k as f64 / parts as f64), seconds / parts as f64)?;
            if self.blend == Blend::Anchored {
                let mut layers = self.wearer.layers().to_vec();
                let is_apart = self.apart.keep(&mut layers) == 0;
                self.crossing = if is_apart { 0 } else { self.apart.crossing() };
                self.wearer.correct(&layers)?;
            }
        }
        Ok(())
    }

    /// True where the person was elsewhere in the last frame than anybody gets in its time: cloth was carried there.
    pub fn jumped(&self) -> bool {
        self.jumped
    }

    /// Counts what crosses where nothing keeps the layers apart.
    pub fn look(&mut self) {
        if self.blend != Blend::Anchored || self.live.is_some() {
            let layers = self.live.as_ref().map_or_else(|| self.wearer.layers(), |live| live.layers());
            self.apart.look(layers);
            self.crossing = self.apart.crossing();
        }
    }

    /// What decides how the layers move on, to the bit.
    pub fn state(&self) -> Vec<Vec<f64>> {
        self.wearer.state()
    }

    /// Goes on from a state of the same layers.
    ///
    /// # Errors
    /// [`AnimationError::Motion`] for a state of other layers, and in real time, where frames are made sooner than they are kept.
    pub fn restore(&mut self, state: &[Vec<f64>]) -> Result<(), AnimationError> {
        if self.live.is_some() {
            return Err(AnimationError::Motion("a motion in real time is not gone on with".into()));
        }
        self.wearer.restore(state)
    }

    /// Brings the layers from the pose of the scan to before the first frame of a `motion`: to its first pose, or through the
    /// lead-in of one that goes round.
    pub fn start(&mut self, scanned: &Pose, motion: &Motion, lead_in: Option<&LeadIn>) -> Result<(), AnimationError> {
        let lead_in: &[Pose] = lead_in.map_or(&[], |lead_in| &lead_in.poses);
        let first = lead_in.first().or(motion.poses.first());
        let Some(first) = first.filter(|_| self.live.is_some() || self.blend != Blend::Skinning) else { return Ok(()) };
        self.warm_up(scanned, first)?;
        // Corrections are forgotten sooner than swings: layers are kept apart only in the last of it.
        let apart_from = lead_in.len().saturating_sub((APART_BEFORE / motion.frame_time).ceil() as usize);
        for (k, pose) in lead_in.iter().enumerate().skip(1) {
            if k < apart_from && self.live.is_none() {
                self.wearer.warm_up(pose, motion.frame_time)?;
            } else {
                self.frame(&lead_in[k - 1], pose, motion.frame_time)?;
            }
        }
        Ok(())
    }

    /// Brings the layers from the pose of the scan into the `first` of a motion and lets them settle there.
    fn warm_up(&mut self, scanned: &Pose, first: &Pose) -> Result<(), AnimationError> {
        let steps = ((WARM_UP.0 + WARM_UP.1) / WARM_UP.2).ceil();
        let mut before = scanned.clone();
        for k in 1..=steps as usize {
            let share = (k as f64 / (steps * WARM_UP.0 / (WARM_UP.0 + WARM_UP.1))).min(1.0);
            let pose = scanned.interpolated(first, share);
            self.frame(&before, &pose, WARM_UP.2)?;
            before = pose;
        }
        Ok(())
    }
}
