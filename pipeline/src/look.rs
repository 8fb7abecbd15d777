//! The avatar's layers in the poses that it will be seen in: those of its motion, and the T-pose of VRM.

use serde::{Deserialize, Serialize};
use toile_avatar::Avatar;
use toile_character::{Motion, Pose, dress_pose::t_pose};
use toile_garments::{PosedReport, TORN, Worn, posed_report};

/// Poses of the motion that are looked at.
pub const POSES: usize = 8;
/// Crossing pairs from which a spot is worth a warning: the rim of one that is 20 mm wide, with edges of 6 mm that cross
/// two triangles each.
const SPOT_PAIRS: usize = 20;

/// The findings of each layer but the innermost, which has nothing below it.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Look {
    /// Name of the motion.
    pub motion: String,
    /// Names of the layers.
    pub layers: Vec<String>,
    /// In poses of the motion, by layer.
    pub in_motion: Vec<PosedReport>,
    /// In the T-pose, by layer.
    pub in_t_pose: Vec<PosedReport>,
}

/// Indices of the poses of a motion of `count` that are looked at: a little more than their share apart, so that a motion
/// that repeats is not looked at in one phase alone.
pub fn sampled(count: usize, poses: usize) -> Vec<usize> {
    (0..poses.min(count)).map(|k| k * (poses + 1) * count / (poses * poses) % count).collect()
}

/// Looks at the layers by their weights alone, as programs that load the avatar show them.
pub fn at(avatar: &Avatar, motion: &Motion) -> Look {
    let worn: Vec<Worn> = avatar.layers.iter().map(|l| Worn { mesh: &l.mesh, weights: &l.weights }).collect();
    let moving: Vec<Pose> = sampled(motion.poses.len(), POSES).into_iter().map(|k| motion.poses[k].clone()).collect();
    let posed = |poses: &[Pose]| {
        let mut reports = posed_report(&worn, &avatar.skeleton, &avatar.pose0, poses);
        reports.drain(..1.min(reports.len()));
        reports
    };
    Look {
        motion: motion.name.clone(),
        layers: avatar.layers.iter().skip(1).map(|l| l.name.clone()).collect(),
        in_motion: posed(&moving),
        in_t_pose: posed(&[t_pose(&avatar.skeleton)]),
    }
}

impl Look {
    /// Places to look at, a sentence each.
    pub fn warnings(&self) -> Vec<String> {
        let moving = format!("the motion `{}`", self.motion);
        let both = self.in_motion.iter().zip(&self.in_t_pose);
        let layer = |(name, (moves, stands)): (&String, (&PosedReport, &PosedReport))| {
            [seen(name, moves, &moving), seen(name, stands, "the T-pose of avatar.vrm")]
        };
        self.layers.iter().zip(both).flat_map(layer).flatten().collect()
    }
}

fn seen(layer: &str, report: &PosedReport, when: &str) -> Vec<String> {
    let (pairs, torn) = (report.crossing_pairs_most, report.torn_most);
    let found = [
        (pairs >= SPOT_PAIRS, format!("in {when} a layer below pokes through it, at up to {pairs} pairs of triangles")),
        (torn > 0, format!("in {when} up to {torn} of its triangles stretch more than {TORN:.0} times")),
    ];
    found.into_iter().filter(|(is_so, _)| *is_so).map(|(_, what)| format!("{layer}: {what}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_of_a_motion_that_repeats_lie_in_different_phases() {
        // Two steps of 40 poses: no two samples in the same phase.
        let mut phases: Vec<usize> = sampled(80, POSES).into_iter().map(|k| k % 40).collect();
        phases.sort_unstable();
        phases.dedup();
        assert_eq!(phases.len(), POSES);
        assert_eq!(sampled(1, POSES), [0]);
        assert!(sampled(0, POSES).is_empty() && sampled(1000, POSES).iter().all(|k| *k < 1000));
    }

    #[test]
    fn warnings_name_the_motion_and_the_t_pose() {
        let calm = PosedReport { stretch_most: 1.0, ..PosedReport::default() };
        let wild = PosedReport { crossing_pairs_most: 30, torn_most: 2, ..calm.clone() };
        let look = Look {
            motion: "dance".into(),
            layers: vec!["01-top".into(), "02-coat".into()],
            in_motion: vec![wild.clone(), calm.clone()],
            in_t_pose: vec![calm, wild],
        };
        let said = look.warnings();
        assert_eq!(said.len(), 4);
        assert!(said[0].starts_with("01-top: in the motion `dance`") && said[2].contains("02-coat: in the T-pose"));
    }
}
