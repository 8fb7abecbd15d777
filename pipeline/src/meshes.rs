//! Meshes as files: any mesh, and meshes with their skin weights as vertex attributes.

use std::{io::Read, path::Path};

use toile_capture::files::open_regular;
use toile_character::{SkinWeights, skin::INFLUENCES};
use toile_geometry::{Mesh, obj, ply};

use crate::PipelineError;

/// The largest mesh file that is read, bytes.
const MAX_BYTES: u64 = 1 << 30;
const JOINT: [&str; INFLUENCES] = ["joint0", "joint1", "joint2", "joint3"];
const WEIGHT: [&str; INFLUENCES] = ["weight0", "weight1", "weight2", "weight3"];

/// Reads a mesh: PLY, or OBJ by its extension.
///
/// # Errors
/// [`PipelineError`] where the file is missing or is not a mesh.
pub fn read_mesh(path: &Path) -> Result<Mesh, PipelineError> {
    Ok(if is_obj(path) { obj::read(path)? } else { ply::read(path)? })
}

/// Looks at the size of a mesh file and at its first bytes, before anybody reads all of it.
///
/// # Errors
/// [`PipelineError`] where it is missing or is no file of a mesh.
pub(crate) fn check_kind(path: &Path) -> Result<(), PipelineError> {
    let wrap = |e| PipelineError::io(path, e);
    let file = open_regular(path)?;
    let length = file.metadata().map_err(wrap)?.len();
    if length > MAX_BYTES {
        let reason = format!("holds {length} bytes; a mesh of at most {} MiB can be read", MAX_BYTES >> 20);
        return Err(PipelineError::format(path, reason));
    }
    let mut head = Vec::new();
    file.take(3).read_to_end(&mut head).map_err(wrap)?;
    if is_obj(path) || head == b"ply" {
        return Ok(());
    }
    Err(PipelineError::format(
        path,
        "is not a PLY file: it does not start with `ply` (an OBJ file must be called .obj)",
    ))
}

fn is_obj(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("obj"))
}

/// Reads a mesh that [`encode_skinned`] wrote.
///
/// # Errors
/// [`PipelineError`] where the file is missing, is not a mesh or has no skin weights.
pub fn read_skinned(path: &Path) -> Result<(Mesh, SkinWeights), PipelineError> {
    let mut mesh = read_mesh(path)?;
    let lacks = || PipelineError::format(path, "has no skin weights; delete it and run again");
    let weights = take_weights(&mut mesh).ok_or_else(lacks)?;
    Ok((mesh, weights))
}

/// The mesh with its weights as a PLY file.
pub fn encode_skinned(mesh: &Mesh, weights: &SkinWeights) -> Vec<u8> {
    let mut mesh = mesh.clone();
    for k in 0..INFLUENCES {
        mesh.attributes.insert(JOINT[k].into(), weights.joints.iter().map(|j| f32::from(j[k])).collect());
        mesh.attributes.insert(WEIGHT[k].into(), weights.weights.iter().map(|w| w[k]).collect());
    }
    ply::encode(&mesh)
}

/// Takes the weights out of a mesh again; `None` where it has none, or not as many as vertices.
fn take_weights(mesh: &mut Mesh) -> Option<SkinWeights> {
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

    use super::*;

    #[test]
    fn weights_survive_a_file() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("garment.ply");
        let mesh = Mesh::new(vec![Point3::origin(); 3], vec![[0, 1, 2]]);
        let mut weights = SkinWeights::default();
        weights.push(&[(3, 0.3), (51, 0.7)]);
        weights.push(&[(0, 1.0)]);
        weights.push(&[(1, 0.1), (2, 0.2), (4, 0.3), (5, 0.4)]);
        std::fs::write(&path, encode_skinned(&mesh, &weights)).unwrap();
        assert_eq!(read_skinned(&path).unwrap(), (mesh.clone(), weights));
        std::fs::write(&path, ply::encode(&mesh)).unwrap();
        assert!(read_skinned(&path).unwrap_err().to_string().contains("no skin weights"));
    }
}
