//! Contours of arms and legs.

use nalgebra::Vector3;
use toile_character::Joint;

use super::{
    Draft, Section,
    chest::ArmHole,
    circle,
    links::{arm_chain, leg_chain},
    trunk::Trunk,
};
use crate::{
    bones::{Chain, Place},
    group::Group,
};

/// Farthest skin from the bone of an arm, metres: the upper arm's girth of the widest men of ANSUR II (0.52 m) as a circle, once over.
const ARM_REACH: f64 = 0.16;
/// Farthest skin from the bone of a leg, metres: the thigh's girth of the widest (0.87 m) as a circle, half over.
const LEG_REACH: f64 = 0.21;
/// Farthest skin from the middle of the hip joints in the plane between the legs, metres.
const SEAM_REACH: f64 = 0.3;
/// Where the first contour across the upper arm lies, metres from the shoulder joint per metre of the person's height.
const FIRST_ON_ARM: f64 = 0.072;
/// How far below the crotch the first contour across the thigh lies, per metre of the person's height.
const BELOW_CROTCH: f64 = 0.02;
/// From this share of the shank on its skin belongs to the ankle.
const ANKLE: f64 = 0.8;

/// Contours across two links.
struct Tube {
    chain: Chain,
    /// The first of the two links.
    link: usize,
    /// Share of the first link at which they begin.
    first: f64,
    reference: Vector3<f64>,
    angles: Vec<f64>,
    reach: f64,
    extremity: usize,
}

impl Draft<'_> {
    /// The arm of a side, from the rim of its hole to the hand.
    pub(super) fn arm(&mut self, side: usize, hole: &ArmHole) {
        let [front, back] = [&hole.front[..hole.front.len() - 1], &hole.back[..]];
        let top = hole.front[hole.front.len() - 1];
        let (up, down) = if side == 0 { (front, back) } else { (back, front) };
        let rim: Vec<u32> =
            [&[hole.corner], up, &[top]].concat().into_iter().chain(down.iter().rev().copied()).collect();
        let chain = arm_chain(side);
        let length = (self.bones.at(chain.0[2]) - self.bones.at(chain.0[1])).norm();
        let tube = Tube {
            link: 1,
            first: (FIRST_ON_ARM * self.marks.height / length).min(0.5),
            reference: -Vector3::y(),
            angles: circle(rim.len(), 0.0, -1.0),
            reach: ARM_REACH,
            extremity: 1 + side,
            chain,
        };
        let groups = |link: usize, _: f64| match (side, link) {
            (0, 1) => Group::LeftUpperArm,
            (0, _) => Group::LeftLowerArm,
            (_, 1) => Group::RightUpperArm,
            _ => Group::RightLowerArm,
        };
        self.limb(&rim, &tube, [Group::LeftShoulder, Group::RightShoulder][side], groups);
    }

    /// The leg of a side, from half of the trunk's lowest contour and the seam between the legs to the foot.
    pub(super) fn leg(&mut self, side: usize, trunk: &Trunk, seam: &[u32]) {
        let half = self.level.half_trunk;
        let seat = trunk.seat();
        let (front, back) = (half / 2, 3 * half / 2);
        let outer: Vec<u32> = match side {
            0 => (0..=half).map(|k| seat[(front + 2 * half - k) % (2 * half)]).collect(),
            _ => (0..=half).map(|k| seat[back - k]).collect(),
        };
        let rim: Vec<u32> = match side {
            0 => outer.iter().copied().chain(seam.iter().rev().copied()).collect(),
            _ => outer.iter().copied().chain(seam.iter().copied()).collect(),
        };
        let chain = leg_chain(side);
        let (hip, knee) = (self.bones.at(chain.0[0]), self.bones.at(chain.0[1]));
        let below = self.marks.crotch.y - BELOW_CROTCH * self.marks.height;
        let tube = Tube {
            link: 0,
            first: ((hip.y - below) / (hip.y - knee.y)).clamp(0.1, 0.7),
            reference: [Vector3::x(), -Vector3::x()][side],
            // the rim begins and ends its outer half at the seam, a third of the way round on either side
            angles: circle(rim.len(), std::f64::consts::TAU / 3.0, -1.0),
            reach: LEG_REACH,
            extremity: 3 + side,
            chain,
        };
        let groups = |link: usize, share: f64| match (side, link) {
            (0, 0) => Group::LeftUpperLeg,
            (0, _) if share < ANKLE => Group::LeftLowerLeg,
            (0, _) => Group::LeftAnkle,
            (_, 0) => Group::RightUpperLeg,
            _ if share < ANKLE => Group::RightLowerLeg,
            _ => Group::RightAnkle,
        };
        self.limb(&rim, &tube, groups(0, 0.0), groups);
    }

    /// The seam between the legs, from front to back without its ends.
    pub(super) fn seam(&mut self) -> Vec<u32> {
        let chain = Chain([Joint::LeftUpperLeg, Joint::RightUpperLeg].map(Place::Socket).to_vec());
        let edges = self.level.seam();
        // the normal points to the right: from the front (+Z), a negative turn about it goes down
        let angles: Vec<f64> = (1..edges).map(|k| -std::f64::consts::PI * k as f64 / edges as f64).collect();
        let section = Section { chain, link: 0, share: 0.5, reference: Vector3::z() };
        self.ring(section, &angles, Group::Hip, SEAM_REACH)
    }

    /// A limb: contours between its rim and the first across it, then across both links, then the end at the extremity.
    fn limb(&mut self, rim: &[u32], tube: &Tube, rim_group: Group, group: impl Fn(usize, f64) -> Group) {
        let places = &tube.chain.0[tube.link..tube.link + 3];
        let (first_link, second_link) = ((places[0], places[1]), (places[1], places[2]));
        let spacing = self.level.spacing();
        let length = |a: Place, b: Place| (self.bones.at(b) - self.bones.at(a)).norm();
        let (upper, lower) = (length(places[0], places[1]), length(places[1], places[2]));
        let is_clear =
            |share: &f64| self.clearance(tube.extremity, &tube.chain, tube.link + 1, *share) >= 0.6 * spacing;
        let end = lower * (0..=40).map(|k| 1.0 - 0.02 * f64::from(k)).find(is_clear).unwrap_or(0.5);
        let begin = tube.first * upper;
        let rows = ((upper - begin + end) / spacing).round().max(4.0) as usize;
        let mut contours = Vec::with_capacity(rows + 1);
        for row in 0..=rows {
            let along = begin + (upper + end - begin) * row as f64 / rows as f64;
            let (link, share) = if along < upper { (0, along / upper) } else { (1, (along - upper) / lower) };
            let link = tube.link + link;
            let section = Section { chain: tube.chain.clone(), link, share, reference: tube.reference };
            contours.push(self.ring(section, &tube.angles, group(link, share), tube.reach));
        }
        let count = (begin / (1.5 * spacing)).round().max(1.0) as usize;
        let between = self.between(2, (rim, &contours[0]), count, first_link, rim_group);
        let mut last = rim.to_vec();
        for contour in between.into_iter().chain(contours) {
            self.tube(&last, &contour);
            last = contour;
        }
        self.end(tube.extremity, &last, second_link, group(tube.link + 1, 1.0));
    }
}
