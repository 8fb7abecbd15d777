//! The minimum of a step's potential: L-BFGS over the factorised matrix (Liu et al. 2017, algorithm 1).

use nalgebra::Vector3;

use crate::objective::Objective;

/// Steps that the curvature is learnt from.
const MEMORY: usize = 6;
/// Share of the descent that a step's length must bring (Armijo).
const ENOUGH: f64 = 1e-4;
/// Maximum number of times that a step is halved.
const HALVINGS: usize = 12;

/// A step and the change of the gradient over it.
struct Learnt {
    step: Vec<Vector3<f64>>,
    change: Vec<Vector3<f64>>,
    /// 1 / (step · change).
    scale: f64,
}

/// Moves `x` towards the minimum, by at most `iterations` steps, until the next would be shorter than `tolerance` metres
/// (root mean square over the vertices). The potential never grows.
pub(crate) fn minimise(objective: &Objective, x: &mut Vec<Vector3<f64>>, iterations: usize, tolerance: f64) {
    let n = x.len();
    let mut gradient = vec![Vector3::zeros(); n];
    let mut energy = objective.evaluate(x, &mut gradient);
    let mut learnt: Vec<Learnt> = Vec::with_capacity(MEMORY);
    let mut next_gradient = vec![Vector3::zeros(); n];
    for _ in 0..iterations {
        let direction = direction(objective, &gradient, &learnt);
        let slope = dot(&direction, &gradient);
        if slope.is_nan() || slope >= 0.0 || dot(&direction, &direction) < tolerance * tolerance * n as f64 {
            break;
        }
        let mut length = 1.0;
        let mut accepted = None;
        for _ in 0..HALVINGS {
            let next: Vec<Vector3<f64>> = x.iter().zip(&direction).map(|(x, d)| x + d * length).collect();
            let e = objective.evaluate(&next, &mut next_gradient);
            if e <= energy + ENOUGH * length * slope {
                accepted = Some((next, e));
                break;
            }
            length *= 0.5;
        }
        let Some((next, e)) = accepted else { break };
        remember(&mut learnt, x, &next, &gradient, &next_gradient);
        (*x, energy) = (next, e);
        std::mem::swap(&mut gradient, &mut next_gradient);
    }
}

/// The quasi-Newton direction: two loops around the factorised matrix.
fn direction(objective: &Objective, gradient: &[Vector3<f64>], learnt: &[Learnt]) -> Vec<Vector3<f64>> {
    let mut q = gradient.to_vec();
    let mut shares = Vec::with_capacity(learnt.len());
    for l in learnt.iter().rev() {
        let share = l.scale * dot(&l.step, &q);
        axpy(&mut q, -share, &l.change);
        shares.push(share);
    }
    let mut r = objective.system.solve(&q);
    for (l, share) in learnt.iter().zip(shares.iter().rev()) {
        let back = l.scale * dot(&l.change, &r);
        axpy(&mut r, share - back, &l.step);
    }
    r.iter_mut().for_each(|d| *d = -*d);
    r
}

fn remember(
    learnt: &mut Vec<Learnt>,
    from: &[Vector3<f64>],
    to: &[Vector3<f64>],
    gradient_from: &[Vector3<f64>],
    gradient_to: &[Vector3<f64>],
) {
    let difference = |a: &[Vector3<f64>], b: &[Vector3<f64>]| a.iter().zip(b).map(|(a, b)| b - a).collect::<Vec<_>>();
    let (step, change) = (difference(from, to), difference(gradient_from, gradient_to));
    let curvature = dot(&step, &change);
    if curvature > 1e-18 {
        if learnt.len() == MEMORY {
            learnt.remove(0);
        }
        learnt.push(Learnt { step, change, scale: 1.0 / curvature });
    }
}

fn dot(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}

fn axpy(x: &mut [Vector3<f64>], factor: f64, y: &[Vector3<f64>]) {
    x.iter_mut().zip(y).for_each(|(x, y)| *x += y * factor);
}
