//! Skinning: linear (Hu et al. 2017, eq. 3), in log space and hybrid (Magnenat-Thalmann et al. 2004, eq. 3 and section 4.2).
//!
//! - [`skin`] and [`unskin`]: linear blending and its inverse, once, by matrices of single precision; in parallel;
//! - [`Skinner`]: one mesh in pose after pose by any [`Skinning`], with normals and the local frame of each vertex;
//! - [`twist`]: logarithms of rigid transforms, and blending in log space in double precision.
//!
//! ```
//! use toile_character::{BodyModel, Joint, PosedSkin, Skinner, Skinning};
//!
//! let body = BodyModel::load_default()?.skinned(&[0.5]);
//! let skinner = Skinner::new(&body.mesh, &body.weights)?;
//! let mut pose = toile_character::Pose::identity();
//! *pose.rotation_mut(Joint::LeftLowerArm) = nalgebra::UnitQuaternion::from_euler_angles(0.0, 1.5, 0.0);
//! let mut posed = PosedSkin::with_frames(); // kept from frame to frame
//! skinner.pose(&pose.skinning_transforms(&body.skeleton), Skinning::Log, &mut posed)?;
//! let sleeve = posed.frame(7).map(|posed_from_local| posed_from_local * nalgebra::Point3::new(0.0, 0.01, 0.0));
//! # assert!(sleeve.is_some());
//! # Ok::<(), toile_character::CharacterError>(())
//! ```

mod groups;
mod kernel;
mod motions;
mod skinner;
pub mod twist;
mod way;

pub use skinner::{PosedSkin, Skinner};
pub use way::Skinning;

use nalgebra::{Isometry3, Matrix3x4, Matrix4, Point3};
use rayon::prelude::*;

use crate::SkinWeights;

/// Moves rest `positions` by the weighted sum of `posed_from_rest` transforms, one a joint. Parallel, deterministic.
pub fn skin(positions: &[Point3<f32>], weights: &SkinWeights, posed_from_rest: &[Isometry3<f64>]) -> Vec<Point3<f32>> {
    let matrices = matrices(posed_from_rest);
    positions
        .par_iter()
        .enumerate()
        .map(|(v, p)| blended(weights, v, &matrices) * p.to_homogeneous())
        .map(Point3::from)
        .collect()
}

/// Takes posed `positions` back to rest: the inverse of each vertex's blended transform. A vertex whose blend
/// cannot be inverted (it would need opposite rotations) follows its strongest joint.
pub fn unskin(
    positions: &[Point3<f32>],
    weights: &SkinWeights,
    posed_from_rest: &[Isometry3<f64>],
) -> Vec<Point3<f32>> {
    let matrices = matrices(posed_from_rest);
    positions
        .par_iter()
        .enumerate()
        .map(|(v, p)| {
            let mut full = Matrix4::<f64>::identity();
            full.fixed_view_mut::<3, 4>(0, 0).copy_from(&blended(weights, v, &matrices).cast::<f64>());
            let point = p.cast::<f64>();
            match full.try_inverse() {
                Some(rest_from_posed) => rest_from_posed.transform_point(&point).cast::<f32>(),
                None => posed_from_rest[weights.joints[v][0] as usize].inverse_transform_point(&point).cast::<f32>(),
            }
        })
        .collect()
}

/// The blended 3×4 `posed_from_rest` matrix of vertex `v`.
pub fn blended(weights: &SkinWeights, v: usize, matrices: &[Matrix3x4<f32>]) -> Matrix3x4<f32> {
    let mut sum = Matrix3x4::zeros();
    for (joint, weight) in weights.of(v) {
        sum += matrices[joint as usize] * weight;
    }
    sum
}

/// Upper 3×4 parts in f32, once a pose.
pub fn matrices(posed_from_rest: &[Isometry3<f64>]) -> Vec<Matrix3x4<f32>> {
    posed_from_rest.iter().map(|t| t.to_homogeneous().cast::<f32>().fixed_view::<3, 4>(0, 0).into_owned()).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    #[test]
    fn unskin_takes_skin_back() {
        let transforms: Vec<_> = (0..3)
            .map(|i| {
                let t = f64::from(i);
                Isometry3::new(Vector3::new(t, 0.2 * t, -t), Vector3::new(0.2 * t, 0.1, -0.3 * t))
            })
            .collect();
        let mut weights = SkinWeights::default();
        let positions: Vec<Point3<f32>> = (0..50)
            .map(|i| {
                let t = i as f32 * 0.37;
                weights.push(&[(0, t.sin().abs()), (1, t.cos().abs()), (2, 0.1)]);
                Point3::new(t.sin(), t.cos(), t * 0.1)
            })
            .collect();
        let posed = skin(&positions, &weights, &transforms);
        let back = unskin(&posed, &weights, &transforms);
        assert!(posed.iter().zip(&positions).any(|(a, b)| (a - b).norm() > 0.1));
        assert!(back.iter().zip(&positions).all(|(a, b)| (a - b).norm() < 1e-5));
    }
}
