//! Motions that go round: what comes before their first frame, so that the last one's cloth flows into it.

use serde::{Deserialize, Serialize};
use toile_animation::turn_of_loop;
use toile_character::{Motion, Pose, Skeleton};

use super::caches::Cached;
use crate::PipelineError;

/// Seconds of the motion that are played before its first frame: cloth that swings on springs of 5 rad/s, damped by 7/s, has forgotten how
/// it began to some e⁻⁷ by then.
const BEFORE: f64 = 2.0;

/// What is played before a motion that goes round.
pub(super) struct LeadIn {
    /// The poses, the last of them a frame before the motion's first.
    pub poses: Vec<Pose>,
    /// `last_from_first`: where a round ends, seen from where it began.
    around: nalgebra::Isometry3<f64>,
}

/// How well a motion that goes round closes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Endless {
    /// Seconds of it that were played before the first frame.
    pub seconds_before: f64,
    /// Mean and largest distance of the garments' vertices between the last frame and the first, millimetres.
    pub gap_mm: [f64; 2],
}

impl LeadIn {
    /// The lead-in of a motion; `None` where it does not go round.
    pub fn of(motion: &Motion, skeleton: &Skeleton) -> Option<Self> {
        let around = turn_of_loop(motion, skeleton)?;
        // The last pose is the first of the next round.
        let round = motion.poses.len() - 1;
        let wanted = (BEFORE / motion.frame_time).round() as usize;
        let back = around.inverse();
        let mut poses = Vec::with_capacity(wanted);
        let mut moved_back = back;
        for k in 0..wanted {
            let in_round = k % round;
            if k > 0 && in_round == 0 {
                moved_back = back * moved_back;
            }
            poses.push(motion.poses[round - 1 - in_round].moved(&moved_back, skeleton));
        }
        poses.reverse();
        Some(Self { poses, around })
    }

    /// How well the frames in the caches close.
    pub fn closed(&self, cached: &mut [Cached], motion: &Motion) -> Result<Endless, PipelineError> {
        let last = motion.poses.len() - 1;
        let around = self.around.cast::<f32>();
        let (mut sum, mut most, mut count) = (0.0, 0.0f64, 0usize);
        for layer in cached.iter_mut().skip(1) {
            for (first, last) in layer.frame(0)?.iter().zip(layer.frame(last)?) {
                let apart = f64::from((around * first - last).norm()) * 1e3;
                (sum, most, count) = (sum + apart, most.max(apart), count + 1);
            }
        }
        let gap_mm = [sum / count.max(1) as f64, most];
        Ok(Endless { seconds_before: self.poses.len() as f64 * motion.frame_time, gap_mm })
    }
}
