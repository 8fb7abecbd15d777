//! An outfit in motion.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use rayon::prelude::*;
use toile_character::{Pose, PosedSkin, Skinning};
use toile_cloth::{Effort, MovingSurface, Obstacle, Sheet, Surroundings, obstacle::Plane};

use super::{
    Blend,
    outfit::Outfit,
    proxy::Proxy,
    squeeze::Pressed,
    strain::{ROUNDS, Torn},
};
use crate::AnimationError;

/// Farthest that a joint moves in one step of the simulation, metres, where that needs no more steps than are taken: the reach of contact
/// is twice that.
const LONGEST_WAY: f32 = 0.015;
/// Steps of the simulation in a frame: at least, at most.
const STEPS: (usize, usize) = (2, 6);
/// Rate at which the air and the layers below damp cloth that moves against the body, 1/s.
pub(crate) const DRAG: f64 = 7.0;
/// Deceleration by the cloth's own friction, m/s²: a twentieth of gravity, assumed.
const DRY: f64 = 0.5;
/// Time in which corrections fade, seconds: less than a step of a walk, so that no phase of it carries those of the others. Chosen by trying.
const FORGET: f64 = 0.4;

/// Acceleration of gravity, m/s².
const GRAVITY: Vector3<f64> = Vector3::new(0.0, -9.81, 0.0);
/// What catches a garment that falls off.
const FLOOR: Plane = Plane { point: Vector3::new(0.0, 0.0, 0.0), normal: Vector3::new(0.0, 1.0, 0.0) };
/// Work in a step for sheets that are tied to their skinned places, and for those that hang by contact alone: that has to be looked for
/// more often, and the sheet falls onto itself.
const TIED: Effort = Effort { rounds: 1, iterations: 10, tolerance: 5e-6, self_contact: false };
const HUNG: Effort = Effort { rounds: 2, iterations: 10, tolerance: 5e-6, self_contact: true };

/// An outfit in motion: give it pose after pose.
pub struct Wearer<'a> {
    outfit: &'a Outfit,
    pub(super) blend: Blend,
    way: Skinning,
    pub(super) pose: Pose,
    pub(super) sheets: Vec<Sheet>,
    /// Skinned and pressed places of the proxies at the end of the last step.
    pub(super) carried: Vec<Vec<Vector3<f64>>>,
    pub(super) body: MovingSurface,
    /// The garments' sheets as lower layers of each other.
    surfaces: Vec<MovingSurface>,
    /// How the columns are pressed in the last pose.
    pub(super) pressed: Option<Pressed>,
    /// Where the vertices of each garment were moved to beside where cloth and skin take them, in their local frames.
    pub(super) corrections: Vec<Vec<Vector3<f32>>>,
    /// One for each layer.
    torn: Vec<Torn>,
    skins: Vec<PosedSkin>,
    proxy_skins: Vec<PosedSkin>,
    layers: Vec<Vec<Point3<f32>>>,
}

impl<'a> Wearer<'a> {
    /// The outfit in its first pose, at rest.
    pub fn new(outfit: &'a Outfit, blend: Blend, way: Skinning) -> Self {
        let layers: Vec<Vec<Point3<f32>>> = outfit.layers.iter().map(|l| l.mesh.positions.clone()).collect();
        let sheet = |p: &Proxy| if blend.hangs() { p.hung.sheet.clone() } else { p.sheet.clone() };
        let sheets: Vec<Sheet> = outfit.proxies.iter().map(sheet).collect();
        Self {
            blend,
            way,
            pose: outfit.pose0.clone(),
            body: MovingSurface::new(&layers[0], &outfit.layers[0].mesh.triangles),
            surfaces: sheets.iter().map(|s| MovingSurface::new(&points(&s.positions), s.triangles())).collect(),
            pressed: None,
            torn: outfit.layers.iter().map(|l| Torn::new(l.mesh.triangles.len(), ROUNDS)).collect(),
            corrections: layers[1..].iter().map(|l| vec![Vector3::zeros(); l.len()]).collect(),
            skins: layers.iter().map(|_| PosedSkin::with_frames()).collect(),
            proxy_skins: outfit.proxies.iter().map(|_| PosedSkin::with_frames()).collect(),
            layers,
            carried: sheets.iter().map(|s| s.positions.clone()).collect(),
            sheets,
            outfit,
        }
    }

