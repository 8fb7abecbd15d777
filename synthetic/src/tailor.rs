//! How each kind of garment is cut for a person.

use nalgebra::{Point3, Vector3};
use toile_character::{BodyModel, Joint};

use crate::{
    person::Person,
    random::Random,
    settings::GarmentKind,
    tailoring::{Neckline, Plane, Tailoring},
};

/// Measures `person` for a garment; sizes vary a little with `random`.
pub(crate) fn tailor(kind: GarmentKind, model: &BodyModel, person: &Person, random: &mut Random) -> Tailoring {
    let measure = Measure { model, person };
    let vary = random.range(-1.0, 1.0) as f32;
    match kind {
        GarmentKind::Trousers => measure.bottoms(0.93 + 0.01 * vary, 0.010, 0.025),
        GarmentKind::Shorts => measure.bottoms(0.42 + 0.03 * vary, 0.011, 0.05),
        GarmentKind::Skirt => measure.skirt(0.9 + 0.06 * vary),
        GarmentKind::Tshirt => measure.top(0.38 + 0.02 * vary, 0.05, 0.010, 0.6),
        GarmentKind::Blouse => measure.top(0.86 + 0.02 * vary, 0.03, 0.010, 0.6),
        GarmentKind::Jumper => measure.top(0.92, 0.045, 0.013, 0.8),
        GarmentKind::Jacket => measure.open_top(0.93, 0.07, 0.014),
        GarmentKind::Coat => measure.coat(0.94),
        GarmentKind::Dress => measure.dress(0.22 + 0.03 * vary),
        GarmentKind::Scarf => measure.scarf(),
        GarmentKind::Hat => measure.hat(),
    }
}

/// A person being measured.
struct Measure<'a> {
    model: &'a BodyModel,
    person: &'a Person,
}

