//! A skinned surface with its derivatives by pose and shape (Hu et al. 2017, eq. 2 and 3).

use nalgebra::{Isometry3, Point3, Vector3};
use rayon::prelude::*;
use toile_character::{BodyModel, JOINT_COUNT, Joint, Skeleton, SkinWeights, SkinnedMesh, joint::JOINTS};

use super::{Columns, State};
use crate::surface::Thinned;

/// Vertices that can be posed and shaped, with what their derivatives need.
pub(crate) struct Articulated {
    rest: Vec<Point3<f32>>,
    rest_normals: Vec<Vector3<f32>>,
    /// Area that each vertex stands for, square metres.
    pub areas: Vec<f32>,
    weights: SkinWeights,
    /// Vertex-major shape components: `basis[vertex * components + component]`.
    basis: Vec<Vector3<f32>>,
    components: usize,
    skeleton: Skeleton,
    joint_basis: Vec<Vec<Vector3<f64>>>,
}

/// Vertices of one state.
pub(crate) struct Posed {
    pub points: Vec<Point3<f32>>,
    /// Rest normals turned along: right to a few degrees, which is enough to keep the two sides of a limb apart.
    pub normals: Vec<Vector3<f32>>,
    /// Shaped rest vertices.
    shaped: Vec<Point3<f64>>,
    /// `posed_from_rest` of each joint.
    transforms: Vec<Isometry3<f64>>,
    /// World position and orientation of each joint.
    pub frames: Vec<Isometry3<f64>>,
    /// For each component and joint: how the joint's transform moves its part of the skin for β_b = 1.
    joint_shifts: Vec<Vec<Vector3<f64>>>,
}

impl Articulated {
    /// The vertices `picked` of the statistical body, with its first `components` components.
    pub fn of_model(model: &BodyModel, picked: &Thinned, components: usize) -> Self {
        let components = components.min(model.components.len());
        let mesh = toile_geometry::Mesh::new(model.mean.clone(), model.triangles.clone());
        let mut out = Self::of_mesh(&mesh, &model.weights, &model.mean_skeleton, picked);
        out.components = components;
        out.basis = picked
            .vertices
            .iter()
            .flat_map(|&v| (0..components).map(move |b| (v as usize, b)))
            .map(|(v, b)| model.components[b][v])
            .collect();
        out.joint_basis = model.joint_components[..components].to_vec();
        out
    }

    /// The vertices `picked` of a skinned mesh; its shape is fixed.
    pub fn of_skinned(skinned: &SkinnedMesh, picked: &Thinned) -> Self {
        Self::of_mesh(&skinned.mesh, &skinned.weights, &skinned.skeleton, picked)
    }

    fn of_mesh(mesh: &toile_geometry::Mesh, weights: &SkinWeights, skeleton: &Skeleton, picked: &Thinned) -> Self {
        let normals = mesh.vertex_normals();
        let areas = picked.areas.clone();
        let picked = &picked.vertices;
        Self {
            rest: picked.iter().map(|&v| mesh.positions[v as usize]).collect(),
            rest_normals: picked.iter().map(|&v| normals[v as usize]).collect(),
            areas,
            weights: SkinWeights {
                joints: picked.iter().map(|&v| weights.joints[v as usize]).collect(),
                weights: picked.iter().map(|&v| weights.weights[v as usize]).collect(),
            },
            basis: Vec::new(),
            components: 0,
            skeleton: skeleton.clone(),
            joint_basis: Vec::new(),
        }
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.rest.len()
    }

    /// Rest joints at `beta`.
    pub fn skeleton_at(&self, beta: &[f64]) -> Skeleton {
        let mut skeleton = self.skeleton.clone();
        for (column, &b) in self.joint_basis.iter().zip(beta) {
            for (joint, d) in skeleton.rest.iter_mut().zip(column) {
                *joint += d * b;
            }
        }
        skeleton
    }

    /// Poses and shapes all vertices.
    pub fn pose(&self, state: &State) -> Posed {
        let skeleton = self.skeleton_at(&state.beta);
        let frames = state.pose.joint_frames(&skeleton);
        let transforms = state.pose.skinning_transforms(&skeleton);
        let joint_shifts = self.joint_basis.iter().map(|column| joint_shifts(column, &frames)).collect();
        let all: Vec<_> = (0..self.len())
            .into_par_iter()
            .with_min_len(256)
            .map(|v| self.skinned(v, &state.beta, &transforms))
            .collect();
        Posed {
            points: all.iter().map(|a| a.1).collect(),
            normals: all.iter().map(|a| a.2).collect(),
            shaped: all.iter().map(|a| a.0).collect(),
            transforms,
            frames,
            joint_shifts,
        }
    }

    /// Position, normal and area of the vertices `of` only.
    pub fn pose_of(&self, state: &State, of: &[usize]) -> Vec<(Point3<f32>, Vector3<f32>, f32)> {
        let transforms = state.pose.skinning_transforms(&self.skeleton_at(&state.beta));
        let vertex = |v: usize| {
            let (_, point, normal) = self.skinned(v, &state.beta, &transforms);
            (point, normal, self.areas[v])
        };
        of.iter().map(|&v| vertex(v)).collect()
    }

    /// The joint that moves vertex `v` most.
    pub fn main_joint(&self, v: usize) -> Joint {
        Joint::from_index(usize::from(self.weights.joints[v][0])).unwrap_or(Joint::Hips)
    }

