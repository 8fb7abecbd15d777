//! The rim of a cut garment, grown by what the sensor loses at a free edge.
//!
//! Where nothing lies close behind a hem, a depth camera's outermost pixels are mixed and the depth filter takes them
//! off: the scan ends short of the cloth. The rim is carried on along the surface by that much and marked as filled.

use nalgebra::Vector3;
use toile_geometry::topology::{VertexNeighbors, boundary_loops};

use super::{
    draft::Draft,
    rim::{outward, smoothed},
};

/// Directions and widths are smoothed along the rim by this many steps of two neighbours.
const RIM_STEPS: usize = 12;
/// Rings of triangles behind the rim between which the cloth's direction is read.
const CLOTH_RINGS: [usize; 2] = [2, 5];
/// Narrower strips are not added, metres.
const MIN_WIDTH: f32 = 0.001;
/// Rims with fewer vertices are left as they are.
const FEWEST_VERTICES: usize = 8;

/// Grows a strip on the rims, of the width that `widths` has for each vertex (metres), smoothed along the rim. New
/// vertices are marked as filled.
pub(super) fn extend(draft: &mut Draft, widths: &[f32]) {
    let mesh = &draft.surface;
    let normals = mesh.vertex_normals();
    let neighbors = VertexNeighbors::new(mesh.positions.len(), &mesh.triangles);
    for rim in boundary_loops(&mesh.triangles).into_iter().filter(|l| l.len() >= FEWEST_VERTICES) {
        let widths = smoothed(rim.iter().map(|&v| widths[v as usize]).collect(), RIM_STEPS);
        let cloth: Vec<Vector3<f32>> = rim.iter().map(|&v| cloth_normal(&normals, &neighbors, v)).collect();
        let outward = smoothed(outward(&draft.surface, &cloth, &rim), RIM_STEPS);
        add_strip(draft, &rim, &widths, &outward);
    }
    draft.surface.recompute_normals();
}

/// Normal of the cloth some rings behind a rim vertex: at the rim itself a scan bends towards what lies behind.
fn cloth_normal(normals: &[Vector3<f32>], neighbors: &VertexNeighbors, rim: u32) -> Vector3<f32> {
    let mut found = vec![rim];
    let (mut start, mut behind) = (0, 0);
    for ring in 1..=CLOTH_RINGS[1] {
        let end = found.len();
        for k in start..end {
            for &n in neighbors.of(found[k] as usize) {
                if !found.contains(&n) {
                    found.push(n);
                }
            }
        }
        start = end;
        if ring == CLOTH_RINGS[0] {
            behind = found.len();
        }
    }
    let cloth = if behind < found.len() { &found[behind..] } else { &found[..] };
    let sum: Vector3<f32> = cloth.iter().map(|&v| normals[v as usize]).sum();
    sum.try_normalize(1e-6).unwrap_or(normals[rim as usize])
}

fn add_strip(draft: &mut Draft, rim: &[u32], widths: &[f32], outward: &[Vector3<f32>]) {
    let mut grown = Vec::with_capacity(rim.len());
    for ((&v, &width), out) in rim.iter().zip(widths).zip(outward) {
        let out = out.try_normalize(0.3).filter(|_| width >= MIN_WIDTH);
        grown.push(out.map_or(v, |out| draft.push_moved(v, out * width)));
    }
    for i in 0..rim.len() {
        let j = (i + 1) % rim.len();
        let (a, b, c, d) = (rim[i], rim[j], grown[j], grown[i]);
        // The loop runs along the triangles inside; the strip's run against it.
        if d != a {
            draft.surface.triangles.push([a, d, b]);
        }
        if c != b {
            draft.surface.triangles.push([b, d, c]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{draft::Channel, rim::tests::tube};

    #[test]
    fn a_free_rim_grows_along_the_surface_and_a_seen_one_stays() {
        let mut draft = Draft::of(&tube(0.0));
        let mesh = &draft.surface;
        let widths: Vec<f32> = mesh.positions.iter().map(|p| if p.y > 0.09 { 0.008 } else { 0.0 }).collect();
        let area = mesh.area();
        extend(&mut draft, &widths);
        let mesh = &draft.surface;
        let (lo, hi) = mesh.bounds().unwrap();
        assert!((hi[1] - 0.108).abs() < 1e-4 && lo[1].abs() < 1e-6, "{lo} {hi}");
        assert!((mesh.area() / area - 1.08).abs() < 0.01);
        assert_eq!(boundary_loops(&mesh.triangles).len(), 2);
        assert!(mesh.positions.iter().zip(&draft.channels[Channel::Filled]).all(|(p, &f)| (f > 0.5) == (p.y > 0.101)));
        mesh.validate().unwrap();
    }
}
