//! Numbers of frames, by their times and by the camera's own counter where it has one.

/// Numbers the frames of a camera that gives one each period.
#[derive(Debug, Clone, Copy)]
pub struct Numbering {
    period_ns: f64,
    last: Option<Last>,
}

/// The frame before.
#[derive(Debug, Clone, Copy)]
struct Last {
    number: u64,
    time_ns: i64,
    sequence: Option<u32>,
}

impl Numbering {
    /// For frames that are `period_ns` nanoseconds apart where none is lost.
    pub fn new(period_ns: f64) -> Self {
        Self { period_ns, last: None }
    }

    /// Number of the frame at `time_ns` (nanoseconds of the camera's clock) and how many were lost before it.
    ///
    /// Where this frame and the one before have the camera's own number, the difference counts; else how many periods have
    /// passed. A camera that counts anew, or says nonsense, has not lost thousands of frames: a difference that does not
    /// fit the time is left out.
    pub fn count(&mut self, time_ns: i64, sequence: Option<u32>) -> (u64, u64) {
        let (number, lost) = match self.last {
            None => (u64::from(sequence.unwrap_or(0)), 0),
            Some(last) => {
                let passed = time_ns.saturating_sub(last.time_ns) as f64;
                let by_time = (passed / self.period_ns).round().max(1.0) as u64;
                let by_sequence = sequence.zip(last.sequence).map(|(now, before)| u64::from(now.wrapping_sub(before)));
                let steps = by_sequence.filter(|steps| (1..=by_time + 2).contains(steps)).unwrap_or(by_time);
                (last.number + steps, steps - 1)
            }
        };
        self.last = Some(Last { number, time_ns, sequence });
        (number, lost)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_go_by_time_or_by_a_counter_that_fits_it() {
        let count = |frames: &[(i64, Option<u32>)]| {
            let mut numbering = Numbering::new(100.0);
            frames.iter().map(|(time, sequence)| numbering.count(*time, *sequence)).collect::<Vec<_>>()
        };
        assert_eq!(count(&[(5, None), (110, None), (390, None), (391, None)]), [(0, 0), (1, 0), (4, 2), (5, 0)]);
        // The counter is right where the times tremble; it may wrap.
        let wraps = [(0, Some(u32::MAX - 1)), (160, Some(u32::MAX)), (300, Some(1))];
        let first = u64::from(u32::MAX) - 1;
        assert_eq!(count(&wraps), [(first, 0), (first + 1, 0), (first + 3, 1)]);
        // A counter that begins anew, and one that is missing in between.
        assert_eq!(count(&[(0, Some(40)), (100, Some(0)), (200, Some(1))]), [(40, 0), (41, 0), (42, 0)]);
        assert_eq!(count(&[(0, Some(7)), (100, None), (300, Some(10))]), [(7, 0), (8, 0), (10, 1)]);
    }
}
