//! Sampling all contours of a plan on a shape (paper 002 §2).

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::{
    bones::{Bones, Plane},
    boundary,
    plan::{Plan, Rule},
    surface::{Ray, Surface},
};

/// How much farther than the point that it passes a ray between rims looks: a fifth as far again, and 2.5 cm. Contours between rims
/// bulge less than that, and the next limb is farther away.
const BEYOND: (f64, f64) = (1.2, 0.025);

/// How much farther from the bone than at rest skin may go in a pose, as a factor and metres more: a biceps or calf that tightens
/// makes its limb a tenth thicker, a bent knee stands out as much again. A ray that is still inside there has run into another part of
/// the body that came near, such as the shank behind a bent knee, and ends there.
const BULGE: (f64, f64) = (1.2, 0.008);

/// The points of all contours.
#[derive(Debug, Clone)]
pub struct Contours {
    /// Points, by node of the plan.
    pub points: Vec<Point3<f64>>,
    /// The rays that they were found on, by node.
    pub rays: Vec<Ray>,
    /// From the ray's origin to the point that it passes, metres; 0 on rings, whose rays pass none.
    pub lengths: Vec<f64>,
    /// Points whose ray missed the shape: they lie where they were expected.
    pub missed: usize,
}

/// One point with its ray.
#[derive(Debug, Clone, Copy)]
struct Sample {
    point: Point3<f64>,
    ray: Ray,
    length: f64,
    is_hit: bool,
}

impl Contours {
    /// How far beyond the point that its ray passes each point lies (on rings, beyond the origin), metres.
    pub fn beyond(&self) -> Vec<f64> {
        let rays = self.points.iter().zip(&self.rays).zip(&self.lengths);
        rays.map(|((point, ray), length)| (point - ray.origin).dot(&ray.direction) - length).collect()
    }
}

/// Samples the contours of `plan` for a skeleton in a pose on `surface`; `rims` are the rims of the extremities in that pose. Where
/// it is known how far beyond those that their rays pass points lie at rest (`at_rest`, else empty), no point goes much farther.
pub fn sample(
    plan: &Plan,
    bones: &Bones,
    rims: &[Vec<Point3<f64>>; 5],
    at_rest: &[f64],
    surface: &dyn Surface,
) -> Contours {
    let planes: Vec<(Plane, Vector3<f64>, Vector3<f64>)> = planes(plan, bones);
    let nothing = Ray { group: plan.nodes[0].group, origin: Point3::origin(), direction: Vector3::y(), reach: 0.0 };
    let count = plan.nodes.len();
    let mut out = Contours {
        points: vec![Point3::origin(); count],
        rays: vec![nothing; count],
        lengths: vec![0.0; count],
        missed: 0,
    };
    let sampler = Sampler { plan, bones, rims, planes: &planes, at_rest, surface };
    for phase in &plan.phases {
        let of = |&n: &u32| sampler.one(n, &out);
        let samples: Vec<Sample> = phase.par_iter().with_min_len(64).map(of).collect();
        for (&n, sample) in phase.iter().zip(samples) {
            out.points[n as usize] = sample.point;
            out.rays[n as usize] = sample.ray;
            out.lengths[n as usize] = sample.length;
            out.missed += usize::from(!sample.is_hit);
        }
    }
    out
}

/// The plane of each section with its axes.
pub(crate) fn planes(plan: &Plan, bones: &Bones) -> Vec<(Plane, Vector3<f64>, Vector3<f64>)> {
    let of = |s: &crate::plan::Section| {
        let plane = bones.plane(&s.chain, s.link, s.share);
        let (x, y) = plane.axes(&s.reference);
        (plane, x, y)
    };
    plan.sections.iter().map(of).collect()
}

/// What the rays of one pose are found from.
struct Sampler<'a> {
    plan: &'a Plan,
    bones: &'a Bones,
    rims: &'a [Vec<Point3<f64>>; 5],
    planes: &'a [(Plane, Vector3<f64>, Vector3<f64>)],
    at_rest: &'a [f64],
    surface: &'a dyn Surface,
}

impl Sampler<'_> {
    fn one(&self, n: u32, done: &Contours) -> Sample {
        let node = &self.plan.nodes[n as usize];
        let (origin, passed) = match &node.rule {
            Rule::Rim { extremity, place } => {
                let point = boundary::at(&self.rims[*extremity as usize], *place);
                let ray = Ray { group: node.group, origin: point, direction: Vector3::y(), reach: 0.0 };
                return Sample { point, ray, length: 0.0, is_hit: true };
            }
            Rule::Ring { section, angle } => {
                let (plane, x, y) = &self.planes[*section as usize];
                let direction = x * angle.cos() + y * angle.sin();
                let ray = Ray { group: node.group, origin: plane.origin, direction, reach: node.reach };
                return self.cast(n, ray, 0.0, 0.3 * node.reach);
            }
            Rule::Between { start, goal, share, link } => {
                let ends = (self.bones.at(link.0), self.bones.at(link.1));
                boundary::ray(&done.points[*start as usize], &done.points[*goal as usize], *share, ends)
            }
            Rule::Span(weights) => {
                let sum = |of: &dyn Fn(usize) -> Point3<f64>| {
                    Point3::from(weights.iter().map(|(n, w)| of(*n as usize).coords * *w).sum::<Vector3<f64>>())
                };
                (sum(&|n| done.rays[n].origin), sum(&|n| done.points[n]))
            }
        };
        let way = passed - origin;
        let length = way.norm();
        let Some(direction) = way.try_normalize(1e-6) else {
            let ray = Ray { group: node.group, origin, direction: Vector3::y(), reach: 0.0 };
            return Sample { point: passed, ray, length: 0.0, is_hit: false };
        };
        let ray = Ray { group: node.group, origin, direction, reach: BEYOND.0 * length + BEYOND.1 };
        self.cast(n, ray, length, length)
    }

    /// Where node `n`'s ray leaves the surface; `expected` along it where that is not known better.
    fn cast(&self, n: u32, mut ray: Ray, length: f64, expected: f64) -> Sample {
        let at_rest = self.at_rest.get(n as usize).map(|beyond| (length + beyond).max(0.0));
        if let Some(t) = at_rest {
            ray.reach = ray.reach.min(BULGE.0 * t + BULGE.1);
        }
        let hit = self.surface.outermost(&ray);
        let t = hit.or(at_rest).unwrap_or(expected);
        Sample { point: ray.at(t), ray, length, is_hit: hit.is_some() || at_rest.is_some() }
    }
}
