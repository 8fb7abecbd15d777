//! Capsules in the hips, thighs and shins, fitted to the body's skin.

use nalgebra::{Point3, Vector3};
use toile_character::{Joint, SpringCollider};
use toile_geometry::statistics::quantile;

use super::layer::RestedLayer;

/// Places down a bone between which capsules lie, as shares of its length: two ends share one radius, and a thigh tapers from 90 to 55 mm.
const STATIONS: [f64; 4] = [0.1, 0.4, 0.7, 1.0];
/// Skin within this share of the bone's length of a station says how thick the bone is there.
const NEAR: f64 = 0.1;
/// Share of the skin's vertices at a station that a capsule holds: a leg is no circle, and cloth lies on its bulges.
const HELD: f64 = 0.8;
/// Fewest vertices that say how thick a bone is.
const FEWEST: usize = 6;

/// Capsules in the `body`'s hips and thighs, and in its shins where cloth comes down to the height `low`.
pub(super) fn fit(joints: &[Point3<f64>], body: &RestedLayer<'_>, low: f64) -> Vec<SpringCollider> {
    use Joint::*;
    let legs = [[LeftUpperLeg, LeftLowerLeg, LeftFoot], [RightUpperLeg, RightLowerLeg, RightFoot]];
    let mut capsules: Vec<SpringCollider> = hips(joints, body).into_iter().collect();
    for [upper, lower, foot] in legs {
        for (bone, end) in [(upper, lower), (lower, foot)] {
            let [from, to] = [bone, end].map(|j| joints[j.index()]);
            // A knee that rises lifts the shin: its upper half comes as far up as the thigh is long.
            if bone == upper || low < from.y + 0.5 * (from.y - to.y) {
                let skin = skin_of(body, &[upper, lower]);
                capsules.extend(of_bone(bone, from, to, &skin));
            }
        }
    }
    capsules
}

/// Vertices that one of `joints` moves most.
fn skin_of(body: &RestedLayer<'_>, joints: &[Joint]) -> Vec<Point3<f64>> {
    let most = |v: usize| usize::from(body.weights.joints[v][0]);
    let is_of = |v: &usize| joints.iter().any(|j| j.index() == most(*v));
    (0..body.weights.len()).filter(is_of).map(|v| body.mesh.positions[v].cast()).collect()
}

/// Capsules down the bone `joint`.
fn of_bone(joint: Joint, from: Point3<f64>, to: Point3<f64>, skin: &[Point3<f64>]) -> Vec<SpringCollider> {
    let axis = to - from;
    let rings: Vec<(Point3<f64>, f64)> = STATIONS.iter().filter_map(|&s| ring(from, axis, s, skin)).collect();
    rings
        .windows(2)
        .map(|pair| SpringCollider { joint, ends: [pair[0].0, pair[1].0], radius: pair[0].1.max(pair[1].1) })
        .collect()
}

/// Centre and radius of the skin around the bone at a `station`.
fn ring(from: Point3<f64>, axis: Vector3<f64>, station: f64, skin: &[Point3<f64>]) -> Option<(Point3<f64>, f64)> {
    let along = |p: &Point3<f64>| (p - from).dot(&axis) / axis.norm_squared();
    let near: Vec<Point3<f64>> = skin.iter().filter(|p| (along(p) - station).abs() < NEAR).copied().collect();
    if near.len() < FEWEST {
        return None;
    }
    let across: Vec<Vector3<f64>> = near.iter().map(|p| p - (from + axis * along(p))).collect();
    let low = across.iter().fold(Vector3::repeat(f64::MAX), |low, a| low.inf(a));
    let high = across.iter().fold(Vector3::repeat(f64::MIN), |high, a| high.sup(a));
    let middle = (low + high) * 0.5;
    let mut radii: Vec<f64> = across.iter().map(|a| (a - middle).norm()).collect();
    Some((from + axis * station + middle, quantile(&mut radii, HELD)?))
}

/// One capsule across the hips, from one hip's joint to the other.
fn hips(joints: &[Point3<f64>], body: &RestedLayer<'_>) -> Option<SpringCollider> {
    let [left, right] = [Joint::LeftUpperLeg, Joint::RightUpperLeg].map(|j| joints[j.index()]);
    let skin = skin_of(body, &[Joint::Hips, Joint::LeftUpperLeg, Joint::RightUpperLeg]);
    // What lies in front of and behind the joints, at their height.
    let (center, radius) =
        ring(left, right - left, 0.5, &skin.into_iter().filter(|p| (p.y - left.y).abs() < 0.05).collect::<Vec<_>>())?;
    let shift = Vector3::new(0.0, 0.0, center.z - nalgebra::center(&left, &right).z);
    Some(SpringCollider { joint: Joint::Hips, ends: [left + shift, right + shift], radius })
}
