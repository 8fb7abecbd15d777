//! All parameters of all primitives at once: Levenberg–Marquardt on distances to the skin.
//!
//! The distance of a point from the skin is (T − F) / |∇F| to first order; |∇F| is held within a step. A sample depends on the few
//! primitives around it, so the normal equations are solved by conjugate gradients without ever being formed. Sums run over fixed
//! blocks of samples in their order, whatever the number of threads.

use nalgebra::{Isometry3, Matrix3, Point3, UnitQuaternion, Vector3};
use rayon::prelude::*;
use toile_character::joint::JOINTS;

use super::{
    samples::{Known, Sample, Samples},
    start::SIZES,
};
use crate::{
    body::ImplicitBody,
    field_function::{FieldFunction, THRESHOLD},
    group::{Group, Groups},
    primitive::Primitive,
};

/// Parameters of a primitive: centre, logarithms of half axes, turn.
const PARAMETERS: usize = 9;
/// Samples a block.
const BLOCK: usize = 512;
/// Steps of conjugate gradients.
const INNER: usize = 30;
/// The slope of the field counts as at least this, 1/m: that of a metaball of 0.2 m at its surface is 4.
const LEAST_SLOPE: f64 = 3.0;
/// Distances beyond this count less and less, metres: a ray beside its mark must not pull.
const ROBUST: f64 = 0.012;
/// How far parameters may go in one step of a fit, as standard deviations of a prior around where it began: 5 cm, a factor of 1.8, 35°.
const PRIOR: [f64; 3] = [0.05, 0.6, 0.6];
/// Weight of the prior beside a sample of 1 m: a tenth of a millimetre a standard deviation and sample.
const PRIOR_WEIGHT: f64 = 0.0006;
/// A primitive belongs to a neighbouring group where a contour of it runs within this share of the influence.
const SHARE: f64 = 0.85;

#[derive(Debug, Clone, Copy)]
struct Ellipsoid {
    /// At rest, in the subject's frame.
    center: Point3<f64>,
    log_axes: Vector3<f64>,
    rotation: UnitQuaternion<f64>,
}

struct Row {
    residual: f64,
    weight: f64,
    entries: Vec<(u32, [f64; PARAMETERS])>,
}

/// A fit under way.
pub(super) struct Problem<'a> {
    body: &'a ImplicitBody,
    samples: &'a Samples,
    field: FieldFunction,
    ellipsoids: Vec<Ellipsoid>,
    groups: Vec<Groups>,
    /// Primitives of each group.
    members: Vec<Vec<u32>>,
}

impl<'a> Problem<'a> {
    pub fn new(body: &'a ImplicitBody, samples: &'a Samples) -> Self {
        let ellipsoids = body
            .primitives
            .iter()
            .map(|p| Ellipsoid {
                center: body.skeleton.position(p.joint) + p.state.center,
                log_axes: p.state.axes.map(f64::ln),
                rotation: p.state.rotation(),
            })
            .collect();
        let groups = body.primitives.iter().map(|p| p.groups).collect();
        let mut problem = Self { body, samples, field: body.field, ellipsoids, groups, members: Vec::new() };
        problem.regroup();
        problem
    }

    /// Takes up to `iterations` steps.
    pub fn descend(&mut self, iterations: usize) {
        let start = self.ellipsoids.clone();
        let mut damping = 1e-2;
        let mut rows = self.rows();
        let mut cost = self.cost(&rows, &start);
        for iteration in 0..iterations {
            let mut is_better = false;
            for _ in 0..4 {
                let step = self.step(&rows, &start, damping);
                let before = self.ellipsoids.clone();
                self.apply(&step);
                let next = self.rows();
                let next_cost = self.cost(&next, &start);
                if next_cost < cost {
                    is_better = cost - next_cost > 1e-4 * cost;
                    (rows, cost) = (next, next_cost);
                    damping = (damping * 0.3).max(1e-5);
                    break;
                }
                self.ellipsoids = before;
                damping *= 5.0;
            }
            if iteration % 4 == 3 && self.regroup() {
                rows = self.rows();
                cost = self.cost(&rows, &start);
            } else if !is_better && iteration % 4 == 3 {
                break;
            }
        }
        self.regroup();
    }

    /// The primitives as they are now.
    pub fn primitives(&self) -> Vec<Primitive> {
        let states = self.body.primitives.iter().zip(self.ellipsoids.iter().zip(&self.groups));
        states
            .map(|(p, (e, &groups))| {
                let mut next = Primitive { groups, ..p.clone() };
                next.state.axes = e.log_axes.map(f64::exp);
                next.state.center = e.center - self.body.skeleton.position(p.joint);
                next.state = next.state.turned(&e.rotation);
                next
            })
            .collect()
    }

    /// Signed distances of the samples at rest from the field's surface, metres; positive where the surface lies inside.
    pub fn errors(&self) -> Vec<f64> {
        let matrices = self.matrices();
        self.samples.rest().par_iter().map(|s| self.row(s, &matrices).map_or(0.02, |r| r.residual)).collect()
    }

