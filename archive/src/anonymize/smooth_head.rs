//! A head that is nobody's: a stack of smooth ellipses in place of what was scanned.

use nalgebra::{Point3, Vector3};
use toile_geometry::Mesh;

/// Heights of the sections lie so far apart, metres.
const SPACING: f64 = 0.01;
/// Sections are of the points around their height, weighed by a Gaussian of this standard deviation, metres: under it, what tells
/// profiles apart (nose, lips, chin, brows: 10 to 40 mm high) is spread over the head.
const SPREAD: f64 = 0.04;
/// The ends of the Gaussian that count, in standard deviations.
const REACH: f64 = 3.0;
/// Under the crown, sections close as an ellipsoid does, over this height, metres: half a head's breadth.
const CROWN: f64 = 0.08;
/// Rays are followed in steps of this length, metres, and hits halved as often as brings them below a sensor's millimetre.
const STEP: f64 = 0.005;
const HALVINGS: usize = 6;

/// The stack of ellipses, in the scan's frame (+Y up, metres).
pub(super) struct SmoothHead {
    from_height: f64,
    top: f64,
    /// Unit axes of all ellipses in the ground plane.
    axes: [Vector3<f64>; 2],
    /// From `from_height` up.
    sections: Vec<Section>,
}

/// Centre along the two axes, and half the width along each, metres.
#[derive(Clone, Copy)]
struct Section {
    centre: [f64; 2],
    half: [f64; 2],
}

/// Where a ray meets the head.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Met {
    /// Depth at which the ray enters it.
    pub(super) at: Option<f64>,
    /// True where it passes close by.
    pub(super) near: bool,
}

impl SmoothHead {
    /// Of all points of a scan above `from_height`; `None` where there are none.
    pub(super) fn of(scan: &Mesh, from_height: f64, top: f64) -> Option<Self> {
        let points: Vec<Point3<f64>> =
            scan.positions.iter().map(|p| p.cast::<f64>()).filter(|p| p.y > from_height).collect();
        let axes = axes(&points)?;
        let count = ((top - from_height) / SPACING).ceil() as usize + 1;
        let section = |at: usize| section(&points, &axes, from_height + at as f64 * SPACING);
        let mut sections: Vec<Section> = (0..count).map(section).collect();
        for (at, section) in sections.iter_mut().enumerate() {
            let above = (from_height + at as f64 * SPACING - (top - CROWN)).clamp(0.0, CROWN) / CROWN;
            section.half = section.half.map(|half| half * (1.0 - above * above).sqrt());
        }
        Some(Self { from_height, top, axes, sections })
    }

    /// True where a point lies inside, or within `margin` metres beside it.
    fn holds(&self, point: &Point3<f64>, margin: f64) -> bool {
        if point.y < self.from_height || point.y > self.top + margin {
            return false;
        }
        let at = ((point.y - self.from_height) / SPACING).min((self.sections.len() - 1) as f64);
        let (low, share) = (at as usize, at.fract());
        let (a, b) = (self.sections[low], self.sections[(low + 1).min(self.sections.len() - 1)]);
        let mix = |a: f64, b: f64| a + share * (b - a);
        let along = |k: usize| {
            let half = (mix(a.half[k], b.half[k]) + margin).max(1e-6);
            (self.axes[k].dot(&point.coords) - mix(a.centre[k], b.centre[k])) / half
        };
        along(0).powi(2) + along(1).powi(2) < 1.0
    }

    /// Follows the ray `origin + depth * way` from the depth `from` to `to`; `margin` says what passes close by.
    pub(super) fn meet(&self, origin: &Point3<f64>, way: &Vector3<f64>, [from, to]: [f64; 2], margin: f64) -> Met {
        let point = |depth: f64| origin + way * depth;
        let mut met = Met::default();
        let mut before = from;
        while before < to {
            let depth = before + STEP;
            met.near |= self.holds(&point(depth), margin);
            if self.holds(&point(depth), 0.0) {
                // From below, a ray enters through the neck: there is a body in front of it.
                let through_the_neck = point(before).y < self.from_height;
                met.at = (!through_the_neck).then(|| self.halve(before, depth, &point));
                return met;
            }
            before = depth;
        }
        met
    }

    fn halve(&self, mut outside: f64, mut inside: f64, point: &impl Fn(f64) -> Point3<f64>) -> f64 {
        for _ in 0..HALVINGS {
            let middle = f64::midpoint(outside, inside);
            if self.holds(&point(middle), 0.0) {
                inside = middle;
            } else {
                outside = middle;
            }
        }
        inside
    }

    /// The middle of the head, and a radius that holds all of it and `margin` metres more.
    pub(super) fn ball(&self, margin: f64) -> (Point3<f64>, f64) {
        let middle = self.sections[self.sections.len() / 2];
        let height = f64::midpoint(self.from_height, self.top);
        let centre = self.axes[0] * middle.centre[0] + self.axes[1] * middle.centre[1];
        let widest = self.sections.iter().flat_map(|section| section.half).fold(0.0, f64::max);
        let radius = (0.5 * (self.top - self.from_height)).hypot(2.0 * widest) + 2.0 * margin;
        (Point3::new(centre.x, height, centre.z), radius)
    }
}

/// The two directions in the ground plane along which points vary most and least; `None` without points.
fn axes(points: &[Point3<f64>]) -> Option<[Vector3<f64>; 2]> {
    if points.is_empty() {
        return None;
    }
    let count = points.len() as f64;
    let mean = points.iter().fold(Vector3::zeros(), |sum, p| sum + p.coords) / count;
    let mut spread = [0.0; 3];
    for p in points {
        let d = p.coords - mean;
        spread = [spread[0] + d.x * d.x, spread[1] + d.x * d.z, spread[2] + d.z * d.z];
    }
    let angle = 0.5 * (2.0 * spread[1]).atan2(spread[0] - spread[2]);
    Some([Vector3::new(angle.cos(), 0.0, angle.sin()), Vector3::new(-angle.sin(), 0.0, angle.cos())])
}

/// The ellipse at a height. Along an axis, points on an ellipse vary by half the square of its half width.
fn section(points: &[Point3<f64>], axes: &[Vector3<f64>; 2], height: f64) -> Section {
    let weight = |p: &Point3<f64>| (-0.5 * ((p.y - height) / SPREAD).powi(2)).exp();
    let near = || points.iter().filter(|p| (p.y - height).abs() < REACH * SPREAD);
    let all: f64 = near().map(weight).sum::<f64>().max(1e-12);
    let mean = |k: usize| near().map(|p| weight(p) * axes[k].dot(&p.coords)).sum::<f64>() / all;
    let centre = [mean(0), mean(1)];
    let half = [0, 1].map(|k| {
        let variance = near().map(|p| weight(p) * (axes[k].dot(&p.coords) - centre[k]).powi(2)).sum::<f64>() / all;
        (2.0 * variance).sqrt()
    });
    Section { centre, half }
}
