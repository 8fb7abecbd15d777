//! Contours of the trunk, from the height of the hip joints to below the armpits, and of the neck.

use nalgebra::Vector3;
use toile_character::Joint;

use super::{Draft, Section, circle, links::spine};
use crate::{
    bones::{Chain, Place},
    group::Group,
};

/// Farthest skin from the spine, metres: a girth of 2 m is a circle of 0.32 m, and the spine does not run in its middle.
const REACH: f64 = 0.45;
/// How far below the armpits the trunk's last contour runs, share of the height.
const BELOW_ARMPIT: f64 = 0.012;
/// How far the skin of the trunk may lie outside of the armpit's deepest point, metres.
const ARMPIT_FOLD: f64 = 0.02;
/// How far the neck's first contour stays below the head's rim, per metre of the person's height.
const CLEAR: f64 = 0.012;
/// Farthest skin from the axis of the neck, metres.
const NECK_REACH: f64 = 0.16;

/// Contours of the trunk in ascending order; the first point of each is at the left side, the next ones go to the front.
pub(super) struct Trunk {
    pub contours: Vec<Vec<u32>>,
}

impl Trunk {
    pub fn seat(&self) -> &[u32] {
        &self.contours[0]
    }

    pub fn below_armpits(&self) -> &[u32] {
        &self.contours[self.contours.len() - 1]
    }
}

impl Draft<'_> {
    /// The trunk from the hip joints to below the armpits.
    pub(super) fn trunk(&mut self) -> Trunk {
        let chain = spine();
        let at: Vec<_> = chain.0.iter().map(|&p| self.bones.at(p)).collect();
        let armpit = 0.5 * (self.marks.armpits[0].y + self.marks.armpits[1].y);
        let top = (armpit - BELOW_ARMPIT * self.marks.height).clamp(at[2].y + 0.02, at[4].y - 0.05);
        let rows = ((top - at[0].y) / self.level.spacing()).round().max(4.0) as usize;
        let angles = circle(2 * self.level.half_trunk, 0.0, -1.0);
        let mut contours: Vec<Vec<u32>> = Vec::new();
        for row in 0..=rows {
            let y = at[0].y + (top - at[0].y) * row as f64 / rows as f64;
            let link = (0..3).find(|&l| y < at[l + 1].y).unwrap_or(3);
            let share = ((y - at[link].y) / (at[link + 1].y - at[link].y)).clamp(0.0, 1.0);
            let group = match link {
                0 => Group::Hip,
                1 => Group::LowerTorso,
                _ => Group::UpperTorso,
            };
            let section = Section { chain: chain.clone(), link, share, reference: Vector3::x() };
            let aside = self.aside(y, link);
            let contour =
                self.ring_within(section, &angles, group, |angle| REACH.min(aside / angle.cos().abs().max(1e-3)));
            if let Some(below) = contours.last() {
                let below = below.clone();
                self.tube(&below, &contour);
            }
            contours.push(contour);
        }
        Trunk { contours }
    }

    /// How far to the side the trunk reaches at height `y`: above the waist not into the arms, which in the A-pose go away from it
    /// from the armpits on at 45°; half of the gap is the trunk's.
    fn aside(&self, y: f64, link: usize) -> f64 {
        let [left, right] = self.marks.armpits;
        let below = (0.5 * (left.y + right.y) - y).max(0.0);
        if link < 2 { REACH } else { left.x.abs().max(right.x.abs()) + ARMPIT_FOLD + 0.5 * below }
    }

    /// The contour where the neck begins, clear of the head's rim; its first point is at the left side.
    pub(super) fn neck_base(&mut self) -> Vec<u32> {
        let count = 2 * (self.level.half_trunk - 2 * self.level.ridge());
        let clear = CLEAR * self.marks.height;
        let steps = (0..=20).map(|k| 1.0 - 0.025 * f64::from(k));
        let share = steps.clone().find(|&s| self.clearance(0, &spine(), 3, s) >= clear).unwrap_or(0.5);
        let section = Section { chain: spine(), link: 3, share, reference: Vector3::x() };
        self.ring(section, &circle(count, 0.0, -1.0), Group::UpperTorso, NECK_REACH)
    }

    /// The neck from its base to the head.
    pub(super) fn neck(&mut self, base: &[u32]) {
        let link = (Place::Joint(Joint::Neck), Place::Joint(Joint::Head));
        self.end(0, base, link, Group::UpperTorso);
    }

    /// How far the rim of an extremity stays ahead of the plane at `share` of a link, metres.
    pub(super) fn clearance(&self, extremity: usize, chain: &Chain, link: usize, share: f64) -> f64 {
        let plane = self.bones.plane(chain, link, share);
        let rim = self.extremities.rim(extremity, &self.extremities.skin.mesh.positions);
        rim.iter().map(|p| (p - plane.origin).dot(&plane.normal)).fold(f64::MAX, f64::min)
    }
}
