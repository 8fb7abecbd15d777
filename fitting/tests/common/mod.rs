//! People made from the model itself, with known shape and pose.
#![allow(dead_code)] // each test file uses a part

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use toile_character::{BodyModel, Joint, Pose};
use toile_geometry::Mesh;

pub mod motions;
pub mod strangers;
pub mod surface;
pub mod tape;

/// A small deterministic generator of numbers between −1 and 1 (Weyl sequence, mixed).
pub struct Numbers(pub u64);

impl Numbers {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// About normal, with a standard deviation of 1.
    pub fn normal(&mut self) -> f64 {
        self.next() + self.next() + self.next()
    }

    pub fn vector(&mut self) -> Vector3<f64> {
        Vector3::new(self.next(), self.next(), self.next())
    }
}

pub struct Person {
    pub beta: Vec<f64>,
    pub pose: Pose,
    pub mesh: Mesh,
}

/// A person of a random shape in about the A-pose, turned by `heading` degrees about the vertical.
pub fn person(model: &BodyModel, seed: u64, heading: f64) -> Person {
    let mut numbers = Numbers(seed);
    let beta: Vec<f64> = (0..model.component_count()).map(|_| 1.2 * numbers.next()).collect();
    let mut pose = Pose::identity();
    for joint in toile_character::joint::JOINTS {
        let degrees = match joint {
            Joint::Hips => 0.0,
            j if j.is_finger() => 2.0,
            Joint::LeftUpperArm | Joint::RightUpperArm => 8.0,
            _ => 3.0,
        };
        let turn = Vector3::new(numbers.next(), numbers.next(), numbers.next()) * f64::to_radians(degrees);
        *pose.rotation_mut(joint) = UnitQuaternion::from_scaled_axis(turn);
    }
    let stand = Isometry3::new(Vector3::new(0.05, 0.01, -0.03), Vector3::y() * heading.to_radians());
    let pose = pose.moved(&stand, &model.skeleton_at(&beta));
    let mut mesh = Mesh::new(model.posed(&beta, &pose), model.triangles.clone());
    mesh.recompute_normals();
    Person { beta, pose, mesh }
}

/// The part that a scanner sees: no soles, no inner pockets, `noise` metres along the normals.
pub fn scanned(model: &BodyModel, person: &Person, noise: f64, seed: u64) -> Mesh {
    let mut numbers = Numbers(seed);
    let floor = person.mesh.positions.iter().map(|p| p.y).fold(f32::INFINITY, f32::min);
    let keep = |t: usize| {
        let triangle = person.mesh.triangles[t];
        let inner = triangle.iter().any(|&v| model.inner[v as usize]);
        let sole = triangle
            .iter()
            .all(|&v| person.mesh.positions[v as usize].y < floor + 0.03 && person.mesh.normals[v as usize].y < -0.5);
        !inner && !sole
    };
    let (mut mesh, _) = person.mesh.filter_triangles(keep);
    for (p, n) in mesh.positions.iter_mut().zip(&mesh.normals) {
        // the sum of three uniform numbers has a standard deviation of 1
        let r = numbers.next() + numbers.next() + numbers.next();
        *p += n * (noise * r) as f32;
    }
    mesh
}

/// Mean distance between two meshes of the same topology, metres.
pub fn mean_distance(a: &[Point3<f32>], b: &[Point3<f32>]) -> f64 {
    a.iter().zip(b).map(|(a, b)| f64::from((a - b).norm())).sum::<f64>() / a.len() as f64
}

/// Mean distance of the 22 body joints, metres.
pub fn joint_distance(a: &[Point3<f64>], b: &[Point3<f64>]) -> f64 {
    a.iter().zip(b).take(22).map(|(a, b)| (a - b).norm()).sum::<f64>() / 22.0
}

/// An axis-aligned box, outward.
pub fn cuboid(lo: [f32; 3], hi: [f32; 3]) -> Mesh {
    let corner = |i: usize| Point3::new([lo[0], hi[0]][i & 1], [lo[1], hi[1]][i >> 1 & 1], [lo[2], hi[2]][i >> 2 & 1]);
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let mut mesh = Mesh::new((0..8).map(corner).collect(), Vec::new());
    for [a, b, c, d] in faces {
        mesh.triangles.extend([[a, b, c], [a, c, d]]);
    }
    mesh
}

/// Several meshes as one.
pub fn joined(parts: &[Mesh]) -> Mesh {
    let mut out = Mesh::default();
    for part in parts {
        let shift = out.positions.len() as u32;
        out.positions.extend(&part.positions);
        out.triangles.extend(part.triangles.iter().map(|t| t.map(|v| v + shift)));
    }
    out
}

/// Each triangle cut into four, `times` times.
pub fn finer(mesh: &Mesh, times: usize) -> Mesh {
    let mut corners: Vec<[Point3<f32>; 3]> = (0..mesh.triangles.len()).map(|t| mesh.corners(t)).collect();
    for _ in 0..times {
        let middle = |a: &Point3<f32>, b: &Point3<f32>| nalgebra::center(a, b);
        corners = corners
            .iter()
            .flat_map(|[a, b, c]| {
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                [[*a, ab, ca], [ab, *b, bc], [ca, bc, *c], [ab, bc, ca]]
            })
            .collect();
    }
    let triangles = (0..corners.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    Mesh::new(corners.into_iter().flatten().collect(), triangles)
}
