//! The constant matrix of projective dynamics, factorised: the first guess of the potential's curvature.
//!
//! A = M / h² + anchors + Σ area (stretch + 2 shear) G Gᵀ + the second derivative of bending about a flat rest shape.
//! It is the same for x, y and z, and stiffer than the true second derivative of stretch, shear and bending in every direction.
//! Contacts that press are added to its diagonal, in all directions alike: where they press, friction holds too.

use faer::{
    Mat, Side,
    linalg::solvers::Solve,
    sparse::{
        SparseColMat, Triplet,
        linalg::solvers::{Llt, SymbolicLlt},
    },
};
use nalgebra::Vector3;

use crate::{ClothError, contact::Contact, rest::Rest, self_contact::Pair};

/// A over one length of time step.
#[derive(Debug, Clone)]
pub(crate) struct System {
    /// Length of the time step, seconds.
    pub step: f64,
    /// The diagonal of A: how stiff the cloth is around each vertex, N/m.
    pub diagonal: Vec<f64>,
    /// Upper triangle of A; every diagonal entry is the last of its column.
    matrix: SparseColMat<usize, f64>,
    symbolic: SymbolicLlt<usize>,
    free: Llt<usize, f64>,
    /// A with the contacts that hold now, where there are any.
    held: Option<Llt<usize, f64>>,
}

impl System {
    pub fn new(rest: &Rest, h: f64) -> Result<Self, ClothError> {
        if !(h.is_finite() && h > 0.0) {
            return Err(ClothError::TimeStep(h));
        }
        let n = rest.len();
        let mut entries = elastic(rest);
        entries.extend((0..n).map(|v| Triplet::new(v, v, rest.masses[v] / (h * h) + rest.anchors[v])));
        let matrix = SparseColMat::try_new_from_triplets(n, n, &entries)
            .map_err(|_| ClothError::Sheet("its stiffness cannot be assembled".into()))?;
        let symbolic = SymbolicLlt::try_new(matrix.symbolic(), Side::Upper)
            .map_err(|_| ClothError::Sheet("its stiffness cannot be ordered".into()))?;
        let free = factorise(&symbolic, &matrix)?;
        let diagonal = (0..n).map(|v| matrix.val()[matrix.col_ptr()[v + 1] - 1]).collect();
        Ok(Self { step: h, diagonal, matrix, symbolic, free, held: None })
    }

    /// Takes the stiffness of contacts into account, as far as they press or pressed.
    pub fn hold(&mut self, x: &[Vector3<f64>], contacts: &[Contact], pairs: &[Pair]) -> Result<(), ClothError> {
        let mut matrix = self.matrix.clone();
        let mut any = false;
        let mut add = |v: u32, stiffness: f64| {
            let place = self.matrix.col_ptr()[v as usize + 1] - 1;
            matrix.val_mut()[place] += stiffness;
            any = true;
        };
        for c in contacts.iter().filter(|c| c.pressed > 0.0 || c.depth(&x[c.vertex as usize]) > 0.0) {
            add(c.vertex, c.stiffness);
        }
        for p in pairs.iter().filter(|p| p.depth(x) > 0.0) {
            p.vertices.iter().for_each(|&v| add(v, p.stiffness));
        }
        self.held = if any { Some(factorise(&self.symbolic, &matrix)?) } else { None };
        Ok(())
    }

    /// A⁻¹ times `x`.
    pub fn solve(&self, x: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        let right = Mat::from_fn(x.len(), 3, |v, k| x[v][k]);
        let out = self.held.as_ref().unwrap_or(&self.free).solve(&right);
        (0..x.len()).map(|v| Vector3::new(out[(v, 0)], out[(v, 1)], out[(v, 2)])).collect()
    }
}

fn factorise(symbolic: &SymbolicLlt<usize>, matrix: &SparseColMat<usize, f64>) -> Result<Llt<usize, f64>, ClothError> {
    Llt::try_new_with_symbolic(symbolic.clone(), matrix.as_ref(), Side::Upper)
        .map_err(|_| ClothError::Sheet("its stiffness cannot be factorised".into()))
}

/// Upper triangle of the elastic part.
fn elastic(rest: &Rest) -> Vec<Triplet<usize, usize, f64>> {
    let mut entries = Vec::with_capacity(rest.elements.len() * 6 + rest.bends.len() * 21 + rest.len());
    let mut put = |a: u32, b: u32, value: f64| {
        entries.push(Triplet::new(a.min(b) as usize, a.max(b) as usize, value));
    };
    let membrane = rest.fabric.stretch + 2.0 * rest.fabric.shear;
    for e in &rest.elements {
        for i in 0..3 {
            for j in i..3 {
                put(e.vertices[i], e.vertices[j], membrane * e.area * e.gradients[i].dot(&e.gradients[j]));
            }
        }
    }
    for bend in &rest.bends {
        let second = bend.second_derivative();
        for (a, row) in bend.vertices.into_iter().zip(second) {
            for (b, value) in bend.vertices.into_iter().zip(row) {
                // Entries of a pair stand twice; a border's corner that stands for nothing has a weight of zero.
                if a <= b {
                    put(a, b, rest.fabric.bending * value);
                }
            }
        }
    }
    entries
}
