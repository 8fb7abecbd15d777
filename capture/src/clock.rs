//! Clocks: which one stamps a device's frames, and what time it was on the host's.

use std::time::SystemTime;

use serde::{Deserialize, Serialize};

/// Which clock a sensor's `device_time_ns` is of. Times of different domains must not be compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ClockDomain {
    /// The device's own, from an unknown start.
    #[default]
    Device,
    /// The host's monotonic clock at arrival (a driver or kernel without the device's time).
    HostMonotonic,
    /// The host's Unix clock.
    HostUnix,
}

/// The host's clock now: Unix, nanoseconds.
pub fn host_now_ns() -> i64 {
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    i64::try_from(since.as_nanos()).unwrap_or(i64::MAX)
}

/// The device's clock may run away from the host's by this much, parts of one: quartz clocks keep to 100 ppm.
const DRIFT: f64 = 200e-6;
/// A difference of the clocks that changes by more did so because a device's time is wrong or began anew.
const JUMP_NS: u64 = 2_000_000_000;

/// Host time of frames by the device's clock: without the jitter of their arrival, and without drift.
///
/// A frame arrives late by the bus and the scheduler, never early. The smallest difference of arrival and device time
/// is therefore the best one; it may grow by 200 ppm, so that a device clock that runs slow is followed too. One frame
/// whose time is wrong by seconds is not learnt from; with the second in a row the fit begins anew.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ClockFit {
    /// Device time and host time minus device time, at the last frame that was believed.
    last: Option<(i64, i64)>,
    is_doubted: bool,
}

impl ClockFit {
    /// Host time (Unix, nanoseconds) of a frame of `device_ns` that arrived at `arrival_ns`.
    pub fn host_time_ns(&mut self, device_ns: i64, arrival_ns: i64) -> i64 {
        let seen = arrival_ns.saturating_sub(device_ns);
        let offset = match self.last {
            Some((_, offset)) if seen.abs_diff(offset) > JUMP_NS => {
                if !self.is_doubted {
                    self.is_doubted = true;
                    return device_ns.saturating_add(offset).min(arrival_ns);
                }
                seen
            }
            Some((before, offset)) => {
                let grown = (device_ns.saturating_sub(before).max(0) as f64 * DRIFT) as i64;
                seen.min(offset.saturating_add(grown))
            }
            None => seen,
        };
        self.is_doubted = false;
        self.last = Some((device_ns, offset));
        device_ns.saturating_add(offset)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Arrivals with up to 20 ms of jitter, of a device clock that is wrong by `ppm`.
    fn errors_after(ppm: f64) -> Vec<i64> {
        let mut fit = ClockFit::default();
        let error = |i: i64| {
            let true_ns = i * 33_333_333;
            let device = (true_ns as f64 * (1.0 + ppm * 1e-6)) as i64;
            let jitter = (i * 7919 % 20) * 1_000_000;
            fit.host_time_ns(device, 1_700_000_000_000_000_000 + true_ns + jitter) - 1_700_000_000_000_000_000 - true_ns
        };
        (0..20_000).map(error).skip(30).collect()
    }

    #[test]
    fn host_time_neither_jitters_nor_drifts() {
        for ppm in [-100.0, 0.0, 100.0] {
            // After eleven minutes as at the start: within what the clock can grow between the best arrivals.
            assert!(errors_after(ppm).iter().all(|e| (-1_000..500_000).contains(e)), "{ppm}");
        }
    }

    /// Host times of frames that arrive each 33 ms, whose device times have these errors, minus their arrivals; ns.
    fn lateness(device_errors: [i64; 5]) -> Vec<i64> {
        let mut fit = ClockFit::default();
        let arrivals = (0..).map(|k| 1_700_000_000_000_000_000 + k * 33_000_000);
        let times = device_errors.iter().zip(arrivals);
        times
            .map(|(error, arrival)| fit.host_time_ns(arrival - 1_600_000_000_000_000_000 + error, arrival) - arrival)
            .collect()
    }

    #[test]
    fn one_wrong_device_time_is_not_learnt_and_a_clock_that_begins_anew_is() {
        const T: i64 = 20_000_000_000;
        assert_eq!(lateness([0, 0, T, 0, 0]), [0; 5]);
        assert_eq!(lateness([0, 0, -T, 0, 0]), [0, 0, -T, 0, 0]);
        assert_eq!(lateness([0, 0, T, T, T]), [0; 5]);
        assert_eq!(lateness([0, 0, -T, -T, -T]), [0, 0, -T, 0, 0]);
    }
}
