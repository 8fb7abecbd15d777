//! The light of the room, the lens's fall-off and the exposure of each picture, from vertices that several pictures show.
//!
//! A person turns before lamps that rest, so that each place of the surface is seen in changing light; its own colour is what
//! does not change. Of vertex v in picture f the camera gives
//!
//! ```text
//! ln I = a(v) + e(f) + k·(r², r⁴) + b·(x, z) + ln E(n),   E(n) = w0 + Σ wj max(0, n·dj)
//! ```
//!
//! with the vertex's own colour a, the exposure e, the lens's fall-off over the distance r from the axis, a slope of brightness over
//! the room, and the light E that falls on a normal n from lamps in directions dj all around, none of them negative (Lambert's law;
//! weights by their logarithms). Gauss-Newton over everything but a, which is eliminated vertex by vertex, with weights that let
//! highlights go. Afterwards exposures are solved for each channel, which gives the white balance.

use nalgebra::{DMatrix, DVector, Vector3};
use rayon::prelude::*;

use crate::{
    photo::Shot,
    sight::{Sight, Surface},
    zonal::{self, Sample, polynomials},
};

/// Vertices that the light is solved over, at most.
const VERTICES: usize = 1500;
/// Vertices whose neighbours are looked at, at most.
const PAIRED: usize = 5000;
/// Fewer pictures of a vertex say nothing about the light.
const LEAST_VIEWS: usize = 4;
/// Darker than this (linear) is mostly noise and stray light.
const DARK: f32 = 0.004;
/// Steps of Gauss-Newton.
const STEPS: usize = 8;
/// Residual, in logarithms, at which an observation counts half: prints that move in and out of the blur, edges of shadows.
const SCALE: f64 = 0.04;
/// Standard deviations of what is believed before: logarithms of exposures, the lens's fall-off at slope 1, brightness a metre, and
/// logarithms of the lamps' weights.
const PRIORS: [f64; 4] = [0.3, 1.0, 0.2, 1.5];
/// Numbers besides exposures and lamps: two of the lens, two of the room.
const SHARED: usize = 4;

/// The light of the room and the exposures.
pub(crate) struct Light {
    /// Logarithm of each picture's exposure by channel.
    pub exposures: Vec<[f32; 3]>,
    lens: [f64; 2],
    slope: [f64; 2],
    /// Of the height of a normal, which a turn does not show.
    heights: Vector3<f64>,
    lamps: Vec<f64>,
    directions: Vec<Vector3<f64>>,
}

/// What is known of a vertex in a picture: which one, what the model sees of it, its brightness's logarithm, and how much it counts.
struct Observation {
    view: usize,
    seen: Seen,
    value: f64,
    weight: f64,
}

/// What decides the light on a vertex in a picture.
pub(crate) struct Seen {
    /// Squared distance from the axis, as a slope.
    radius2: f64,
    /// Place in the room, to the right and ahead, metres.
    place: [f64; 2],
    normal: Vector3<f64>,
    /// Height of the normal on the surface itself.
    height: f64,
}

impl Seen {
    pub(crate) fn new(shot: &Shot, surface: &Surface, vertex: usize) -> Self {
        let point = shot.seen(&surface.mesh.positions[vertex]);
        let (x, y) = (point.x / point.z, point.y / point.z);
        let turned = shot.room_from_surface * surface.mesh.positions[vertex].cast::<f64>().coords;
        let normal = shot.in_room(&surface.smooth[vertex]).cast::<f64>();
        Self {
            radius2: x * x + y * y,
            place: [turned.x, turned.z],
            normal,
            height: f64::from(surface.smooth[vertex].y),
        }
    }
}

impl Light {
    /// No knowledge: everything is lit alike.
    pub(crate) fn even(views: usize) -> Self {
        let directions = directions();
        let mut lamps = vec![f64::NEG_INFINITY; directions.len() + 1];
        lamps[0] = 0.0;
        Self {
            exposures: vec![[0.0; 3]; views],
            lens: [0.0; 2],
            slope: [0.0; 2],
            heights: Vector3::zeros(),
            lamps,
            directions,
        }
    }