    /// The last pose.
    pub fn pose(&self) -> &Pose {
        &self.pose
    }

    /// Vertices of all layers, as they were left by the last [`Wearer::advance`].
    pub fn layers(&self) -> &[Vec<Point3<f32>>] {
        &self.layers
    }

    /// Moves only the simulated cloth on to `pose` within `seconds`: what comes before the first frame that is looked at.
    ///
    /// # Errors
    /// [`AnimationError::Motion`] where a layer cannot be moved.
    pub fn warm_up(&mut self, pose: &Pose, seconds: f64) -> Result<(), AnimationError> {
        if self.blend != Blend::Skinning {
            let (steps, pressed) = (self.steps(pose), self.pressed_at(pose)?);
            let before = self.pressed.take();
            for k in 1..=steps {
                let share = k as f64 / steps as f64;
                let between = self.pose.interpolated(pose, share);
                self.step(&between, seconds / steps as f64, (before.as_ref(), &pressed, share as f32))?;
            }
            self.pressed = Some(pressed);
        }
        self.pose = pose.clone();
        Ok(())
    }

    /// Moves on to `pose` within `seconds`.
    ///
    /// # Errors
    /// [`AnimationError::Motion`] where a layer cannot be moved.
    pub fn advance(&mut self, pose: &Pose, seconds: f64) -> Result<(), AnimationError> {
        let wrong = |e: &dyn std::fmt::Display| AnimationError::Motion(e.to_string());
        self.warm_up(pose, seconds)?;
        let moved = self.moved(pose);
        for (skinner, skin) in self.outfit.skinners.iter().zip(&mut self.skins) {
            skinner.pose(&moved, self.way, skin).map_err(|e| wrong(&e))?;
        }
        for (layer, skin) in self.layers.iter_mut().zip(&self.skins) {
            layer.clone_from(&skin.positions);
        }
        match self.blend {
            Blend::Skinning => {}
            Blend::Anchored => self.finish(seconds),
            Blend::Physics | Blend::Seed => self.mix(),
        }
        Ok(())
    }

    /// Takes body and cloth along as one rigid thing to where the hips of `pose` are: what a person who is set down elsewhere wears.
    pub fn carry_to(&mut self, pose: &Pose) {
        let hips = |pose: &Pose| pose.joint_frames(&self.outfit.skeleton)[0];
        let carried = hips(pose) * hips(&self.pose).inverse();
        let place = |p: &mut Vector3<f64>| *p = carried.transform_point(&Point3::from(*p)).coords;
        for (k, sheet) in self.sheets.iter_mut().enumerate() {
            sheet.moved_by(&carried);
            self.carried[k].iter_mut().for_each(place);
        }
        let to = carried.cast::<f32>();
        let body: Vec<Point3<f32>> = self.body.positions().iter().map(|p| to * p).collect();
        self.body.move_to(&body);
        self.pose = self.pose.moved(&carried, &self.outfit.skeleton);
    }

    /// Takes of each garment's simulated motion the share that the blend gives it: Hu et al. 2017, eq. 8, with w_p = 1 for physics alone.
    fn mix(&mut self) {
        for (k, proxy) in self.outfit.proxies.iter().enumerate() {
            let shares: &[f32] = if self.blend == Blend::Seed { &proxy.shares.of_vertices } else { &[] };
            proxy.ride.carry(&self.moved_beside_skin(k), shares, &mut self.layers[k + 1]);
        }
    }

    /// How far the vertices of garment `k`'s proxy are from where it is carried, metres.
    fn moved_beside_skin(&self, k: usize) -> Vec<Vector3<f32>> {
        self.sheets[k].positions.iter().zip(&self.carried[k]).map(|(x, c)| (x - c).cast::<f32>()).collect()
    }

