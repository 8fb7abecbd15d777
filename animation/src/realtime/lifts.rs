//! How vertices are lifted by what was found at the edges and triangles that they belong to.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

/// Vertices in a parallel chunk.
const CHUNK: usize = 4096;

/// Lifts of one layer, used again for each layer below it.
pub(super) struct Lifts {
    /// Lift of each edge or triangle, metres; zero where it needs none.
    pub found: Vec<Vector3<f32>>,
    of_vertex: Vec<Vector3<f32>>,
}

impl Lifts {
    /// For a layer of so many vertices, of which so many edges or triangles are looked at at once.
    pub fn new(vertices: usize, looked_at: usize) -> Self {
        Self { found: vec![Vector3::zeros(); looked_at], of_vertex: vec![Vector3::zeros(); vertices] }
    }

    /// Moves each of `points` by the longest lift of its `groups`, which are as many as there are lifts found, from the first on.
    pub fn apply<const N: usize>(&mut self, groups: &[[u32; N]], points: &mut [Point3<f32>]) {
        let Self { found, of_vertex } = self;
        for (by, vertices) in found.iter().zip(groups).filter(|(by, _)| **by != Vector3::zeros()) {
            for &v in vertices {
                let lift = &mut of_vertex[v as usize];
                if by.norm_squared() > lift.norm_squared() {
                    *lift = *by;
                }
            }
        }
        points.par_iter_mut().zip(of_vertex).with_min_len(CHUNK).for_each(|(p, lift)| {
            *p += *lift;
            *lift = Vector3::zeros();
        });
    }
}