    /// Solves for the light; exposures are relative to their mean.
    pub(crate) fn solve(shots: &[Shot], sights: &[Sight], surface: &Surface) -> Self {
        let observed = observations(shots, sights, surface);
        let mut light = Self::even(shots.len());
        let share = 1.0 / light.directions.len() as f64;
        light.lamps.fill((2.0 * share).ln());
        light.lamps[0] = 0.5f64.ln();
        let start = light.parameters();
        for _ in 0..STEPS {
            let (matrix, right) = light.equations(&observed, &start);
            let Some(cholesky) = matrix.cholesky() else { break };
            light.step(&cholesky.solve(&right));
        }
        light.heights = light.heights_of(shots, sights, surface);
        light.balance(shots, sights, surface);
        light
    }

    /// Logarithm of what the light, the lens and the room make of a colour.
    pub(crate) fn shading(&self, seen: &Seen) -> f64 {
        let Seen { radius2, place, .. } = seen;
        self.lens[0] * radius2
            + self.lens[1] * radius2 * radius2
            + self.slope[0] * place[0]
            + self.slope[1] * place[1]
            + self.heights.dot(&polynomials(seen.height))
            + self.falling(&seen.normal).max(1e-3).ln()
    }

    /// The light on a normal.
    fn falling(&self, normal: &Vector3<f64>) -> f64 {
        let lamps = self.directions.iter().zip(&self.lamps[1..]);
        self.lamps[0].exp() + lamps.map(|(d, w)| w.exp() * d.dot(normal).max(0.0)).sum::<f64>()
    }

    fn parameters(&self) -> DVector<f64> {
        let exposures = self.exposures.iter().map(|e| f64::from(e[0]));
        let all = exposures.chain(self.lens).chain(self.slope).chain(self.lamps.iter().copied());
        DVector::from_vec(all.collect())
    }

    fn step(&mut self, delta: &DVector<f64>) {
        let views = self.exposures.len();
        for (exposure, d) in self.exposures.iter_mut().zip(delta.iter()) {
            *exposure = [(f64::from(exposure[0]) + d) as f32; 3];
        }
        (0..2).for_each(|k| self.lens[k] += delta[views + k]);
        (0..2).for_each(|k| self.slope[k] += delta[views + 2 + k]);
        for (lamp, d) in self.lamps.iter_mut().zip(delta.iter().skip(views + SHARED)) {
            *lamp += d.clamp(-1.0, 1.0);
        }
    }

    /// Normal equations of a step, vertices' own colours eliminated, and what is believed before.
    fn equations(&self, observed: &[Vec<Observation>], start: &DVector<f64>) -> (DMatrix<f64>, DVector<f64>) {
        let size = start.len();
        let parts: Vec<_> = observed
            .par_chunks(256)
            .map(|vertices| {
                let (mut matrix, mut right) = (DMatrix::zeros(size, size), DVector::zeros(size));
                vertices.iter().for_each(|vertex| self.add_vertex(vertex, &mut matrix, &mut right));
                (matrix, right)
            })
            .collect();
        let (mut matrix, mut right) = (DMatrix::zeros(size, size), DVector::zeros(size));
        for (m, r) in parts {
            matrix += m;
            right += r;
        }
        matrix.fill_upper_triangle_with_lower_triangle();
        let now = self.parameters();
        let views = self.exposures.len();
        let count = observed.iter().map(Vec::len).sum::<usize>() as f64;
        for i in 0..size {
            let sigma = match i {
                i if i < views => PRIORS[0],
                i if i < views + 2 => PRIORS[1],
                i if i < views + SHARED => PRIORS[2],
                _ => PRIORS[3],
            };
            // Priors count as ten vertices do: against thousands they decide only what the pictures leave open.
            let weight = 10.0_f64.min(count) * (SCALE / sigma).powi(2);
            matrix[(i, i)] += weight;
            right[i] += weight * (start[i] - now[i]);
        }
        (matrix, right)
    }

