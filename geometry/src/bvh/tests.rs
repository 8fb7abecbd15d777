//! Every query against brute force.

use nalgebra::{Point3, Vector3};

use super::*;
use crate::triangle;

/// A unit octahedron cut finer, pushed onto the sphere.
fn sphere(levels: usize) -> (Vec<Point3<f32>>, Vec<[u32; 3]>) {
    let mut corners: Vec<[Point3<f32>; 3]> = Vec::new();
    for s in 0..8 {
        let sign = |bit: usize| if s >> bit & 1 == 0 { 1.0 } else { -1.0 };
        let (x, y, z) =
            (Point3::new(sign(0), 0.0, 0.0), Point3::new(0.0, sign(1), 0.0), Point3::new(0.0, 0.0, sign(2)));
        let outward = sign(0) * sign(1) * sign(2) > 0.0;
        corners.push(if outward { [x, y, z] } else { [x, z, y] });
    }
    for _ in 0..levels {
        let mid = |a: Point3<f32>, b: Point3<f32>| Point3::from((a.coords + b.coords).normalize());
        corners = corners
            .iter()
            .flat_map(|&[a, b, c]| {
                let (ab, bc, ca) = (mid(a, b), mid(b, c), mid(c, a));
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    let positions = corners.iter().flatten().copied().collect();
    let triangles = (0..corners.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    (positions, triangles)
}

fn probes() -> impl Iterator<Item = Point3<f32>> {
    (0..300).map(|i| {
        let t = i as f32;
        Point3::new((t * 0.7).sin() * 1.7, (t * 1.3).cos() * 1.6, (t * 0.37).sin() * 1.5)
    })
}

#[test]
fn closest_agrees_with_brute_force() {
    let (positions, triangles) = sphere(3);
    let bvh = Bvh::new(&positions, &triangles);
    for p in probes() {
        let brute = triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|v| positions[v as usize]);
                (triangle::at(triangle::closest_barycentric(&p, &a, &b, &c), &a, &b, &c) - p).norm()
            })
            .fold(f32::INFINITY, f32::min);
        let hit = bvh.closest(&p, f32::INFINITY).unwrap();
        assert!((hit.distance - brute).abs() < 1e-6, "{} against {brute}", hit.distance);
        assert!(bvh.closest(&p, brute * 0.99).is_none());
    }
}

#[test]
fn rays_agree_with_brute_force() {
    let (positions, triangles) = sphere(3);
    let bvh = Bvh::new(&positions, &triangles);
    for (i, p) in probes().enumerate() {
        let d = Vector3::new((i as f32).cos(), (i as f32 * 2.1).sin(), 0.3).normalize();
        let brute = triangles
            .iter()
            .filter_map(|t| triangle::ray_hit(&p, &d, &t.map(|v| positions[v as usize])))
            .map(|h| h.0)
            .fold(f32::INFINITY, f32::min);
        let found = bvh.ray(&p, &d, f32::INFINITY).map_or(f32::INFINITY, |h| h.t);
        assert!(found == brute || (found - brute).abs() < 1e-5, "{found} against {brute}");
    }
}

#[test]
fn refitted_answers_as_built_anew() {
    let (mut positions, triangles) = sphere(3);
    let mut refitted = Bvh::new(&positions, &triangles);
    positions.iter_mut().for_each(|p| *p = Point3::new(p.x * 1.3 + 0.2 * p.y, p.y, p.z * 0.8 - 0.1));
    refitted.refit(&positions, &triangles);
    let built = Bvh::new(&positions, &triangles);
    for p in probes() {
        let of = |tree: &Bvh| tree.closest(&p, f32::INFINITY).unwrap().distance;
        assert!((of(&refitted) - of(&built)).abs() < 1e-6);
        let of = |tree: &Bvh| tree.ray(&p, &-p.coords, f32::INFINITY).map(|h| h.t);
        assert_eq!(of(&refitted), of(&built));
        assert!((refitted.winding_number(&p) - built.winding_number(&p)).abs() < 0.02);
    }
}

#[test]
fn winding_number_distinguishes_inside_from_outside() {
    let (positions, triangles) = sphere(3);
    let bvh = Bvh::new(&positions, &triangles);
    for p in probes().filter(|p| (p.coords.norm() - 1.0).abs() > 0.03) {
        let inside = p.coords.norm() < 1.0;
        let w = bvh.winding_number(&p);
        assert!((w - f32::from(u8::from(inside))).abs() < 0.05, "{w} at {p}");
    }
}

#[test]
fn an_empty_mesh_answers_nothing() {
    let bvh = Bvh::new(&[], &[]);
    assert!(bvh.closest(&Point3::origin(), 1.0).is_none());
    assert!(bvh.ray(&Point3::origin(), &Vector3::x(), 1.0).is_none());
    assert_eq!(bvh.winding_number(&Point3::origin()), 0.0);
}

#[test]
fn overlaps_agree_with_brute_force() {
    let (positions, triangles) = sphere(3);
    let bvh = Bvh::new(&positions, &triangles);
    for p in probes() {
        let (lo, hi) = (p - Vector3::repeat(0.2), p + Vector3::new(0.1, 0.4, 0.3));
        let mut found = Vec::new();
        bvh.overlapping(&lo, &hi, |t| found.push(t));
        found.sort_unstable();
        let overlaps = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| positions[v as usize]);
            let (low, high) = (a.inf(&b).inf(&c), a.sup(&b).sup(&c));
            (0..3).all(|k| low[k] <= hi[k] && lo[k] <= high[k])
        };
        let brute: Vec<u32> = (0..triangles.len() as u32).filter(|&t| overlaps(&triangles[t as usize])).collect();
        assert_eq!(found, brute);
    }
}

#[test]
fn of_a_pierced_ball_only_accepted_triangles_answer() {
    let (positions, triangles) = sphere(3);
    let bvh = Bvh::new(&positions, &triangles);
    for (i, p) in probes().enumerate() {
        let accept = |t: u32| t as usize % 3 != i % 3;
        let all = triangles.iter().enumerate().filter(|(t, _)| accept(*t as u32));
        let brute = all
            .map(|(_, t)| {
                let [a, b, c] = t.map(|v| positions[v as usize]);
                (triangle::at(triangle::closest_barycentric(&p, &a, &b, &c), &a, &b, &c) - p).norm()
            })
            .fold(f32::INFINITY, f32::min);
        let hit = bvh.closest_where(&p, f32::INFINITY, accept).unwrap();
        assert!(accept(hit.triangle) && (hit.distance - brute).abs() < 1e-6, "{} against {brute}", hit.distance);
    }
}
