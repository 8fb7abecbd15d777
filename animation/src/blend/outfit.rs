//! A body and its garments, prepared for motion.

use nalgebra::Point3;
use rayon::prelude::*;
use toile_character::{Joint, Pose, Skeleton, SkinWeights, Skinner, skin::INFLUENCES};
use toile_geometry::Mesh;

use super::{
    anchors::Closeness,
    layer::OutfitLayer,
    proxy::Proxy,
    squeeze::Columns,
    strain::{CLOTH, SKIN, StrainLimit},
};
use crate::AnimationError;

/// A body and its garments, inside to outside, in the pose in which they were scanned.
pub struct Outfit {
    pub(crate) skeleton: Skeleton,
    pub(crate) pose0: Pose,
    pub(crate) layers: Vec<OutfitLayer>,
    pub(crate) skinners: Vec<Skinner>,
    /// One for each garment.
    pub(crate) proxies: Vec<Proxy>,
    pub(crate) columns: Columns,
    /// One for each layer.
    pub(crate) limits: Vec<StrainLimit>,
}

impl Outfit {
    /// Prepares the `layers` (the first is the body, the others garments from inside to outside), which are in `pose0` of
    /// `skeleton`.
    ///
    /// # Errors
    /// [`AnimationError::Motion`] where there is no body, or a layer cannot be skinned or simulated.
    pub fn new(skeleton: Skeleton, pose0: Pose, layers: Vec<OutfitLayer>) -> Result<Self, AnimationError> {
        let Some(body) = layers.first().filter(|b| !b.mesh.is_empty()) else {
            return Err(AnimationError::Motion("an outfit needs a body".into()));
        };
        let skinner = |l: &OutfitLayer| {
            Skinner::new(&l.mesh, &l.weights).map_err(|e| AnimationError::Motion(format!("layer {}: {e}", l.name)))
        };
        let skinners = layers.iter().map(skinner).collect::<Result<Vec<_>, _>>()?;
        let closeness = Closeness::new(&body.mesh);
        let proxies: Result<Vec<Proxy>, AnimationError> =
            layers[1..].par_iter().map(|layer| Proxy::new(layer, &closeness)).collect();
        let meshes: Vec<&Mesh> = layers.iter().map(|l| &l.mesh).collect();
        let columns = Columns::new(&meshes, hands_and_feet(&body.weights), &closeness);
        let limits = meshes
            .par_iter()
            .enumerate()
            .map(|(k, mesh)| StrainLimit::new(mesh, if k == 0 { SKIN } else { CLOTH }))
            .collect();
        Ok(Self { limits, skeleton, pose0, proxies: proxies?, columns, skinners, layers })
    }

    /// The layers in the outfit's first pose.
    pub fn layers(&self) -> &[OutfitLayer] {
        &self.layers
    }

    /// The weights w_p that [`Blend::Seed`](super::Blend::Seed) gives the physics of each garment: one, or two for a skirt (what lies on the
    /// body, and what hangs free).
    pub fn physical_shares(&self) -> Vec<Vec<f64>> {
        self.proxies.iter().map(|proxy| proxy.shares.parts.clone()).collect()
    }

    /// Positions of a layer in the outfit's first pose.
    pub fn scanned(&self, layer: usize) -> &[Point3<f32>] {
        &self.layers[layer].mesh.positions
    }
}

/// True for vertices that a hand, a finger or a foot moves most.
fn hands_and_feet(weights: &SkinWeights) -> Vec<bool> {
    let moves_most = |joints: &[u8; INFLUENCES]| Joint::from_index(usize::from(joints[0]));
    let ends =
        [Joint::LeftHand, Joint::RightHand, Joint::LeftFoot, Joint::RightFoot, Joint::LeftToes, Joint::RightToes];
    let is_end = |joint: Joint| joint.is_finger() || ends.contains(&joint);
    weights.joints.iter().map(|joints| moves_most(joints).is_some_and(is_end)).collect()
}
