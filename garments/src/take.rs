//! A take before its garment is extracted.

use nalgebra::Point3;
use toile_character::{GarmentType, Pose, Skeleton, SkinWeights, joint::JOINTS};
use toile_geometry::Mesh;

use crate::{edits::format::Edits, error::GarmentError};

/// A dressed take with all that earlier stages found. All meshes are in the scan's frame, metres.
#[derive(Debug, Clone, Copy)]
pub struct DressedTake<'a> {
    /// The new scan, with colours and the attribute `filled`.
    pub scan: &'a Mesh,
    /// The surface worn before (the scan of the take before), posed into this scan, with colours.
    pub previous: &'a Mesh,
    /// No take was scanned before: `previous` is the body as it was guessed, and cloth is told from bare skin.
    pub is_first: bool,
    /// The body posed into this scan, on the template's triangles.
    pub body: &'a Mesh,
    /// Skin weights of the body, one for each of its vertices.
    pub weights: &'a SkinWeights,
    /// The body's rest skeleton.
    pub skeleton: &'a Skeleton,
    /// The body's pose in this take, relative to rest.
    pub pose: &'a Pose,
    /// The body's pose in take 0: the common frame.
    pub pose0: &'a Pose,
    /// The garment's type where it is known; it is guessed otherwise.
    pub garment_type: Option<GarmentType>,
    /// Corrections by hand.
    pub edits: Option<&'a Edits>,
}

impl DressedTake<'_> {
    /// Checks that meshes, weights and edits can be used together.
    pub(crate) fn check(&self) -> Result<(), GarmentError> {
        for (mesh, name) in [(self.scan, "scan"), (self.previous, "earlier layers' surface"), (self.body, "body")] {
            if mesh.is_empty() {
                return Err(GarmentError::Empty(name));
            }
            mesh.validate().map_err(|e| GarmentError::Mesh(format!("the {name}: {e}")))?;
        }
        let (vertices, weights) = (self.body.positions.len(), self.weights.len());
        if vertices != weights {
            return Err(GarmentError::Mismatch(format!("the body has {vertices} vertices but weights for {weights}")));
        }
        self.edits.map_or(Ok(()), |edits| edits.check().and_then(|()| edits.check_on(self.scan)))
    }

    /// Segments from each joint to its parent, in the scan's frame.
    pub(crate) fn bones(&self) -> Vec<[Point3<f32>; 2]> {
        let at = self.pose.joint_positions(self.skeleton);
        let bone = |j: &toile_character::Joint| Some([at[j.parent()?.index()].cast(), at[j.index()].cast()]);
        JOINTS.iter().filter_map(bone).collect()
    }
}
