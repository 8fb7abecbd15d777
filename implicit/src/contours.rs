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

/// The points of all contours.
#[derive(Debug, Clone)]
pub struct Contours {
    /// Points, by node of the plan.
    pub points: Vec<Point3<f64>>,
    /// The rays that they were found on, by node.
    pub rays: Vec<Ray>,
    /// Points whose ray missed the shape: they lie where they were expected.
    pub missed: usize,
}

/// One point with its ray.
#[derive(Debug, Clone, Copy)]
struct Sample {
    point: Point3<f64>,
    ray: Ray,
    is_hit: bool,
}

/// Samples the contours of `plan` for a skeleton in a pose on `surface`; `rims` are the rims of the extremities in that pose.
pub fn sample(plan: &Plan, bones: &Bones, rims: &[Vec<Point3<f64>>; 5], surface: &dyn Surface) -> Contours {
    let planes: Vec<(Plane, Vector3<f64>, Vector3<f64>)> = planes(plan, bones);
    let nothing = Ray { group: plan.nodes[0].group, origin: Point3::origin(), direction: Vector3::y(), reach: 0.0 };
    let mut out =
        Contours { points: vec![Point3::origin(); plan.nodes.len()], rays: vec![nothing; plan.nodes.len()], missed: 0 };
    for phase in &plan.phases {
        let of = |&n: &u32| one(plan, n, bones, rims, &planes, &out, surface);
        let samples: Vec<Sample> = phase.par_iter().with_min_len(64).map(of).collect();
        for (&n, sample) in phase.iter().zip(samples) {
            out.points[n as usize] = sample.point;
            out.rays[n as usize] = sample.ray;
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

fn one(
    plan: &Plan,
    n: u32,
    bones: &Bones,
    rims: &[Vec<Point3<f64>>; 5],
    planes: &[(Plane, Vector3<f64>, Vector3<f64>)],
    done: &Contours,
    surface: &dyn Surface,
) -> Sample {
    let node = &plan.nodes[n as usize];
    let (origin, passed) = match &node.rule {
        Rule::Rim { extremity, place } => {
            let point = boundary::at(&rims[*extremity as usize], *place);
            let ray = Ray { group: node.group, origin: point, direction: Vector3::y(), reach: 0.0 };
            return Sample { point, ray, is_hit: true };
        }
        Rule::Ring { section, angle } => {
            let (plane, x, y) = &planes[*section as usize];
            let direction = x * angle.cos() + y * angle.sin();
            let ray = Ray { group: node.group, origin: plane.origin, direction, reach: node.reach };
            return cast(ray, 0.3 * node.reach, surface);
        }
        Rule::Between { start, goal, share, link } => {
            let ends = (bones.at(link.0), bones.at(link.1));
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
        return Sample { point: passed, ray, is_hit: false };
    };
    cast(Ray { group: node.group, origin, direction, reach: BEYOND.0 * length + BEYOND.1 }, length, surface)
}

fn cast(ray: Ray, expected: f64, surface: &dyn Surface) -> Sample {
    let hit = surface.outermost(&ray);
    Sample { point: ray.at(hit.unwrap_or(expected)), ray, is_hit: hit.is_some() }
}