    /// Finds which neighbouring groups each primitive reaches into; true where that changed.
    fn regroup(&mut self) -> bool {
        let matrices = self.matrices();
        let rest = self.samples.rest();
        let reaches = |k: usize, g: Group| {
            let (m, e) = (&matrices[k], &self.ellipsoids[k]);
            rest.iter().any(|s| s.group == g && (m * (s.point - e.center)).norm_squared() < SHARE * SHARE)
        };
        let of = |k: usize| -> Groups {
            let home = Group::of_joint(self.body.primitives[k].joint);
            let near = Group::ALL.into_iter().filter(|g| *g == home || (g.meets(home) && reaches(k, *g)));
            near.collect()
        };
        let groups: Vec<Groups> = (0..self.ellipsoids.len()).into_par_iter().map(of).collect();
        let changed = groups != self.groups || self.members.is_empty();
        self.groups = groups;
        let of = |g: Group| (0..self.groups.len() as u32).filter(|&k| self.groups[k as usize].contains(g)).collect();
        self.members = Group::ALL.into_iter().map(of).collect();
        changed
    }

    /// Offsets at rest to units of the influence, by primitive.
    fn matrices(&self) -> Vec<Matrix3<f64>> {
        let influence = self.field.influence();
        let of = |e: &Ellipsoid| {
            Matrix3::from_diagonal(&e.log_axes.map(|l| (-l).exp() / influence))
                * e.rotation.inverse().to_rotation_matrix().matrix()
        };
        self.ellipsoids.iter().map(of).collect()
    }

    fn rows(&self) -> Vec<Row> {
        let matrices = self.matrices();
        self.samples.samples.par_iter().filter_map(|s| self.row(s, &matrices)).collect()
    }

    /// The distance of a sample and how it depends on the parameters; `None` where a bound is kept.
    fn row(&self, sample: &Sample, matrices: &[Matrix3<f64>]) -> Option<Row> {
        let bones: &[Isometry3<f64>] = &self.samples.bones[sample.pose];
        let local: [Option<Point3<f64>>; JOINTS.len()] = [None; JOINTS.len()];
        let mut local = local;
        let (mut value, mut gradient) = (0.0, Vector3::zeros());
        let mut entries = Vec::new();
        for &k in &self.members[sample.group as usize] {
            let primitive = &self.body.primitives[k as usize];
            let joint = primitive.joint.index();
            let at_rest = *local[joint].get_or_insert_with(|| bones[joint].inverse_transform_point(&sample.point));
            let (m, e) = (&matrices[k as usize], &self.ellipsoids[k as usize]);
            let offset = at_rest - e.center;
            let unit = m * offset;
            let s = unit.norm_squared();
            if s >= 1.0 {
                continue;
            }
            value += primitive.weight * self.field.value(s);
            let slope = primitive.weight * self.field.slope(s);
            let by_center = -2.0 * slope * (m.transpose() * unit);
            let by_axes = unit.map(|y| -2.0 * slope * y * y);
            let by_turn = (-by_center).cross(&offset);
            gradient += bones[joint].rotation * -by_center;
            let (c, a, t) = (by_center, by_axes, by_turn);
            entries.push((k, [c.x, c.y, c.z, a.x, a.y, a.z, t.x, t.y, t.z]));
        }
        let wanted = match sample.kind {
            Known::Skin => THRESHOLD,
            Known::AtMost(bound) if value > bound => bound,
            Known::AtLeast(bound) if value < bound => bound,
            Known::AtMost(_) | Known::AtLeast(_) => return None,
        };
        let scale = -1.0 / gradient.norm().max(LEAST_SLOPE);
        entries.iter_mut().flat_map(|(_, d)| d).for_each(|d| *d *= scale);
        let residual = (value - wanted) * scale;
        let robust = 1.0 / (1.0 + (residual / ROBUST).powi(2)).sqrt();
        Some(Row { residual, weight: sample.weight * robust, entries })
    }

    fn cost(&self, rows: &[Row], start: &[Ellipsoid]) -> f64 {
        // the robust weights of a step are those of its own residuals: the cost is their pseudo-Huber function
        let of = |r: &Row| {
            let share = r.residual / ROBUST;
            let plain = r.weight * (1.0 + share * share).sqrt();
            plain * 2.0 * ROBUST * ROBUST * ((1.0 + share * share).sqrt() - 1.0)
        };
        let data: f64 = rows.iter().map(of).sum();
        let offsets = self.offsets(start);
        data + offsets.iter().enumerate().map(|(k, o)| prior(k) * o * o).sum::<f64>()
    }

    /// How far parameters are from where they started.
    fn offsets(&self, start: &[Ellipsoid]) -> Vec<f64> {
        let of = |(e, s): (&Ellipsoid, &Ellipsoid)| {
            let (c, a) = (e.center - s.center, e.log_axes - s.log_axes);
            let t = (e.rotation * s.rotation.inverse()).scaled_axis();
            [c.x, c.y, c.z, a.x, a.y, a.z, t.x, t.y, t.z]
        };
        self.ellipsoids.iter().zip(start).flat_map(of).collect()
    }

