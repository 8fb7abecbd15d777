//! An outfit in real time: garments in three classes of cloth, and layers that keep their order.
//!
//! The way of Magnenat-Thalmann et al. (the project's paper 000, §5.3, after Cordier and Magnenat-Thalmann 2002): cloth is divided by its
//! distance to the skin at rest into what rides on the skin (stretch), what moves within a certain distance of it (loose, on limbs and on the
//! trunk) and what floats. In the order of the modules, for each pose:
//!
//! 1. the joints are placed (`posing`), and all layers follow them by their skin weights;
//! 2. layers between parts of the body that come near each other are pressed together in their order (`press`);
//! 3. beside that, rough meshes of the garments (`rough`) are simulated in steps of 1/240 s (`simulation`): each vertex by its `class`, as
//!    `particles` that hit what is below (`hits`); layers that lie on each other move `together`; the scanned meshes ride on them;
//! 4. triangles that stretch too far shrink (`blend/strain.rs`); then, garment by garment, the order of the layers is restored (`order`): each
//!    vertex and each edge is kept `over` the layers below, on whose `surface` it walks, and over the vertices that come `through`.
//!
//! Nothing is allocated from the second call of [`Live::advance`] on. What a pose gives depends on the poses and times before, and on nothing
//! else: not on the number of threads. From outside of a thread pool, rayon's own queue takes a block of memory every few dozen calls; inside of
//! one (`ThreadPool::install`) it takes none.

mod class;
mod hit;
mod hits;
mod lifts;
mod link;
mod on;
mod order;
mod over;
mod particles;
mod posing;
mod press;
mod rough;
mod simulation;
mod surface;
mod through;
mod together;

use nalgebra::Point3;
use rayon::prelude::*;
use toile_character::{Pose, PosedSkin, Skinning};
use toile_geometry::Mesh;

use self::{order::Order, posing::Posing, press::Press, simulation::Simulation};
use crate::{
    AnimationError,
    blend::{Outfit, strain::Torn},
};

/// Rounds in which triangles that stretch too far shrink: few, for the sake of time.
const ROUNDS: usize = 2;

/// An outfit in real time: give it pose after pose, at any rate.
pub struct Live<'a> {
    outfit: &'a Outfit,
    carried: Carried,
    simulation: Simulation,
    /// One for each garment.
    torn: Vec<Torn>,
    order: Order,
    /// Vertices, metres.
    layers: Vec<Vec<Point3<f32>>>,
}

impl<'a> Live<'a> {
    /// The outfit in its first pose, at rest; skin weights are blended in this `way`.
    ///
    /// # Errors
    /// [`AnimationError::Motion`] where a garment lies over no body, or cannot be skinned.
    pub fn new(outfit: &'a Outfit, way: Skinning) -> Result<Self, AnimationError> {
        let meshes: Vec<&Mesh> = outfit.layers.iter().map(|l| &l.mesh).collect();
        Ok(Self {
            carried: Carried::new(outfit, way),
            simulation: Simulation::new(outfit, way)?,
            torn: meshes[1..].iter().map(|m| Torn::new(m.triangles.len(), ROUNDS)).collect(),
            order: Order::new(&meshes),
            layers: meshes.iter().map(|m| m.positions.clone()).collect(),
            outfit,
        })
    }

    /// Vertices of all layers, as they were left by the last [`Live::advance`]: metres, in the subject's frame.
    pub fn layers(&self) -> &[Vec<Point3<f32>>] {
        &self.layers
    }

    /// Moves on to `pose` within `seconds`. With 0 seconds, all cloth goes along as it is; of more than two seconds, the last two are simulated.
    ///
    /// # Errors
    /// [`AnimationError::Motion`] for a pose that has not one finite rotation for each joint, and for a time that is negative or not
    /// finite; nothing has moved then.
    pub fn advance(&mut self, seconds: f64, pose: &Pose) -> Result<(), AnimationError> {
        posing::check(pose)?;
        if !(seconds.is_finite() && seconds >= 0.0) {
            return Err(AnimationError::Motion(format!("{seconds} seconds to the next pose; it must be 0 or more")));
        }
        let Self { outfit, carried, simulation, torn, order, layers } = self;
        let (simulated, posed) =
            rayon::join(|| simulation.advance(seconds, pose), || carried.advance(outfit, pose, layers));
        simulated.and(posed)?;
        let garments = simulation.garments.par_iter().zip(&carried.press.free).zip(&outfit.limits[1..]).zip(torn);
        layers[1..].par_iter_mut().zip(garments).for_each(|(layer, (((rough, free), limit), torn))| {
            rough.ride.carry(&rough.moved, free, layer);
            limit.apply(layer, None, torn);
        });
        for k in 1..layers.len() {
            order.keep(layers, k);
        }
        Ok(())
    }
}

/// The layers where the skeleton carries them, pressed where parts of the body come near each other.
struct Carried {
    way: Skinning,
    posing: Posing,
    skins: Vec<PosedSkin>,
    press: Press,
}

impl Carried {
    fn new(outfit: &Outfit, way: Skinning) -> Self {
        let body = &outfit.layers[0].mesh;
        Self {
            way,
            posing: Posing::new(&outfit.skeleton, &outfit.pose0),
            skins: outfit.layers.iter().map(|_| PosedSkin::default()).collect(),
            press: Press::new(&outfit.columns, &body.positions, &body.vertex_normals()),
        }
    }

    fn advance(&mut self, outfit: &Outfit, pose: &Pose, layers: &mut [Vec<Point3<f32>>]) -> Result<(), AnimationError> {
        let Self { way, posing, skins, press } = self;
        posing.set(pose);
        let moved = &posing.moved;
        skins.par_iter_mut().zip(&outfit.skinners).try_for_each(|(skin, skinner)| {
            skinner.pose(moved, *way, skin).map_err(|e| AnimationError::Motion(e.to_string()))
        })?;
        layers.iter_mut().zip(&*skins).for_each(|(layer, skin)| layer.copy_from_slice(&skin.positions));
        let skin = &skins[0];
        press.press(&outfit.columns, &skin.positions, &skin.normals);
        for (k, layer) in layers.iter_mut().skip(1).enumerate() {
            press.apply(&outfit.columns, &skin.positions, k, layer);
        }
        press.pressed.apply_to_body(&mut layers[0]);
        Ok(())
    }
}
