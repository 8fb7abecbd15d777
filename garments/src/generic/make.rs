//! A generic garment made out of the mean body.

use nalgebra::{Point3, Vector3};
use toile_character::{BodyModel, FREE_PART, GarmentType, Pose, Region, SkinWeights};
use toile_geometry::{Mesh, remesh::isotropic, smooth::taubin};

use super::{
    hanging::hang,
    kinds::{GenericGarment, Pattern},
    lines::Lines,
};
use crate::{
    mesh::part_where_positive,
    settings::ExtractSettings,
    skin::{common_frame, hanging::mark_free},
    take::DressedTake,
};

/// Length of the edges, metres: folds that a scan shows are three times as wide.
const EDGE: f32 = 0.010;
/// The ease is added in so many steps, the surface smoothed after each, so that the hollows of the skin close.
const STEPS: usize = 5;
const PASSES: usize = 40;

/// A garment that is nobody's.
#[derive(Debug, Clone)]
pub struct Generic {
    /// Its mesh on the mean body at rest, metres.
    pub mesh: Mesh,
    /// Its skin weights.
    pub weights: SkinWeights,
}

/// Makes a generic garment: the mean body's surface cut at the garment's lines, cloth added that hangs below, and all of it moved off
/// the skin by the garment's ease. The same program gives the same vertices and triangles each time, whoever wears it then.
pub fn make_generic(kind: GenericGarment, model: &BodyModel) -> Generic {
    let (pattern, lines) = (kind.pattern(), Lines::new(model));
    let body = model.skinned(&[]);
    let mut mesh = part_where_positive(&body.mesh, &lines.field(&pattern));
    if pattern.leg.is_none() {
        let to = lines.hips() - pattern.hem * (lines.hips() - lines.ankles());
        hang(&mut mesh, &trunk_and_legs(model), &lines.axis(), lines.hips(), to, pattern.flare);
    }
    let mut mesh = isotropic(&mesh, EDGE);
    add_ease(&mut mesh, &pattern);
    mesh.recompute_normals();
    if kind.garment_type() == GarmentType::Skirt {
        mesh.attributes.insert(FREE_PART.into(), mark_free(&body.mesh, &mesh));
    }
    let weights = weights_on(&body.mesh, &body.weights, &body.skeleton, &Pose::identity(), &mesh);
    Generic { mesh, weights }
}

/// Skin weights of cloth on a body that wears it in `pose`.
pub(super) fn weights_on(
    body: &Mesh,
    weights: &SkinWeights,
    skeleton: &toile_character::Skeleton,
    pose: &Pose,
    mesh: &Mesh,
) -> SkinWeights {
    let on = DressedTake {
        scan: mesh,
        previous: body,
        is_first: false,
        body,
        weights,
        skeleton,
        pose,
        pose0: pose,
        garment_type: None,
        edits: None,
    };
    common_frame::weights(&on, mesh, &ExtractSettings::default())
}

fn trunk_and_legs(model: &BodyModel) -> Vec<Point3<f32>> {
    let is_of = |r: &Region| matches!(r, Region::Torso | Region::LeftLeg | Region::RightLeg);
    model.mean.iter().zip(&model.regions).filter(|(_, r)| is_of(r)).map(|(p, _)| *p).collect()
}

fn add_ease(mesh: &mut Mesh, pattern: &Pattern) {
    let mobility = vec![1.0; mesh.positions.len()];
    for _ in 0..STEPS {
        let normals: Vec<Vector3<f32>> = mesh.vertex_normals();
        let step = pattern.ease / STEPS as f32;
        mesh.positions.iter_mut().zip(&normals).for_each(|(p, n)| *p += n * step);
        taubin(&mut mesh.positions, &mesh.triangles, PASSES, &mobility);
    }
}
