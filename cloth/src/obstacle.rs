//! Surfaces that a sheet cannot pass.

use nalgebra::{Point3, Vector3};
use toile_geometry::{bvh::Bvh, mesh::vertex_normals};

/// The place of a surface that is nearest to a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Near {
    /// The place itself, metres.
    pub point: Vector3<f64>,
    /// Unit normal there, to the side where the sheet must stay.
    pub normal: Vector3<f64>,
    /// How the surface moved there during the step, metres.
    pub moved: Vector3<f64>,
}

/// A surface that a sheet cannot pass.
pub trait Obstacle: Sync {
    /// The nearest place within `reach` metres of `point`, at the end of the step.
    fn near(&self, point: &Vector3<f64>, reach: f64) -> Option<Near>;
}

/// A plane without end.
#[derive(Debug, Clone, Copy)]
pub struct Plane {
    /// A point of it.
    pub point: Vector3<f64>,
    /// Unit normal, to the side where sheets stay.
    pub normal: Vector3<f64>,
}

impl Obstacle for Plane {
    fn near(&self, point: &Vector3<f64>, reach: f64) -> Option<Near> {
        let height = (point - self.point).dot(&self.normal);
        let at = || Near { point: point - self.normal * height, normal: self.normal, moved: Vector3::zeros() };
        (height <= reach).then(at)
    }
}

/// A triangle mesh that moves, counter-clockwise seen from the side where sheets stay.
#[derive(Debug, Clone)]
pub struct MovingSurface {
    triangles: Vec<[u32; 3]>,
    before: Vec<Point3<f32>>,
    now: Vec<Point3<f32>>,
    normals: Vec<Vector3<f32>>,
    bvh: Bvh,
}

impl MovingSurface {
    /// A surface that rests at `positions`.
    pub fn new(positions: &[Point3<f32>], triangles: &[[u32; 3]]) -> Self {
        Self {
            triangles: triangles.to_vec(),
            before: positions.to_vec(),
            now: positions.to_vec(),
            normals: vertex_normals(positions, triangles),
            bvh: Bvh::new(positions, triangles),
        }
    }

    /// Where its vertices are, metres.
    pub fn positions(&self) -> &[Point3<f32>] {
        &self.now
    }

    /// Moves the surface to `positions`, within one step.
    pub fn move_to(&mut self, positions: &[Point3<f32>]) {
        std::mem::swap(&mut self.before, &mut self.now);
        self.now.clear();
        self.now.extend_from_slice(positions);
        self.normals = vertex_normals(positions, &self.triangles);
        self.bvh.refit(positions, &self.triangles);
    }
}

impl Obstacle for MovingSurface {
    fn near(&self, point: &Vector3<f64>, reach: f64) -> Option<Near> {
        let hit = self.bvh.closest(&Point3::from(point.cast::<f32>()), reach as f32)?;
        let corners = self.triangles[hit.triangle as usize].map(|v| v as usize);
        let mix = |of: &dyn Fn(usize) -> Vector3<f32>| -> Vector3<f32> {
            corners.iter().zip(hit.barycentric).map(|(&v, w)| of(v) * w).sum()
        };
        // Normals of vertices, mixed: they do not jump from triangle to triangle.
        let normal = mix(&|v| self.normals[v]).try_normalize(1e-6)?;
        let moved = mix(&|v| self.now[v] - self.before[v]);
        Some(Near { point: hit.point.coords.cast(), normal: normal.cast(), moved: moved.cast() })
    }
}
