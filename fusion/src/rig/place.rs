//! Places of a camera: how far they are apart where the subject is, and their mean.

use nalgebra::{Matrix6xX, Point3, UnitQuaternion, Vector3, Vector6};
use toile_geometry::{Rigid, statistics::median};

/// Half the height and width of the part of the subject at which places are compared, metres.
const EXTENT: f64 = 0.5;
/// Rounds of the robust mean, and the distance (in median distances) beyond which a place does not count.
const ROUNDS: usize = 5;
const OUTSIDE: f64 = 3.0;

/// Where in the room places are compared: around a point of the subject.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Subject {
    /// Room frame, metres.
    pub center: Point3<f64>,
}

impl Subject {
    /// The largest distance between where two places put the same points of the subject, metres.
    pub(crate) fn distance(&self, a: &Rigid, b: &Rigid) -> f64 {
        let motion = b * a.inverse();
        let moved = |d: Vector3<f64>| {
            let p = self.center + d;
            (motion * p - p).norm()
        };
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
        axes.iter().flat_map(|d| [moved(d * EXTENT), moved(d * -EXTENT)]).fold(0.0, f64::max)
    }

    /// The place that most others lie near, and which ones do. `None` where there is none.
    pub(crate) fn consensus(&self, places: &[Rigid], within: f64) -> Option<(Rigid, Vec<usize>)> {
        let near = |a: &Rigid| -> Vec<usize> {
            (0..places.len()).filter(|&j| self.distance(a, &places[j]) < within).collect()
        };
        // Of several with as many neighbours, the first.
        let best = places.iter().map(|a| (a, near(a))).rev().max_by_key(|(_, near)| near.len())?;
        Some((*best.0, best.1))
    }

    /// The robust mean of places near each other.
    pub(crate) fn mean(&self, places: &[Rigid]) -> Option<Rigid> {
        let (mut mean, _) = self.consensus(places, 0.01)?;
        for _ in 0..ROUNDS {
            let mut distances: Vec<f64> = places.iter().map(|p| self.distance(&mean, p)).collect();
            let limit = OUTSIDE * median(&mut distances)?.max(1e-9);
            let inside = places.iter().filter(|p| self.distance(&mean, p) <= limit);
            let steps: Vec<Vector6<f64>> = inside.map(|p| self.step(&mean, p)).collect();
            let step: Vector6<f64> = Matrix6xX::from_columns(&steps).column_mean();
            mean = self.moved(&mean, &step);
        }
        Some(mean)
    }

    /// From one place to another: turn about the subject's centre (axis times angle) and shift there.
    pub(crate) fn step(&self, from: &Rigid, to: &Rigid) -> Vector6<f64> {
        let motion = to * from.inverse();
        let (turn, shift) = (motion.rotation.scaled_axis(), motion * self.center - self.center);
        Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z)
    }

    /// The inverse of [`Subject::step`].
    fn moved(&self, from: &Rigid, step: &Vector6<f64>) -> Rigid {
        crate::tracking::increment(step, &self.center) * from
    }
}

/// How far apart two places are: metres between the cameras, and degrees.
pub(crate) fn apart(a: &Rigid, b: &Rigid) -> (f64, f64) {
    let turn: UnitQuaternion<f64> = a.rotation.inverse() * b.rotation;
    ((a.translation.vector - b.translation.vector).norm(), turn.angle().to_degrees())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_forgets_places_far_off() {
        let subject = Subject { center: Point3::new(0.0, 0.9, 0.0) };
        let truth = Rigid::new(Vector3::new(0.1, 1.0, 2.2), Vector3::new(0.0, 2.9, 0.1));
        let off = |k: u32, size: f64| {
            let at = |j: u32| (f64::from(k * 7 + j) * 2.399).sin() * size;
            Rigid::new(Vector3::new(at(0), at(1), at(2)), Vector3::new(at(3), at(4), at(5))) * truth
        };
        let mut places: Vec<Rigid> = (0..40).map(|k| off(k, 0.002)).collect();
        places.extend((40..50).map(|k| off(k, 0.1)));
        let mean = subject.mean(&places).unwrap();
        assert!(subject.distance(&mean, &truth) < 0.0012, "{}", subject.distance(&mean, &truth));
        assert!(subject.consensus(&places, 0.012).unwrap().1.len() >= 40);
        assert!(subject.mean(&[]).is_none());
    }
}
