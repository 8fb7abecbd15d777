//! A mesh that is posed again and again.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use toile_geometry::{Mesh, lanes::floats::dispatch};

use super::{
    groups::Groups,
    kernel::{Move, Turn},
    motions::Motions,
    way::Skinning,
};
use crate::{CharacterError, SkinWeights};

/// A mesh prepared for skinning frame after frame: single precision, vector instructions, one thread, no allocation a frame.
///
/// Results do not depend on the vector instructions that a machine has.
#[derive(Debug, Clone)]
pub struct Skinner {
    groups: Groups,
    vertices: usize,
    joints: usize,
}

/// A posed mesh, in the vertex order of the rest mesh; used again from frame to frame.
#[derive(Debug, Clone, Default)]
pub struct PosedSkin {
    /// Positions, metres, in the frame of the pose.
    pub positions: Vec<Point3<f32>>,
    /// Unit normals; zero where the rest mesh has none.
    pub normals: Vec<Vector3<f32>>,
    /// By how much each vertex's surroundings are turned from rest, where asked for by [`PosedSkin::with_frames`]; else empty.
    pub rotations: Vec<UnitQuaternion<f32>>,
    frames: bool,
    motions: Motions,
}

impl PosedSkin {
    /// A posed mesh with the local frame of every vertex.
    pub fn with_frames() -> Self {
        Self { frames: true, ..Self::default() }
    }

    /// `posed_from_local` of vertex `v`: the frame whose origin is the posed vertex and whose axes were those of the rest mesh at
    /// rest. What stands off the skin (cloth) is placed in it: at offset d from the rest vertex at rest, at `frame * d` now.
    ///
    /// The rotation is blended in log space for every way of skinning, because a sum of matrices is no rotation. `None`
    /// without [`PosedSkin::with_frames`] and beyond the last vertex.
    pub fn frame(&self, v: usize) -> Option<Isometry3<f32>> {
        Some(Isometry3::from_parts((*self.positions.get(v)?).into(), *self.rotations.get(v)?))
    }
}

impl Skinner {
    /// Prepares the rest `mesh` (normals computed where it has none) with its `weights`, which are scaled to sum to 1;
    /// a vertex without a weight follows joint 0. Joints beyond the skeleton's 52 are helpers that hang on the hips.
    ///
    /// # Errors
    /// [`CharacterError::Mismatch`] where mesh and weights differ in length or a weight is not finite.
    pub fn new(mesh: &Mesh, weights: &SkinWeights) -> Result<Self, CharacterError> {
        let vertices = mesh.positions.len();
        if weights.len() != vertices || weights.weights.len() != vertices {
            return Err(CharacterError::Mismatch(format!("{vertices} vertices but weights for {}", weights.len())));
        }
        if let Some(v) = weights.weights.iter().position(|w| !w.iter().all(|w| w.is_finite())) {
            return Err(CharacterError::Mismatch(format!("a skin weight of vertex {v} is not a finite number")));
        }
        let own = mesh.normals.len() == vertices;
        let computed = if own { Vec::new() } else { mesh.vertex_normals() };
        let groups = Groups::new(&mesh.positions, if own { &mesh.normals } else { &computed }, weights);
        let last = groups.groups.iter().flat_map(|g| &g.joints[..g.count]).max();
        Ok(Self { joints: last.map_or(0, |&j| usize::from(j) + 1), groups, vertices })
    }

