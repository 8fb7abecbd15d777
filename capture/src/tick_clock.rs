//! A device's clock of 32 bits, which wraps, as a time that does not.

use std::time::{Duration, Instant};

/// How much longer a step may be by the device's clock than by ours, and how far one stream may be behind another.
const SLACK: Duration = Duration::from_secs(1);

/// One clock for all streams of a device, whose ticks wrap at 32 bits.
///
/// A time that cannot be is nonsense (a damaged header) or a clock that began anew. The first such frame has no time;
/// with the second in a row the clock goes on from there.
#[derive(Debug, Clone, Copy)]
pub struct TickClock {
    ticks_per_second: u32,
    /// Ticks and arrival of the last frame that was believed.
    last: Option<(u32, Instant)>,
    /// Ticks since the device's zero, without wrapping.
    ticks: i64,
    is_doubted: bool,
}

impl TickClock {
    /// A clock with this many ticks a second.
    pub fn new(ticks_per_second: u32) -> Self {
        Self { ticks_per_second, last: None, ticks: 0, is_doubted: false }
    }

    /// Device time, nanoseconds, of a frame that carries `ticks` and arrived at `arrival`; `None` where that cannot be.
    pub fn time_ns(&mut self, ticks: u32, arrival: Instant) -> Option<i64> {
        let step = match self.last {
            None => i64::from(ticks),
            Some((last, before)) => {
                let passed = arrival.saturating_duration_since(before);
                let slack = self.ticks_in(SLACK);
                // Either stream may be a little behind the other.
                let counted = i64::from(ticks.wrapping_sub(last).wrapping_add(slack as u32)) - slack;
                let is_possible = counted <= self.ticks_in(passed) + slack;
                if !is_possible && !self.is_doubted {
                    self.is_doubted = true;
                    return None;
                }
                if is_possible { counted } else { self.ticks_in(passed) }
            }
        };
        self.is_doubted = false;
        self.last = Some((ticks, arrival));
        self.ticks += step;
        Some((self.ticks as f64 * 1e9 / f64::from(self.ticks_per_second)) as i64)
    }

    fn ticks_in(&self, duration: Duration) -> i64 {
        (duration.as_secs_f64() * f64::from(self.ticks_per_second)) as i64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HERTZ: u32 = 60_000_000;
    const FRAME: u32 = HERTZ / 30;

    /// Times, milliseconds, of frames that arrive 33 ms apart.
    fn times(ticks: &[u32]) -> Vec<Option<i64>> {
        let (mut clock, start) = (TickClock::new(HERTZ), Instant::now());
        let arrival = |k: u32| start + Duration::from_millis(33) * k;
        ticks.iter().zip(0..).map(|(t, k)| clock.time_ns(*t, arrival(k)).map(|ns| (ns + 500_000) / 1_000_000)).collect()
    }

    #[test]
    fn it_goes_on_when_ticks_wrap_between_two_streams() {
        let wrap = [0_u32.wrapping_sub(FRAME), 0, 0_u32.wrapping_sub(FRAME / 2), FRAME];
        let device: Vec<i64> = times(&wrap).into_iter().flatten().collect();
        let steps: Vec<i64> = device.windows(2).map(|w| w[1] - w[0]).collect();
        assert!(steps.iter().zip([33, -17, 50]).all(|(step, truth)| (step - truth).abs() <= 1), "{steps:?}");
    }

    #[test]
    fn one_nonsense_time_costs_its_frame_only() {
        for nonsense in [HERTZ * 2, HERTZ * 50, u32::MAX - 2 * HERTZ] {
            assert_eq!(times(&[0, FRAME, nonsense, 3 * FRAME]), [Some(0), Some(33), None, Some(100)], "{nonsense}");
        }
    }

    #[test]
    fn a_clock_that_begins_anew_goes_on_by_ours() {
        let anew = [40 * HERTZ, 40 * HERTZ + FRAME, 0, FRAME, 2 * FRAME];
        assert_eq!(times(&anew), [Some(40_000), Some(40_033), None, Some(40_099), Some(40_133)]);
    }

    #[test]
    fn a_long_gap_is_believed_where_ours_saw_it_too_and_a_quick_or_slow_device_always() {
        let (mut clock, start) = (TickClock::new(HERTZ), Instant::now());
        assert_eq!(clock.time_ns(0, start), Some(0));
        assert_eq!(clock.time_ns(50 * HERTZ, start + Duration::from_secs(50)), Some(50_000_000_000));
        // A hundred frames at once, and one in three seconds.
        let end = (1..=100).map(|k| clock.time_ns(50 * HERTZ + k * FRAME, start + Duration::from_secs(50))).last();
        assert_eq!(end, Some(Some(53_333_333_333)));
        let slow = clock.time_ns(50 * HERTZ + 101 * FRAME, start + Duration::from_secs(53));
        assert_eq!(slow.map(|ns| ns / 1_000_000), Some(53_366));
    }
}
