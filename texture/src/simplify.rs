//! Levels of detail that keep their places in the texture.
//!
//! Edges are collapsed onto one of their ends, cheapest first under quadric error (Garland and Heckbert 1997), so that every vertex that is left is one of
//! the mesh's, with its place in the texture and everything else that is known of it. A vertex on a border of charts goes along that border only, on both
//! sides at once, as in Hoppe 1999 ("New quadric metric for simplifying meshes with appearance attributes"); one where three charts meet stays.

mod cost;
mod state;

use nalgebra::Point3;

use cost::Quadric;
use state::State;

/// A surface to simplify.
#[derive(Debug, Clone, Copy)]
pub struct Seamed<'a> {
    /// Positions of its vertices, metres.
    pub positions: &'a [Point3<f32>],
    /// The vertex behind each of the texture's.
    pub source: &'a [u32],
    /// Place of each of the texture's vertices, 0 to 1; empty where there is no texture.
    pub uv: &'a [[f32; 2]],
    /// Triangles, in vertices of the texture.
    pub triangles: &'a [[u32; 3]],
    /// How far the outline of a chart may move, as a share of the picture's edge: what lies between charts.
    pub room: f32,
}

/// Simplifies a surface to each of `targets` triangles, which fall; returns the triangles of each level, in vertices of the texture.
///
/// A level has more triangles than asked for where no edge can be collapsed without folding the surface or a chart, changing its topology, or moving a
/// chart's outline by more than `room`. O(n log n); the same for any number of threads.
pub fn simplify(surface: &Seamed, targets: &[usize]) -> Vec<Vec<[u32; 3]>> {
    let mut state = State::new(surface);
    let level = |&target: &usize| {
        while state.alive > target && state.round(target) > 0 {}
        state.triangles()
    };
    targets.iter().map(level).collect()
}
