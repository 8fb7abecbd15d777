//! The hierarchy of a mesh: the tree, the triangles' corners and the far fields of its boxes.

use nalgebra::Point3;

use super::{
    build,
    far_field::{FarField, summarise},
    tree::Tree,
};

/// Maximum number of triangles in a leaf.
const LEAF: usize = 4;

/// A bounding-volume hierarchy that owns copies of its triangles' corners.
#[derive(Debug, Clone)]
pub struct Bvh {
    pub(super) tree: Tree,
    /// Corners of the triangles, in the tree's order.
    pub(super) corners: Vec<[Point3<f32>; 3]>,
    /// One for each node of the tree.
    pub(super) far_fields: Vec<FarField>,
}

impl Bvh {
    /// Builds the hierarchy. Triangle indices must be in range. O(n log n).
    pub fn new(positions: &[Point3<f32>], triangles: &[[u32; 3]]) -> Self {
        let all: Vec<[Point3<f32>; 3]> = triangles.iter().map(|t| t.map(|v| positions[v as usize])).collect();
        let centroids: Vec<Point3<f32>> =
            all.iter().map(|[a, b, c]| Point3::from((a.coords + b.coords + c.coords) / 3.0)).collect();
        let tree = build::divide(&centroids, LEAF);
        let corners = tree.order.iter().map(|&t| all[t as usize]).collect();
        let mut bvh = Self { tree, corners, far_fields: Vec::new() };
        bvh.summarise();
        bvh
    }

    /// Takes over moved `positions` of the mesh it was built from, with the same `triangles`. It keeps the division, which
    /// costs a fraction of building anew. Queries stay exact; they get slower where neighbours in space change. O(n).
    pub fn refit(&mut self, positions: &[Point3<f32>], triangles: &[[u32; 3]]) {
        self.refit_boxes(positions, triangles);
        summarise(&self.tree.nodes, &self.corners, &mut self.far_fields);
    }

    /// As [`Bvh::refit`], for all queries but winding numbers, which stay those of before; it takes no memory.
    pub fn refit_boxes(&mut self, positions: &[Point3<f32>], triangles: &[[u32; 3]]) {
        for (corners, &t) in self.corners.iter_mut().zip(&self.tree.order) {
            *corners = triangles[t as usize].map(|v| positions[v as usize]);
        }
        self.boxes();
    }

    fn boxes(&mut self) {
        self.tree.refit(|i| {
            let [a, b, c] = &self.corners[i];
            (a.inf(b).inf(c), a.sup(b).sup(c))
        });
    }

    fn summarise(&mut self) {
        self.boxes();
        summarise(&self.tree.nodes, &self.corners, &mut self.far_fields);
    }
}
