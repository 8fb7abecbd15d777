//! The kind of garment that new cloth is, and whether it is a single one, by the parts of the body that it covers.

use nalgebra::Vector3;
use toile_character::{GarmentType, Joint, joint::JOINTS};
use toile_geometry::bvh::Bvh;

use super::types::Labels;
use crate::{
    measure::{
        Measured,
        body_parts::{BodyPart, PART_COUNT, part_of},
    },
    take::DressedTake,
};

/// Cloth this near to the inner thigh follows it, metres.
const FOLLOWS: f32 = 0.06;
/// Body vertices whose normals lie within this angle (cosine) of the way to the other leg are the inner thighs.
const INNER: f32 = 0.8;
/// New cloth on this share of the inner thighs goes around each leg separately.
const LEGS_APART: f32 = 0.2;
/// Cloth that covers more than this share of the torso (legs, pelvis) is a garment for it.
const COVERS_TORSO: f32 = 0.35;
const COVERS_LEGS: f32 = 0.4;
const COVERS_PELVIS: f32 = 0.3;
/// A cap leaves face and neck free, a scarf reaches no higher than the chin; shoes leave at most the ankles free.
const COVERS_HEAD: f32 = 0.25;
const COVERS_FEET: f32 = 0.5;
/// Half the width of the strip along the middle of front and back where a garment may be open, metres.
const MIDDLE: f32 = 0.04;
/// Scan further than this from the body says nothing about the front, metres.
const NEAR_BODY: f32 = 0.1;
/// The front is open where the back is covered by more than this share, and the front by less than this share of that.
const BACK_COVERED: f32 = 0.6;

/// The type, from the covered parts, the cloth along the inner thighs and whether the front is open.
pub(super) fn guess_type(on: &Measured, labels: &Labels) -> GarmentType {
    let covered = covered_shares(on, |v| labels.garment[v]);
    let thighs = inner_thighs(on.take, labels);
    if on.take.is_first && covered[BodyPart::Torso as usize] > COVERS_TORSO && thighs > LEGS_APART {
        // all that a person wears, trousers and whatever is above them
        return GarmentType::Other;
    }
    fitting_type(&covered, thighs, front_is_open(on.take, labels))
}

/// True where one piece covers the torso and each leg separately, or where large pieces cover different parts: a pair of
/// socks covers the same parts twice, a shirt and a skirt do not.
pub(crate) fn looks_like_two(on: &Measured, labels: &Labels) -> bool {
    let all = covered_shares(on, |v| labels.garment[v]);
    let jumpsuit = all[BodyPart::Torso as usize] > COVERS_TORSO && inner_thighs(on.take, labels) > LEGS_APART;
    let (piece, areas) = on.graph.components(|v| labels.garment[v]);
    let main = |k: usize| {
        let shares = covered_shares(on, |v| piece[v] == k as u32);
        (0..PART_COUNT).max_by(|&a, &b| shares[a].total_cmp(&shares[b]))
    };
    let pieces: Vec<_> = (0..areas.len()).map(main).collect();
    jumpsuit || pieces.windows(2).any(|p| p[0] != p[1])
}

/// The type that fits a garment best, from the share of each body part's area that it covers, the share of the inner
/// thighs that it follows, and whether it is open in front.
fn fitting_type(covered: &[f32; PART_COUNT], inner_thighs: f32, open_in_front: bool) -> GarmentType {
    let c = |part: BodyPart| covered[part as usize];
    let covers_torso = c(BodyPart::Torso) > COVERS_TORSO;
    let covers_pelvis = c(BodyPart::Pelvis) > COVERS_PELVIS;
    match () {
        () if covers_torso && open_in_front => GarmentType::Jacket,
        () if covers_torso && c(BodyPart::UpperLeg) > COVERS_LEGS => GarmentType::Dress,
        () if covers_torso => GarmentType::Top,
        () if covers_pelvis && inner_thighs > LEGS_APART => GarmentType::Trousers,
        () if covers_pelvis => GarmentType::Skirt,
        () if c(BodyPart::Head) > COVERS_HEAD => GarmentType::Hat,
        () if c(BodyPart::Foot) > COVERS_FEET => GarmentType::Shoes,
        () => GarmentType::Other,
    }
}

/// Share of each body part's scanned area for which `new` holds.
fn covered_shares(on: &Measured, new: impl Fn(usize) -> bool) -> [f32; PART_COUNT] {
    let (mut covered, mut all) = ([0.0f32; PART_COUNT], [1e-6f32; PART_COUNT]);
    for (v, &area) in on.graph.areas.iter().enumerate() {
        for (k, share) in on.evidence.parts[v].iter().enumerate() {
            all[k] += share * area;
            covered[k] += if new(v) { share * area } else { 0.0 };
        }
    }
    std::array::from_fn(|k| covered[k] / all[k])
}

