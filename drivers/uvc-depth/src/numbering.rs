//! Numbers of frames, which go on where the kernel counts anew.

/// Counts the frames of a stream, those that were lost too.
#[derive(Debug, Clone, Copy, Default)]
pub struct Numbering {
    last: Option<Came>,
    /// Nanoseconds from frame to frame, as the last ones were.
    interval_ns: Option<i64>,
}

/// The frame that came last.
#[derive(Debug, Clone, Copy)]
struct Came {
    number: u64,
    /// The kernel's number; none after a restart.
    sequence: Option<u32>,
    time_ns: i64,
}

impl Numbering {
    /// The kernel counts anew from now on; the time until the next frame shows how many are lost.
    pub fn restart(&mut self) {
        self.last = self.last.map(|last| Came { sequence: None, ..last });
    }

    /// Number of the frame with the kernel's `sequence` and `time_ns`, and how many were lost before it.
    pub fn count(&mut self, sequence: u32, time_ns: i64) -> (u64, u64) {
        let Some(last) = self.last else {
            self.last = Some(Came { number: sequence.into(), sequence: Some(sequence), time_ns });
            return (sequence.into(), 0);
        };
        let passed = time_ns.saturating_sub(last.time_ns).max(0) as u64;
        let steps = match (last.sequence, self.interval_ns) {
            // The kernel's counter is 32 bits wide and wraps; the difference does not mind.
            (Some(before), _) => u64::from(sequence.wrapping_sub(before)),
            (None, Some(interval)) => (passed as f64 / interval as f64).round() as u64,
            (None, None) => 1,
        };
        let steps = steps.max(1);
        if last.sequence.is_some() && passed >= steps {
            self.interval_ns = Some((passed / steps) as i64);
        }
        let number = last.number + steps;
        self.last = Some(Came { number, sequence: Some(sequence), time_ns });
        (number, steps - 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: i64 = 33_333_333;

    #[test]
    fn numbers_go_on_after_a_silence_and_what_was_lost_in_it_is_counted() {
        let mut numbering = Numbering::default();
        let before = [0, 1, 3].map(|k| numbering.count(k, i64::from(k) * FRAME));
        assert_eq!(before, [(0, 0), (1, 0), (3, 1)]);
        numbering.restart();
        let after = [0, 1, 2].map(|k| numbering.count(k, (64 + i64::from(k)) * FRAME + 2_000_000));
        assert_eq!(after, [(64, 60), (65, 0), (66, 0)]);
    }

    #[test]
    fn the_kernels_counter_wraps_and_a_number_that_stands_still_is_the_next_frame() {
        let mut numbering = Numbering::default();
        let numbers = [u32::MAX, 1, 1].map(|k| numbering.count(k, 0));
        assert_eq!(numbers, [(0xffff_ffff, 0), (0x1_0000_0001, 1), (0x1_0000_0002, 0)]);
    }
}
