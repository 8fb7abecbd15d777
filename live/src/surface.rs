//! The surface that grows while a take runs, light enough to be sent several times a second.

use std::{
    collections::HashMap,
    sync::{Arc, Mutex, PoisonError},
    time::{Duration, Instant},
};

use nalgebra::{Point3, Vector3};
use toile_fusion::LiveFuser;
use toile_geometry::Mesh;

/// Triangles of a surface at most.
pub const MOST_TRIANGLES: usize = 20_000;
/// Between two surfaces. At least two a second are promised, and making one takes some tens of milliseconds.
const EVERY: Duration = Duration::from_millis(400);
/// Vertices within a cell of this size become one, metres; where too many triangles are left, the cells grow by a quarter.
const CELL: f32 = 0.014;
/// The longest time that making surfaces may take of the preview's: a fifth.
const SHARE: u32 = 5;

/// A surface: positions in the scan frame, metres; colours of a light from the camera's side; triangles.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Surface {
    /// Counts up with each surface of a take.
    pub number: u64,
    /// Vertices.
    pub positions: Vec<[f32; 3]>,
    /// A colour for each vertex.
    pub colors: Vec<[u8; 3]>,
    /// Corners, counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// Where the last surface is; cheap to clone.
#[derive(Debug, Clone, Default)]
pub struct Surfaces(Arc<Mutex<Option<Arc<Surface>>>>);

impl Surfaces {
    /// The last surface.
    pub fn last(&self) -> Option<Arc<Surface>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn put(&self, surface: Surface) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(Arc::new(surface));
    }
}

/// Makes surfaces at their pace, for whoever wants them.
pub struct Growing {
    surfaces: Option<Surfaces>,
    next: Instant,
    number: u64,
}

impl Growing {
    /// For `surfaces`, or for nobody.
    pub fn new(surfaces: Option<Surfaces>) -> Self {
        Self { surfaces, next: Instant::now(), number: 0 }
    }

    /// Shows the surface of `fuser` where it is time.
    pub fn show(&mut self, fuser: &LiveFuser) {
        let begun = Instant::now();
        let Some(surfaces) = self.surfaces.as_ref().filter(|_| begun >= self.next) else { return };
        self.number += 1;
        surfaces.put(Surface { number: self.number, ..light(&fuser.surface()) });
        self.next = begun + EVERY.max(begun.elapsed() * SHARE);
    }
}

/// A mesh with at most [`MOST_TRIANGLES`]: vertices of one cell become one, in their middle.
fn light(mesh: &Mesh) -> Surface {
    let mut cell = CELL;
    loop {
        let surface = clustered(mesh, cell);
        if surface.triangles.len() <= MOST_TRIANGLES {
            return surface;
        }
        cell *= 1.25;
    }
}

fn clustered(mesh: &Mesh, cell: f32) -> Surface {
    let mut numbers: HashMap<[i32; 3], u32> = HashMap::new();
    let mut sums: Vec<(Vector3<f32>, f32)> = Vec::new();
    let of_vertex: Vec<u32> = mesh
        .positions
        .iter()
        .map(|p| {
            let key = [p.x, p.y, p.z].map(|c| (c / cell).floor() as i32);
            let number = *numbers.entry(key).or_insert(sums.len() as u32);
            if number as usize == sums.len() {
                sums.push((Vector3::zeros(), 0.0));
            }
            let sum = &mut sums[number as usize];
            *sum = (sum.0 + p.coords, sum.1 + 1.0);
            number
        })
        .collect();
    let positions: Vec<Point3<f32>> = sums.iter().map(|(sum, count)| Point3::from(sum / *count)).collect();
    let corners = mesh.triangles.iter().map(|t| t.map(|k| of_vertex[k as usize]));
    let triangles: Vec<[u32; 3]> = corners.filter(|[a, b, c]| a != b && b != c && c != a).collect();
    let colors = shaded(&positions, &triangles);
    Surface { number: 0, positions: positions.iter().map(|p| [p.x, p.y, p.z]).collect(), colors, triangles }
}

/// Light from above the front, on grey.
fn shaded(positions: &[Point3<f32>], triangles: &[[u32; 3]]) -> Vec<[u8; 3]> {
    let mut normals = vec![Vector3::<f32>::zeros(); positions.len()];
    for corners in triangles {
        let [a, b, c] = corners.map(|k| positions[k as usize]);
        let normal = (b - a).cross(&(c - a));
        corners.iter().for_each(|k| normals[*k as usize] += normal);
    }
    let light = Vector3::new(0.3, 0.5, 0.8).normalize();
    let shade = |normal: &Vector3<f32>| {
        let facing = normal.try_normalize(1e-12).map_or(0.0, |n| 0.5 + 0.5 * n.dot(&light));
        [(70.0 + 150.0 * facing) as u8; 3]
    };
    normals.iter().map(shade).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sphere of 0.8 m with this many rings.
    fn sphere(rings: u32) -> Mesh {
        let at = |i: u32, k: u32| {
            let (a, b) =
                (std::f32::consts::PI * i as f32 / rings as f32, std::f32::consts::TAU * k as f32 / rings as f32);
            Point3::new(a.sin() * b.cos(), a.cos(), a.sin() * b.sin()) * 0.8
        };
        let positions = (0..=rings).flat_map(|i| (0..rings).map(move |k| at(i, k))).collect();
        let quad = |i: u32, k: u32| {
            let next = (k + 1) % rings;
            let [a, b, c, d] = [i * rings + k, i * rings + next, (i + 1) * rings + k, (i + 1) * rings + next];
            [[a, b, c], [b, d, c]]
        };
        let triangles = (0..rings).flat_map(|i| (0..rings).flat_map(move |k| quad(i, k))).collect();
        Mesh::new(positions, triangles)
    }

    #[test]
    fn a_fine_surface_becomes_a_light_one_of_the_same_shape() {
        let fine = sphere(400);
        let surface = light(&fine);
        assert!(fine.triangles.len() > 300_000 && surface.triangles.len() <= MOST_TRIANGLES);
        assert!(surface.triangles.len() > MOST_TRIANGLES / 4 && surface.colors.len() == surface.positions.len());
        let radius = |p: &[f32; 3]| p.iter().map(|c| c * c).sum::<f32>().sqrt();
        assert!(surface.positions.iter().all(|p| (radius(p) - 0.8).abs() < 0.01));
        let count = surface.positions.len() as u32;
        assert!(surface.triangles.iter().flatten().all(|k| *k < count));
    }
}
