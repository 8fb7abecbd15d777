//! Which two measures cannot be had together.

use nalgebra::{DMatrix, DVector};

use super::Reached;

/// Two measures that no body of the model has together.
#[derive(Debug, Clone, PartialEq)]
pub struct Conflict {
    /// The measure that was missed most, and the one whose change would help it most.
    pub names: [String; 2],
    /// For people: what was asked for and what there is.
    pub sentence: String,
}

/// The pair to blame where a measure was missed: the one that is missed most, in allowances, and that other one without which
/// it would be missed least, to first order around the body (`slopes`: metres for a standard deviation).
pub(super) fn find(reached: &[Reached], slopes: &DMatrix<f64>) -> Option<Conflict> {
    let miss = |r: &Reached| (r.reached_m - r.wanted_m).abs() / r.allowed_m;
    let (worst, most) = reached.iter().enumerate().max_by(|a, b| miss(a.1).total_cmp(&miss(b.1)))?;
    if most.is_met() {
        return None;
    }
    let others = (0..reached.len()).filter(|&k| k != worst);
    let left = others.map(|k| (k, miss_without(reached, slopes, worst, k)));
    let Some((other, _)) = left.min_by(|a, b| a.1.total_cmp(&b.1)) else {
        let sentence = format!("no body of the model has a {}; the nearest has {:.3} m", asked(most), most.reached_m);
        return Some(Conflict { names: [most.name.clone(), most.name.clone()], sentence });
    };
    let other = &reached[other];
    let sentence = format!(
        "no body of the model has a {} and a {} together; the nearest has {:.3} m and {:.3} m, so change one of the two",
        asked(most),
        asked(other),
        most.reached_m,
        other.reached_m
    );
    Some(Conflict { names: [most.name.clone(), other.name.clone()], sentence })
}

fn asked(r: &Reached) -> String {
    format!("{} of {:.3} m", r.name, r.wanted_m)
}

/// How far measure `worst` would be missed if `left_out` had not been asked for, metres: one more step of the solution without it.
fn miss_without(reached: &[Reached], slopes: &DMatrix<f64>, worst: usize, left_out: usize) -> f64 {
    let kept: Vec<usize> = (0..reached.len()).filter(|&k| k != left_out).collect();
    let scaled = DMatrix::from_fn(kept.len(), slopes.ncols(), |r, c| slopes[(kept[r], c)] / reached[kept[r]].allowed_m);
    let off = |k: usize| (reached[k].wanted_m - reached[k].reached_m) / reached[k].allowed_m;
    let left = DVector::from_fn(kept.len(), |r, _| off(kept[r]));
    let among = &scaled * scaled.transpose() + DMatrix::identity(kept.len(), kept.len());
    let Some(pull) = among.cholesky().map(|c| c.solve(&left)) else { return f64::INFINITY };
    // what remains of A x = b under ridge 1 is the pull itself
    kept.iter().position(|&k| k == worst).map_or(f64::INFINITY, |k| pull[k].abs())
}
