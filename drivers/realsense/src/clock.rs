//! Device time of one stream's pictures.

/// Nanoseconds of a microsecond.
const MICROSECOND: i64 = 1000;

/// The camera's 32-bit microseconds (which wrap after 71 minutes) to nanoseconds that do not.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Clock {
    period: i64,
    pub(crate) last: Option<Moment>,
    sequence: Option<u32>,
    /// Pictures in a row that came without a time.
    pub(crate) without_time: u32,
}

/// The camera's time (microseconds), the kernel's and ours (nanoseconds) of a picture.
pub(crate) type Moment = (u32, i64, i64);

/// A step of the camera's clock that is so much longer than the kernel's cannot be, nanoseconds: it began anew, or says
/// nonsense.
const SLACK: i64 = 1_000_000_000;

impl Clock {
    pub(crate) fn new(period: i64) -> Self {
        Self { period, last: None, sequence: None, without_time: 0 }
    }

    pub(crate) fn restart(&mut self) {
        self.sequence = None;
    }

    /// Pictures missing by the kernel's numbers.
    pub(crate) fn lost(&mut self, sequence: u32) -> u64 {
        let lost = self.sequence.map_or(0, |last| sequence.wrapping_sub(last).wrapping_sub(1));
        self.sequence = Some(sequence);
        u64::from(lost)
    }

    /// Time of a picture; where none was ever stated, from the last one of the `other` stream on, that both are of one clock.
    pub(crate) fn time_ns(&mut self, stated: Option<u32>, kernel_ns: i64, other: Option<Moment>) -> i64 {
        let time = match (self.last, stated) {
            (None, Some(now)) => i64::from(now) * MICROSECOND,
            (None, None) => other.map_or(kernel_ns, |(_, kernel, time)| time + kernel_ns - kernel),
            (Some((last, kernel, time)), now) => {
                // Where the camera's time is missing or jumps, the kernel's clock shows how long it was.
                let by_kernel = (kernel_ns - kernel).max(self.period / 2);
                let step = now.map(|now| i64::from(now.wrapping_sub(last)) * MICROSECOND);
                time + step.filter(|s| *s > 0 && *s <= by_kernel + SLACK).unwrap_or(by_kernel)
            }
        };
        let passed = |(last, _, before): Moment| last.wrapping_add(((time - before) / MICROSECOND) as u32);
        let stated = stated.unwrap_or_else(|| self.last.map_or(0, passed));
        self.last = Some((stated, kernel_ns, time));
        time
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_clock_goes_on_when_it_wraps_and_when_it_is_missing_or_jumps() {
        let mut clock = Clock::new(33_333_333);
        let first = clock.time_ns(Some(u32::MAX - 999), 0, None);
        assert_eq!(clock.time_ns(Some(32_333), 33_000_000, None) - first, 33_333_000);
        let before = clock.time_ns(Some(65_666), 66_000_000, None);
        assert_eq!(clock.time_ns(None, 100_000_000, None) - before, 34_000_000);
        let before = clock.time_ns(Some(132_332), 133_000_000, None);
        // A jump of five seconds, and back.
        assert_eq!(clock.time_ns(Some(5_166_000), 166_000_000, None) - before, 33_000_000);
        assert_eq!(clock.time_ns(Some(199_000), 199_000_000, None) - before, 66_000_000);
        // A long pause that the kernel saw too, and a kernel much slower than the camera.
        let before = clock.time_ns(Some(232_332), 232_000_000, None);
        assert_eq!(clock.time_ns(Some(90_232_332), 90_232_000_000, None) - before, 90_000_000_000);
        assert_eq!(clock.time_ns(Some(90_265_665), 93_000_000_000, None) - before, 90_033_333_000);
    }

    #[test]
    fn a_stream_that_never_stated_its_time_starts_from_the_others_clock() {
        let (mut depth, mut color) = (Clock::new(33_333_333), Clock::new(33_333_333));
        let time = depth.time_ns(Some(7_000_000), 100_000_000, None);
        assert_eq!(color.time_ns(None, 110_000_000, depth.last), time + 10_000_000);
        // Where neither does, the kernel's stands in.
        assert_eq!(Clock::new(33_333_333).time_ns(None, 110_000_000, None), 110_000_000);
    }
}
