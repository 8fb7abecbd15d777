//! Where each vertex of a scan lies on the body.

use rayon::prelude::*;
use toile_geometry::bvh::Bvh;

use super::body_parts::{PART_COUNT, part_shares};
use crate::{measure::scan_graph::ScanGraph, take::DressedTake};

/// The place of a scan vertex on the body.
pub(super) struct OnBody {
    /// Shares of the body parts at the closest point of the body.
    pub parts: [f32; PART_COUNT],
    /// Distance from the body, metres.
    pub distance: f32,
    /// Cosine between the scan's normal and the body's there.
    pub alignment: f32,
}

/// The place of every scan vertex on the body.
pub(super) fn on_body(take: &DressedTake, graph: &ScanGraph) -> Vec<OnBody> {
    let body = Bvh::new(&take.body.positions, &take.body.triangles);
    let shares = part_shares(take.weights);
    let normals = take.body.triangle_normals();
    let place = |(p, normal)| {
        let Some(hit) = body.closest(p, f32::INFINITY) else {
            return OnBody { parts: [0.0; PART_COUNT], distance: f32::INFINITY, alignment: 0.0 };
        };
        let corners = take.body.triangles[hit.triangle as usize];
        OnBody {
            parts: blend(&shares, corners, hit.barycentric),
            distance: hit.distance,
            alignment: normals[hit.triangle as usize].dot(normal),
        }
    };
    take.scan.positions.par_iter().zip(&graph.normals).map(place).collect()
}

fn blend(shares: &[[f32; PART_COUNT]], corners: [u32; 3], w: [f32; 3]) -> [f32; PART_COUNT] {
    std::array::from_fn(|k| (0..3).map(|c| shares[corners[c] as usize][k] * w[c]).sum())
}
