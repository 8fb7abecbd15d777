//! Everything that labelling a take starts from: the scan as a graph, and the evidence at each of its vertices.

mod before;
pub mod body_parts;
pub(crate) mod bones;
pub mod color;
pub mod evidence;
mod noise;
mod on_body;
pub mod scan_graph;

use nalgebra::Point3;

use self::{evidence::Evidence, scan_graph::ScanGraph};
use crate::{settings::ExtractSettings, take::DressedTake};

/// A take with everything that was measured on it; nothing in here changes while the take is labelled.
pub struct Measured<'a> {
    /// The take itself.
    pub take: &'a DressedTake<'a>,
    /// The scan's surface as a graph.
    pub graph: ScanGraph,
    /// The evidence at each vertex of the scan.
    pub evidence: Evidence,
    /// Segments from each joint of the body to its parent, in the scan's frame.
    pub bones: Vec<[Point3<f32>; 2]>,
}

impl<'a> Measured<'a> {
    /// Measures a take.
    pub fn new(take: &'a DressedTake<'a>, settings: &ExtractSettings) -> Self {
        let graph = ScanGraph::new(take.scan);
        let evidence = evidence::measure(take, &graph, settings);
        Self { take, graph, evidence, bones: take.bones() }
    }
}
