//! Spring bones: loose parts of garments that swing in other people's programs.
//!
//! A program that plays VRM files knows chains of joints that swing as springs (VRM Consortium, VRMC_springBone-1.0). From an avatar
//! at rest in its T-pose:
//!
//! 1. `around`: places by the angle around the legs and the height;
//! 2. `cloth`: which layers hang around the legs, how far out they hang, and how much of their motion is their own;
//! 3. `colliders`: capsules in the hips, thighs and shins;
//! 4. `chains`: joints down the cloth, clear of the capsules, so that the scanned shape is where they rest;
//! 5. `binding`: at most four weights a vertex, on chains and on legs.
//!
//! One set of chains carries all layers, so that those which lie on each other move alike. [`Swing`] plays the chains as the format's
//! reference does. Results do not depend on the number of threads.

mod around;
mod binding;
mod chains;
mod cloth;
mod colliders;
mod layer;
mod swing;

use nalgebra::Point3;
use toile_character::{JOINT_COUNT, SpringBones};

pub use layer::RestedLayer;
pub use swing::Swing;

use around::Around;
use cloth::Cloth;

/// Spring bones for the `layers` (the first is the body) of an avatar that rests in its T-pose, its `joints` there, metres. `None` where nothing
/// hangs loose around the legs.
///
/// Only cloth below the hips gets chains: sleeves and scarves follow their skin. Gravity is left out, since the scanned shape
/// is the one that gravity gave it.
pub fn spring_bones(joints: &[Point3<f64>], layers: &[RestedLayer<'_>]) -> Option<SpringBones> {
    let body = layers.first().filter(|_| joints.len() == JOINT_COUNT)?;
    let around = Around::new(joints, layers)?;
    let cloth = Cloth::new(&around, layers)?;
    let colliders = colliders::fit(joints, body, cloth.low);
    let chains = chains::lay(&around, &cloth, &colliders);
    let weights = layers
        .iter()
        .enumerate()
        .map(|(k, layer)| cloth.hangs[k].then(|| binding::bind(&around, &cloth, &chains, layer)))
        .collect();
    Some(SpringBones { chains, colliders, drag: chains::drag(), weights })
}
