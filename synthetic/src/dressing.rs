//! A person posed with the garments on, no layer inside another.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use toile_character::Pose;
use toile_geometry::{Mesh, bvh::Bvh, mesh::triangle_normals, topology::VertexNeighbors};

use crate::{garment::Garment, person::Person};

/// Smallest distance of cloth from the layers below in any pose, metres.
const CLEARANCE: f32 = 0.003;
/// Cloth deeper than this belongs to another part of the body, metres.
const DEEPEST: f32 = 0.03;
/// Rounds of pushing out.
const ROUNDS: usize = 6;

/// Vertex positions of every layer in one pose.
#[derive(Debug, Clone)]
pub struct Dressed {
    /// The body on the template's topology.
    pub body: Vec<Point3<f32>>,
    /// The fine skin.
    pub skin: Vec<Point3<f32>>,
    /// Each garment.
    pub garments: Vec<Vec<Point3<f32>>>,
}

/// Poses the person with the first `count` garments and pushes each garment out of the layers below it.
pub fn dress(person: &Person, garments: &[Garment], count: usize, pose: &Pose) -> Dressed {
    let skin = person.skin.posed(pose);
    let mut below = vec![Collider::new(&skin, &person.skin.mesh.triangles)];
    let mut posed = Vec::new();
    for garment in garments.iter().take(count) {
        let mesh = &garment.worn.mesh;
        let mut positions = garment.worn.posed(pose);
        let neighbours = VertexNeighbors::new(positions.len(), &mesh.triangles);
        for _ in 0..ROUNDS {
            if !push_out(&mut positions, &neighbours, &below) {
                break;
            }
        }
        below.push(Collider::new(&positions, &mesh.triangles));
        posed.push(positions);
    }
    Dressed { body: person.body.posed(pose), skin, garments: posed }
}

/// A layer that cloth must stay outside of.
pub struct Collider {
    bvh: Bvh,
    normals: Vec<Vector3<f32>>,
}

impl Collider {
    /// A layer in one pose.
    pub fn new(positions: &[Point3<f32>], triangles: &[[u32; 3]]) -> Self {
        Self { bvh: Bvh::new(positions, triangles), normals: triangle_normals(positions, triangles) }
    }

    /// A layer in one pose.
    pub fn of(mesh: &Mesh) -> Self {
        Self::new(&mesh.positions, &mesh.triangles)
    }

    /// Signed distance to the layer and its outward normal there, where the layer is near and not merely its rim.
    pub fn distance(&self, p: &Point3<f32>) -> Option<(f32, Vector3<f32>)> {
        let hit = self.bvh.closest(p, DEEPEST)?;
        let normal = self.normals[hit.triangle as usize];
        let height = (p - hit.point).dot(&normal);
        (height.abs() > 0.5 * hit.distance).then_some((hit.distance.copysign(height), normal))
    }
}

/// One round; false when nothing had to move.
fn push_out(positions: &mut [Point3<f32>], neighbours: &VertexNeighbors, below: &[Collider]) -> bool {
    let pushes: Vec<Vector3<f32>> = positions
        .par_iter()
        .map(|p| {
            let near = below.iter().filter_map(|layer| layer.distance(p)).filter(|(d, _)| *d < CLEARANCE);
            let deepest = near.min_by(|a, b| a.0.total_cmp(&b.0));
            deepest.map_or_else(Vector3::zeros, |(d, normal)| normal * (CLEARANCE - d))
        })
        .collect();
    for (v, p) in positions.iter_mut().enumerate() {
        let around = neighbours.of(v);
        let mean = around.iter().map(|&n| pushes[n as usize]).sum::<Vector3<f32>>() / around.len().max(1) as f32;
        *p += if pushes[v].norm_squared() > mean.norm_squared() { pushes[v] } else { mean };
    }
    pushes.iter().any(|d| d.norm() > 1e-4)
}
