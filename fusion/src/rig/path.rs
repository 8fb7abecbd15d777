//! How the disk has turned at any time, from the leading sensor's poses.

use toile_geometry::Rigid;

use crate::tracking::scaled;

/// The turn of the disk is followed beyond the first and the last pose by at most this many steps.
const BEYOND: f64 = 1.5;

/// The poses of the leading sensor over the host's time.
pub(crate) struct Path {
    /// Host time (ns) and `model_from_room`: the room is the model's frame at the first pose.
    turns: Vec<(i64, Rigid)>,
}

impl Path {
    /// From host times (ns) and poses (model_from_camera) in the order of time.
    pub(crate) fn new(poses: impl Iterator<Item = (i64, Rigid)>) -> Self {
        let mut turns: Vec<(i64, Rigid)> = poses.collect();
        let first = turns.first().map_or_else(Rigid::identity, |t| t.1).inverse();
        turns.iter_mut().for_each(|t| t.1 *= first);
        Self { turns }
    }

    /// `model_from_room` at a host time, ns: between two poses the disk turns evenly.
    pub(crate) fn at(&self, time_ns: i64) -> Rigid {
        let after = self.turns.partition_point(|t| t.0 <= time_ns).clamp(1, self.turns.len().max(2) - 1);
        let (Some(a), Some(b)) = (self.turns.get(after - 1), self.turns.get(after)) else {
            return self.turns.first().map_or_else(Rigid::identity, |t| t.1);
        };
        let share = (time_ns - a.0) as f64 / (b.0 - a.0).max(1) as f64;
        scaled(&(b.1 * a.1.inverse()), share.clamp(1.0 - BEYOND, BEYOND)) * a.1
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Vector3};

    use super::*;

    #[test]
    fn between_two_poses_the_disk_turns_evenly() {
        let camera = Isometry3::translation(0.1, 1.0, 2.0);
        let turned = |a: f64| Isometry3::rotation(Vector3::y() * a);
        let path = Path::new((0..20).map(|k| (k * 100, turned(0.06 * k as f64) * camera)));
        for t in [0, 50, 333, 1850, 1900, 1940] {
            let off = path.at(t).inverse() * turned(0.0006 * t as f64);
            assert!(off.rotation.angle() < 1e-9 && off.translation.vector.norm() < 1e-9, "{t}");
        }
        assert_eq!(Path::new([(5, camera)].into_iter()).at(9), Rigid::identity());
    }
}
