//! The lines that generic garments are cut at, as fields over the mean body at rest: positive where there is cloth, metres.

use nalgebra::{Point3, Vector3};
use toile_character::{BodyModel, Joint, Region};

use super::kinds::Pattern;

/// Half the width of the opening in front, metres: a finger.
const OPENING: f32 = 0.008;
/// The neckline falls to the front by this much: tangent of 25°, as a neck stands on shoulders.
const NECK_FALL: f32 = 0.47;
/// The neckline lies this much below the neck joint, metres: a finger.
const BELOW_NECK: f32 = 0.01;
/// The value of a field where its line is far.
const FAR: f32 = 1.0;

/// The mean body's landmarks that lines are named by.
pub(super) struct Lines<'a> {
    model: &'a BodyModel,
}

impl<'a> Lines<'a> {
    pub fn new(model: &'a BodyModel) -> Self {
        Self { model }
    }

    fn joint(&self, joint: Joint) -> Point3<f32> {
        self.model.mean_skeleton.position(joint).cast()
    }

    /// Height of the hip joints: the crotch is below.
    pub fn hips(&self) -> f32 {
        self.joint(Joint::LeftUpperLeg).y
    }

    /// Height of the ankles.
    pub fn ankles(&self) -> f32 {
        self.joint(Joint::LeftFoot).y
    }

    /// The middle of the trunk, seen from above, at hip height.
    pub fn axis(&self) -> Point3<f32> {
        self.joint(Joint::Hips)
    }

    /// One value a vertex of the template: the pattern without what is added below the hips.
    pub fn field(&self, pattern: &Pattern) -> Vec<f32> {
        let normals = toile_geometry::mesh::vertex_normals(&self.model.mean, &self.model.triangles);
        let value = |(v, p): (usize, &Point3<f32>)| {
            let region = self.model.regions[v];
            let lower = if pattern.leg.is_some() { self.leg(region, p, pattern) } else { self.above_hips(region, p) };
            let upper = if pattern.sleeve.is_some() { self.upper(region, p, pattern) } else { self.waist(region, p) };
            let front = if pattern.open { opening(region, p, &normals[v]) } else { FAR };
            lower.min(upper).min(front)
        };
        self.model.mean.iter().enumerate().map(value).collect()
    }

    fn above_hips(&self, region: Region, p: &Point3<f32>) -> f32 {
        if is_arm(region) { FAR } else { p.y - self.hips() }
    }

    /// Below the natural waist: half-way between the spine's two lowest joints and so far above the hip bones.
    fn waist(&self, region: Region, p: &Point3<f32>) -> f32 {
        let waist = 0.5 * (self.joint(Joint::Spine).y + self.joint(Joint::Chest).y);
        if is_arm(region) { -FAR } else { waist - p.y }
    }

    fn leg(&self, region: Region, p: &Point3<f32>, pattern: &Pattern) -> f32 {
        let ends = match region {
            Region::LeftLeg | Region::LeftFoot => [Joint::LeftUpperLeg, Joint::LeftFoot],
            Region::RightLeg | Region::RightFoot => [Joint::RightUpperLeg, Joint::RightFoot],
            _ => return FAR,
        };
        before(p, ends.map(|j| self.joint(j)), pattern.leg.unwrap_or(1.0))
    }

    /// Sleeves and neckline.
    fn upper(&self, region: Region, p: &Point3<f32>, pattern: &Pattern) -> f32 {
        let ends = match region {
            Region::LeftArm | Region::LeftHand => [Joint::LeftUpperArm, Joint::LeftHand],
            Region::RightArm | Region::RightHand => [Joint::RightUpperArm, Joint::RightHand],
            _ => {
                let under = self.joint(Joint::Neck) - p;
                return (under.y - BELOW_NECK + NECK_FALL * under.z) / (1.0 + NECK_FALL * NECK_FALL).sqrt();
            }
        };
        before(p, ends.map(|j| self.joint(j)), pattern.sleeve.unwrap_or(1.0))
    }
}

fn opening(region: Region, p: &Point3<f32>, normal: &Vector3<f32>) -> f32 {
    let is_front = !is_arm(region) && normal.z > 0.0;
    if is_front { p.x.abs() - OPENING } else { FAR }
}

fn is_arm(region: Region) -> bool {
    matches!(region, Region::LeftArm | Region::RightArm | Region::LeftHand | Region::RightHand)
}

/// How far `p` is before the plane across a limb at a `share` of the way between its ends, metres.
fn before(p: &Point3<f32>, [from, to]: [Point3<f32>; 2], share: f32) -> f32 {
    let way = to - from;
    share * way.norm() - (p - from).dot(&way) / way.norm().max(1e-6)
}
