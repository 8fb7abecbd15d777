//! Head, hands and feet: rigid but for their joints, taken from the template body (paper 002 §3 and §4.1).

use nalgebra::Point3;
use toile_character::{BodyModel, Joint, Pose, Region, SkinnedMesh, skinning};
use toile_geometry::{Mesh, topology::boundary_loops};

use crate::{ImplicitError, body::ImplicitBody};

/// Head, hands and feet of one person.
#[derive(Debug, Clone)]
pub struct Extremities {
    /// Their surface at rest with its weights, vertex order of the template.
    pub skin: SkinnedMesh,
    /// Which extremity each vertex is of, as in [`EXTREMITIES`].
    pub parts: Vec<u8>,
    /// The rim of each: vertices in order around it.
    pub rims: [Vec<u32>; 5],
}

/// The extremities in the order of [`Extremities::rims`].
pub const EXTREMITIES: [Region; 5] =
    [Region::Head, Region::LeftHand, Region::RightHand, Region::LeftFoot, Region::RightFoot];

/// The joint that an extremity hangs on.
pub fn joint_of(extremity: usize) -> Joint {
    [Joint::Head, Joint::LeftHand, Joint::RightHand, Joint::LeftFoot, Joint::RightFoot][extremity]
}

impl Extremities {
    /// Of `body`: those of the model with its coefficients, `scale` times as large, on its joints at rest.
    ///
    /// # Errors
    /// [`ImplicitError::Body`] where the template's head, hands or feet do not have one rim each.
    pub fn new(model: &BodyModel, body: &ImplicitBody) -> Result<Self, ImplicitError> {
        let (beta, skeleton) = (&body.beta[..], &body.skeleton);
        let whole = Mesh::new(model.shape(beta), model.triangles.clone());
        let is_part = |t: usize| model.triangles[t].iter().all(|&v| model.regions[v as usize].is_extremity());
        let (mut mesh, old_of_new) = whole.filter_triangles(is_part);
        let own = model.skeleton_at(beta);
        for (p, &old) in mesh.positions.iter_mut().zip(&old_of_new) {
            // the person's own joints may lie beside those of the model
            let joint = joint_of(extremity_of(model.regions[old as usize]));
            let offset = p.cast::<f64>() - own.position(joint);
            *p = (skeleton.position(joint) + offset * body.scale).cast();
        }
        let mut rims: [Vec<u32>; 5] = Default::default();
        for rim in boundary_loops(&mesh.triangles) {
            let of = extremity_of(model.regions[old_of_new[rim[0] as usize] as usize]);
            if rim.len() > rims[of].len() {
                rims[of] = rim;
            }
        }
        if let Some(of) = rims.iter().position(|rim| rim.len() < 3) {
            let reason =
                format!("the template's {} has no rim that skin could be stitched to", EXTREMITIES[of].words());
            return Err(ImplicitError::Body(reason));
        }
        let weights = model.weights.gather(&old_of_new);
        let parts = old_of_new.iter().map(|&v| extremity_of(model.regions[v as usize]) as u8).collect();
        Ok(Self { skin: SkinnedMesh::new(mesh, skeleton.clone(), weights)?, parts, rims })
    }

    /// Their vertices in `pose`.
    pub fn posed(&self, pose: &Pose) -> Vec<Point3<f32>> {
        let transforms = pose.skinning_transforms(&self.skin.skeleton);
        skinning::skin(&self.skin.mesh.positions, &self.skin.weights, &transforms)
    }

    /// The points of a rim among `positions`.
    pub fn rim(&self, extremity: usize, positions: &[Point3<f32>]) -> Vec<Point3<f64>> {
        self.rims[extremity].iter().map(|&v| positions[v as usize].cast()).collect()
    }
}

fn extremity_of(region: Region) -> usize {
    EXTREMITIES.iter().position(|r| *r == region).unwrap_or(0)
}
