//! The statistical body: mean, components, weights, joints (Hu et al. 2017, §5.1, eq. 1 and 2).

use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};

use crate::{Skeleton, SkinWeights};

/// The part of the body that a template vertex belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[repr(u8)]
#[allow(missing_docs)] // the names are the documentation
pub enum Region {
    Torso,
    LeftArm,
    RightArm,
    LeftLeg,
    RightLeg,
    LeftHand,
    RightHand,
    LeftFoot,
    RightFoot,
    Head,
}

/// The statistical body model: closed template, shapes as mean + Σ βᵢ μᵢ (eq. 2), joints, skin weights.
///
/// Rest pose is an A-pose: straight arms about 45° down, legs slightly apart; +Y up, +Z front, soles at y = 0.
/// β is in units of standard deviations: each component's column is already scaled by its σ.
#[derive(Debug, Clone)]
pub struct BodyModel {
    /// Triangles of the closed template, outward.
    pub triangles: Vec<[u32; 3]>,
    /// Mean vertex positions, metres.
    pub mean: Vec<Point3<f32>>,
    /// Displacement of every vertex for β_i = 1: `components[i][v]`, metres; strongest first.
    pub components: Vec<Vec<Vector3<f32>>>,
    /// Skin weights of the template's vertices.
    pub weights: SkinWeights,
    /// Rest joints of the mean body.
    pub mean_skeleton: Skeleton,
    /// Affine joint regressor: displacement of every joint for β_i = 1, `joint_components[i][joint]`.
    pub joint_components: Vec<Vec<Vector3<f64>>>,
    /// Region of every vertex.
    pub regions: Vec<Region>,
    /// True for vertices inside mouth and eye sockets: no scanner sees them.
    pub inner: Vec<bool>,
    /// Landmark vertices by name, in name order.
    pub landmarks: Vec<(String, u32)>,
}
