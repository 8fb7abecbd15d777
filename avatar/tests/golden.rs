//! A GLB file that another program wrote, and ours of the same mesh, read by the same reader (see `data/README.md`).
#![allow(clippy::unwrap_used)] // helpers of tests are not seen as tests

use std::path::Path;

use nalgebra::Point3;
use toile_avatar::{Avatar, AvatarLayer, write_glb};
use toile_character::{JOINT_COUNT, JointNaming, Pose, Skeleton, SkinWeights};
use toile_geometry::Mesh;

const CORNERS: [[f32; 3]; 5] =
    [[-1.0, 0.0, -1.0], [1.0, 0.0, -1.0], [1.0, 0.0, 1.0], [-1.0, 0.0, 1.0], [0.0, 3.0, 0.0]];
const TRIANGLES: [[u32; 3]; 6] = [[1, 0, 4], [2, 1, 4], [3, 2, 4], [0, 3, 4], [0, 1, 2], [0, 2, 3]];

/// Positions and indices of the first primitive of the first mesh.
fn surface(glb: &[u8]) -> (Vec<[f32; 3]>, Vec<u32>) {
    let (document, buffers, _) = gltf::import_slice(glb).unwrap();
    let mesh = document.meshes().next().unwrap();
    let primitive = mesh.primitives().next().unwrap();
    assert_eq!(primitive.mode(), gltf::mesh::Mode::Triangles);
    let reader = primitive.reader(|b| Some(&buffers[b.index()]));
    (reader.read_positions().unwrap().collect(), reader.read_indices().unwrap().into_u32().collect())
}

fn pyramid() -> Avatar {
    let mut weights = SkinWeights::default();
    CORNERS.iter().for_each(|_| weights.push(&[(0, 1.0)]));
    Avatar {
        name: "pyramid".into(),
        skeleton: Skeleton { rest: [Point3::new(0.0, 1.0, 0.0); JOINT_COUNT] },
        joint_names: JointNaming::Vrm,
        pose0: Pose::identity(),
        layers: vec![AvatarLayer {
            name: "body".into(),
            mesh: Mesh::new(CORNERS.map(Point3::from).to_vec(), TRIANGLES.to_vec()),
            weights,
            order: 0,
            garment: None,
            thickness: None,
            texture: None,
        }],
        motions: Vec::new(),
    }
}

#[test]
fn our_file_and_that_of_another_program_hold_the_same_mesh() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/trimesh.glb");
    let theirs = surface(&std::fs::read(path).unwrap());
    assert_eq!(theirs, (CORNERS.to_vec(), TRIANGLES.as_flattened().to_vec()));
    assert_eq!(surface(&write_glb(&pyramid()).unwrap()), theirs);
}