/// Share of the inner thighs that new cloth follows: trousers do, a skirt hangs around both legs.
fn inner_thighs(take: &DressedTake, labels: &Labels) -> f32 {
    let joints = take.pose.joint_positions(take.skeleton);
    let across = joints[Joint::RightUpperLeg.index()] - joints[Joint::LeftUpperLeg.index()];
    let across = across.cast::<f32>().try_normalize(1e-6).unwrap_or(-Vector3::x());
    let bvh = Bvh::new(&take.scan.positions, &take.scan.triangles);
    let normals = take.scan.triangle_normals();
    let (mut followed, mut inner) = (0, 0);
    for (v, n) in take.body.vertex_normals().iter().enumerate() {
        let side = match JOINTS.get(take.weights.joints[v][0] as usize) {
            Some(Joint::LeftUpperLeg) => 1.0,
            Some(Joint::RightUpperLeg) => -1.0,
            _ => continue,
        };
        if n.dot(&across) * side > INNER {
            inner += 1;
            let hit = bvh.ray(&take.body.positions[v], n, FOLLOWS).filter(|h| {
                let new = labels.garment[take.scan.triangles[h.triangle as usize][0] as usize];
                new && normals[h.triangle as usize].dot(n) > 0.0
            });
            followed += usize::from(hit.is_some());
        }
    }
    followed as f32 / inner.max(1) as f32
}

/// True where the middle of the back is covered much more than the middle of the front.
fn front_is_open(take: &DressedTake, labels: &Labels) -> bool {
    let scan_from_chest = take.pose.joint_frames(take.skeleton)[Joint::Chest.index()].cast::<f32>();
    let body = Bvh::new(&take.body.positions, &take.body.triangles);
    let normals = take.body.triangle_normals();
    let on_torso = |triangle: u32| {
        let joint = take.weights.joints[take.body.triangles[triangle as usize][0] as usize][0];
        JOINTS.get(joint as usize).is_some_and(|&j| part_of(j) == BodyPart::Torso)
    };
    let (mut front, mut back) = (Coverage::default(), Coverage::default());
    for (p, &is_new) in take.scan.positions.iter().zip(&labels.garment) {
        if scan_from_chest.inverse_transform_point(p).x.abs() > MIDDLE {
            continue;
        }
        let Some(hit) = body.closest(p, NEAR_BODY).filter(|hit| on_torso(hit.triangle)) else { continue };
        match (scan_from_chest.rotation.inverse() * normals[hit.triangle as usize]).z {
            z if z > 0.5 => front.count(is_new),
            z if z < -0.5 => back.count(is_new),
            _ => {}
        }
    }
    back.share() > BACK_COVERED && front.share() < BACK_COVERED * back.share()
}

/// Vertices on one side, and those of them that are new.
#[derive(Default)]
struct Coverage {
    new: f32,
    all: f32,
}

impl Coverage {
    fn count(&mut self, is_new: bool) {
        self.new += f32::from(u8::from(is_new));
        self.all += 1.0;
    }

    fn share(&self) -> f32 {
        self.new / self.all.max(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn guesses_follow_coverage() {
        use BodyPart::*;
        let covered = |pairs: &[(BodyPart, f32)]| {
            let mut c = [0.0; PART_COUNT];
            pairs.iter().for_each(|&(p, x)| c[p as usize] = x);
            c
        };
        let legs = covered(&[(Pelvis, 0.8), (UpperLeg, 1.0), (LowerLeg, 0.9)]);
        assert_eq!(fitting_type(&legs, 0.9, false), GarmentType::Trousers);
        assert_eq!(fitting_type(&legs, 0.02, false), GarmentType::Skirt);
        let torso = covered(&[(Torso, 0.9), (UpperArm, 0.6)]);
        assert_eq!(fitting_type(&torso, 0.0, false), GarmentType::Top);
        assert_eq!(fitting_type(&torso, 0.0, true), GarmentType::Jacket);
        assert_eq!(fitting_type(&covered(&[(Head, 0.5)]), 0.0, false), GarmentType::Hat);
        assert_eq!(fitting_type(&covered(&[(Foot, 0.9), (LowerLeg, 0.1)]), 0.0, false), GarmentType::Shoes);
        assert_eq!(fitting_type(&covered(&[(Head, 0.1), (Neck, 0.9)]), 0.0, false), GarmentType::Other);
    }
}
