//! The rest of the body kept out of the floor: knees, hands and trunk of those who kneel, lie, sit or turn over.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use toile_character::{Motion, Pose, SkinnedMesh, soles::Soles};
use toile_geometry::statistics::{Rank, median, quantile_by};

use super::{smooth::envelope, stances::Stances};

/// Less than this below the floor is left there, metres: skin gives by more.
const LEFT: f64 = 0.001;
/// Deeper than this in half of all poses is no fault of feet, metres.
const DEEP: f64 = 0.05;
/// Seconds to either side in which the whole goes up for something that comes into the floor.
const RISES: f64 = 0.2;

/// Where most of a motion is deep in the floor, nobody stands on feet: someone lies, swims or stands on the hands. Then the floor is where
/// the body's lowest points are.
pub(super) fn put_on_floor(body: &SkinnedMesh, poses: &mut [Pose]) {
    let mut depths = depths(body, poses);
    if median(&mut depths).is_none_or(|depth| depth < DEEP) {
        return;
    }
    let up = quantile_by(&mut depths, 0.98, Rank::Count).unwrap_or(0.0);
    poses.iter_mut().for_each(|pose| pose.translation.y += up);
}

/// Lifts the whole, smoothly, by the least that keeps the lowest vertex of `body` on the floor; feet that stand stay where they
/// are. Gives the farthest that it was lifted, metres.
pub(super) fn lift(soles: &Soles, body: &SkinnedMesh, motion: &mut Motion, stances: &[Stances; 2]) -> f64 {
    let masks = stances.each_ref().map(|s| s.mask(motion.poses.len()));
    let reach = (RISES / motion.frame_time).round().max(1.0) as usize;
    let depths = depths(body, &motion.poses);
    let mut most = 0.0;
    if depths.iter().all(|depth| *depth <= LEFT) {
        return most;
    }
    let up = envelope(&depths, reach);
    for (k, pose) in motion.poses.iter_mut().enumerate() {
        pose.translation.y += up[k];
        most = f64::max(most, up[k]);
        let standing = soles.feet().iter().zip(&masks).filter(|(_, mask)| mask[k] && up[k] > 0.0);
        for (sole, _) in standing {
            let by = -soles.height_of(sole, pose);
            sole.leg.move_ankle(soles.skeleton(), pose, &(Vector3::y() * by));
        }
    }
    // legs that were bent again may have brought a knee into the floor
    let left = self::depths(body, &motion.poses);
    motion.poses.iter_mut().zip(left).for_each(|(pose, depth)| pose.translation.y += depth);
    most
}

/// How far each pose's lowest vertex is below the floor, metres; 0 where it is above, or hardly below.
fn depths(body: &SkinnedMesh, poses: &[Pose]) -> Vec<f64> {
    let depth = |pose: &Pose| {
        let transforms = pose.skinning_transforms(&body.skeleton);
        let rows: Vec<[f64; 4]> = transforms
            .iter()
            .map(|t| {
                let row = t.to_homogeneous();
                [row[(1, 0)], row[(1, 1)], row[(1, 2)], row[(1, 3)]]
            })
            .collect();
        let height = |(v, p): (usize, &Point3<f32>)| {
            let at = |[x, y, z, w]: [f64; 4]| x * f64::from(p.x) + y * f64::from(p.y) + z * f64::from(p.z) + w;
            body.weights.of(v).map(|(j, weight)| f64::from(weight) * at(rows[usize::from(j)])).sum::<f64>()
        };
        let low = body.mesh.positions.iter().enumerate().map(height).fold(f64::INFINITY, f64::min);
        if -low > LEFT { -low } else { 0.0 }
    };
    poses.par_iter().map(depth).collect()
}