    /// One vertex's part of the normal equations.
    fn add_vertex(&self, observed: &[Observation], matrix: &mut DMatrix<f64>, right: &mut DVector<f64>) {
        let views = self.exposures.len();
        let own: Vec<usize> = observed.iter().map(|o| o.view).chain(views..matrix.nrows()).collect();
        let rows: Vec<Vec<f64>> =
            observed.iter().enumerate().map(|(k, o)| self.row(k, observed.len(), &o.seen)).collect();
        let predicted = |o: &Observation| self.shading(&o.seen) + f64::from(self.exposures[o.view][0]);
        let rest: Vec<f64> = observed.iter().map(|o| o.value - predicted(o)).collect();
        let weights = trust(observed, &rest);
        let total: f64 = weights.iter().sum();
        if total < 1e-9 {
            return;
        }
        let mean = weights.iter().zip(&rest).map(|(w, r)| w * r).sum::<f64>() / total;
        let mut average = vec![0.0; own.len()];
        for (row, w) in rows.iter().zip(&weights) {
            average.iter_mut().zip(row).for_each(|(a, x)| *a += w * x / total);
        }
        for ((row, w), r) in rows.iter().zip(&weights).zip(&rest) {
            let centred: Vec<f64> = row.iter().zip(&average).map(|(x, a)| x - a).collect();
            for (k, (i, x)) in own.iter().zip(&centred).enumerate() {
                right[*i] += w * x * (r - mean);
                // The lower half; `own` rises.
                for (j, y) in own[k..].iter().zip(&centred[k..]) {
                    matrix[(*j, *i)] += w * x * y;
                }
            }
        }
    }

    /// Derivatives of an observation, the `k`-th of `count`, by the exposures of these, by the shared numbers and the lamps.
    fn row(&self, k: usize, count: usize, seen: &Seen) -> Vec<f64> {
        let mut row = vec![0.0; count];
        row[k] = 1.0;
        row.extend([seen.radius2, seen.radius2 * seen.radius2, seen.place[0], seen.place[1]]);
        let all = self.falling(&seen.normal).max(1e-3);
        row.push(self.lamps[0].exp() / all);
        let lamps = self.directions.iter().zip(&self.lamps[1..]);
        row.extend(lamps.map(|(d, w)| w.exp() * d.dot(&seen.normal).max(0.0) / all));
        row
    }

    /// What brightness neighbours show that differ in the height of their normals.
    fn heights_of(&self, shots: &[Shot], sights: &[Sight], surface: &Surface) -> Vector3<f64> {
        let sample = |&v: &usize| {
            let one = |f: usize| {
                let (quality, color) = (sights[f].quality[v], sights[f].color[v]);
                let brightness = color.iter().sum::<f32>() / 3.0;
                let shading = || self.shading(&Seen::new(&shots[f], surface, v)) + f64::from(self.exposures[f][0]);
                (quality > 0.0 && brightness > DARK).then(|| f64::from(brightness).ln() - shading())
            };
            let mut own: Vec<f64> = (0..shots.len()).filter_map(one).collect();
            own.sort_by(f64::total_cmp);
            let brightness = *own.get(own.len() / 2)?;
            Some(Sample { place: surface.mesh.positions[v], normal: surface.smooth[v], brightness })
        };
        let samples: Vec<Option<Sample>> = chosen(sights, PAIRED).par_iter().map(sample).collect();
        zonal::solve(&samples.into_iter().flatten().collect::<Vec<_>>())
    }

    /// Exposures of each channel: alternately the vertices' colours and the pictures' exposures.
    fn balance(&mut self, shots: &[Shot], sights: &[Sight], surface: &Surface) {
        let chosen = chosen(sights, VERTICES);
        for channel in 0..3 {
            let lit: Vec<Vec<(usize, f64)>> = chosen
                .par_iter()
                .map(|&v| {
                    let seen =
                        (0..shots.len()).filter(|&f| sights[f].quality[v] > 0.0 && sights[f].color[v][channel] > DARK);
                    seen.map(|f| {
                        let shading = self.shading(&Seen::new(&shots[f], surface, v));
                        (f, f64::from(sights[f].color[v][channel]).ln() - shading)
                    })
                    .collect()
                })
                .collect();
            let mut exposures: Vec<f64> = self.exposures.iter().map(|e| f64::from(e[channel])).collect();
            for _ in 0..10 {
                update_exposures(&lit, &mut exposures);
            }
            let mean = exposures.iter().sum::<f64>() / exposures.len() as f64;
            self.exposures.iter_mut().zip(exposures).for_each(|(e, new)| e[channel] = (new - mean) as f32);
        }
    }
}