    /// Presses the skinned layers and lets them ride on the cloth, from where they were corrected to last.
    fn finish(&mut self, seconds: f64) {
        let outfit = self.outfit;
        let skin = self.layers[0].clone();
        let pressed = self.pressed.take().unwrap_or_else(|| outfit.columns.press(&skin));
        pressed.apply_to_body(&mut self.layers[0]);
        outfit.limits[0].apply(&mut self.layers[0], Some(&pressed.normals), &mut self.torn[0]);
        for (k, proxy) in outfit.proxies.iter().enumerate() {
            let moved = self.moved_beside_skin(k);
            let fine = &mut self.layers[k + 1];
            outfit.columns.apply(&pressed, &skin, k, fine);
            proxy.ride.carry(&moved, &[], fine);
            let kept = (-seconds / FORGET).exp() as f32;
            let turns = &self.skins[k + 1].rotations;
            let corrections = &mut self.corrections[k];
            fine.par_iter_mut().zip(corrections).zip(turns).for_each(|((p, c), turn)| {
                *c *= kept;
                *p += turn * *c;
            });
            outfit.limits[k + 1].apply(fine, None, &mut self.torn[k + 1]);
        }
        self.pressed = Some(pressed);
    }

    /// Takes over where the layers were moved to after the last frame, to keep them apart: the next frame starts from there.
    ///
    /// # Errors
    /// [`AnimationError::Motion`] where they are not the layers of this outfit.
    pub fn correct(&mut self, layers: &[Vec<Point3<f32>>]) -> Result<(), AnimationError> {
        let same =
            layers.len() == self.layers.len() && layers.iter().zip(&self.layers).all(|(a, b)| a.len() == b.len());
        if !same {
            return Err(AnimationError::Motion("the corrected layers are not those of the outfit".into()));
        }
        for (k, corrections) in self.corrections.iter_mut().enumerate() {
            let turns = &self.skins[k + 1].rotations;
            for (v, correction) in corrections.iter_mut().enumerate() {
                *correction += turns[v].inverse() * (layers[k + 1][v] - self.layers[k + 1][v]);
            }
        }
        self.layers.iter_mut().zip(layers).for_each(|(own, new)| own.clone_from(new));
        Ok(())
    }

    /// Farthest that a joint moves against the hips from the last pose to this, metres.
    pub fn way_to(&self, pose: &Pose) -> f64 {
        let joints = |pose: &Pose| pose.joint_positions(&self.outfit.skeleton);
        let (from, to) = (joints(&self.pose), joints(pose));
        let hips = to[0] - from[0];
        from.iter().zip(&to).map(|(a, b)| (b - a - hips).norm()).fold(0.0, f64::max)
    }

    /// Way of the hips from the last pose to this, metres.
    pub fn travel_to(&self, pose: &Pose) -> f64 {
        (pose.translation - self.pose.translation).norm()
    }

