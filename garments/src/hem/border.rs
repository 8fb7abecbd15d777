//! The garment's border and the cloth behind it.

use std::collections::BTreeSet;

use toile_geometry::edge_distance::distances_along_edges;

use crate::measure::Measured;

/// The neighbourhood of a garment's border.
pub(super) struct Border<'a> {
    pub on: &'a Measured<'a>,
    pub garment: &'a [bool],
    /// Distance over the garment from its border along edges, metres; infinite beyond `depth` and outside the garment.
    pub distance: Vec<f32>,
    /// How far from the border is looked, metres.
    pub depth: f32,
}

impl<'a> Border<'a> {
    pub fn new(on: &'a Measured, garment: &'a [bool], depth: f32) -> Self {
        let graph = &on.graph;
        let beside_old = |v: usize| graph.neighbors.of(v).iter().any(|&n| !garment[n as usize]);
        let at_border = |v: &u32| garment[*v as usize] && (graph.open[*v as usize] || beside_old(*v as usize));
        let starts = (0..graph.len() as u32).filter(at_border);
        let may_pass = |v: u32| garment[v as usize];
        let distance = distances_along_edges(&graph.positions, &graph.neighbors, starts, depth, may_pass);
        Self { on, garment, distance, depth }
    }

    /// The garment's vertices within `depth` of `center` that are connected to it there.
    pub fn around(&self, center: u32) -> Vec<u32> {
        let graph = &self.on.graph;
        let origin = graph.positions[center as usize];
        let mut visited = BTreeSet::from([center]);
        let mut found = vec![center];
        let mut next = 0;
        while next < found.len() {
            for &n in graph.neighbors.of(found[next] as usize) {
                let near = (graph.positions[n as usize] - origin).norm() < self.depth;
                if near && self.garment[n as usize] && visited.insert(n) {
                    found.push(n);
                }
            }
            next += 1;
        }
        found
    }
}
