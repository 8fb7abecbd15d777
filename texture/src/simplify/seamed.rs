//! A surface with borders of charts on it.

use nalgebra::Point3;

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
    /// How far the outline of a chart may move, as a share of the picture's edge: half of what lies between charts.
    pub room: f32,
}