    /// Steps that the simulation needs for the way from the last pose to this.
    fn steps(&self, pose: &Pose) -> usize {
        let (from, to) =
            (self.pose.joint_positions(&self.outfit.skeleton), pose.joint_positions(&self.outfit.skeleton));
        let way = from.iter().zip(&to).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max) as f32;
        ((way / LONGEST_WAY).ceil() as usize).clamp(STEPS.0, STEPS.1)
    }

    fn moved(&self, pose: &Pose) -> Vec<Isometry3<f64>> {
        pose.transforms_from(&self.outfit.pose0, &self.outfit.skeleton)
    }

    /// How the columns are pressed in a pose.
    pub(super) fn pressed_at(&mut self, pose: &Pose) -> Result<Pressed, AnimationError> {
        let moved = self.moved(pose);
        let posed = self.outfit.skinners[0].pose(&moved, self.way, &mut self.skins[0]);
        posed.map_err(|e| AnimationError::Motion(e.to_string()))?;
        let (columns, skin) = (&self.outfit.columns, &self.skins[0].positions);
        Ok(if self.blend.hangs() { columns.unpressed(skin) } else { columns.press(skin) })
    }

    /// One step of the simulation, a `share` of the way from how the columns were pressed `before` to how they are pressed `after`.
    fn step(
        &mut self,
        pose: &Pose,
        h: f64,
        (before, after, share): (Option<&Pressed>, &Pressed, f32),
    ) -> Result<(), AnimationError> {
        let wrong = |e: &dyn std::fmt::Display| AnimationError::Motion(e.to_string());
        let outfit = self.outfit;
        let moved = self.moved(pose);
        outfit.skinners[0].pose(&moved, self.way, &mut self.skins[0]).map_err(|e| wrong(&e))?;
        let skin = &self.skins[0].positions;
        let pressed = outfit.columns.between(before, after, share, skin);
        let mut body = skin.clone();
        pressed.apply_to_body(&mut body);
        self.body.move_to(&body);
        let mut targets: Vec<Vec<Vector3<f64>>> = Vec::with_capacity(self.sheets.len());
        for (k, (proxy, posed)) in outfit.proxies.iter().zip(&mut self.proxy_skins).enumerate() {
            proxy.skinner.pose(&moved, self.way, posed).map_err(|e| wrong(&e))?;
            let mut places = posed.positions.clone();
            outfit.columns.apply_over(&pressed, skin, k, &proxy.over, &mut places);
            targets.push(places.iter().map(|p| p.coords.cast()).collect());
        }
        // Each layer meets the lower ones where they would be carried.
        let guesses: Vec<Vec<Vector3<f64>>> =
            self.sheets.iter().enumerate().map(|(k, s)| self.guess(k, s, &targets[k], h)).collect();
        self.surfaces.par_iter_mut().zip(&self.sheets).zip(&guesses).for_each(|((surface, sheet), guess)| {
            surface.move_to(&points(&sheet.positions));
            surface.move_to(&points(guess));
        });
        let (body, surfaces, proxy_skins, hangs) = (&self.body, &self.surfaces, &self.proxy_skins, self.blend.hangs());
        let results: Vec<Result<(), toile_cloth::ClothError>> = self
            .sheets
            .par_iter_mut()
            .enumerate()
            .map(|(k, sheet)| {
                let mut obstacles: Vec<&dyn Obstacle> = vec![body];
                obstacles.extend(surfaces[..k].iter().map(|s| s as &dyn Obstacle));
                let gaps = &outfit.proxies[k].gaps;
                let met = Surroundings { anchors: &targets[k], guess: &guesses[k], gaps, ..Surroundings::still() };
                if hangs {
                    obstacles.push(&FLOOR);
                    let around = Surroundings { gravity: GRAVITY, obstacles: &obstacles, ..met };
                    return sheet.advance(h, &around, &HUNG);
                }
                let pulls = pulls(&proxy_skins[k].rotations);
                let around = Surroundings { pulls: &pulls, obstacles: &obstacles, drag: DRAG, dry: DRY, ..met };
                sheet.advance(h, &around, &TIED)
            })
            .collect();
        results.into_iter().collect::<Result<(), _>>().map_err(|e| wrong(&e))?;
        self.carried = targets;
        Ok(())
    }

    /// Where a sheet would be at the end of the step: cloth on the skin with the skin, cloth that hangs free as before.
    fn guess(&self, k: usize, sheet: &Sheet, target: &[Vector3<f64>], h: f64) -> Vec<Vector3<f64>> {
        let proxy = &self.outfit.proxies[k];
        let tied = if self.blend.hangs() { &proxy.hung.tied } else { &proxy.tied };
        let place = |v: usize| {
            let carried = target[v] - self.carried[k][v];
            sheet.positions[v] + carried * tied[v] + sheet.velocities[v] * (h * (1.0 - tied[v]))
        };
        (0..sheet.len()).map(place).collect()
    }
}

fn points(places: &[Vector3<f64>]) -> Vec<Point3<f32>> {
    places.iter().map(|p| Point3::from(p.cast::<f32>())).collect()
}

/// Gravity, less what held the scanned shape against it: that turns with the body, so that cloth hangs as it was scanned
/// while the body is as it was scanned, and falls to where it must when the body leans.
fn pulls(rotations: &[UnitQuaternion<f32>]) -> Vec<Vector3<f64>> {
    rotations.iter().map(|r| GRAVITY - r.cast::<f64>() * GRAVITY).collect()
}
