//! Meshes that other people's programs wrote (see `data/README.md`).
#![allow(clippy::unwrap_used)] // helpers of tests are not seen as tests

use std::path::{Path, PathBuf};

use toile_geometry::{Mesh, obj, ply, topology::Edges};

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

/// The square pyramid that all files hold: corner positions, outward triangles, volume.
fn assert_pyramid(mesh: &Mesh, name: &str) {
    let positions: Vec<[f32; 3]> = mesh.positions.iter().map(|p| [p.x, p.y, p.z]).collect();
    let corners = [[-1.0, 0.0, -1.0], [1.0, 0.0, -1.0], [1.0, 0.0, 1.0], [-1.0, 0.0, 1.0], [0.0, 3.0, 0.0]];
    assert_eq!(positions, corners, "{name}");
    assert_eq!(mesh.triangles.len(), 6, "{name}");
    assert_eq!(mesh.triangles[..4], [[1, 0, 4], [2, 1, 4], [3, 2, 4], [0, 3, 4]], "{name}");
    assert!(Edges::new(&mesh.triangles).is_closed(), "{name}");
    assert!((mesh.signed_volume() - 4.0).abs() < 1e-12, "{name}: {}", mesh.signed_volume());
}

const COLORS: [[u8; 3]; 5] = [[255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 0], [12, 34, 56]];

#[test]
fn ply_files_of_five_programs_are_read() {
    for name in ["trimesh_binary.ply", "trimesh_ascii.ply", "plyfile_big_endian.ply", "meshlab.ply"] {
        let mesh = ply::read(&data(name)).unwrap();
        assert_pyramid(&mesh, name);
        assert_eq!(mesh.colors, COLORS, "{name}");
    }
    for name in ["meshio_ascii.ply", "meshio_binary.ply"] {
        let mesh = ply::read(&data(name)).unwrap();
        assert_pyramid(&mesh, name);
        assert_eq!(mesh.attributes["quality"], [0.0, 1.0, 2.0, 3.0, 4.0], "{name}");
    }
    for name in ["blender_ascii.ply", "blender_binary.ply"] {
        assert_pyramid(&ply::read(&data(name)).unwrap(), name);
    }
    let normals = ply::read(&data("blender_ascii.ply")).unwrap().normals;
    assert!(normals.len() == 5 && normals.iter().all(|n| (n.norm() - 1.0).abs() < 1e-5), "{normals:?}");
}

#[test]
fn obj_files_of_four_programs_are_read() {
    for (name, colored) in [("trimesh.obj", true), ("meshlab.obj", true), ("meshio.obj", false), ("blender.obj", false)]
    {
        let mesh = obj::read(&data(name)).unwrap();
        assert_pyramid(&mesh, name);
        assert_eq!(mesh.colors, if colored { COLORS.to_vec() } else { Vec::new() }, "{name}");
    }
}
