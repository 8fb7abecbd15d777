//! Skin weights inside a mesh file, as vertex attributes.

use toile_character::{SkinWeights, skin::INFLUENCES};
use toile_geometry::Mesh;

const JOINT: [&str; INFLUENCES] = ["joint0", "joint1", "joint2", "joint3"];
const WEIGHT: [&str; INFLUENCES] = ["weight0", "weight1", "weight2", "weight3"];

/// The mesh with its weights as attributes.
pub fn with_weights(mesh: &Mesh, weights: &SkinWeights) -> Mesh {
    let mut mesh = mesh.clone();
    for k in 0..INFLUENCES {
        mesh.attributes.insert(JOINT[k].into(), weights.joints.iter().map(|j| f32::from(j[k])).collect());
        mesh.attributes.insert(WEIGHT[k].into(), weights.weights.iter().map(|w| w[k]).collect());
    }
    mesh
}

/// Takes the weights out of a mesh again; `None` where it has none, or not as many as vertices.
pub fn take_weights(mesh: &mut Mesh) -> Option<SkinWeights> {
    let count = mesh.positions.len();
    let mut weights = SkinWeights { joints: vec![[0; INFLUENCES]; count], weights: vec![[0.0; INFLUENCES]; count] };
    for k in 0..INFLUENCES {
        let (joints, values) = (mesh.attributes.remove(JOINT[k])?, mesh.attributes.remove(WEIGHT[k])?);
        for (v, (joint, value)) in joints.into_iter().zip(values).enumerate() {
            (weights.joints[v][k], weights.weights[v][k]) = (joint as u8, value);
        }
    }
    Some(weights)
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;
    use toile_geometry::ply;

    use super::*;

    #[test]
    fn weights_survive_a_file() {
        let mesh = Mesh::new(vec![Point3::origin(); 3], vec![[0, 1, 2]]);
        let mut weights = SkinWeights::default();
        weights.push(&[(3, 0.3), (51, 0.7)]);
        weights.push(&[(0, 1.0)]);
        weights.push(&[(1, 0.1), (2, 0.2), (4, 0.3), (5, 0.4)]);
        let mut read = ply::decode(&ply::encode(&with_weights(&mesh, &weights))).unwrap();
        assert_eq!(take_weights(&mut read), Some(weights));
        assert_eq!(read, mesh);
        assert_eq!(take_weights(&mut read), None);
    }
}
