//! The known body inside a dressed scan, once the pose is found: hands brought to where they are seen, skin drawn inside.

use nalgebra::Point3;
use serde::{Deserialize, Serialize};
use toile_character::{BodyModel, Pose, SkinnedMesh};
use toile_geometry::Mesh;

use super::{contain::contained, inside::Inside};
use crate::{FittingError, Method, UnderSettings, fit::fit_hands_again, surface::trust_of};

/// A vertex that moved less than this stayed, metres.
const MOVED: f32 = 0.0005;

/// The body under a dressed scan.
#[derive(Debug, Clone)]
pub struct SettledBody {
    /// The pose, with arms and wrists turned so that the hands lie on this scan.
    pub pose: Pose,
    /// The body in that pose and the scan's frame, drawn inside the scan; template topology.
    pub mesh: Mesh,
    /// The actions taken.
    pub report: SettleReport,
}

/// The moves of settling the body.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SettleReport {
    /// Largest turn of an arm's joint or wrist, degrees.
    pub hand_turn_deg: f64,
    /// Share of the body's outer vertices that were moved by more than half a millimetre, 0–1.
    pub moved: f64,
    /// Farthest that one was moved, millimetres.
    pub moved_most_mm: f64,
    /// Share of the body's outer vertices that lay more than 2 mm outside the scan before they were moved, however far,
    /// 0–1.
    pub outside_before: f64,
    /// The same of the settled body.
    pub outside: f64,
    /// How far the farthest of these lies from the scan, millimetres.
    pub outside_most_mm: f64,
}

/// Settles the body (its own shape at rest, template topology of `model`) in `pose` (from [`crate::pose_under`]) inside
/// `scan`: brings the hands to what is seen of them, then moves skin that lies over the scan inward and counts what is
/// left outside. Skin that cloth covers keeps its shape. With [`Method::Seed`] the body only is posed and counted. Same
/// result for any number of threads.
///
/// # Errors
/// [`FittingError::Mesh`] where the body is not of the model's topology; [`FittingError::Scan`] where the scan is broken.
pub fn settle_under(
    model: &BodyModel,
    body: &SkinnedMesh,
    pose: &Pose,
    scan: &Mesh,
    settings: &UnderSettings,
) -> Result<SettledBody, FittingError> {
    if body.mesh.positions.len() != model.vertex_count() {
        let (have, want) = (body.mesh.positions.len(), model.vertex_count());
        return Err(FittingError::Mesh(format!("it has {have} vertices, but the template has {want}")));
    }
    scan.validate().map_err(|e| FittingError::Scan(e.to_string()))?;
    let mut scan = scan.clone();
    scan.recompute_normals();
    let trust = trust_of(&scan);
    let inside = Inside::new(&scan);
    let is_settled = settings.method == Method::Toile;
    let turned = if is_settled { fit_hands_again(model, body, &scan, &trust, pose)? } else { pose.clone() };
    let posed = body.posed(&turned);
    let points = if is_settled { contained(model, &posed, (&scan, &trust), &inside) } else { posed.clone() };
    let report = report(model, &inside, &posed, &points, largest_turn(pose, &turned));
    let mut mesh = Mesh { positions: points, normals: Vec::new(), ..body.mesh.clone() };
    mesh.recompute_normals();
    Ok(SettledBody { pose: turned, mesh, report })
}

/// The moves from `posed` to `points`, and the vertices that still lie outside.
fn report(
    model: &BodyModel,
    inside: &Inside,
    posed: &[Point3<f32>],
    points: &[Point3<f32>],
    hand_turn_deg: f64,
) -> SettleReport {
    let outer: Vec<usize> = (0..points.len()).filter(|&v| !model.inner[v]).collect();
    let share = |count: usize| count as f64 / outer.len().max(1) as f64;
    let moves = outer.iter().map(|&v| (posed[v] - points[v]).norm());
    let count = |out: &[bool]| outer.iter().filter(|v| out[**v]).count();
    let is_outside = inside.is_outside(points);
    let deepest = outer.iter().filter(|v| is_outside[**v]).map(|&v| inside.depth_outside(&points[v]));
    SettleReport {
        hand_turn_deg,
        moved: share(moves.clone().filter(|m| *m > MOVED).count()),
        moved_most_mm: 1e3 * f64::from(moves.fold(0.0, f32::max)),
        outside_before: share(count(&inside.is_outside(posed))),
        outside: share(count(&is_outside)),
        outside_most_mm: 1e3 * f64::from(deepest.fold(0.0, f32::max)),
    }
}

fn largest_turn(a: &Pose, b: &Pose) -> f64 {
    let turns = a.rotations.iter().zip(&b.rotations).map(|(a, b)| a.angle_to(b).to_degrees());
    turns.fold(0.0, f64::max)
}
