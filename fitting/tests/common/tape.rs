//! Tapes by brute force: another way to the same lengths, for comparison with the library's.
//!
//! The length of a taut tape around points of a plane is the integral of their support function over all directions
//! (Cauchy's formula). Parts of the body are distinguished by skin weights, not by the template's regions.

use std::f64::consts::TAU;

use nalgebra::{Point3, Vector3};
use toile_character::{BodyModel, Joint, SkinnedMesh};
use toile_fitting::MeasureTable;

/// Directions in which the support function is taken.
const DIRECTIONS: u32 = 720;

/// A standing body that is measured by brute force.
pub struct BruteForce<'a> {
    pub model: &'a BodyModel,
    pub body: &'a SkinnedMesh,
    pub table: &'a MeasureTable,
}

/// Which vertices a tape may touch.
pub type Keep = Vec<bool>;

impl BruteForce<'_> {
    /// A landmark of the table.
    pub fn landmark(&self, name: &str) -> Point3<f64> {
        let found = self.table.landmarks.iter().find(|l| l.name == name);
        found.unwrap_or_else(|| panic!("no landmark {name}")).position.into()
    }

    fn share(&self, v: usize, of: impl Fn(Joint) -> bool) -> f32 {
        let joints = self.model.weights.of(v);
        joints.filter(|(j, _)| Joint::from_index(usize::from(*j)).is_some_and(&of)).map(|(_, w)| w).sum()
    }

    /// The part that moves less with the arms and the head than with the rest.
    pub fn without_arms(&self) -> Keep {
        let is_arm = |j: Joint| is_in(j, Joint::LeftUpperArm) || is_in(j, Joint::RightUpperArm);
        (0..self.model.vertex_count()).map(|v| self.share(v, is_arm) < 0.5).collect()
    }

    /// The part that moves more with one leg than with the other.
    pub fn leg(&self, side: &str) -> Keep {
        let (own, other) = match side {
            "left" => (Joint::LeftUpperLeg, Joint::RightUpperLeg),
            _ => (Joint::RightUpperLeg, Joint::LeftUpperLeg),
        };
        let more = |v| self.share(v, |j| is_in(j, own)) > self.share(v, |j| is_in(j, other));
        (0..self.model.vertex_count()).map(more).collect()
    }

    /// The part that moves mostly with one arm.
    pub fn arm(&self, side: &str) -> Keep {
        let upper = if side == "left" { Joint::LeftUpperArm } else { Joint::RightUpperArm };
        (0..self.model.vertex_count()).map(|v| self.share(v, |j| is_in(j, upper)) >= 0.5).collect()
    }

    /// Points in which a plane cuts what is kept.
    fn cut(&self, keep: &Keep, point: &Point3<f64>, normal: &Vector3<f64>) -> Vec<Point3<f64>> {
        let mesh = &self.table.standing;
        let mut points = Vec::new();
        for t in mesh.triangles.iter().filter(|t| t.iter().all(|&v| keep[v as usize])) {
            let corners = t.map(|v| mesh.positions[v as usize].cast::<f64>());
            for k in 0..3 {
                let (a, b) = (corners[k], corners[(k + 1) % 3]);
                let (h, g) = ((a - point).dot(normal), (b - point).dot(normal));
                if (h < 0.0) != (g < 0.0) {
                    points.push(a + (b - a) * (h / (h - g)));
                }
            }
        }
        points
    }

    /// Length of the tape around what is kept in a plane.
    pub fn girth(&self, keep: &Keep, point: &Point3<f64>, normal: &Vector3<f64>) -> f64 {
        let points = self.cut(keep, point, normal);
        let u = normal.cross(&if normal.y.abs() < 0.9 { Vector3::y() } else { Vector3::x() }).normalize();
        let v = normal.cross(&u);
        let support = |k: u32| {
            let (sin, cos) = (TAU * f64::from(k) / f64::from(DIRECTIONS)).sin_cos();
            let direction = u * cos + v * sin;
            points.iter().map(|p| (p - point).dot(&direction)).fold(f64::NEG_INFINITY, f64::max)
        };
        (0..DIRECTIONS).map(support).sum::<f64>() * TAU / f64::from(DIRECTIONS)
    }

    /// Length of the tape at a level.
    pub fn level(&self, keep: &Keep, y: f64) -> f64 {
        self.girth(keep, &Point3::new(0.0, y, 0.0), &Vector3::y())
    }

    /// The kept vertex between two heights that scores highest.
    pub fn extreme(&self, keep: &Keep, range: (f64, f64), score: impl Fn(&Point3<f64>) -> f64) -> Point3<f64> {
        let positions = self.table.standing.positions.iter().map(|p| p.cast::<f64>());
        let kept = positions.zip(keep).filter(|(p, k)| **k && p.y > range.0 && p.y < range.1).map(|(p, _)| p);
        kept.max_by(|a, b| score(a).total_cmp(&score(b))).expect("there are vertices between the two heights")
    }
}

