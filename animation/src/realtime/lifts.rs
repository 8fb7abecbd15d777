//! How vertices are lifted by what was found at the edges and triangles that they belong to.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

/// Edges or triangles in a parallel chunk.
const CHUNK: usize = 512;

/// Lifts of one layer, used again for each layer below it.
pub(super) struct Lifts {
    /// Lift of each edge or triangle, metres; only those of chunks where some are needed are of this frame.
    found: Vec<Vector3<f32>>,
    /// True for the chunks in which some need a lift.
    needed: Vec<bool>,
    of_vertex: Vec<Vector3<f32>>,
    /// The vertices that are lifted.
    lifted: Vec<u32>,
}

impl Lifts {
    /// For a layer of so many vertices, of which so many edges or triangles are looked at at once.
    pub fn new(vertices: usize, looked_at: usize) -> Self {
        Self {
            found: vec![Vector3::zeros(); looked_at],
            needed: vec![false; looked_at.div_ceil(CHUNK)],
            of_vertex: vec![Vector3::zeros(); vertices],
            lifted: Vec::with_capacity(vertices),
        }
    }

    /// Looks how far each of `groups` of vertices has to be lifted, metres; zero where it needs no lift.
    pub fn find<T: Send>(&mut self, groups: &mut [T], lift: impl Fn(&mut T) -> Vector3<f32> + Sync) {
        let chunks = groups.par_chunks_mut(CHUNK).zip(self.found.par_chunks_mut(CHUNK)).zip(&mut self.needed);
        chunks.for_each(|((groups, found), needed)| {
            *needed = false;
            for (by, group) in found.iter_mut().zip(groups) {
                *by = lift(group);
                *needed |= *by != Vector3::zeros();
            }
        });
    }

    /// Moves each of `points` by the longest lift of the groups it is in, whose vertices `of` tells.
    pub fn apply<T, const N: usize>(&mut self, groups: &[T], of: impl Fn(&T) -> [u32; N], points: &mut [Point3<f32>]) {
        let Self { found, needed, of_vertex, lifted } = self;
        let chunks = groups.chunks(CHUNK).zip(found.chunks(CHUNK)).zip(&*needed);
        for ((groups, found), _) in chunks.filter(|(_, needed)| **needed) {
            for (group, by) in groups.iter().zip(found).filter(|(_, by)| **by != Vector3::zeros()) {
                for v in of(group) {
                    let lift = &mut of_vertex[v as usize];
                    if *lift == Vector3::zeros() {
                        lifted.push(v);
                    }
                    if by.norm_squared() > lift.norm_squared() {
                        *lift = *by;
                    }
                }
            }
        }
        for v in lifted.drain(..) {
            points[v as usize] += std::mem::take(&mut of_vertex[v as usize]);
        }
    }
}
