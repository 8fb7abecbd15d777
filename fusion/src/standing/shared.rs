//! How much of the subject two cameras see in common, and how much they contradict each other.

use toile_geometry::{Rigid, transform_point};

use super::align::Sight;
use crate::{
    frame::{DepthView, dot},
    tracking::{Sample, samples},
};

/// Points of a camera that are looked up in another one's picture.
const POINTS: usize = 3000;
/// Two cameras see the same place within this distance, metres.
const SAME: f32 = 0.02;
/// A camera that sees this much farther than where another one sees a surface looks through it, metres.
const THROUGH: f32 = 0.04;

/// Shares of a camera's points of the subject.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Shared {
    /// Those that the other camera sees, too.
    pub seen: f64,
    /// Those where the other camera looks through the subject.
    pub contradicted: f64,
}

/// What two cameras see of the subject in common: the smaller share of what they both see, the larger of contradictions.
pub(crate) fn shared(a: (&Sight, &Rigid), b: (&Sight, &Rigid)) -> Shared {
    let (there, back) = (shared_by(a, b), shared_by(b, a));
    Shared { seen: there.seen.min(back.seen), contradicted: there.contradicted.max(back.contradicted) }
}

fn shared_by((a, pose_a): (&Sight, &Rigid), (b, pose_b): (&Sight, &Rigid)) -> Shared {
    let points = samples(&a.subject, POINTS);
    let b_from_a = pose_b.inverse() * pose_a;
    let all: Vec<Look> = points.iter().map(|s| look(s, &b_from_a, &b.room)).collect();
    let share = |what: Look| all.iter().filter(|l| **l == what).count() as f64 / all.len().max(1) as f64;
    Shared { seen: share(Look::Same), contradicted: share(Look::Through) }
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Look {
    /// Sees the point.
    Same,
    /// Sees something behind it.
    Through,
    /// Sees something before it, or nothing.
    Hidden,
}

fn look(s: &Sample, b_from_a: &Rigid, view: &DepthView) -> Look {
    let p = transform_point(b_from_a, &s.point);
    let camera = &view.camera;
    let (u, v) =
        (camera.fx as f32 * p.x / p.z + camera.cx as f32 + 0.5, camera.fy as f32 * p.y / p.z + camera.cy as f32 + 0.5);
    let is_inside = p.z > 0.05 && u >= 0.0 && v >= 0.0 && u < camera.width as f32 && v < camera.height as f32;
    let Some((q, n)) = is_inside.then(|| view.element_at(u as usize, v as usize)).flatten() else {
        return Look::Hidden;
    };
    let normal = b_from_a.rotation.cast::<f32>() * nalgebra::Vector3::from(s.normal);
    let distance = dot(n, [p.x - q[0], p.y - q[1], p.z - q[2]]);
    if q[2] - p.z > THROUGH {
        Look::Through
    } else if distance.abs() < SAME && dot(n, normal.into()) > 0.5 {
        Look::Same
    } else {
        Look::Hidden
    }
}
