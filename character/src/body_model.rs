//! The statistical body: mean, components, weights, joints (Hu et al. 2017, §5.1, eq. 1 and 2).

use std::sync::{Arc, OnceLock};

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use toile_geometry::Mesh;

use crate::{
    CharacterError, Pose, Region, Skeleton, SkinWeights, SkinnedMesh, dress_pose,
    joint::{JOINT_COUNT, JOINTS},
    mean_value::mean_value_weights,
};

/// How the joints of a body are found from its shape.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum JointRegressor {
    /// Affine in β, learnt from the generator's people: nearer on body joints.
    #[default]
    Affine,
    /// Mean value coordinates of the surface, as in Hu et al. 2017, eq. 1: nearer on fingers.
    MeanValue,
}

/// Facts about the people that the model was made from.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PopulationInfo {
    /// Mean β of the men.
    pub beta_male: Vec<f32>,
    /// Mean β of the women.
    pub beta_female: Vec<f32>,
    /// The generator's report: errors on held-out people, moments against ANSUR II.
    pub report: serde_json::Value,
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
    /// Root mean square displacement of the skin for β_i = 1, metres.
    pub sigma: Vec<f32>,
    /// Where the model comes from.
    pub population: PopulationInfo,
    /// Mean value coordinates of each joint of the mean body, computed when first asked for.
    pub(crate) mean_value_weights: OnceLock<Arc<Vec<Vec<f64>>>>,
}

impl BodyModel {
    /// Vertices of the body with coefficients `beta` in its rest pose (Hu et al. 2017, eq. 2), metres.
    ///
    /// `beta` may be shorter than the number of components (k = 15 as in the seed); further coefficients are ignored.
    pub fn shape(&self, beta: &[f64]) -> Vec<Point3<f32>> {
        const CHUNK: usize = 1024;
        let mut out = self.mean.clone();
        out.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, points)| {
            for (column, &b) in self.components.iter().zip(beta) {
                let b = b as f32;
                for (p, d) in points.iter_mut().zip(&column[chunk * CHUNK..]) {
                    *p += d * b;
                }
            }
        });
        out
    }

    /// Rest joints by the affine regressor in β: the default, the more exact one on body joints.
    pub fn joints_affine(&self, beta: &[f64]) -> Skeleton {
        let mut skeleton = self.mean_skeleton.clone();
        for (column, &b) in self.joint_components.iter().zip(beta) {
            for (joint, d) in skeleton.rest.iter_mut().zip(column) {
                *joint += d * b;
            }
        }
        skeleton
    }

    /// Rest joints of a body with this template's topology by mean value coordinates (Hu et al. 2017, eq. 1).
    ///
    /// # Errors
    /// [`CharacterError::Mismatch`] where the number of `vertices` is not the template's.
    pub fn joints_mvc(&self, vertices: &[Point3<f32>]) -> Result<Skeleton, CharacterError> {
        if vertices.len() != self.mean.len() {
            let (have, want) = (vertices.len(), self.mean.len());
            return Err(CharacterError::Mismatch(format!("{have} vertices, but the template has {want}")));
        }
        Ok(self.mean_value_joints(vertices))
    }

    fn mean_value_joints(&self, vertices: &[Point3<f32>]) -> Skeleton {
        let mut rest = [Point3::origin(); JOINT_COUNT];
        for (joint, weights) in rest.iter_mut().zip(self.mean_value_weights()) {
            joint.coords = weights.iter().zip(vertices).map(|(w, p)| p.coords.cast::<f64>() * *w).sum();
        }
        Skeleton { rest }
    }

    /// Mean value coordinates of each joint (joints × vertices), computed on the mean body when first asked for.
    pub fn mean_value_weights(&self) -> &[Vec<f64>] {
        self.mean_value_weights.get_or_init(|| {
            let positions: Vec<Point3<f64>> = self.mean.iter().map(|p| p.cast()).collect();
            let joint =
                |j: &crate::Joint| mean_value_weights(&self.mean_skeleton.position(*j), &positions, &self.triangles);
            Arc::new(JOINTS.par_iter().map(joint).collect())
        })
    }

    /// The default skeleton of a body: [`Self::joints_affine`].
    pub fn skeleton_at(&self, beta: &[f64]) -> Skeleton {
        self.skeleton_by(beta, JointRegressor::Affine)
    }

    /// Rest joints of the body with coefficients `beta` by `regressor`.
    pub fn skeleton_by(&self, beta: &[f64], regressor: JointRegressor) -> Skeleton {
        match regressor {
            JointRegressor::Affine => self.joints_affine(beta),
            JointRegressor::MeanValue => self.mean_value_joints(&self.shape(beta)),
        }
    }

    /// This model with joints that follow β by `regressor`, so that a fit works with them. Mean value coordinates are
    /// linear in the vertices, hence affine in β as well.
    pub fn with_joints_by(&self, regressor: JointRegressor) -> Self {
        let mut model = self.clone();
        if regressor == JointRegressor::MeanValue {
            let weights = self.mean_value_weights();
            let of = |column: &Vec<Vector3<f32>>| -> Vec<Vector3<f64>> {
                let joint = |w: &Vec<f64>| w.iter().zip(column).map(|(w, d)| d.cast::<f64>() * *w).sum();
                weights.iter().map(joint).collect()
            };
            model.joint_components = self.components.par_iter().map(of).collect();
        }
        model
    }

    /// The body with coefficients `beta` as a skinned mesh at rest.
    pub fn skinned(&self, beta: &[f64]) -> SkinnedMesh {
        let mesh = Mesh::new(self.shape(beta), self.triangles.clone());
        SkinnedMesh { mesh, skeleton: self.skeleton_at(beta), weights: self.weights.clone() }
    }

    /// Vertices of the body with coefficients `beta` in `pose` (eq. 2, then eq. 3).
    pub fn posed(&self, beta: &[f64], pose: &Pose) -> Vec<Point3<f32>> {
        let transforms = pose.skinning_transforms(&self.skeleton_at(beta));
        crate::skinning::skin(&self.shape(beta), &self.weights, &transforms)
    }

    /// The pose that brings the body with coefficients `beta` from its A-pose to the T-pose.
    pub fn t_pose(&self, beta: &[f64]) -> Pose {
        dress_pose::t_pose(&self.skeleton_at(beta))
    }

    /// Vertex of the landmark called `name`.
    pub fn landmark(&self, name: &str) -> Option<u32> {
        self.landmarks.iter().find(|(n, _)| n == name).map(|(_, v)| *v)
    }

    /// Number of components.
    pub fn component_count(&self) -> usize {
        self.components.len()
    }

    /// Number of template vertices.
    pub fn vertex_count(&self) -> usize {
        self.mean.len()
    }
}
