//! Generic garments (the V-Man project, paper 004 §2.1.3): one mesh a type of dress, the same vertices and triangles whoever wears it.
//!
//! [`make_generic`] makes one on the mean body; [`wear()`](crate::wear()) puts it on a person, by the template that all bodies share, and
//! [`conform_generic`] gives it the shape of a garment that was scanned.

mod conform;
mod hanging;
mod kinds;
mod lines;
mod make;
mod rims;

use serde::{Deserialize, Serialize};
use toile_character::{BodyModel, FREE_PART, GarmentType, Pose, SkinWeights};
use toile_geometry::Mesh;

use self::{
    conform::{conformed, nearness, unmatched},
    make::weights_on,
};
pub use self::{
    kinds::GenericGarment,
    make::{Generic, make_generic},
};
use crate::{
    GarmentError,
    mesh::untangled,
    skin::hanging::mark_free,
    wear::{Person, wear},
};

/// A generic garment that took on the shape of a scanned one.
#[derive(Debug, Clone)]
pub struct Conformed {
    /// Its mesh, in the pose of the person.
    pub mesh: Mesh,
    /// Its skin weights.
    pub weights: SkinWeights,
    /// How it came about.
    pub report: ConformedReport,
}

/// How a generic garment took on a shape.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ConformedReport {
    /// Which one.
    pub generic: GenericGarment,
    /// Mean distance of its vertices from the scanned garment, metres.
    pub to_scan_m: f32,
    /// Mean distance of the scanned garment's vertices from it, metres.
    pub from_scan_m: f32,
}

/// The generic garment of type `garment_type` that comes nearest to a `scanned` one (in the pose of `person`, metres), in its shape;
/// `None` for types that have no generic garment.
///
/// # Errors
/// [`GarmentError::Mismatch`] where the person's body has another template than `model`.
pub fn conform_generic(
    scanned: &Mesh,
    garment_type: GarmentType,
    person: Person,
    model: &BodyModel,
) -> Result<Option<Conformed>, GarmentError> {
    let (mean, rest) = (model.skinned(&[]), Pose::identity());
    let nobody = Person { body: &mean, pose: &rest };
    let start = |&kind: &GenericGarment| {
        let generic = make_generic(kind, model);
        let start = wear(&generic.mesh, &generic.weights, garment_type, nobody, person)?;
        Ok((kind, unmatched(&start, scanned), start))
    };
    let starts = GenericGarment::of_type(garment_type).iter().map(start).collect::<Result<Vec<_>, GarmentError>>()?;
    // One that is open elsewhere than the scanned garment is of another cut.
    let fewest = starts.iter().map(|s| s.1).min().unwrap_or(0);
    let conform = |(kind, _, start): &(GenericGarment, usize, Mesh)| {
        let mesh = untangled(conformed(start, scanned));
        let near = nearness(&mesh, scanned);
        (mesh, ConformedReport { generic: *kind, to_scan_m: near.to_scan, from_scan_m: near.from_scan })
    };
    let sum = |r: &ConformedReport| r.to_scan_m + r.from_scan_m;
    let all = starts.iter().filter(|s| s.1 == fewest).map(conform);
    let best = all.min_by(|a, b| sum(&a.1).total_cmp(&sum(&b.1)));
    Ok(best.map(|(mut mesh, report)| {
        let body = person.body.posed_mesh(person.pose);
        if scanned.attributes.contains_key(FREE_PART) {
            mesh.attributes.insert(FREE_PART.into(), mark_free(&body, &mesh));
        }
        let weights = weights_on(&body, &person.body.weights, &person.body.skeleton, person.pose, &mesh);
        Conformed { mesh, weights, report }
    }))
}
