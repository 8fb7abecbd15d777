//! An indexed triangle mesh.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};

use crate::{GeometryError, Rigid, triangle::double_area};

/// An indexed triangle mesh, counter-clockwise seen from outside.
///
/// `normals`, `colors` and every attribute are either empty or as long as `positions`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions, metres.
    pub positions: Vec<Point3<f32>>,
    /// Vertex indices of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Unit vertex normals, or empty.
    pub normals: Vec<Vector3<f32>>,
    /// sRGB vertex colours, or empty.
    pub colors: Vec<[u8; 3]>,
    /// Further scalar vertex attributes by name (written as float properties in PLY), such as `filled`
    /// (1 where a hole was closed and nothing was seen).
    pub attributes: BTreeMap<String, Vec<f32>>,
}

impl Mesh {
    /// A mesh of positions and triangles alone.
    pub fn new(positions: Vec<Point3<f32>>, triangles: Vec<[u32; 3]>) -> Self {
        Self { positions, triangles, ..Self::default() }
    }

    /// True when there is nothing to draw.
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// Checks indices, lengths of attributes and finite positions.
    ///
    /// # Errors
    /// [`GeometryError::Mesh`] names the first rule that is broken.
    pub fn validate(&self) -> Result<(), GeometryError> {
        let count = self.positions.len();
        if let Some(i) = self.triangles.iter().position(|t| t.iter().any(|&v| v as usize >= count)) {
            return Err(GeometryError::Mesh(format!("triangle {i} names a vertex beyond the last of {count}")));
        }
        if let Some(i) = self.positions.iter().position(|p| !p.coords.iter().all(|c| c.is_finite())) {
            return Err(GeometryError::Mesh(format!("vertex {i} is not finite")));
        }
        let fits = |n: usize| n == 0 || n == count;
        if !fits(self.normals.len()) || !fits(self.colors.len()) || self.attributes.values().any(|a| a.len() != count) {
            return Err(GeometryError::Mesh("normals, colours or an attribute do not match the vertex count".into()));
        }
        Ok(())
    }

    /// Corner positions of triangle `t`.
    #[inline]
    pub fn corners(&self, t: usize) -> [Point3<f32>; 3] {
        self.triangles[t].map(|v| self.positions[v as usize])
    }

    /// Unit normals of all triangles; zero for degenerate ones.
    pub fn triangle_normals(&self) -> Vec<Vector3<f32>> {
        triangle_normals(&self.positions, &self.triangles)
    }

    /// Area-weighted unit vertex normals; zero where no triangle gives one.
    pub fn vertex_normals(&self) -> Vec<Vector3<f32>> {
        vertex_normals(&self.positions, &self.triangles)
    }

    /// Replaces `normals` by the area-weighted vertex normals.
    pub fn recompute_normals(&mut self) {
        self.normals = self.vertex_normals();
    }

    /// Total area, square metres.
    pub fn area(&self) -> f64 {
        let corners = |t: &[u32; 3]| t.map(|v| self.positions[v as usize].coords.cast::<f64>());
        self.triangles.iter().map(|t| double_area(corners(t)) * 0.5).sum()
    }

    /// Signed volume, cubic metres; meaningful for a closed mesh, positive when normals point outward.
    pub fn signed_volume(&self) -> f64 {
        let p = |v: u32| self.positions[v as usize].coords.cast::<f64>();
        self.triangles.iter().map(|t| p(t[0]).dot(&p(t[1]).cross(&p(t[2]))) / 6.0).sum()
    }

    /// Lowest and highest coordinates, or `None` for an empty mesh.
    pub fn bounds(&self) -> Option<(Point3<f32>, Point3<f32>)> {
        let first = *self.positions.first()?;
        Some(self.positions.iter().fold((first, first), |(lo, hi), p| (lo.inf(p), hi.sup(p))))
    }

    /// The same mesh seen from another frame.
    pub fn transformed(&self, a_from_b: &Rigid) -> Self {
        let rotation = a_from_b.rotation.cast::<f32>();
        Self {
            positions: self.positions.iter().map(|p| crate::transform_point(a_from_b, p)).collect(),
            normals: self.normals.iter().map(|n| rotation * n).collect(),
            ..self.clone()
        }
    }

    /// Keeps the triangles for which `keep` holds and drops vertices that none of them uses.
    ///
    /// Returns the mesh and, for each of its vertices, the old index.
    pub fn filter_triangles(&self, keep: impl Fn(usize) -> bool) -> (Self, Vec<u32>) {
        let kept: Vec<[u32; 3]> = (0..self.triangles.len()).filter(|&t| keep(t)).map(|t| self.triangles[t]).collect();
        let mut new_of_old = vec![u32::MAX; self.positions.len()];
        for v in kept.iter().flatten() {
            new_of_old[*v as usize] = 0;
        }
        let mut old_of_new = Vec::new();
        for (old, new) in new_of_old.iter_mut().enumerate().filter(|(_, n)| **n == 0) {
            *new = old_of_new.len() as u32;
            old_of_new.push(old as u32);
        }
        let triangles = kept.iter().map(|t| t.map(|v| new_of_old[v as usize])).collect();
        (self.gather(&old_of_new, triangles), old_of_new)
    }

    /// A mesh whose vertex i is this mesh's vertex `old_of_new[i]`, with all attributes.
    pub fn gather(&self, old_of_new: &[u32], triangles: Vec<[u32; 3]>) -> Self {
        Self {
            positions: pick(&self.positions, old_of_new),
            normals: pick(&self.normals, old_of_new),
            colors: pick(&self.colors, old_of_new),
            attributes: self.attributes.iter().map(|(k, a)| (k.clone(), pick(a, old_of_new))).collect(),
            triangles,
        }
    }
}

fn pick<T: Copy>(values: &[T], indices: &[u32]) -> Vec<T> {
    if values.is_empty() { Vec::new() } else { indices.iter().map(|&i| values[i as usize]).collect() }
}

/// Unit normals of triangles over `positions`; zero for degenerate ones.
pub fn triangle_normals(positions: &[Point3<f32>], triangles: &[[u32; 3]]) -> Vec<Vector3<f32>> {
    triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|v| positions[v as usize]);
            (b - a).cross(&(c - a)).try_normalize(f32::MIN_POSITIVE).unwrap_or_default()
        })
        .collect()
}

/// Area-weighted unit vertex normals; zero where no triangle gives one.
pub fn vertex_normals(positions: &[Point3<f32>], triangles: &[[u32; 3]]) -> Vec<Vector3<f32>> {
    let mut sums = vec![Vector3::<f64>::zeros(); positions.len()];
    for t in triangles {
        let [a, b, c] = t.map(|v| positions[v as usize].cast::<f64>());
        let n = (b - a).cross(&(c - a));
        for &v in t {
            sums[v as usize] += n;
        }
    }
    sums.iter().map(|n| n.try_normalize(1e-30).unwrap_or_default().cast::<f32>()).collect()
}