/// True where `joint` hangs on `root`, or is it.
fn is_in(joint: Joint, root: Joint) -> bool {
    let mut at = Some(joint);
    while let Some(j) = at {
        if j == root {
            return true;
        }
        at = j.parent();
    }
    false
}

/// Every girth of a table that brute force can take, with its own length, metres.
pub fn girths(model: &BodyModel, body: &SkinnedMesh, table: &MeasureTable) -> Vec<(String, f64)> {
    let brute = BruteForce { model, body, table };
    let mut out = trunk(&brute);
    for side in ["left", "right"] {
        out.extend(leg(&brute, side).map(|(name, girth)| (format!("{side} {name}"), girth)));
        out.extend(arm(&brute, side).map(|(name, girth)| (format!("{side} {name}"), girth)));
    }
    out
}

fn trunk(brute: &BruteForce) -> Vec<(String, f64)> {
    let keep = brute.without_arms();
    let both = |name: &str| {
        nalgebra::center(&brute.landmark(&format!("left {name}")), &brute.landmark(&format!("right {name}")))
    };
    let waist = 0.5 * (both("lowest rib point").y + both("highest point of the hip bone").y);
    let height = |name: &str| brute.table.value(name).expect("the level was found");
    let (bust, hip) = (height("bust height"), height("hip height"));
    let armpit = brute.landmark("left armpit point").y.min(brute.landmark("right armpit point").y) - 0.02;
    let chest = (0..200).map(|k| brute.level(&keep, bust + (armpit - bust) * f64::from(k) / 199.0)).fold(0.0, f64::max);
    [
        ("chest girth", chest),
        ("bust girth", brute.level(&keep, bust)),
        ("waist girth", brute.level(&keep, waist)),
        ("top hip girth", brute.level(&keep, 0.5 * (waist + hip))),
        ("hip girth", brute.level(&keep, hip)),
    ]
    .map(|(name, girth)| (name.to_string(), girth))
    .into()
}

/// How much farther back the rearmost vertex near the buttocks is than the trunk at the table's hip level, and how much
/// farther forward the foremost vertex near the nipples is than the table's bust points, metres.
pub fn prominence_given_up(model: &BodyModel, body: &SkinnedMesh, table: &MeasureTable) -> [f64; 2] {
    let brute = BruteForce { model, body, table };
    let keep = brute.without_arms();
    let (crotch, hip) = (brute.landmark("crotch point").y, table.value("hip height").expect("the hip was found"));
    let bone = brute.landmark("left highest point of the hip bone").y;
    let rearmost = -brute.extreme(&keep, (crotch, bone), |p| -p.z).z;
    let at_level = |y: f64, score: &dyn Fn(&Point3<f64>) -> f64| {
        let points = brute.cut(&keep, &Point3::new(0.0, y, 0.0), &Vector3::y());
        points.iter().map(score).fold(f64::NEG_INFINITY, f64::max)
    };
    let nipple = brute.landmark("left nipple");
    let bust = table.value("bust height").expect("the bust was found");
    let before = |p: &Point3<f64>| if (p.x - nipple.x).abs() < 0.04 { p.z } else { f64::NEG_INFINITY };
    let foremost = before(&brute.extreme(&keep, (nipple.y - 0.03, nipple.y + 0.03), before));
    [rearmost - at_level(hip, &|p| -p.z), foremost - at_level(bust, &before)]
}

fn leg(brute: &BruteForce, side: &str) -> [(&'static str, f64); 5] {
    let keep = brute.leg(side);
    let (crotch, knee) = (brute.landmark("crotch point").y, brute.landmark(&format!("{side} knee point")).y);
    let ankle = brute.landmark(&format!("{side} ankle point")).y;
    let thigh = |t: f64| brute.level(&keep, crotch + t * (knee - crotch));
    let shank = |t: f64| brute.level(&keep, knee + t * (ankle - knee));
    let along = |from: f64, to: f64| (0..100).map(move |k| from + (to - from) * f64::from(k) / 99.0);
    [
        ("thigh girth", along(0.03, 0.18).map(thigh).fold(0.0, f64::max)),
        ("mid-thigh girth", thigh(0.5)),
        ("knee girth", shank(0.0)),
        ("calf girth", along(0.1, 0.6).map(shank).fold(0.0, f64::max)),
        ("ankle girth", along(0.7, 0.97).map(shank).fold(f64::MAX, f64::min)),
    ]
}

fn arm(brute: &BruteForce, side: &str) -> [(&'static str, f64); 2] {
    let keep = brute.arm(side);
    let at = |name: &str| brute.landmark(&format!("{side} {name}"));
    let joint = |name: &str| {
        Joint::from_name(&format!("{side}{name}"))
            .map(|j| brute.body.skeleton.position(j))
            .expect("the joint has this name")
    };
    let (upper, lower) = (joint("LowerArm") - joint("UpperArm"), joint("Hand") - joint("LowerArm"));
    let middle = nalgebra::center(&at("shoulder point"), &at("elbow point"));
    [
        ("upper arm girth", brute.girth(&keep, &middle, &upper.normalize())),
        ("wrist girth", brute.girth(&keep, &at("wrist point"), &lower.normalize())),
    ]
}