    /// Shaped rest position, posed position and normal of a vertex.
    fn skinned(
        &self,
        v: usize,
        beta: &[f64],
        transforms: &[Isometry3<f64>],
    ) -> (Point3<f64>, Point3<f32>, Vector3<f32>) {
        let shaped = self.shaped(v, beta);
        let (mut p, mut n) = (Vector3::zeros(), Vector3::zeros());
        for (j, w) in self.weights.of(v) {
            let t = &transforms[j as usize];
            p += (t * shaped).coords * f64::from(w);
            n += t.rotation * self.rest_normals[v].cast::<f64>() * f64::from(w);
        }
        let normal = n.try_normalize(1e-9).unwrap_or_default().cast::<f32>();
        (shaped, Point3::from(p.cast::<f32>()), normal)
    }

    fn shaped(&self, v: usize, beta: &[f64]) -> Point3<f64> {
        let mut p = self.rest[v].cast::<f64>();
        for (d, &b) in self.basis[v * self.components..(v + 1) * self.components].iter().zip(beta) {
            p += d.cast::<f64>() * b;
        }
        p
    }

    /// Writes the derivative of `normal · vertex` by all columns into `row`.
    pub fn derivative(&self, posed: &Posed, v: usize, normal: &Vector3<f64>, columns: &Columns, row: &mut [f64]) {
        row.fill(0.0);
        row[..3].copy_from_slice(normal.as_slice());
        let mut turned = Vector3::zeros();
        let (first_beta, betas) = (columns.first_beta(), columns.betas);
        for (j, w) in self.weights.of(v) {
            let (transform, w) = (&posed.transforms[j as usize], f64::from(w));
            let moved = transform * posed.shaped[v];
            let mut joint = Joint::from_index(j as usize);
            while let Some(ancestor) = joint {
                if let Some(c) = columns.of(ancestor) {
                    let lever = moved.coords - posed.frames[ancestor.index()].translation.vector;
                    let turn = lever.cross(normal) * w;
                    (0..3).for_each(|k| row[c + k] += turn[k]);
                }
                joint = ancestor.parent();
            }
            turned += transform.rotation.inverse() * normal * w;
            for (slot, shifts) in row[first_beta..first_beta + betas].iter_mut().zip(&posed.joint_shifts) {
                *slot += normal.dot(&shifts[j as usize]) * w;
            }
        }
        let basis = &self.basis[v * self.components..(v + 1) * self.components];
        for (slot, d) in row[first_beta..first_beta + betas].iter_mut().zip(basis) {
            *slot += turned.dot(&d.cast::<f64>());
        }
    }
}

/// Translation of each joint's `posed_from_rest` per unit of one component: dP_k − R_k dJ_k.
fn joint_shifts(column: &[Vector3<f64>], frames: &[Isometry3<f64>]) -> Vec<Vector3<f64>> {
    let mut moved = [Vector3::zeros(); JOINT_COUNT];
    for joint in JOINTS {
        let i = joint.index();
        moved[i] = match joint.parent() {
            None => column[i],
            Some(p) => moved[p.index()] + frames[p.index()].rotation * (column[i] - column[p.index()]),
        };
    }
    (0..JOINT_COUNT).map(|i| moved[i] - frames[i].rotation * column[i]).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;
    use toile_character::Pose;

    use super::*;

    fn bent(model: &BodyModel) -> State {
        let mut pose = Pose::identity();
        pose.translation = Vector3::new(0.1, -0.05, 0.2);
        for (i, r) in pose.rotations.iter_mut().enumerate() {
            let t = i as f64;
            *r = UnitQuaternion::from_scaled_axis(Vector3::new(t.sin(), (1.7 * t).cos(), (0.6 * t).sin()) * 0.3);
        }
        let beta = (0..model.components.len()).map(|i| (i as f64 * 0.9).sin()).collect();
        State { pose, beta }
    }

    #[test]
    fn derivatives_agree_with_finite_differences() {
        let model = BodyModel::load_default().unwrap();
        let picked = Thinned::of_vertices((0..model.mean.len() as u32).step_by(397).collect());
        let body = Articulated::of_model(&model, &picked, 12);
        let mut state = bent(&model);
        state.beta.truncate(12);
        let columns = Columns::new(JOINTS.to_vec(), 12);
        let posed = body.pose(&state);
        let normal = Vector3::new(0.3, -0.5, 0.8).normalize();
        let project = |s: &State, v: usize| body.pose_exact(s, v).coords.dot(&normal);
        let mut row = vec![0.0; columns.len()];
        for v in 0..body.len() {
            body.derivative(&posed, v, &normal, &columns, &mut row);
            for c in 0..columns.len() {
                let step = |h: f64| {
                    let mut delta = vec![0.0; columns.len()];
                    delta[c] = h;
                    project(&state.stepped(&delta, &columns, &posed.frames), v)
                };
                let numeric = (step(1e-5) - step(-1e-5)) / 2e-5;
                assert!((row[c] - numeric).abs() < 1e-6, "vertex {v} column {c}: {} against {numeric}", row[c]);
            }
        }
    }

    impl Articulated {
        fn pose_exact(&self, state: &State, v: usize) -> Point3<f64> {
            let transforms = state.pose.skinning_transforms(&self.skeleton_at(&state.beta));
            let shaped = self.shaped(v, &state.beta);
            let sum: Vector3<f64> =
                self.weights.of(v).map(|(j, w)| (transforms[j as usize] * shaped).coords * f64::from(w)).sum();
            Point3::from(sum)
        }
    }
}
