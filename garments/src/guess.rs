//! What kind of garment new cloth is, and whether it is one: by the parts of the body that it covers.

use nalgebra::Vector3;
use toile_character::{Joint, joint::JOINTS};
use toile_geometry::bvh::Bvh;

use crate::{
    GarmentType,
    body_parts::{BodyPart, PART_COUNT, part_of},
    evidence::Evidence,
    extract::Take,
    labels::Labels,
    scan_graph::ScanGraph,
};

/// Cloth this near to the inner thigh follows it, metres.
const FOLLOWS: f32 = 0.06;
/// New cloth on this share of the inner thighs goes around each leg by itself.
pub(crate) const LEGS_APART: f32 = 0.2;

/// Type from what is covered, what follows the inner thighs and whether the front is open.
pub(crate) fn guess_type(take: &Take, graph: &ScanGraph, evidence: &Evidence, labels: &Labels) -> GarmentType {
    let shares = covered_shares(graph, evidence, |v| labels.garment[v]);
    GarmentType::guess(&shares, inner_thighs(take, labels), front_is_open(take, labels))
}

/// True where one piece covers torso and each leg by itself, or where large pieces cover different parts: a pair of
/// socks covers the same parts twice, a shirt and a skirt do not.
pub(crate) fn looks_like_two(take: &Take, graph: &ScanGraph, evidence: &Evidence, labels: &Labels) -> bool {
    let covers = |shares: &[f32; PART_COUNT], part: BodyPart| shares[part as usize] > 0.35;
    let all = covered_shares(graph, evidence, |v| labels.garment[v]);
    let jumpsuit = covers(&all, BodyPart::Torso) && inner_thighs(take, labels) > LEGS_APART;
    let (piece, areas) = graph.components(|v| labels.garment[v]);
    let main = |k: usize| {
        let shares = covered_shares(graph, evidence, |v| piece[v] == k as u32);
        (0..PART_COUNT).max_by(|&a, &b| shares[a].total_cmp(&shares[b]))
    };
    let pieces: Vec<_> = (0..areas.len()).map(main).collect();
    jumpsuit || pieces.windows(2).any(|p| p[0] != p[1])
}

/// Share of each body part's scanned area for which `new` holds.
fn covered_shares(graph: &ScanGraph, evidence: &Evidence, new: impl Fn(usize) -> bool) -> [f32; PART_COUNT] {
    let (mut covered, mut all) = ([0.0f32; PART_COUNT], [1e-6f32; PART_COUNT]);
    for v in 0..graph.len() {
        for (k, share) in evidence.parts[v].iter().enumerate() {
            all[k] += share * graph.areas[v];
            covered[k] += if new(v) { share * graph.areas[v] } else { 0.0 };
        }
    }
    std::array::from_fn(|k| covered[k] / all[k])
}

/// Share of the inner thighs that new cloth follows: trousers do, a skirt hangs around both legs.
fn inner_thighs(take: &Take, labels: &Labels) -> f32 {
    let joints = take.pose.joint_positions(take.skeleton);
    let across = joints[Joint::RightUpperLeg.index()] - joints[Joint::LeftUpperLeg.index()];
    let across = across.cast::<f32>().try_normalize(1e-6).unwrap_or(-Vector3::x());
    let bvh = Bvh::new(&take.scan.positions, &take.scan.triangles);
    let normals = take.scan.triangle_normals();
    let body_normals = take.body.vertex_normals();
    let (mut followed, mut inner) = (0, 0);
    for (v, n) in body_normals.iter().enumerate() {
        let side = match JOINTS.get(take.weights.joints[v][0] as usize) {
            Some(Joint::LeftUpperLeg) => 1.0,
            Some(Joint::RightUpperLeg) => -1.0,
            _ => continue,
        };
        if n.dot(&across) * side > 0.8 {
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
fn front_is_open(take: &Take, labels: &Labels) -> bool {
    let frame = take.pose.joint_frames(take.skeleton)[Joint::Chest.index()].cast::<f32>();
    let (mut front, mut back) = ([0.0f32; 2], [0.0f32; 2]);
    let body = Bvh::new(&take.body.positions, &take.body.triangles);
    let normals = take.body.triangle_normals();
    for (v, p) in take.scan.positions.iter().enumerate() {
        let local = frame.inverse_transform_point(p);
        if local.x.abs() > 0.04 {
            continue;
        }
        let Some(hit) = body.closest(p, 0.1) else { continue };
        let joint = take.weights.joints[take.body.triangles[hit.triangle as usize][0] as usize][0];
        if JOINTS.get(joint as usize).is_none_or(|&j| part_of(j) != BodyPart::Torso) {
            continue;
        }
        let facing = (frame.rotation.inverse() * normals[hit.triangle as usize]).z;
        let side = if facing > 0.5 { &mut front } else { &mut back };
        if facing.abs() > 0.5 {
            side[0] += f32::from(u8::from(labels.garment[v]));
            side[1] += 1.0;
        }
    }
    let share = |s: [f32; 2]| s[0] / s[1].max(1.0);
    share(back) > 0.6 && share(front) < 0.6 * share(back)
}
