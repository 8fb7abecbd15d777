//! An outfit in motion.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use rayon::prelude::*;
use toile_character::{Pose, PosedSkin, Skinning};
use toile_cloth::{Effort, MovingSurface, Obstacle, Sheet, Surroundings};

use super::{Blend, outfit::Outfit, squeeze::Pressed};
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

/// An outfit in motion: give it pose after pose.
pub struct Wearer<'a> {
    outfit: &'a Outfit,
    blend: Blend,
    way: Skinning,
    pose: Pose,
    sheets: Vec<Sheet>,
    /// Skinned and pressed places of the proxies at the end of the last step.
    carried: Vec<Vec<Vector3<f64>>>,
    body: MovingSurface,
    /// The garments' sheets as lower layers of each other.
    surfaces: Vec<MovingSurface>,
    /// How the columns are pressed in the last pose.
    pressed: Option<Pressed>,
    /// Where the vertices of each garment were moved to beside where cloth and skin take them, in their local frames.
    corrections: Vec<Vec<Vector3<f32>>>,
    skins: Vec<PosedSkin>,
    proxy_skins: Vec<PosedSkin>,
    layers: Vec<Vec<Point3<f32>>>,
}

impl<'a> Wearer<'a> {
    /// The outfit in its first pose, at rest.
    pub fn new(outfit: &'a Outfit, blend: Blend, way: Skinning) -> Self {
        let layers: Vec<Vec<Point3<f32>>> = outfit.layers.iter().map(|l| l.mesh.positions.clone()).collect();
        let sheets: Vec<Sheet> = outfit.proxies.iter().map(|p| p.sheet.clone()).collect();
        Self {
            blend,
            way,
            pose: outfit.pose0.clone(),
            body: MovingSurface::new(&layers[0], &outfit.layers[0].mesh.triangles),
            surfaces: sheets.iter().map(|s| MovingSurface::new(&points(&s.positions), s.triangles())).collect(),
            pressed: None,
            corrections: layers[1..].iter().map(|l| vec![Vector3::zeros(); l.len()]).collect(),
            skins: layers.iter().map(|_| PosedSkin::with_frames()).collect(),
            proxy_skins: outfit.proxies.iter().map(|_| PosedSkin::with_frames()).collect(),
            layers,
            carried: sheets.iter().map(|s| s.positions.clone()).collect(),
            sheets,
            outfit,
        }
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
        if self.blend == Blend::Anchored {
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
        if self.blend == Blend::Anchored {
            self.finish(seconds);
        }
        Ok(())
    }

    /// Presses the skinned layers and lets them ride on the cloth, from where they were corrected to last.
    fn finish(&mut self, seconds: f64) {
        let outfit = self.outfit;
        let skin = self.layers[0].clone();
        let pressed = self.pressed.get_or_insert_with(|| outfit.columns.press(&skin));
        pressed.apply_to_body(&mut self.layers[0]);
        outfit.limits[0].apply(&mut self.layers[0], Some(&pressed.normals));
        for (k, proxy) in outfit.proxies.iter().enumerate() {
            let fine = &mut self.layers[k + 1];
            outfit.columns.apply(pressed, &skin, k, fine);
            let moved: Vec<Vector3<f32>> =
                self.sheets[k].positions.iter().zip(&self.carried[k]).map(|(x, c)| (x - c).cast::<f32>()).collect();
            proxy.ride.carry(&moved, fine);
            let kept = (-seconds / FORGET).exp() as f32;
            let turns = &self.skins[k + 1].rotations;
            let corrections = &mut self.corrections[k];
            fine.par_iter_mut().zip(corrections).zip(turns).for_each(|((p, c), turn)| {
                *c *= kept;
                *p += turn * *c;
            });
            outfit.limits[k + 1].apply(fine, None);
        }
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
    fn pressed_at(&mut self, pose: &Pose) -> Result<Pressed, AnimationError> {
        let moved = self.moved(pose);
        let posed = self.outfit.skinners[0].pose(&moved, self.way, &mut self.skins[0]);
        posed.map_err(|e| AnimationError::Motion(e.to_string()))?;
        Ok(self.outfit.columns.press(&self.skins[0].positions))
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
        let (body, surfaces, proxy_skins) = (&self.body, &self.surfaces, &self.proxy_skins);
        let results: Vec<Result<(), toile_cloth::ClothError>> = self
            .sheets
            .par_iter_mut()
            .enumerate()
            .map(|(k, sheet)| {
                let mut obstacles: Vec<&dyn Obstacle> = vec![body];
                obstacles.extend(surfaces[..k].iter().map(|s| s as &dyn Obstacle));
                let around = Surroundings {
                    pulls: &pulls(&proxy_skins[k].rotations),
                    anchors: &targets[k],
                    guess: &guesses[k],
                    obstacles: &obstacles,
                    gaps: &outfit.proxies[k].gaps,
                    drag: DRAG,
                    dry: DRY,
                    ..Surroundings::still()
                };
                sheet.advance(h, &around, &Effort { rounds: 1, iterations: 10, tolerance: 5e-6, self_contact: false })
            })
            .collect();
        results.into_iter().collect::<Result<(), _>>().map_err(|e| wrong(&e))?;
        self.carried = targets;
        Ok(())
    }

    /// Where a sheet would be at the end of the step: cloth on the skin with the skin, cloth that hangs free as before.
    fn guess(&self, k: usize, sheet: &Sheet, target: &[Vector3<f64>], h: f64) -> Vec<Vector3<f64>> {
        let tied = &self.outfit.proxies[k].tied;
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
    let gravity = Vector3::new(0.0, -9.81, 0.0);
    rotations.iter().map(|r| gravity - r.cast::<f64>() * gravity).collect()
}
