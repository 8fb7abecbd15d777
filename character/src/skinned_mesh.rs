//! A mesh with its skeleton and weights.

use nalgebra::Point3;
use toile_geometry::Mesh;

use crate::{CharacterError, Pose, Skeleton, SkinWeights, skinning};

/// A mesh at rest with its skeleton and weights.
#[derive(Debug, Clone)]
pub struct SkinnedMesh {
    /// The mesh in the skeleton's rest pose.
    pub mesh: Mesh,
    /// The skeleton it hangs on.
    pub skeleton: Skeleton,
    /// Weights of the mesh's vertices.
    pub weights: SkinWeights,
}

impl SkinnedMesh {
    /// Joins the parts.
    ///
    /// # Errors
    /// [`CharacterError::Mismatch`] where mesh and weights differ in length.
    pub fn new(mesh: Mesh, skeleton: Skeleton, weights: SkinWeights) -> Result<Self, CharacterError> {
        if mesh.positions.len() != weights.len() {
            let (v, w) = (mesh.positions.len(), weights.len());
            return Err(CharacterError::Mismatch(format!("{v} vertices but weights for {w}")));
        }
        Ok(Self { mesh, skeleton, weights })
    }

    /// Vertex positions in `pose`.
    pub fn posed(&self, pose: &Pose) -> Vec<Point3<f32>> {
        skinning::skin(&self.mesh.positions, &self.weights, &pose.skinning_transforms(&self.skeleton))
    }

    /// The mesh in `pose`, normals recomputed.
    pub fn posed_mesh(&self, pose: &Pose) -> Mesh {
        let mut mesh = Mesh { positions: self.posed(pose), normals: Vec::new(), ..self.mesh.clone() };
        mesh.recompute_normals();
        mesh
    }
}
