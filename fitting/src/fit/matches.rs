//! Closest compatible points in both directions, with robust weights.

use rayon::prelude::*;

use crate::{
    solve::{Articulated, Gate, INDEPENDENT, Posed, Residual},
    surface::{Cloud, Samples},
};

/// Residuals of both directions and how well the surfaces agree.
pub(crate) struct Matches {
    pub residuals: Vec<Residual>,
    /// Robust cost 0–1, averaged over the areas of both surfaces; area without a match counts 1.
    pub misfit: f64,
}

/// Pairs each body vertex with the scan, and each of `reverse` with the body.
pub(crate) fn matches(body: &Articulated, posed: &Posed, scan: &Cloud, reverse: &Samples, gate: &Gate) -> Matches {
    let forward: Vec<Option<Residual>> = (0..body.len())
        .into_par_iter()
        .with_min_len(128)
        .map(|v| {
            let (p, n) = (&posed.points[v], &posed.normals[v]);
            let q = scan.nearest(p, n, gate.distance, gate.min_cos)? as usize;
            let trust = f64::from(scan.samples.weights[q] / scan.samples.areas[q].max(f32::MIN_POSITIVE));
            let weight = f64::from(body.areas[v]) * trust;
            gate.pair(v as u32, p, &scan.samples.points[q], &scan.samples.normals[q], weight)
        })
        .collect();
    let backward = backward(posed, reverse, gate);
    let body_area: Vec<f64> = body.areas.iter().map(|&a| f64::from(a)).collect();
    let scan_area: Vec<f64> = reverse.weights.iter().map(|&a| f64::from(a)).collect();
    let (mut residuals, forward_misfit) = weigh(forward, &body_area, gate, body);
    let (more, backward_misfit) = weigh(backward, &scan_area, gate, body);
    residuals.extend(more);
    Matches { residuals, misfit: 0.5 * (forward_misfit + backward_misfit) }
}

fn backward(posed: &Posed, reverse: &Samples, gate: &Gate) -> Vec<Option<Residual>> {
    let samples = Samples { points: posed.points.clone(), normals: posed.normals.clone(), ..Samples::default() };
    let Some(surface) = Cloud::new(samples) else { return vec![None; reverse.points.len()] };
    (0..reverse.points.len())
        .into_par_iter()
        .with_min_len(128)
        .map(|k| {
            let (q, m) = (&reverse.points[k], &reverse.normals[k]);
            let v = surface.nearest(q, m, gate.distance, gate.min_cos)?;
            gate.pair(v, &posed.points[v as usize], q, m, f64::from(reverse.weights[k]))
        })
        .collect()
}

/// Turns areas into weights of the normal equations; returns them with the misfit.
fn weigh(pairs: Vec<Option<Residual>>, areas: &[f64], gate: &Gate, body: &Articulated) -> (Vec<Residual>, f64) {
    let total: f64 = areas.iter().sum::<f64>().max(1e-12);
    let scale = 0.5 * INDEPENDENT / (total * f64::from(gate.noise).powi(2));
    let mut cost = 0.0;
    let mut out = Vec::with_capacity(pairs.len());
    for (pair, &area) in pairs.into_iter().zip(areas) {
        let Some(mut r) = pair else {
            cost += area;
            continue;
        };
        let cloth = gate.cloth.filter(|_| r.value < 0.0);
        let cloth = cloth.and_then(|cloth| cloth.over(body.main_joint(r.vertex as usize)));
        r.value += cloth.map_or(0.0, |(stand_off, _)| stand_off);
        let squared = f64::from(r.value).powi(2);
        cost += area * squared / (squared + f64::from(gate.kernel).powi(2));
        r.weight *= match cloth {
            Some((_, weight)) => 0.5 * weight / total,
            None => scale * gate.robust(r.value),
        };
        if r.weight > 0.0 {
            out.push(r);
        }
    }
    (out, cost / total)
}
