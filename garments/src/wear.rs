//! A garment of one person on another person.
//!
//! Every body has the same template, so that skin of the one is known on the other. [`wear()`] brings the garment into the pose of
//! who will wear it, on the body that it was cut from, and then [resizes](resize) it as the skin around it differs between the two
//! bodies. Putting it outside of what is worn below is [`stack()`](crate::stack())'s work.

mod resize;
mod similarity;

use toile_character::{FREE_PART, GarmentType, Pose, SkinWeights, SkinnedMesh, skinning};
use toile_geometry::{Mesh, topology::vertex_components};

use self::resize::{Skin, resized, resized_in_pieces};
use crate::{GarmentError, skin::hanging::mark_free};

/// A body in the pose in which it wears its layers.
#[derive(Debug, Clone, Copy)]
pub struct Person<'a> {
    /// The body at rest: the template's vertices, metres.
    pub body: &'a SkinnedMesh,
    /// The pose in which the layers are given.
    pub pose: &'a Pose,
}

/// The `garment` that `from` wears (in the pose of `from`, with its skin `weights`, metres) as `to` wears it, in the pose of `to`.
///
/// Weights stay: both skeletons have the same joints. Hats and shoes are stiff: each piece of them keeps its shape and changes its
/// size only. Where the garment marks what hangs free ([`FREE_PART`]), that is marked anew.
///
/// # Errors
/// [`GarmentError::Mismatch`] where the bodies have not the same template, or the weights are of another mesh.
pub fn wear(
    garment: &Mesh,
    weights: &SkinWeights,
    garment_type: GarmentType,
    from: Person,
    to: Person,
) -> Result<Mesh, GarmentError> {
    let (have, want) = (from.body.mesh.positions.len(), to.body.mesh.positions.len());
    if have != want {
        return Err(GarmentError::Mismatch(format!("the one body has {have} vertices, the other {want}")));
    }
    let (vertices, count) = (garment.positions.len(), weights.len());
    if vertices != count {
        return Err(GarmentError::Mismatch(format!("the garment has {vertices} vertices but weights for {count}")));
    }
    let skeleton = &from.body.skeleton;
    let rest = skinning::unskin(&garment.positions, weights, &from.pose.skinning_transforms(skeleton));
    let mut worn = garment.clone();
    worn.positions = skinning::skin(&rest, weights, &to.pose.skinning_transforms(skeleton));
    let (before, after) = (from.body.posed_mesh(to.pose), to.body.posed_mesh(to.pose));
    let skin = Skin::new(&before, &after.positions);
    worn.positions = if matches!(garment_type, GarmentType::Hat | GarmentType::Shoes) {
        let (piece, count) = vertex_components(worn.positions.len(), &worn.triangles);
        resized_in_pieces(&worn.positions, &piece, count, &skin)
    } else {
        resized(&worn.positions, &skin)
    };
    worn.recompute_normals();
    if worn.attributes.contains_key(FREE_PART) {
        let free = mark_free(&after, &worn);
        worn.attributes.insert(FREE_PART.into(), free);
    }
    Ok(worn)
}
