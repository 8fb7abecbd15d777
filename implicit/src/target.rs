//! A skinned body as a shape that rays leave: what primitives are fitted to.

use nalgebra::{Point3, Vector3};
use toile_character::{Joint, Pose, SkinnedMesh};
use toile_geometry::{bvh::Bvh, mesh::triangle_normals};

use crate::{
    group::{Group, Groups},
    surface::{Ray, Surface},
};

/// Weight from which on a triangle belongs to a group.
const QUARTER: f32 = 0.25;

/// The surface of a skinned body in one pose.
pub struct Target {
    /// Vertices in the pose.
    pub positions: Vec<Point3<f32>>,
    /// The joint that moves each triangle most.
    pub joints: Vec<Joint>,
    /// The groups that each triangle belongs to by its weights.
    groups: Vec<Groups>,
    normals: Vec<Vector3<f32>>,
    bvh: Bvh,
}

impl Target {
    /// The body in `pose`.
    pub fn new(body: &SkinnedMesh, pose: &Pose) -> Self {
        let positions = body.posed(pose);
        let triangles = &body.mesh.triangles;
        let (joints, groups) = triangles.iter().map(|t| belonging(body, t)).unzip();
        Self {
            joints,
            groups,
            normals: triangle_normals(&positions, triangles),
            bvh: Bvh::new(&positions, triangles),
            positions,
        }
    }

    /// Distance along the ray and triangle where it leaves the body for the last time.
    pub fn exit(&self, ray: &Ray) -> Option<(f64, u32)> {
        let (end, back) = (ray.at(ray.reach).cast::<f32>(), -ray.direction.cast::<f32>());
        let is_exit = |t: u32| {
            self.groups[t as usize].iter().any(|g| ray.group.meets(g)) && self.normals[t as usize].dot(&back) < 0.0
        };
        let hit = self.bvh.ray_where(&end, &back, ray.reach as f32, is_exit)?;
        Some((ray.reach - f64::from(hit.t), hit.triangle))
    }
}

/// The strongest joint of a triangle, and the groups whose joints hold a quarter of its weights.
fn belonging(body: &SkinnedMesh, triangle: &[u32; 3]) -> (Joint, Groups) {
    let mut weights = [0.0f32; toile_character::JOINT_COUNT];
    triangle.iter().flat_map(|&v| body.weights.of(v as usize)).for_each(|(j, w)| weights[usize::from(j)] += w / 3.0);
    let best = (0..weights.len()).max_by(|&a, &b| weights[a].total_cmp(&weights[b]).then(b.cmp(&a)));
    let joint = best.and_then(Joint::from_index).unwrap_or(Joint::Hips);
    let held = |g: Group| -> f32 {
        toile_character::joint::JOINTS.iter().filter(|j| Group::of_joint(**j) == g).map(|j| weights[j.index()]).sum()
    };
    let groups = Group::ALL.into_iter().filter(|g| held(*g) >= QUARTER).collect::<Groups>();
    (joint, groups.with(Group::of_joint(joint)))
}

impl Surface for Target {
    fn outermost(&self, ray: &Ray) -> Option<f64> {
        self.exit(ray).map(|(t, _)| t)
    }
}
