//! Two closed rims joined by triangles (paper 002 §3.2: meshes are stitched together).

use std::collections::BTreeSet;

use nalgebra::Point3;

use crate::boundary::matched;

/// Triangles between two closed rims of the mesh `triangles` with `positions`, which close the gap between them and face as their
/// neighbours do. Corners are joined in the order of their shares of the perimeter, counted from the first point of the first rim
/// and the point of the second that is nearest to it.
pub fn stitch(positions: &[Point3<f32>], triangles: &[[u32; 3]], first: &[u32], second: &[u32]) -> Vec<[u32; 3]> {
    let at = |v: u32| positions[v as usize].cast::<f64>();
    let points = |rim: &[u32]| rim.iter().map(|&v| at(v)).collect::<Vec<Point3<f64>>>();
    let order = matched(&points(first), &points(second));
    let second: Vec<u32> = order.iter().map(|&k| second[k as usize]).collect();
    let directed: BTreeSet<[u32; 2]> =
        triangles.iter().flat_map(|t| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]).collect();
    let runs_along = first.len() > 1 && directed.contains(&[first[0], first[1]]);
    let mut out = Vec::with_capacity(first.len() + second.len());
    let (along_first, along_second) = (along(&points(first)), along(&points(&second)));
    let (mut i, mut j) = (0, 0);
    while i < first.len() || j < second.len() {
        let [a, b] = [first[i % first.len()], second[j % second.len()]];
        let [next_a, next_b] = [first[(i + 1) % first.len()], second[(j + 1) % second.len()]];
        let triangle = if j == second.len() || (i < first.len() && along_first[i] <= along_second[j]) {
            i += 1;
            [a, next_a, b]
        } else {
            j += 1;
            [a, next_b, b]
        };
        // the neighbour runs from a to the next along its own edge; the new triangle must run against it
        out.push(if runs_along { [triangle[1], triangle[0], triangle[2]] } else { triangle });
    }
    out
}

/// For each corner of a closed contour, the share of the perimeter at which the next one lies.
fn along(contour: &[Point3<f64>]) -> Vec<f64> {
    let pairs = contour.iter().zip(contour.iter().cycle().skip(1));
    let lengths: Vec<f64> = pairs.map(|(a, b)| (b - a).norm()).collect();
    let total = lengths.iter().sum::<f64>().max(f64::MIN_POSITIVE);
    let sum = |so_far: &mut f64, length: &f64| {
        *so_far += length / total;
        Some(*so_far)
    };
    lengths.iter().scan(0.0, sum).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tube_between_rims_of_different_counts_is_closed_by_caps() {
        let circle = |count: usize, height: f32, offset: f32| {
            (0..count).map(move |k| {
                let angle = offset + std::f32::consts::TAU * k as f32 / count as f32;
                Point3::new(angle.cos(), height, angle.sin())
            })
        };
        let (low, high) = (7u32, 12u32);
        let mut positions: Vec<Point3<f32>> = circle(7, 0.0, 0.0).collect();
        positions.extend(circle(12, 1.0, 2.0));
        positions.extend([Point3::new(0.0, -0.2, 0.0), Point3::new(0.0, 1.2, 0.0)]);
        let mut triangles: Vec<[u32; 3]> = (0..low).map(|k| [k, (k + 1) % low, low + high]).collect();
        triangles.extend((0..high).map(|k| [low + (k + 1) % high, low + k, low + high + 1]));
        let backward: Vec<u32> = (0..high).map(|k| low + (high - k) % high).collect();
        let first: Vec<u32> = (0..low).collect();
        let gap = stitch(&positions, &triangles, &first, &backward);
        assert_eq!(gap.len() as u32, low + high);
        triangles.extend(gap);
        let mesh = toile_geometry::Mesh::new(positions, triangles);
        assert!(toile_geometry::topology::Edges::new(&mesh.triangles).is_closed());
        let mut directed = BTreeSet::new();
        assert!(
            mesh.triangles.iter().all(|t| (0..3).all(|k| directed.insert([t[k], t[(k + 1) % 3]]))),
            "one way round"
        );
        assert!(mesh.signed_volume() > 2.0);
    }
}