impl Measure<'_> {
    fn joint(&self, joint: Joint) -> Point3<f32> {
        self.person.body.skeleton.position(joint).cast()
    }

    fn landmark(&self, name: &str) -> Point3<f32> {
        self.model.landmark(name).map_or_else(Point3::origin, |v| self.person.body.mesh.positions[v as usize])
    }

    /// A plane across a limb of two bones at a share of its length, pointing outwards along it, and its mirror image.
    fn across(&self, joints: [Joint; 3], share: f32) -> [Plane; 2] {
        let [a, b, c] = joints.map(|j| self.joint(j));
        let (upper, lower) = ((b - a).norm(), (c - b).norm());
        let at = share * (upper + lower);
        let (start, end, rest) = if at <= upper { (a, b, at) } else { (b, c, at - upper) };
        let normal = (end - start).try_normalize(1e-6).unwrap_or(-Vector3::y());
        let plane = Plane { point: start + normal * rest, normal };
        [plane, plane.mirrored()]
    }

    fn legs(&self, share: f32) -> [Plane; 2] {
        self.across([Joint::LeftUpperLeg, Joint::LeftLowerLeg, Joint::LeftFoot], share)
    }

    fn sleeves(&self, share: f32) -> [Plane; 2] {
        self.across([Joint::LeftUpperArm, Joint::LeftLowerArm, Joint::LeftHand], share)
    }

    /// A little lower in front than behind, as waistbands sit.
    fn waistband(&self) -> Plane {
        let crotch = self.landmark("crotch").y;
        let y = crotch + 0.88 * (self.landmark("navel").y - crotch);
        let normal = Vector3::new(0.0, 1.0, 0.12).normalize();
        Plane { point: Point3::new(0.0, y, 0.0), normal }
    }

    /// A round neckline `wide` metres off the root of the neck.
    fn neckline(&self, wide: f32) -> Neckline {
        let (nape, throat) = (self.landmark("cervicale"), self.landmark("suprasternale"));
        let forward = (throat - nape).try_normalize(1e-6).unwrap_or(Vector3::z()) * (0.6 * wide);
        let center = nalgebra::center(&nape, &throat) + forward;
        let highest = (nape.y + 0.03).min(self.landmark("chin").y - 0.025);
        Neckline { center, radius: 0.5 * (nape - throat).norm() + wide, highest }
    }

    fn bottoms(&self, leg_share: f32, ease: f32, flare: f32) -> Tailoring {
        let waist = self.waistband();
        let knee = self.joint(Joint::LeftLowerLeg).y;
        Tailoring {
            ends: vec![waist],
            neckline: None,
            within: None,
            legs: Some(self.legs(leg_share)),
            sleeves: None,
            opening: None,
            ease,
            drape: 0.0,
            drape_from: self.landmark("crotch").y,
            flare,
            pleats: 0.0,
            lower_end: knee,
            creases: 0.005,
            crease_length: Vector3::new(0.09, 0.06, 0.09),
        }
    }

    fn skirt(&self, thigh_share: f32) -> Tailoring {
        let waist = self.waistband();
        let (hip, knee) = (self.joint(Joint::LeftUpperLeg).y, self.joint(Joint::LeftLowerLeg).y);
        let lower_end = hip + thigh_share * (knee - hip);
        Tailoring {
            ends: vec![waist, level(lower_end, false)],
            neckline: None,
            within: None,
            legs: None,
            sleeves: None,
            opening: None,
            ease: 0.008,
            drape: 1.0,
            drape_from: waist.point.y,
            flare: 0.07,
            pleats: 0.014,
            lower_end,
            creases: 0.003,
            crease_length: Vector3::new(0.08, 0.2, 0.08),
        }
    }

    /// A closed top whose sleeves cover `sleeve_share` of the arm and which ends `below` metres under the hip joints.
    fn top(&self, sleeve_share: f32, below: f32, ease: f32, drape: f32) -> Tailoring {
        let hip = self.joint(Joint::LeftUpperLeg).y;
        let lower_end = hip + 0.05 - below;
        Tailoring {
            ends: vec![level(lower_end, false)],
            neckline: Some(self.neckline(0.026)),
            within: None,
            legs: None,
            sleeves: Some(self.sleeves(sleeve_share)),
            opening: None,
            ease,
            drape,
            drape_from: self.landmark("leftNipple").y,
            flare: 0.02,
            pleats: 0.0,
            lower_end,
            creases: 0.006,
            crease_length: Vector3::new(0.10, 0.07, 0.10),
        }
    }

    fn open_top(&self, sleeve_share: f32, below: f32, ease: f32) -> Tailoring {
        let front = self.joint(Joint::Chest).z;
        let closed = self.top(sleeve_share, below, ease, 0.9);
        Tailoring { neckline: Some(self.neckline(0.045)), opening: Some((0.05, front)), ..closed }
    }

    fn coat(&self, sleeve_share: f32) -> Tailoring {
        let (hip, knee) = (self.joint(Joint::LeftUpperLeg).y, self.joint(Joint::LeftLowerLeg).y);
        let lower_end = knee + 0.15 * (hip - knee);
        let jacket = self.open_top(sleeve_share, 0.0, 0.015);
        let ends = vec![level(lower_end, false)];
        Tailoring { ends, drape: 1.0, flare: 0.05, lower_end, opening: Some((0.03, 0.0)), ..jacket }
    }

    /// A top with short sleeves and a skirt in one.
    fn dress(&self, sleeve_share: f32) -> Tailoring {
        let (hip, knee) = (self.joint(Joint::LeftUpperLeg).y, self.joint(Joint::LeftLowerLeg).y);
        let lower_end = knee + 0.1 * (hip - knee);
        let top = self.top(sleeve_share, 0.0, 0.009, 0.7);
        Tailoring { ends: vec![level(lower_end, false)], flare: 0.06, pleats: 0.01, lower_end, ..top }
    }

    /// A ring around the neck, wide enough to lie on the shoulders.
    fn scarf(&self) -> Tailoring {
        let (nape, throat) = (self.landmark("cervicale"), self.landmark("suprasternale"));
        let center = nalgebra::center(&nape, &throat);
        let lower_end = throat.y - 0.03;
        let highest = self.landmark("chin").y - 0.01;
        let jumper = self.top(0.0, 0.0, 0.016, 0.0);
        Tailoring {
            ends: vec![level(lower_end, false), level(highest, true)],
            neckline: None,
            sleeves: None,
            within: Some((center, 0.13)),
            flare: 0.0,
            lower_end,
            creases: 0.008,
            crease_length: Vector3::new(0.07, 0.03, 0.07),
            ..jumper
        }
    }

    /// A cap down to the brows.
    fn hat(&self) -> Tailoring {
        let chin = self.landmark("chin").y;
        let lower_end = chin + 0.62 * (self.landmark("vertex").y - chin);
        let scarf = self.scarf();
        Tailoring { ends: vec![level(lower_end, false)], within: None, ease: 0.010, creases: 0.003, lower_end, ..scarf }
    }
}

fn level(y: f32, up: bool) -> Plane {
    let normal = if up { Vector3::y() } else { -Vector3::y() };
    Plane { point: Point3::new(0.0, y, 0.0), normal }
}
