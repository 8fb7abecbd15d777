//! Vertices in an order in which the same joints move many at once: prepared once, so that a frame gathers nothing.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};
use toile_geometry::lanes::floats::LANES;

use crate::{
    joint::{JOINT_COUNT, Joint},
    skin::{INFLUENCES, SkinWeights},
};

/// The same values of sixteen vertices.
pub(super) type Row = [f32; LANES];

/// Vertices that the same joints move.
#[derive(Debug, Clone)]
pub(super) struct Group {
    /// The joints: first the one that logarithms are relative to, then the others in ascending order; `count` of them.
    pub joints: [u8; INFLUENCES],
    /// How many joints.
    pub count: usize,
    /// For each joint but the first, which pair (reference, joint) it is.
    pub pairs: [u16; INFLUENCES],
    /// Its blocks.
    pub blocks: std::ops::Range<usize>,
}

/// Sixteen vertices of a group. Where it has fewer, the last one is repeated.
#[derive(Debug, Clone)]
pub(super) struct Block {
    /// Rest positions, by axis.
    pub positions: [Row; 3],
    /// Unit rest normals, by axis; zero where a vertex has none.
    pub normals: [Row; 3],
    /// Weights, in the order of the group's joints.
    pub weights: [Row; INFLUENCES],
    /// Which vertices they are.
    pub vertices: [u32; LANES],
}

/// A mesh prepared for skinning.
#[derive(Debug, Clone, Default)]
pub(super) struct Groups {
    /// In ascending order of joints.
    pub groups: Vec<Group>,
    /// All blocks, group by group.
    pub blocks: Vec<Block>,
    /// The pairs of joints whose relative motion is needed: (reference, other).
    pub pairs: Vec<[u8; 2]>,
}

impl Groups {
    /// Sorts vertices by the joints that move them. All slices are of one length.
    pub fn new(positions: &[Point3<f32>], normals: &[Vector3<f32>], weights: &SkinWeights) -> Self {
        let mut members: BTreeMap<Vec<u8>, Vec<u32>> = BTreeMap::new();
        for v in 0..positions.len() {
            let mut joints: Vec<u8> = weights.of(v).map(|i| i.0).collect();
            joints.sort_unstable();
            joints.dedup();
            if joints.is_empty() {
                joints.push(0);
            }
            members.entry(joints).or_default().push(v as u32);
        }
        let mut sorted = Self::default();
        let mut pairs = BTreeMap::new();
        for (joints, vertices) in members {
            let first = sorted.blocks.len();
            let mut group = sorted.group(&joints, &mut pairs);
            let block = |chunk: &[u32]| Block::new(chunk, &group, positions, normals, weights);
            sorted.blocks.extend(vertices.chunks(LANES).map(block));
            group.blocks = first..sorted.blocks.len();
            sorted.groups.push(group);
        }
        sorted
    }

    fn group(&mut self, joints: &[u8], known: &mut BTreeMap<[u8; 2], u16>) -> Group {
        let reference = reference(joints);
        let mut group = Group { joints: [0; INFLUENCES], count: joints.len(), pairs: [0; INFLUENCES], blocks: 0..0 };
        group.joints[0] = reference;
        let others = joints.iter().copied().filter(|&j| j != reference);
        for (slot, joint) in (1..).zip(others) {
            group.joints[slot] = joint;
            group.pairs[slot] = *known.entry([reference, joint]).or_insert_with(|| {
                self.pairs.push([reference, joint]);
                (self.pairs.len() - 1) as u16
            });
        }
        group
    }
}

impl Block {
    fn new(
        chunk: &[u32],
        group: &Group,
        positions: &[Point3<f32>],
        normals: &[Vector3<f32>],
        weights: &SkinWeights,
    ) -> Self {
        let mut block = Self {
            positions: [[0.0; LANES]; 3],
            normals: [[0.0; LANES]; 3],
            weights: [[0.0; LANES]; INFLUENCES],
            vertices: [0; LANES],
        };
        for lane in 0..LANES {
            let vertex = chunk[lane.min(chunk.len() - 1)];
            let v = vertex as usize;
            block.vertices[lane] = vertex;
            let unit = normals[v].cast::<f64>().try_normalize(1e-12).unwrap_or_default().cast::<f32>();
            for axis in 0..3 {
                block.positions[axis][lane] = positions[v][axis];
                block.normals[axis][lane] = unit[axis];
            }
            let sum: f64 = weights.of(v).map(|i| f64::from(i.1)).sum();
            if sum <= 0.0 {
                block.weights[0][lane] = 1.0;
            }
            for (joint, weight) in weights.of(v) {
                let slot = group.joints[..group.count].iter().position(|&j| j == joint).unwrap_or(0);
                block.weights[slot][lane] += (f64::from(weight) / sum) as f32;
            }
        }
        block
    }
}

