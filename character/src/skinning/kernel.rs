//! Sixteen vertices at a time: blended matrices, blended twists.

use nalgebra::{Point3, Quaternion, UnitQuaternion, Vector3};
use toile_geometry::lanes::floats::{Kernel, LANES, Lanes};

use super::{
    groups::{Block, Group, Groups},
    motions::{Matrix, Motions},
};

/// Squared length below which a blended normal counts as none.
const NO_NORMAL: f32 = 1e-20;

/// sin h / h and cos h in h² ≤ (π/2)², (θ − sin θ)/θ³ in θ² ≤ π²: Taylor series up to terms below 4e-8, which f32 does not resolve.
const SINE: [f32; 7] = alternating(1);
const COSINE: [f32; 8] = alternating(0);
const SCREW: [f32; 8] = alternating(3);

/// Coefficients (−1)ᵏ / (2k + first)!, k ascending.
const fn alternating<const N: usize>(first: u32) -> [f32; N] {
    let (mut coefficients, mut k) = ([0.0; N], 0);
    while k < N {
        let (mut factorial, mut factor) = (1.0, 1);
        while factor <= 2 * k as u32 + first {
            factorial *= factor as f64;
            factor += 1;
        }
        coefficients[k] = (if k % 2 == 0 { 1.0 } else { -1.0 } / factorial) as f32;
        k += 1;
    }
    coefficients
}

/// A vector in each lane.
type Vectors<L> = [<L as Lanes>::F; 3];

/// Moves all vertices and turns their normals.
pub(super) struct Move<'a> {
    pub groups: &'a Groups,
    pub motions: &'a Motions,
    pub positions: &'a mut [Point3<f32>],
    pub normals: &'a mut [Vector3<f32>],
}

impl Kernel for Move<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, l: L) {
        for group in &self.groups.groups {
            let blocks = &self.groups.blocks[group.blocks.clone()];
            if self.motions.in_log_space(group) {
                for block in blocks {
                    let (position, normal) = in_log_space(l, group, block, self.motions);
                    scatter(l, block, position, normal, self.positions, self.normals);
                }
            } else {
                for block in blocks {
                    let (position, normal) = linear(l, group, block, self.motions);
                    scatter(l, block, position, normal, self.positions, self.normals);
                }
            }
        }
    }
}

/// The rotation of every vertex, blended in log space.
pub(super) struct Turn<'a> {
    pub groups: &'a Groups,
    pub motions: &'a Motions,
    pub rotations: &'a mut [UnitQuaternion<f32>],
}

impl Kernel for Turn<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, l: L) {
        for group in &self.groups.groups {
            let [x, y, z, w] = self.motions.turns[usize::from(group.joints[0])];
            let (axis, w) = ([l.splat(x), l.splat(y), l.splat(z)], l.splat(w));
            for block in &self.groups.blocks[group.blocks.clone()] {
                let (turn, _) = twist(l, group, block, self.motions);
                let (half, real) = half_turn(l, turn);
                // The quaternion of the reference times that of the blended turn.
                let along = add(l, add(l, scale(l, axis, real), scale(l, half, w)), cross(l, axis, half));
                let real = l.sub(l.mul(w, real), dot(l, axis, half));
                let (i, j, k, w) = (l.store(along[0]), l.store(along[1]), l.store(along[2]), l.store(real));
                for lane in 0..LANES {
                    let turned = Quaternion::new(w[lane], i[lane], j[lane], k[lane]);
                    self.rotations[block.vertices[lane] as usize] = UnitQuaternion::new_unchecked(turned);
                }
            }
        }
    }
}

/// Positions and normals by the weighted sum of the joints' matrices.
#[inline(always)]
fn linear<L: Lanes>(l: L, group: &Group, block: &Block, motions: &Motions) -> (Vectors<L>, Vectors<L>) {
    let mut sum = [[l.splat(0.0); 4]; 3];
    for slot in 0..group.count {
        let weight = l.load(&block.weights[slot]);
        let matrix = &motions.matrices[usize::from(group.joints[slot])];
        for row in 0..3 {
            for column in 0..4 {
                sum[row][column] = l.add(sum[row][column], l.mul(weight, l.splat(matrix[row][column])));
            }
        }
    }
    let (position, normal) = (load(l, &block.positions), load(l, &block.normals));
    let moved = [
        l.add(dot(l, [sum[0][0], sum[0][1], sum[0][2]], position), sum[0][3]),
        l.add(dot(l, [sum[1][0], sum[1][1], sum[1][2]], position), sum[1][3]),
        l.add(dot(l, [sum[2][0], sum[2][1], sum[2][2]], position), sum[2][3]),
    ];
    let turned = [
        dot(l, [sum[0][0], sum[0][1], sum[0][2]], normal),
        dot(l, [sum[1][0], sum[1][1], sum[1][2]], normal),
        dot(l, [sum[2][0], sum[2][1], sum[2][2]], normal),
    ];
    let length = l.sqrt(l.max(dot(l, turned, turned), l.splat(NO_NORMAL)));
    (moved, scale(l, turned, l.div(l.splat(1.0), length)))
}