/// One round: each vertex's colour from the exposures, then these from the colours, by weighted medians.
fn update_exposures(lit: &[Vec<(usize, f64)>], exposures: &mut [f64]) {
    let mut rest: Vec<Vec<f64>> = vec![Vec::new(); exposures.len()];
    for vertex in lit.iter().filter(|vertex| vertex.len() >= LEAST_VIEWS) {
        let mut own: Vec<f64> = vertex.iter().map(|(f, value)| value - exposures[*f]).collect();
        own.sort_by(f64::total_cmp);
        let middle = own[own.len() / 2];
        vertex.iter().for_each(|(f, value)| rest[*f].push(value - middle));
    }
    for (exposure, mut values) in exposures.iter_mut().zip(rest) {
        values.sort_by(f64::total_cmp);
        if let Some(middle) = values.get(values.len() / 2) {
            *exposure = *middle;
        }
    }
}

/// Weights of a vertex's observations: their own, times Cauchy's by the distance from their median.
fn trust(observed: &[Observation], rest: &[f64]) -> Vec<f64> {
    let mut sorted = rest.to_vec();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted[sorted.len() / 2];
    let of = |(o, r): (&Observation, &f64)| o.weight / (1.0 + ((r - middle) / SCALE).powi(2));
    observed.iter().zip(rest).map(of).collect()
}

/// Vertices that enough pictures show, evenly spread over their numbers.
fn chosen(sights: &[Sight], most: usize) -> Vec<usize> {
    let count = sights.first().map_or(0, |s| s.quality.len());
    let often: Vec<usize> = (0..count)
        .filter(|&v| sights.iter().filter(|s| s.quality[v] > 0.0).take(LEAST_VIEWS).count() == LEAST_VIEWS)
        .collect();
    let step = often.len().div_ceil(most).max(1);
    often.into_iter().step_by(step).collect()
}

fn observations(shots: &[Shot], sights: &[Sight], surface: &Surface) -> Vec<Vec<Observation>> {
    let of_vertex = |&v: &usize| {
        let best = sights.iter().map(|s| s.quality[v]).fold(0.0, f32::max);
        let one = |f: usize| {
            let (quality, color) = (sights[f].quality[v], sights[f].color[v]);
            let brightness = color.iter().sum::<f32>() / 3.0;
            (quality > 0.0 && brightness > DARK).then(|| Observation {
                view: f,
                seen: Seen::new(&shots[f], surface, v),
                value: f64::from(brightness).ln(),
                weight: f64::from(quality / best),
            })
        };
        (0..shots.len()).filter_map(one).collect::<Vec<_>>()
    };
    let all: Vec<Vec<Observation>> = chosen(sights, VERTICES).par_iter().map(of_vertex).collect();
    all.into_iter().filter(|observed| observed.len() >= LEAST_VIEWS).collect()
}

/// Directions all around: the corners of an icosahedron and the middles of its edges.
fn directions() -> Vec<Vector3<f64>> {
    let golden = f64::midpoint(1.0, 5.0f64.sqrt());
    let mut corners = Vec::new();
    for (a, b) in [(1.0, golden), (1.0, -golden), (-1.0, golden), (-1.0, -golden)] {
        corners.extend([Vector3::new(0.0, a, b), Vector3::new(a, b, 0.0), Vector3::new(b, 0.0, a)]);
    }
    let mut all: Vec<Vector3<f64>> = corners.clone();
    for (i, p) in corners.iter().enumerate() {
        let edges = corners[i + 1..].iter().filter(|q| (*q - p).norm() < 2.1);
        all.extend(edges.map(|q| p + q));
    }
    all.into_iter().map(|d| d.normalize()).collect()
}