/// The joint in the middle of `joints` (ascending, one at least): the one with the fewest bones to all others; of equal ones the first.
///
/// Neighbouring vertices whose sets of joints differ by one that fades in share it in a chain of joints, and with two joints it
/// makes no difference: so the surface has no step where it changes. And what is relative to it has turned less
/// than the ends of a chain have to each other.
fn reference(joints: &[u8]) -> u8 {
    let bones = |from: u8| -> usize { joints.iter().map(|&to| distance(from, to)).sum() };
    joints.iter().copied().min_by_key(|&j| bones(j)).unwrap_or(0)
}

/// Number of bones between two joints.
fn distance(a: u8, b: u8) -> usize {
    let (a, b) = (to_root(a), to_root(b));
    let shared = a.iter().rev().zip(b.iter().rev()).take_while(|(a, b)| a == b).count();
    a.len() + b.len() - 2 * shared
}

/// A joint and those above it; what is beyond the skeleton's joints hangs on the hips.
fn to_root(joint: u8) -> Vec<usize> {
    let mut path = Vec::new();
    let mut at = Joint::from_index(usize::from(joint));
    if usize::from(joint) >= JOINT_COUNT {
        path.push(usize::from(joint));
        at = Some(Joint::Hips);
    }
    while let Some(joint) = at {
        path.push(joint.index());
        at = joint.parent();
    }
    path
}

#[cfg(test)]
mod tests {
    use super::*;

    fn indices<const N: usize>(joints: [Joint; N]) -> [u8; N] {
        let mut indices = joints.map(|j| j.index() as u8);
        indices.sort_unstable();
        indices
    }

    #[test]
    fn the_middle_joint_is_the_reference() {
        use Joint::{Hips, LeftHand, LeftLowerArm, LeftLowerLeg, LeftUpperArm, LeftUpperLeg, RightUpperLeg, Spine};
        let of = |joints: &[u8]| Joint::from_index(usize::from(reference(joints))).unwrap();
        assert_eq!(of(&indices([LeftUpperArm, LeftLowerArm, LeftHand])), LeftLowerArm);
        assert_eq!(of(&indices([Hips, Spine, LeftUpperLeg, RightUpperLeg])), Hips);
        assert_eq!(of(&indices([Hips, LeftUpperLeg, LeftLowerLeg])), LeftUpperLeg);
        assert_eq!(distance(LeftUpperLeg.index() as u8, 60), 2, "helper joints hang on the hips");
    }

    #[test]
    fn every_vertex_is_in_one_group_with_its_own_weights() {
        let mut weights = SkinWeights::default();
        for v in 0..100u8 {
            weights.push(&[(v % 3, 0.7), (v % 5, 0.2), (7, if v < 50 { 0.1 } else { 0.0 })]);
        }
        let positions: Vec<Point3<f32>> = (0..100).map(|v| Point3::new(v as f32, 0.0, 0.0)).collect();
        let groups = Groups::new(&positions, &vec![Vector3::y(); 100], &weights);
        let mut seen = [false; 100];
        for group in &groups.groups {
            for (block, lane) in
                groups.blocks[group.blocks.clone()].iter().flat_map(|b| (0..LANES).map(move |l| (b, l)))
            {
                let v = block.vertices[lane] as usize;
                seen[v] = true;
                assert_eq!(block.positions[0][lane], v as f32);
                for (joint, weight) in weights.of(v) {
                    let slot = group.joints[..group.count].iter().position(|&j| j == joint).unwrap();
                    assert!((block.weights[slot][lane] - weight).abs() < 1e-6);
                }
                for slot in 1..group.count {
                    let pair = groups.pairs[usize::from(group.pairs[slot])];
                    assert_eq!(pair, [group.joints[0], group.joints[slot]]);
                }
            }
        }
        assert_eq!(seen, [true; 100]);
    }
}
