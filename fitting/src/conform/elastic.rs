//! The elastic energy of the template, factorised once a round.

use faer::{
    Mat, Side,
    linalg::solvers::Solve,
    sparse::{
        SparseColMat, Triplet,
        linalg::solvers::{Llt, SymbolicLlt},
    },
};
use nalgebra::{Point3, Vector3};
use toile_character::{BodyModel, Region};
use toile_geometry::{
    Mesh,
    areas::vertex_areas,
    laplacian::{Row, cotangent_laplacian},
};

use crate::{ConformSettings, FittingError};

/// Draws an unseen vertex back to the statistical model: weak enough to leave 1 mm of 20 to a seen vertex's neighbour.
const TIE: f64 = 2e-5;
/// Length of the membrane energy, metres: too short to smooth what was seen, enough to rule over wide holes.
const MEMBRANE: f64 = 0.002;
/// Smallest area of a vertex, square metres: a degenerate triangle must not make one infinitely stiff.
const SMALLEST_AREA: f64 = 1e-7;

/// Where the scan draws a vertex, and how strongly.
pub(crate) struct Pull {
    pub target: Point3<f32>,
    /// 1 for a vertex that was seen well and lies near.
    pub weight: f64,
}

/// The bending energy of the template in the scan's pose.
pub(crate) struct Elastic {
    areas: Vec<f64>,
    /// Upper triangle of bending and membrane; every diagonal entry is there, the last of its column.
    matrix: SparseColMat<usize, f64>,
    symbolic: SymbolicLlt<usize>,
}

impl Elastic {
    pub fn new(model: &BodyModel, points: &[Point3<f32>], settings: &ConformSettings) -> Result<Self, FittingError> {
        let mesh = Mesh::new(points.to_vec(), model.triangles.clone());
        let areas: Vec<f64> = vertex_areas(&mesh).iter().map(|&a| f64::from(a).max(SMALLEST_AREA)).collect();
        let laplacian = laplacian(&model.triangles, points);
        let mut entries = squared(&scaled(model, &laplacian, &areas, settings));
        entries.extend(upper(&laplacian, MEMBRANE * MEMBRANE));
        let n = points.len();
        let matrix = SparseColMat::try_new_from_triplets(n, n, &entries).map_err(|_| singular())?;
        let symbolic = SymbolicLlt::try_new(matrix.symbolic(), Side::Upper).map_err(|_| singular())?;
        Ok(Self { areas, matrix, symbolic })
    }

    /// The vertices at `start` displaced to where `pulls` and the energy balance.
    pub fn solve(&self, start: &[Point3<f32>], pulls: &[Pull]) -> Result<Vec<Point3<f32>>, FittingError> {
        let n = start.len();
        let mut matrix = self.matrix.clone();
        for (v, pull) in pulls.iter().enumerate() {
            let diagonal = self.matrix.col_ptr()[v + 1] - 1;
            matrix.val_mut()[diagonal] += self.areas[v] * (pull.weight + TIE);
        }
        let factor =
            Llt::try_new_with_symbolic(self.symbolic.clone(), matrix.as_ref(), Side::Upper).map_err(|_| singular())?;
        let rhs =
            Mat::from_fn(n, 3, |v, k| self.areas[v] * pulls[v].weight * f64::from(pulls[v].target[k] - start[v][k]));
        let d = factor.solve(&rhs);
        let moved = |v: usize| Vector3::new(d[(v, 0)], d[(v, 1)], d[(v, 2)]).cast::<f32>();
        Ok((0..n).map(|v| start[v] + moved(v)).collect())
    }
}

fn singular() -> FittingError {
    FittingError::Singular { what: "the conformation" }
}

/// Bounds of ½ cot, so that slivers and obtuse corners keep the energy positive and finite.
const HALF_COTANGENT: (f64, f64) = (0.02, 5.0);
/// Smallest double area that a cotangent is divided by, square metres.
const SMALLEST_SINE: f64 = 1e-9;

/// The bounded cotangent Laplacian C of the template.
fn laplacian(triangles: &[[u32; 3]], points: &[Point3<f32>]) -> Vec<Row> {
    cotangent_laplacian(triangles, points.len(), |t, k| {
        let [o, i, j] = [k, k + 1, k + 2].map(|c| points[triangles[t][c % 3] as usize]);
        let (a, b) = (i - o, j - o);
        let sine = f64::from(a.cross(&b).norm()).max(SMALLEST_SINE);
        (0.5 * f64::from(a.dot(&b)) / sine).clamp(HALF_COTANGENT.0, HALF_COTANGENT.1)
    })
}

/// Rows M^-½ ℓ² C of the bending energy.
fn scaled(model: &BodyModel, laplacian: &[Row], areas: &[f64], settings: &ConformSettings) -> Vec<Row> {
    let length = |v: usize| match model.regions[v] {
        _ if model.inner[v] => settings.extremity_length,
        Region::Head => settings.head_length,
        r if r.is_extremity() => settings.extremity_length,
        _ => settings.stiffness_length,
    };
    let scale = |v: usize| length(v).powi(2) / areas[v].sqrt();
    laplacian.iter().enumerate().map(|(v, row)| row.iter().map(|&(c, w)| (c, w * scale(v))).collect()).collect()
}

/// Upper triangle of a symmetric matrix times `factor`.
fn upper(rows: &[Row], factor: f64) -> impl Iterator<Item = Triplet<usize, usize, f64>> + '_ {
    rows.iter().enumerate().flat_map(move |(i, row)| {
        row.iter().filter(move |e| e.0 as usize >= i).map(move |&(j, w)| Triplet::new(i, j as usize, w * factor))
    })
}

/// Upper triangle of RᵀR.
fn squared(rows: &[Row]) -> Vec<Triplet<usize, usize, f64>> {
    let mut out = Vec::with_capacity(rows.len() * 28);
    for row in rows {
        for (k, &(i, a)) in row.iter().enumerate() {
            for &(j, b) in &row[k..] {
                out.push(Triplet::new(i as usize, j as usize, a * b));
            }
        }
    }
    out
}