    /// One damped step by conjugate gradients.
    fn step(&self, rows: &[Row], start: &[Ellipsoid], damping: f64) -> Vec<f64> {
        let count = self.ellipsoids.len() * PARAMETERS;
        let residuals: Vec<f64> = rows.iter().map(|r| -r.residual).collect();
        let mut right = transposed(rows, &residuals, count);
        for (k, (r, o)) in right.iter_mut().zip(self.offsets(start)).enumerate() {
            *r -= prior(k) * o;
        }
        let mut diagonal = vec![0.0; count];
        for row in rows {
            for (k, d) in &row.entries {
                let at = *k as usize * PARAMETERS;
                d.iter().enumerate().for_each(|(i, d)| diagonal[at + i] += row.weight * d * d);
            }
        }
        let damped: Vec<f64> = diagonal.iter().enumerate().map(|(k, d)| damping * d + prior(k)).collect();
        let scale: Vec<f64> = diagonal.iter().zip(&damped).map(|(d, e)| 1.0 / (d + e)).collect();
        let times = |x: &[f64]| -> Vec<f64> {
            let forward: Vec<f64> = rows.par_iter().with_min_len(BLOCK).map(|r| dot(r, x)).collect();
            let mut y = transposed(rows, &forward, count);
            y.iter_mut().zip(x.iter().zip(&damped)).for_each(|(y, (x, d))| *y += d * x);
            y
        };
        conjugate_gradients(times, &right, &scale)
    }

    fn apply(&mut self, step: &[f64]) {
        for (e, d) in self.ellipsoids.iter_mut().zip(step.chunks_exact(PARAMETERS)) {
            e.center += Vector3::new(d[0], d[1], d[2]);
            let limits = (SIZES.0.ln(), SIZES.1.ln());
            let grown = e.log_axes + Vector3::new(d[3], d[4], d[5]).map(|g| g.clamp(-0.4, 0.4));
            e.log_axes = grown.map(|a| a.clamp(limits.0, limits.1));
            e.rotation = UnitQuaternion::from_scaled_axis(Vector3::new(d[6], d[7], d[8])) * e.rotation;
        }
    }
}

/// Weight of the prior on parameter `k`.
fn prior(k: usize) -> f64 {
    let sigma = PRIOR[k % PARAMETERS / 3];
    (PRIOR_WEIGHT / sigma).powi(2)
}

fn dot(row: &Row, x: &[f64]) -> f64 {
    let of = |(k, d): &(u32, [f64; PARAMETERS])| -> f64 {
        let x = &x[*k as usize * PARAMETERS..][..PARAMETERS];
        d.iter().zip(x).map(|(d, x)| d * x).sum()
    };
    row.entries.iter().map(of).sum()
}

/// Jᵀ W u: sums of blocks of rows, added in order.
fn transposed(rows: &[Row], u: &[f64], count: usize) -> Vec<f64> {
    let block = |(rows, u): (&[Row], &[f64])| {
        let mut sum = vec![0.0; count];
        for (row, u) in rows.iter().zip(u) {
            for (k, d) in &row.entries {
                let at = &mut sum[*k as usize * PARAMETERS..][..PARAMETERS];
                at.iter_mut().zip(d).for_each(|(s, d)| *s += row.weight * u * d);
            }
        }
        sum
    };
    let sums: Vec<Vec<f64>> = rows.par_chunks(8 * BLOCK).zip(u.par_chunks(8 * BLOCK)).map(block).collect();
    let mut total = vec![0.0; count];
    sums.iter().for_each(|sum| total.iter_mut().zip(sum).for_each(|(t, s)| *t += s));
    total
}

/// Solves A x = b for a positive definite A given as a function, scaled by an approximate inverse diagonal.
fn conjugate_gradients(times: impl Fn(&[f64]) -> Vec<f64>, right: &[f64], scale: &[f64]) -> Vec<f64> {
    let inner = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut x = vec![0.0; right.len()];
    let mut rest = right.to_vec();
    let mut scaled: Vec<f64> = rest.iter().zip(scale).map(|(r, s)| r * s).collect();
    let mut way = scaled.clone();
    let mut size = inner(&rest, &scaled);
    let first = size;
    for _ in 0..INNER {
        if size <= 1e-8 * first || size <= 0.0 {
            break;
        }
        let image = times(&way);
        let along = size / inner(&way, &image).max(f64::MIN_POSITIVE);
        x.iter_mut().zip(&way).for_each(|(x, w)| *x += along * w);
        rest.iter_mut().zip(&image).for_each(|(r, i)| *r -= along * i);
        scaled = rest.iter().zip(scale).map(|(r, s)| r * s).collect();
        let next = inner(&rest, &scaled);
        let turn = next / size;
        way.iter_mut().zip(&scaled).for_each(|(w, s)| *w = s + turn * *w);
        size = next;
    }
    x
}
