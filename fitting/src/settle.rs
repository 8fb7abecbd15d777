//! The known body inside a dressed scan, once the pose is found: hands brought to where they are seen, no skin outside.

use serde::Serialize;
use toile_character::{BodyModel, Pose, SkinnedMesh};
use toile_geometry::Mesh;

use crate::{FittingError, body_fit::trust_of, contain::contained, fingers::fit_hands_again};

/// The body under a dressed scan.
#[derive(Debug, Clone)]
pub struct SettledBody {
    /// The pose, with arms and wrists turned so that the hands lie on this scan.
    pub pose: Pose,
    /// The body in that pose and the scan's frame, drawn inside the scan; template topology.
    pub mesh: Mesh,
    /// What was done.
    pub report: SettleReport,
}

/// What settling the body moved.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SettleReport {
    /// Largest turn of an arm's joint or wrist, degrees.
    pub hand_turn_deg: f64,
    /// Part of the body's outer vertices that were moved by more than half a millimetre, 0–1.
    pub moved: f64,
    /// Farthest that one was moved, millimetres.
    pub moved_most_mm: f64,
}

/// Settles the body (its own shape at rest, template topology of `model`) in `pose` (from [`crate::pose_under`]) inside
/// `scan`: brings the hands to what is seen of them, then moves skin that lies over the scan inward. Skin that cloth
/// covers keeps its shape. Same result for any number of threads.
///
/// # Errors
/// [`FittingError::Mesh`] where the body is not of the model's topology; [`FittingError::Scan`] where the scan is broken.
pub fn settle_under(
    model: &BodyModel,
    body: &SkinnedMesh,
    pose: &Pose,
    scan: &Mesh,
) -> Result<SettledBody, FittingError> {
    if body.mesh.positions.len() != model.vertex_count() {
        let (have, want) = (body.mesh.positions.len(), model.vertex_count());
        return Err(FittingError::Mesh(format!("{have} vertices, but the template has {want}")));
    }
    scan.validate().map_err(|e| FittingError::Scan(e.to_string()))?;
    let mut scan = scan.clone();
    scan.recompute_normals();
    let trust = trust_of(&scan);
    let turned = fit_hands_again(model, body, &scan, &trust, pose)?;
    let posed = body.posed(&turned);
    let points = contained(model, &posed, &scan, &trust);
    let outer = (0..points.len()).filter(|&v| !model.inner[v]);
    let moves: Vec<f32> = outer.map(|v| (posed[v] - points[v]).norm()).collect();
    let report = SettleReport {
        hand_turn_deg: largest_turn(pose, &turned),
        moved: moves.iter().filter(|m| **m > 0.0005).count() as f64 / moves.len().max(1) as f64,
        moved_most_mm: 1e3 * f64::from(moves.iter().fold(0.0f32, |a, &b| a.max(b))),
    };
    let mut mesh = Mesh { positions: points, normals: Vec::new(), ..body.mesh.clone() };
    mesh.recompute_normals();
    Ok(SettledBody { pose: turned, mesh, report })
}

fn largest_turn(a: &Pose, b: &Pose) -> f64 {
    let turns = a.rotations.iter().zip(&b.rotations).map(|(a, b)| a.angle_to(b).to_degrees());
    turns.fold(0.0, f64::max)
}