    /// Number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.vertices
    }

    /// Poses the mesh by `posed_from_rest` transforms, one a joint, into `posed`.
    ///
    /// # Errors
    /// [`CharacterError::Mismatch`] where transforms are missing for joints that have weights.
    pub fn pose(
        &self,
        posed_from_rest: &[Isometry3<f64>],
        way: Skinning,
        posed: &mut PosedSkin,
    ) -> Result<(), CharacterError> {
        if posed_from_rest.len() < self.joints {
            let (given, last) = (posed_from_rest.len(), self.joints - 1);
            return Err(CharacterError::Mismatch(format!(
                "transforms of {given} joints, but weights for joint {last}"
            )));
        }
        posed.motions.set(posed_from_rest, &self.groups, way);
        posed.positions.resize(self.vertices, Point3::origin());
        posed.normals.resize(self.vertices, Vector3::zeros());
        let (groups, motions) = (&self.groups, &posed.motions);
        dispatch(Move { groups, motions, positions: &mut posed.positions, normals: &mut posed.normals });
        if posed.frames {
            posed.rotations.resize(self.vertices, UnitQuaternion::identity());
            dispatch(Turn { groups, motions, rotations: &mut posed.rotations });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix4;
    use toile_geometry::lanes::floats::{Kernel, Scalar};

    use super::*;
    use crate::{skin::INFLUENCES, skinning::twist};

    const VERTICES: usize = 500;

    /// Vertices anywhere within two metres, moved by one to four of twelve joints.
    fn cloud() -> (Mesh, SkinWeights) {
        let (mut mesh, mut weights) = (Mesh::default(), SkinWeights::default());
        for v in 0..VERTICES {
            let t = v as f32;
            mesh.positions.push(Point3::new((1.3 * t).sin(), 1.0 + (0.7 * t).cos(), (2.9 * t).sin()));
            mesh.normals.push(Vector3::new((0.3 * t).sin(), (0.3 * t).cos(), (1.1 * t).sin()).normalize());
            let first = v % 9;
            let influence = |k: usize| ((first + k) as u8, 0.1 + (t * 0.77 + k as f32).sin().abs());
            weights.push(&(0..=v % INFLUENCES).map(influence).collect::<Vec<_>>());
        }
        (mesh, weights)
    }

    /// Turns of up to 1.1 radians; of joint 11, half a revolution against all others.
    fn transforms() -> Vec<Isometry3<f64>> {
        let turn = |t: f64| 0.6 * Vector3::new((0.9 * t).sin(), (1.9 * t).cos(), (0.4 * t).sin());
        let of = |i: i32| Isometry3::new(0.3 * turn(f64::from(i) + 9.0), turn(f64::from(i)));
        (0..12).map(of).collect()
    }

    #[test]
    fn lanes_of_any_kind_pose_alike() {
        let (mesh, weights) = cloud();
        let skinner = Skinner::new(&mesh, &weights).unwrap();
        for way in Skinning::ALL {
            let mut posed = PosedSkin::with_frames();
            skinner.pose(&transforms(), way, &mut posed).unwrap();
            let mut plain = posed.clone();
            plain.positions.fill(Point3::origin());
            plain.normals.fill(Vector3::zeros());
            plain.rotations.fill(UnitQuaternion::identity());
            let (groups, motions) = (&skinner.groups, &posed.motions);
            Move { groups, motions, positions: &mut plain.positions, normals: &mut plain.normals }.run(Scalar);
            Turn { groups, motions, rotations: &mut plain.rotations }.run(Scalar);
            assert_eq!((&plain.positions, &plain.normals), (&posed.positions, &posed.normals), "{way}");
            assert_eq!(plain.rotations, posed.rotations, "{way}");
        }
    }

    /// The transform of a vertex in double precision, by the definition.
    fn defined(skinner: &Skinner, weights: &SkinWeights, v: usize, way: Skinning) -> Matrix4<f64> {
        let transforms = transforms();
        let influences: Vec<_> = weights.of(v).map(|(j, w)| (transforms[usize::from(j)], f64::from(w))).collect();
        if way == Skinning::Linear {
            return influences.iter().map(|(t, w)| t.to_homogeneous() * *w).sum();
        }
        let holds = |b: &super::super::groups::Block| b.vertices.contains(&(v as u32));
        let of = |g: &&super::super::groups::Group| skinner.groups.blocks[g.blocks.clone()].iter().any(holds);
        let group = skinner.groups.groups.iter().find(of).unwrap();
        twist::blended(&transforms[usize::from(group.joints[0])], influences).to_homogeneous()
    }

    #[test]
    fn single_precision_is_the_definition_within_two_micrometres() {
        let (mesh, weights) = cloud();
        let skinner = Skinner::new(&mesh, &weights).unwrap();
        for way in [Skinning::Linear, Skinning::Log] {
            let mut posed = PosedSkin::with_frames();
            skinner.pose(&transforms(), way, &mut posed).unwrap();
            for v in 0..VERTICES {
                let defined = defined(&skinner, &weights, v, way);
                let place = defined.transform_point(&mesh.positions[v].cast());
                let normal = defined.transform_vector(&mesh.normals[v].cast()).normalize();
                assert!((posed.positions[v].cast() - place).norm() < 2e-6, "{way} {v}");
                assert!((posed.normals[v].cast() - normal).norm() < 2e-6, "{way} {v}");
                let frame = posed.frame(v).unwrap();
                assert_eq!(frame.translation.vector, posed.positions[v].coords);
                if way == Skinning::Log {
                    assert!((frame * mesh.normals[v] - posed.normals[v]).norm() < 2e-6, "{v}");
                }
            }
        }
    }

    #[test]
    fn hybrid_is_linear_where_axes_agree_and_log_elsewhere() {
        let (mesh, weights) = cloud();
        let skinner = Skinner::new(&mesh, &weights).unwrap();
        let posed = |transforms: &[Isometry3<f64>], way| {
            let mut posed = PosedSkin::default();
            skinner.pose(transforms, way, &mut posed).unwrap();
            posed.positions
        };
        let gentle = |t: &Isometry3<f64>| Isometry3::new(t.translation.vector, 0.02 * t.rotation.scaled_axis());
        let gentle: Vec<_> = transforms().iter().map(gentle).collect();
        assert_eq!(posed(&gentle, Skinning::Hybrid), posed(&gentle, Skinning::Linear));
        assert_ne!(posed(&gentle, Skinning::Hybrid), posed(&gentle, Skinning::Log));
        assert_eq!(posed(&transforms(), Skinning::Hybrid), posed(&transforms(), Skinning::Log));
    }

    #[test]
    fn a_frame_allocates_nothing() {
        let (mesh, weights) = cloud();
        let skinner = Skinner::new(&mesh, &weights).unwrap();
        let mut posed = PosedSkin::with_frames();
        skinner.pose(&transforms(), Skinning::Log, &mut posed).unwrap();
        let places = |p: &PosedSkin| {
            let motions = (p.motions.matrices.as_ptr(), p.motions.turns.as_ptr(), p.motions.twists.as_ptr());
            (p.positions.as_ptr(), p.normals.as_ptr(), p.rotations.as_ptr(), motions)
        };
        let before = places(&posed);
        for way in Skinning::ALL {
            skinner.pose(&transforms(), way, &mut posed).unwrap();
            assert_eq!(places(&posed), before);
        }
    }
}
