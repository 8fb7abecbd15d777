//! The rough meshes of all garments over a rough body, in steps of one length.

use nalgebra::Point3;
use rayon::prelude::*;
use toile_character::{Pose, PosedSkin, Skinner, Skinning};
use toile_geometry::{bvh::Bvh, remesh};

use super::{
    hit::Below,
    particles::STEP,
    posing::{self, Posing},
    rough::Rough,
    together::lies_on,
};
use crate::{
    AnimationError,
    blend::{Outfit, anchors::Closeness, proxy::carried_over},
};

/// Edges of the rough body, metres.
const BODY_EDGE: f32 = 0.025;
/// Longest piece of a frame in which joints may be taken to move on lines, seconds: 0.5 mm beside an arc of 0.6 m at 2 rad/s.
const PIECE: f64 = 1.0 / 24.0;
/// Of a longer time only this much is simulated, its end, seconds: older motion has died down.
const LONGEST: f64 = 2.0;

/// Less time than this is none, seconds.
const SHORTEST: f64 = 1e-6;

/// The rough body and garments.
pub(super) struct Simulation {
    way: Skinning,
    posing: Posing,
    body: Body,
    pub garments: Vec<Rough>,
    /// The pose of the last call, and poses between.
    pose: Pose,
    between: Pose,
    /// Time that was not simulated yet, seconds: less than a step.
    left: f64,
}

/// The body in few triangles.
struct Body {
    triangles: Vec<[u32; 3]>,
    skinner: Skinner,
    skin: PosedSkin,
    from: Vec<Point3<f32>>,
    bvh: Bvh,
}

impl Simulation {
    pub fn new(outfit: &Outfit, way: Skinning) -> Result<Self, AnimationError> {
        let body = &outfit.layers[0];
        let closeness = Closeness::new(&body.mesh);
        let garments: Result<Vec<Rough>, AnimationError> =
            outfit.layers[1..].par_iter().map(|layer| Rough::new(layer, &closeness)).collect();
        let mut simulation = Self {
            way,
            posing: Posing::new(&outfit.skeleton, &outfit.pose0),
            body: Body::new(outfit)?,
            garments: garments?,
            pose: outfit.pose0.clone(),
            between: outfit.pose0.clone(),
            left: 0.0,
        };
        for k in 0..simulation.garments.len() {
            let heights = (0..=k).map(|j| simulation.below(j).heights(&simulation.garments[k].places)).collect();
            simulation.garments[k].heights = heights;
            let (below, rest) = simulation.garments.split_at(k);
            let on = (0..rest[0].places.len()).map(|v| lies_on(&rest[0], v, below)).collect();
            simulation.garments[k].on = on;
        }
        simulation.skin()?;
        Ok(simulation)
    }

    /// The surface of layer `j`: the body, or a garment.
    fn below(&self, j: usize) -> Below<'_> {
        match j.checked_sub(1) {
            None => self.body.below(),
            Some(j) => self.garments[j].below(),
        }
    }

    /// Moves on to `pose` within `seconds`.
    pub fn advance(&mut self, seconds: f64, pose: &Pose) -> Result<(), AnimationError> {
        if seconds < SHORTEST {
            return self.jump(pose);
        }
        let pieces = (seconds.min(LONGEST) / PIECE).ceil().max(1.0) as usize;
        let first = (1.0 - LONGEST / seconds.max(1e-9)).max(0.0);
        for piece in 1..=pieces {
            let share = first + (1.0 - first) * piece as f64 / pieces as f64;
            posing::between(&self.pose, pose, share, &mut self.between);
            self.posing.set(&self.between);
            self.piece(seconds.min(LONGEST) / pieces as f64)?;
        }
        self.keep(pose);
        Ok(())
    }

    /// Moves on to `pose` in no time: all cloth goes along.
    fn jump(&mut self, pose: &Pose) -> Result<(), AnimationError> {
        self.posing.set(pose);
        self.skin()?;
        for garment in &mut self.garments {
            garment.places.iter_mut().zip(&garment.to).zip(&garment.moved).for_each(|((p, to), moved)| *p = to + moved);
            garment.bvh.refit_boxes(&garment.places, &garment.triangles);
        }
        self.keep(pose);
        Ok(())
    }

    fn keep(&mut self, pose: &Pose) {
        self.pose.translation = pose.translation;
        self.pose.rotations.copy_from_slice(&pose.rotations);
    }

    /// Poses body and garments, and keeps where they were.
    fn skin(&mut self) -> Result<(), AnimationError> {
        let wrong = |e: toile_character::CharacterError| AnimationError::Motion(e.to_string());
        let (way, moved, body) = (self.way, &self.posing.moved, &mut self.body);
        if !body.skin.positions.is_empty() {
            body.from.copy_from_slice(&body.skin.positions);
        }
        body.skinner.pose(moved, way, &mut body.skin).map_err(wrong)?;
        body.bvh.refit_boxes(&body.skin.positions, &body.triangles);
        for garment in &mut self.garments {
            garment.from.copy_from_slice(&garment.to);
            garment.skinner.pose(moved, way, &mut garment.skin).map_err(wrong)?;
            garment.to.copy_from_slice(&garment.skin.positions);
        }
        Ok(())
    }

    /// Moves all garments to where the joints are now, within `seconds`.
    fn piece(&mut self, seconds: f64) -> Result<(), AnimationError> {
        self.skin()?;
        let steps = ((self.left + seconds) / STEP + 1e-9).floor().max(0.0);
        // The cloth is behind by what was left of the last piece.
        let first = (-self.left / seconds) as f32;
        let part = (STEP / seconds) as f32;
        self.left += seconds - steps * STEP;
        for k in 0..self.garments.len() {
            let (below, rest) = self.garments.split_at_mut(k);
            let (garment, body) = (&mut rest[0], &self.body);
            garment.start.copy_from_slice(&garment.places);
            let surface = |j: usize| if j == 0 { body.below() } else { below[j - 1].below() };
            garment.look(surface, k + 1);
            for step in 0..steps as usize {
                garment.step(first + step as f32 * part, part);
            }
            garment.finish(first + steps as f32 * part);
            garment.go_along(below);
        }
        Ok(())
    }
}

impl Body {
    fn new(outfit: &Outfit) -> Result<Self, AnimationError> {
        let body = &outfit.layers[0];
        let mesh = remesh::isotropic(&body.mesh, BODY_EDGE);
        let (weights, _) = carried_over(&body.mesh, &body.weights, &mesh);
        let skinner = Skinner::new(&mesh, &weights).map_err(|e| AnimationError::Motion(format!("body: {e}")))?;
        let mut skin = PosedSkin::default();
        skin.positions.clone_from(&mesh.positions);
        let bvh = Bvh::new(&mesh.positions, &mesh.triangles);
        Ok(Self { triangles: mesh.triangles, skinner, skin, from: mesh.positions, bvh })
    }

    fn below(&self) -> Below<'_> {
        Below { triangles: &self.triangles, bvh: &self.bvh, from: &self.from, to: &self.skin.positions }
    }
}

impl Rough {
    fn below(&self) -> Below<'_> {
        Below { triangles: &self.triangles, bvh: &self.bvh, from: &self.start, to: &self.places }
    }

    /// Tells the scanned mesh and the layers above where the rough mesh is at the end of a piece.
    fn finish(&mut self, share: f32) {
        for v in 0..self.places.len() {
            self.moved[v] = self.places[v] - self.carried(v, share);
        }
        self.bvh.refit_boxes(&self.places, &self.triangles);
    }
}
