//! Decimation by edge collapse under quadric error (Garland and Heckbert 1997) that keeps the volume (Lindstrom and
//! Turk 1998, "Fast and memory efficient polygonal simplification"), attributes carried along.
//!
//! Edges are collapsed in rounds, not one by one from a heap: a round evaluates all edges in one pass, takes the
//! cheapest share in ascending order and leaves out those that an earlier collapse of the round has changed.

mod collapser;
mod corners;
mod quadric;
mod rings;

use collapser::Collapser;
use rings::Rings;

use crate::Mesh;

/// Share of the edges that a round looks at first.
const SHARE: f64 = 0.5;

/// Collapses edges until at most `target` triangles are left or no edge can be collapsed without folding the surface
/// or changing its topology. The volume inside stays as it is. Colours and attributes are interpolated along the
/// collapsed edge; normals are recomputed where the mesh had any. O(n log n); the result depends on the input alone.
pub fn decimate(mesh: &Mesh, target: usize) -> Mesh {
    let mut state = Collapser::new(mesh);
    let mut rings = Rings::default();
    let mut share = SHARE;
    while state.corners.triangles.len() > target {
        let removed = state.round(target, share, &mut rings);
        if removed == 0 {
            if share >= 1.0 {
                break;
            }
            share = (share * 2.0).min(1.0);
        }
    }
    state.into_mesh(mesh)
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;
    use crate::{bvh::Bvh, topology::Edges};

    /// A closed unit sphere from a subdivided octahedron.
    fn sphere(levels: usize) -> Mesh {
        let mut mesh = octahedron(levels);
        mesh.positions.iter_mut().for_each(|p| *p = Point3::from(p.coords.normalize()));
        mesh
    }

    fn octahedron(levels: usize) -> Mesh {
        let p = |x: f32, y: f32, z: f32| Point3::new(x, y, z);
        let mut mesh = Mesh::new(
            vec![p(1., 0., 0.), p(-1., 0., 0.), p(0., 1., 0.), p(0., -1., 0.), p(0., 0., 1.), p(0., 0., -1.)],
            vec![[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]],
        );
        for _ in 0..levels {
            let edges = Edges::new(&mesh.triangles);
            let base = mesh.positions.len() as u32;
            for [a, b] in &edges.vertices {
                let m = nalgebra::center(&mesh.positions[*a as usize], &mesh.positions[*b as usize]);
                mesh.positions.push(m);
            }
            let split = |(t, tri): (usize, &[u32; 3])| {
                let m = edges.of_triangle[t].map(|e| base + e);
                [[tri[0], m[0], m[2]], [tri[1], m[1], m[0]], [tri[2], m[2], m[1]], m]
            };
            mesh.triangles = mesh.triangles.iter().enumerate().flat_map(split).collect();
        }
        mesh
    }

    #[test]
    fn a_sphere_stays_closed_and_round_and_keeps_its_attributes() {
        let mut mesh = sphere(5);
        mesh.attributes.insert("height".into(), mesh.positions.iter().map(|p| p.y).collect());
        mesh.colors = mesh.positions.iter().map(|p| [((p.x + 1.0) * 127.0) as u8, 0, 9]).collect();
        let small = decimate(&mesh, 800);
        assert!(small.triangles.len() <= 800 && small.triangles.len() > 700, "{}", small.triangles.len());
        assert!(Edges::new(&small.triangles).is_closed());
        small.validate().unwrap();
        let bvh = Bvh::new(&mesh.positions, &mesh.triangles);
        for (p, h) in small.positions.iter().zip(&small.attributes["height"]) {
            assert!(bvh.closest(p, 1.0).unwrap().distance < 0.01, "{p}");
            assert!((p.y - h).abs() < 0.03, "{} {h}", p.y);
        }
        let lost = mesh.signed_volume() - small.signed_volume();
        assert!(lost.abs() < 0.002, "{lost}"); // inscribed it would lose 0.057, by quadrics alone 0.026
    }

    #[test]
    fn a_coarse_target_ends_and_a_tetrahedron_stays() {
        let small = decimate(&sphere(3), 0);
        assert!(small.triangles.len() >= 4 && small.triangles.len() < 24, "{}", small.triangles.len());
        assert!(Edges::new(&small.triangles).is_closed());
        assert_eq!(decimate(&Mesh::default(), 10), Mesh::default());
    }

    #[test]
    fn sharp_edges_and_corners_stay() {
        let small = decimate(&octahedron(5), 40);
        assert!(small.triangles.len() <= 40, "{}", small.triangles.len());
        let off = small.positions.iter().map(|p| (p.x.abs() + p.y.abs() + p.z.abs() - 1.0).abs()).fold(0.0, f32::max);
        assert!(off < 1e-3, "{off}");
        assert!((small.signed_volume() - 4.0 / 3.0).abs() < 1e-3, "{}", small.signed_volume());
    }

    #[test]
    fn an_open_border_stays_where_it_is() {
        let n = 20;
        let positions = (0..n * n).map(|i| Point3::new((i % n) as f32, (i / n) as f32, 0.0)).collect();
        let quad = |i: usize| {
            let v = (i / (n - 1) * n + i % (n - 1)) as u32;
            [[v, v + 1, v + n as u32], [v + 1, v + n as u32 + 1, v + n as u32]]
        };
        let mesh = Mesh::new(positions, (0..(n - 1) * (n - 1)).flat_map(quad).collect());
        let small = decimate(&mesh, 60);
        assert!(small.triangles.len() <= 60);
        assert!((small.area() - mesh.area()).abs() < 0.05 * mesh.area(), "{} {}", small.area(), mesh.area());
        assert_eq!(small.bounds().map(|b| (b.0.x.round(), b.1.y.round())), Some((0.0, 19.0)));
    }
}
