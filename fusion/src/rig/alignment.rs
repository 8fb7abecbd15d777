//! The place of a resting camera from all its frames together: point-to-surface distances of every frame, moved to when it
//! was seen by the turn of the disk, depend on the same six numbers.

use nalgebra::Vector3;
use toile_geometry::Rigid;

use crate::{
    field::Tsdf,
    tracking::{
        CONVERGED, NormalEquations, Residual, Sample, accumulate, centroid, conditioning, gate_of, surface_distance,
        tukey,
    },
};

/// Gauss–Newton steps at most, and those in which the gate follows the data.
const STEPS: usize = 25;
const GATED: usize = 6;

/// A frame of the camera: `model_from_room` when it was seen, and its points.
pub(crate) struct Seen {
    pub turn: Rigid,
    pub points: Vec<Sample>,
}

/// A place that was refined.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Aligned {
    pub room_from_camera: Rigid,
    /// Smallest over largest eigenvalue of the normal matrix.
    pub conditioning: f64,
    /// True when the last step was negligible.
    pub converged: bool,
}

/// Refines the place of a camera over its frames.
pub(crate) fn align(field: &Tsdf, frames: &[Seen], start: &Rigid) -> Aligned {
    let mut found = Aligned { room_from_camera: *start, conditioning: 0.0, converged: false };
    let mut gate = 0.0;
    for step in 0..STEPS {
        let place = found.room_from_camera;
        if step < GATED {
            let gates = frames.iter().map(|f| gate_of(field, &f.points, &(f.turn * place)));
            gate = gates.sum::<f64>() / frames.len().max(1) as f64;
        }
        let center = frames.first().map_or_else(Default::default, |f| centroid(&f.points, &place));
        let one = |f: &Seen| system_of(field, f, &place, &center, gate);
        let system = frames.iter().map(one).fold(NormalEquations::zero(), |a, b| a.plus(&b));
        let change = system.step(&center, 1e-7);
        found.room_from_camera = change.motion * place;
        found.conditioning = conditioning(&system);
        found.converged = change.size < CONVERGED;
        if found.converged {
            break;
        }
    }
    found
}

/// The equations of one frame, in the room.
fn system_of(field: &Tsdf, frame: &Seen, place: &Rigid, center: &nalgebra::Point3<f64>, gate: f64) -> NormalEquations {
    let turn = frame.turn.rotation.cast::<f32>();
    accumulate(&frame.points, place, center, |_, room, normal| {
        let q = toile_geometry::transform_point(&frame.turn, room);
        let surface = surface_distance(field, &q, (turn * Vector3::from(normal)).into())?;
        let gradient = turn.inverse() * Vector3::from(surface.normal);
        Some(Residual { value: surface.distance, gradient: gradient.into(), kernel: tukey(surface.distance, gate) })
    })
}
