//! Point clouds in which closest points are looked up: oriented samples of a surface, and plain points.

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use toile_geometry::{Mesh, areas::vertex_areas, point_tree::PointTree};

/// Oriented samples of a surface.
#[derive(Debug, Clone, Default)]
pub(crate) struct Samples {
    pub points: Vec<Point3<f32>>,
    /// Unit normals.
    pub normals: Vec<Vector3<f32>>,
    /// Area that each sample stands for, square metres.
    pub areas: Vec<f32>,
    /// The same times the sample's trust.
    pub weights: Vec<f32>,
    /// sRGB colours 0–255, or empty.
    pub colors: Vec<[f32; 3]>,
}

/// Samples with a k-d tree over them.
pub(crate) struct Cloud {
    pub samples: Samples,
    tree: PointTree,
}

impl Samples {
    /// Thins a mesh to about one sample per grid cell of `cell` metres and main direction of the normal, so that the
    /// two sides of a thin part stay apart. `trust` (0 to 1, one a vertex) scales the weights.
    pub fn of_mesh(mesh: &Mesh, normals: &[Vector3<f32>], trust: &[f32], cell: f32) -> Self {
        let areas = vertex_areas(mesh);
        let mut keyed: Vec<([i32; 4], u32)> = (0..mesh.positions.len())
            .filter(|&v| areas[v] > 0.0 && normals[v] != Vector3::zeros())
            .map(|v| (key(&mesh.positions[v], &normals[v], cell), v as u32))
            .collect();
        keyed.par_sort_unstable();
        let mut out = Self::default();
        for group in keyed.chunk_by(|a, b| a.0 == b.0) {
            out.push_mean(mesh, normals, &areas, trust, group);
        }
        out
    }

    fn push_mean(
        &mut self,
        mesh: &Mesh,
        normals: &[Vector3<f32>],
        areas: &[f32],
        trust: &[f32],
        g: &[([i32; 4], u32)],
    ) {
        let (mut point, mut normal, mut color) = (Vector3::zeros(), Vector3::zeros(), Vector3::zeros());
        let (mut area, mut weight) = (0.0, 0.0);
        for v in g.iter().map(|k| k.1 as usize) {
            let a = areas[v];
            point += mesh.positions[v].coords * a;
            normal += normals[v] * a;
            if let Some(c) = mesh.colors.get(v) {
                color += Vector3::from(c.map(f32::from)) * a;
            }
            area += a;
            weight += a * trust[v];
        }
        let Some(normal) = normal.try_normalize(1e-12) else { return };
        self.points.push(Point3::from(point / area));
        self.normals.push(normal);
        self.areas.push(area);
        self.weights.push(weight);
        if !mesh.colors.is_empty() {
            self.colors.push((color / area).into());
        }
    }
}

impl Cloud {
    /// Builds the tree; `None` without samples.
    pub fn new(samples: Samples) -> Option<Self> {
        if samples.points.is_empty() {
            return None;
        }
        let tree = PointTree::new(&samples.points);
        Some(Self { samples, tree })
    }

    /// The nearest sample within `max_distance` whose normal makes a cosine of at least `min_cos` with `normal`.
    pub fn nearest(&self, p: &Point3<f32>, normal: &Vector3<f32>, max_distance: f32, min_cos: f32) -> Option<u32> {
        let fits = |item: u32| self.samples.normals[item as usize].dot(normal) >= min_cos;
        self.tree.nearest(p, max_distance, fits).map(|n| n.0)
    }
}

/// Points of which only the distance is needed.
pub(crate) struct Nearby(ImmutableKdTree<f32, 3>);

impl Nearby {
    /// Builds the tree; `None` without points.
    pub fn new(points: impl Iterator<Item = Point3<f32>>) -> Option<Self> {
        let entries: Vec<[f32; 3]> = points.map(|p| [p.x, p.y, p.z]).collect();
        if entries.is_empty() { None } else { ImmutableKdTree::new_from_slice(&entries).ok().map(Self) }
    }

    /// Distance to the nearest point, metres.
    pub fn distance(&self, p: &Point3<f32>) -> f32 {
        self.0.query(&[p.x, p.y, p.z]).nearest_one::<SquaredEuclidean<f32>>().execute().distance.sqrt()
    }
}

/// Grid cell of a point and main direction of its normal.
pub(crate) fn key(p: &Point3<f32>, n: &Vector3<f32>, cell: f32) -> [i32; 4] {
    let axis = n.iamax();
    let direction = 2 * axis as i32 + i32::from(n[axis] < 0.0);
    [(p.x / cell).floor() as i32, (p.y / cell).floor() as i32, (p.z / cell).floor() as i32, direction]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_two_sides_of_a_thin_plate_stay_apart() {
        let corner = |x: f32, z: f32, y: f32| Point3::new(x * 0.004, y, z * 0.004);
        let mesh = Mesh::new(
            vec![
                corner(0.0, 0.0, 0.001),
                corner(0.0, 1.0, 0.001),
                corner(1.0, 0.0, 0.001),
                corner(0.0, 0.0, 0.0),
                corner(1.0, 0.0, 0.0),
                corner(0.0, 1.0, 0.0),
            ],
            vec![[0, 1, 2], [3, 4, 5]],
        );
        let cloud = Cloud::new(Samples::of_mesh(&mesh, &mesh.vertex_normals(), &[1.0; 6], 0.01)).unwrap();
        assert_eq!(cloud.samples.points.len(), 2);
        let up = cloud.nearest(&Point3::new(0.001, -0.01, 0.001), &Vector3::y(), 1.0, 0.5).unwrap();
        assert!(cloud.samples.points[up as usize].y > 0.0005);
        assert!(cloud.nearest(&Point3::origin(), &Vector3::x(), 1.0, 0.5).is_none());
    }
}
