//! A garment's cut on one person: where it ends, how it hangs, how it creases.

use nalgebra::{Point3, Vector3};
use toile_character::Region;

/// The distance that counts as clearly outside or inside a garment's extent, metres.
const FAR: f32 = 0.05;

/// The part of the body that a place belongs to, as far as tailoring cares.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Limb {
    /// Trunk, legs, neck and head.
    Trunk,
    /// Left arm and hand.
    LeftArm,
    /// Right arm and hand.
    RightArm,
}

impl Limb {
    /// The limb of a body region.
    pub fn of(region: Region) -> Self {
        match region {
            Region::LeftArm | Region::LeftHand => Self::LeftArm,
            Region::RightArm | Region::RightHand => Self::RightArm,
            _ => Self::Trunk,
        }
    }
}

/// A half space: `normal` points out of the garment.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Plane {
    pub point: Point3<f32>,
    pub normal: Vector3<f32>,
}

impl Plane {
    fn outside(&self, p: &Point3<f32>) -> f32 {
        (p - self.point).dot(&self.normal)
    }

    /// The same on the other side of the body.
    pub fn mirrored(&self) -> Self {
        let flip = Vector3::new(-1.0, 1.0, 1.0);
        Self { point: Point3::from(self.point.coords.component_mul(&flip)), normal: self.normal.component_mul(&flip) }
    }
}

/// Where a top ends around the neck: a ball around the root of the neck, and everything above the collar.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Neckline {
    pub center: Point3<f32>,
    pub radius: f32,
    pub highest: f32,
}

impl Neckline {
    /// From this far beside the axis the collar may rise with the shoulders, metres.
    const COLLAR: f32 = 0.07;
    /// How steeply it may rise.
    const RISE: f32 = 0.7;

    fn outside(&self, p: &Point3<f32>) -> f32 {
        let beside = ((p.x - self.center.x).abs() - Self::COLLAR).max(0.0);
        let above = p.y - self.highest - Self::RISE * beside;
        (self.radius - (p - self.center).norm()).max(above)
    }
}

/// A garment's cut for one person at rest.
#[derive(Debug, Clone)]
pub struct Tailoring {
    /// Trunk: upper and lower ends, each a plane.
    pub(crate) ends: Vec<Plane>,
    /// Around the neck, for tops.
    pub(crate) neckline: Option<Neckline>,
    /// The limits of a scarf: the middle of the neck's root and a distance from it.
    pub(crate) within: Option<(Point3<f32>, f32)>,
    /// Where the legs end (left and right), if the garment has legs.
    pub(crate) legs: Option<[Plane; 2]>,
    /// Where the sleeves end; without them the arms are left out.
    pub(crate) sleeves: Option<[Plane; 2]>,
    /// Half the width of the open front, metres, and the depth (z) in front of which it is cut.
    pub(crate) opening: Option<(f32, f32)>,
    /// Distance from the layers below, metres.
    pub ease: f32,
    /// 0 follows the body, 1 hangs straight down from `drape_from`.
    pub drape: f32,
    /// Height that the cloth hangs down from, metres.
    pub drape_from: f32,
    /// Further ease a metre below `drape_from`.
    pub flare: f32,
    /// Depth of pleats at the lower end, metres.
    pub pleats: f32,
    /// Height of the lower end, metres.
    pub lower_end: f32,
    /// Highest crease, metres.
    pub creases: f32,
    /// Length of creases along x, y, z, metres.
    pub crease_length: Vector3<f32>,
}

impl Tailoring {
    /// How far a place lies outside the garment's extent, metres; negative inside. Beyond limits of the same limb the
    /// value is exact near its zero.
    pub fn outside(&self, p: &Point3<f32>, limb: Limb) -> f32 {
        let arm = match limb {
            Limb::Trunk => None,
            Limb::LeftArm => Some(0),
            Limb::RightArm => Some(1),
        };
        if let Some(side) = arm {
            return self.sleeves.as_ref().map_or(FAR, |s| s[side].outside(p).clamp(-FAR, FAR));
        }
        let mut out = self.ends.iter().map(|end| end.outside(p)).fold(-FAR, f32::max);
        if let Some(neckline) = &self.neckline {
            out = out.max(neckline.outside(p));
        }
        if let Some((center, radius)) = &self.within {
            out = out.max((p - center).norm() - radius);
        }
        if let Some(legs) = &self.legs {
            out = out.max(legs[usize::from(p.x < 0.0)].outside(p));
        }
        if let Some((half_width, front)) = self.opening
            && p.z > front
        {
            out = out.max(half_width - p.x.abs());
        }
        out.min(FAR)
    }
}
