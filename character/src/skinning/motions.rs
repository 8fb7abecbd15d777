//! What the joints do in one frame, as the kernels need it.

use nalgebra::Isometry3;

use super::{
    groups::{Group, Groups},
    twist::Twist,
    way::Skinning,
};

/// Hybrid skinning: the smallest scalar product between the axes of two joints, one axis of one with the same axis of the other, that
/// counts as agreement.
///
/// Halfway between two joints that are turned by α to each other, linear blending keeps cos(α/2) of the distance from the axis of
/// that turn. It may lose one part in 1000 (0.05 mm at a forearm's radius, 0.15 mm at a trunk's: less than any depth
/// sensor resolves): cos α ≥ 0.996. A turn by α lowers the smallest of the three products by at least two thirds of
/// 1 − cos α, whatever its axis: 1 − ⅔ · 0.004.
const AGREEMENT: f64 = 0.9973;

/// The upper three rows of a transform's matrix.
pub(super) type Matrix = [[f32; 4]; 3];

/// What the joints do in one frame. Everything is overwritten by [`Motions::set`]; nothing is allocated from the second frame on.
#[derive(Debug, Clone, Default)]
pub(super) struct Motions {
    /// `posed_from_rest` of each joint.
    pub matrices: Vec<Matrix>,
    /// Its rotation: i, j, k, w.
    pub turns: Vec<[f32; 4]>,
    /// Of each pair of joints, the logarithm of the second one's motion relative to the first: turn, shift.
    pub twists: Vec<[f32; 6]>,
    /// Of each pair, whether the axes agree.
    agree: Vec<bool>,
    way: Skinning,
}

impl Motions {
    /// Takes over a frame's `posed_from_rest` transforms; there is one for every joint that `groups` names.
    pub fn set(&mut self, posed_from_rest: &[Isometry3<f64>], groups: &Groups, way: Skinning) {
        self.way = way;
        self.matrices.clear();
        self.matrices.extend(posed_from_rest.iter().map(matrix));
        self.turns.clear();
        self.turns.extend(posed_from_rest.iter().map(|t| <[f32; 4]>::from(t.rotation.coords.cast::<f32>())));
        self.twists.clear();
        self.agree.clear();
        for &[reference, joint] in &groups.pairs {
            let relative = posed_from_rest[usize::from(reference)].inv_mul(&posed_from_rest[usize::from(joint)]);
            let Twist { turn, shift } = Twist::log(&relative);
            self.twists.push([turn.x, turn.y, turn.z, shift.x, shift.y, shift.z].map(|c| c as f32));
            // The scalar products of the axes are the diagonal of the relative rotation.
            self.agree.push(relative.rotation.to_rotation_matrix().matrix().diagonal().min() >= AGREEMENT);
        }
    }

    /// True where the group's vertices are to be blended in log space.
    pub fn in_log_space(&self, group: &Group) -> bool {
        match self.way {
            Skinning::Linear => false,
            Skinning::Log => group.count > 1,
            Skinning::Hybrid => group.pairs[1..group.count].iter().any(|&p| !self.agree[usize::from(p)]),
        }
    }
}

fn matrix(transform: &Isometry3<f64>) -> Matrix {
    let m = transform.to_homogeneous();
    [0, 1, 2].map(|row| [0, 1, 2, 3].map(|column| m[(row, column)] as f32))
}