/// Positions and normals by the exponential of the weighted sum of the joints' twists relative to the group's reference.
#[inline(always)]
fn in_log_space<L: Lanes>(l: L, group: &Group, block: &Block, motions: &Motions) -> (Vectors<L>, Vectors<L>) {
    let (turn, shift) = twist(l, group, block, motions);
    let square = dot(l, turn, turn);
    let quarter = l.mul(l.splat(0.25), square);
    let (sine, cosine) = (polynomial(l, &SINE, quarter), polynomial(l, &COSINE, quarter));
    // sin θ / θ, (1 − cos θ) / θ², (θ − sin θ) / θ³
    let (a, b) = (l.mul(sine, cosine), l.mul(l.splat(0.5), l.mul(sine, sine)));
    let c = polynomial(l, &SCREW, square);
    let (position, normal) = (load(l, &block.positions), load(l, &block.normals));
    let first = add(l, scale(l, position, a), scale(l, shift, b));
    let second = add(l, scale(l, position, b), scale(l, shift, c));
    let bend = cross(l, turn, add(l, first, cross(l, turn, second)));
    let moved = add(l, add(l, position, shift), bend);
    let turned = add(l, normal, cross(l, turn, add(l, scale(l, normal, a), cross(l, turn, scale(l, normal, b)))));
    let reference = &motions.matrices[usize::from(group.joints[0])];
    let posed = rotated(l, reference, moved);
    let place = [l.splat(reference[0][3]), l.splat(reference[1][3]), l.splat(reference[2][3])];
    (add(l, posed, place), rotated(l, reference, turned))
}

/// The weighted sum of the joints' twists relative to the group's reference: turn and shift.
#[inline(always)]
fn twist<L: Lanes>(l: L, group: &Group, block: &Block, motions: &Motions) -> (Vectors<L>, Vectors<L>) {
    let (mut turn, mut shift) = ([l.splat(0.0); 3], [l.splat(0.0); 3]);
    for slot in 1..group.count {
        let weight = l.load(&block.weights[slot]);
        let twist = &motions.twists[usize::from(group.pairs[slot])];
        for axis in 0..3 {
            turn[axis] = l.add(turn[axis], l.mul(weight, l.splat(twist[axis])));
            shift[axis] = l.add(shift[axis], l.mul(weight, l.splat(twist[axis + 3])));
        }
    }
    (turn, shift)
}

/// The quaternion of a turn (axis times angle, at most π): its vector and its scalar.
#[inline(always)]
fn half_turn<L: Lanes>(l: L, turn: Vectors<L>) -> (Vectors<L>, L::F) {
    let quarter = l.mul(l.splat(0.25), dot(l, turn, turn));
    let half = l.mul(l.splat(0.5), polynomial(l, &SINE, quarter));
    (scale(l, turn, half), polynomial(l, &COSINE, quarter))
}

#[inline(always)]
fn rotated<L: Lanes>(l: L, matrix: &Matrix, v: Vectors<L>) -> Vectors<L> {
    [
        dot(l, [l.splat(matrix[0][0]), l.splat(matrix[0][1]), l.splat(matrix[0][2])], v),
        dot(l, [l.splat(matrix[1][0]), l.splat(matrix[1][1]), l.splat(matrix[1][2])], v),
        dot(l, [l.splat(matrix[2][0]), l.splat(matrix[2][1]), l.splat(matrix[2][2])], v),
    ]
}

/// Horner's rule, lowest coefficient first.
#[inline(always)]
fn polynomial<L: Lanes, const N: usize>(l: L, coefficients: &[f32; N], x: L::F) -> L::F {
    let mut sum = l.splat(coefficients[N - 1]);
    for k in (0..N - 1).rev() {
        sum = l.add(l.mul(sum, x), l.splat(coefficients[k]));
    }
    sum
}

#[inline(always)]
fn load<L: Lanes>(l: L, rows: &[[f32; LANES]; 3]) -> Vectors<L> {
    [l.load(&rows[0]), l.load(&rows[1]), l.load(&rows[2])]
}

#[inline(always)]
fn add<L: Lanes>(l: L, a: Vectors<L>, b: Vectors<L>) -> Vectors<L> {
    [l.add(a[0], b[0]), l.add(a[1], b[1]), l.add(a[2], b[2])]
}

#[inline(always)]
fn scale<L: Lanes>(l: L, a: Vectors<L>, factor: L::F) -> Vectors<L> {
    [l.mul(a[0], factor), l.mul(a[1], factor), l.mul(a[2], factor)]
}

#[inline(always)]
fn dot<L: Lanes>(l: L, a: Vectors<L>, b: Vectors<L>) -> L::F {
    l.add(l.add(l.mul(a[0], b[0]), l.mul(a[1], b[1])), l.mul(a[2], b[2]))
}

#[inline(always)]
fn cross<L: Lanes>(l: L, a: Vectors<L>, b: Vectors<L>) -> Vectors<L> {
    [
        l.sub(l.mul(a[1], b[2]), l.mul(a[2], b[1])),
        l.sub(l.mul(a[2], b[0]), l.mul(a[0], b[2])),
        l.sub(l.mul(a[0], b[1]), l.mul(a[1], b[0])),
    ]
}

/// Puts a block's results where the mesh has its vertices.
#[inline(always)]
fn scatter<L: Lanes>(
    l: L,
    block: &Block,
    position: Vectors<L>,
    normal: Vectors<L>,
    positions: &mut [Point3<f32>],
    normals: &mut [Vector3<f32>],
) {
    let (x, y, z) = (l.store(position[0]), l.store(position[1]), l.store(position[2]));
    let (i, j, k) = (l.store(normal[0]), l.store(normal[1]), l.store(normal[2]));
    for lane in 0..LANES {
        let v = block.vertices[lane] as usize;
        positions[v] = Point3::new(x[lane], y[lane], z[lane]);
        normals[v] = Vector3::new(i[lane], j[lane], k[lane]);
    }
}
