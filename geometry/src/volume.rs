//! The volume of a mesh that need not be closed.

use nalgebra::Vector3;

use crate::{Mesh, topology::boundary_loops};

/// Signed volume, cubic metres, positive where normals point outward; every hole is closed by a fan around the middle of
/// its rim, which is exact for flat holes. Zero for an empty mesh.
pub fn closed_volume(mesh: &Mesh) -> f64 {
    let p = |v: u32| mesh.positions[v as usize].coords.cast::<f64>();
    let fan = |rim: &Vec<u32>| -> f64 {
        let middle = rim.iter().map(|&v| p(v)).sum::<Vector3<f64>>() / rim.len().max(1) as f64;
        let next = rim.iter().cycle().skip(1);
        // Along the rim of a hole the triangles of the mesh run one way, so those of the fan run the other.
        rim.iter().zip(next).map(|(&a, &b)| middle.dot(&p(b).cross(&p(a))) / 6.0).sum()
    };
    mesh.signed_volume() + boundary_loops(&mesh.triangles).iter().map(fan).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;

    #[test]
    fn a_box_without_a_side_has_its_volume_wherever_it_stands() {
        let corner = |i: u32| {
            Point3::new(3.0 + (i & 1) as f32, 5.0 + 2.0 * (i >> 1 & 1) as f32, -7.0 + 3.0 * (i >> 2 & 1) as f32)
        };
        let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let of = |sides: &[[u32; 4]]| {
            let triangles = sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
            closed_volume(&Mesh::new((0..8).map(corner).collect(), triangles))
        };
        for missing in 0..6 {
            let open: Vec<[u32; 4]> = (0..6).filter(|side| *side != missing).map(|side| sides[side]).collect();
            assert!((of(&open) - 6.0).abs() < 1e-9, "{missing}: {}", of(&open));
        }
        assert!((of(&sides) - 6.0).abs() < 1e-9 && of(&[]) == 0.0);
    }
}
