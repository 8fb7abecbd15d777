//! Times of several clocks as one: the host's.

/// A span of frames in which a drift shows, nanoseconds; over a shorter one clocks are taken to run alike.
const MIN_SPAN_NS: i64 = 2_000_000_000;
/// Clocks that run apart by more than this, parts of one, are no clocks: frames are then placed by their arrival.
const MAX_DRIFT: f64 = 0.02;
/// Frames that arrive later than this (median, nanoseconds) after the earliest ones do not follow their device time.
const MAX_DELAY_NS: f64 = 200e6;

/// How a sensor's clock maps to the host's.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct ClockMap {
    start_ns: i64,
    /// Host time minus device time at the start, nanoseconds.
    offset_ns: i64,
    /// How fast that difference grows, parts of one.
    pub drift: f64,
    /// The device's times cannot be used.
    pub by_arrival: bool,
}

impl ClockMap {
    /// From device and host times of a sensor's frames, nanoseconds.
    ///
    /// A frame arrives late by the bus and the scheduler, never early: the line under all differences of host and device
    /// time, on the lower convex hull where the frames are, is the best one (Moon, Skelly and Towsley 1999, "Estimation
    /// and removal of clock skew from network delay measurements").
    pub(crate) fn new(times: &[(i64, i64)]) -> Self {
        let Some(&(start, host)) = times.first() else { return Self::default() };
        let first = host.saturating_sub(start);
        let mut points: Vec<[f64; 2]> = times
            .iter()
            .map(|&(d, h)| [d.saturating_sub(start) as f64, (h.saturating_sub(d) - first) as f64])
            .collect();
        points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
        let span = points[points.len() - 1][0] - points[0][0];
        let (base, drift) = if span < MIN_SPAN_NS as f64 {
            (points.iter().map(|p| p[1]).fold(f64::INFINITY, f64::min), 0.0)
        } else {
            line_under(&points)
        };
        let mut late: Vec<f64> = points.iter().map(|p| p[1] - base - drift * p[0]).collect();
        let delay = toile_geometry::statistics::median(&mut late).unwrap_or(0.0);
        let by_arrival = drift.abs() > MAX_DRIFT || delay > MAX_DELAY_NS;
        Self { start_ns: start, offset_ns: first.saturating_add(base as i64), drift, by_arrival }
    }

    /// Host time of a frame, nanoseconds.
    pub(crate) fn host_ns(&self, device_ns: i64, arrival_ns: i64) -> i64 {
        if self.by_arrival {
            return arrival_ns;
        }
        let since = device_ns.saturating_sub(self.start_ns);
        device_ns.saturating_add(self.offset_ns).saturating_add((since as f64 * self.drift) as i64)
    }
}

/// Height at 0 and slope of the edge of the lower convex hull under the middle of the points (ascending along x).
fn line_under(points: &[[f64; 2]]) -> (f64, f64) {
    let mut hull: Vec<[f64; 2]> = Vec::new();
    for &p in points {
        while let [.., a, b] = hull[..] {
            let left = (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
            if left > 0.0 {
                break;
            }
            hull.pop();
        }
        hull.push(p);
    }
    let middle = points.iter().map(|p| p[0]).sum::<f64>() / points.len() as f64;
    let edge = hull.windows(2).find(|w| w[1][0] >= middle).or_else(|| hull.windows(2).last());
    let Some(&[a, b]) = edge.map(|w| w.first_chunk::<2>()).unwrap_or_default() else { return (points[0][1], 0.0) };
    let slope = (b[1] - a[1]) / (b[0] - a[0]).max(1.0);
    (a[1] - slope * a[0], slope)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clocks_that_drift_and_frames_that_arrive_late_are_brought_together() {
        for ppm in [-300.0, 0.0, 300.0] {
            let truth = |i: i64| i * 200_000_000;
            let device = |i: i64| 77_000_000_000 + (truth(i) as f64 * (1.0 + ppm * 1e-6)) as i64;
            let arrival = |i: i64| 5_000_000_000_000 + truth(i) + 8_000_000 + (i * 7919 % 40) * 100_000;
            let times: Vec<(i64, i64)> = (0..100).map(|i| (device(i), arrival(i))).collect();
            let map = ClockMap::new(&times);
            assert!((map.drift * 1e6 + ppm).abs() < 30.0, "{ppm}: {}", map.drift * 1e6);
            for i in 0..100 {
                let off = map.host_ns(device(i), arrival(i)) - 5_000_008_000_000 - truth(i);
                assert!(off.abs() < 500_000, "{ppm}: frame {i} is {off} ns off");
            }
        }
    }

    #[test]
    fn a_clock_that_begins_anew_is_not_believed() {
        let times: Vec<(i64, i64)> = (0..50).map(|i| ((i % 10) * 33_000_000, i * 33_000_000)).collect();
        let map = ClockMap::new(&times);
        assert!(map.by_arrival);
        assert_eq!(map.host_ns(0, 7), 7);
        assert_eq!(ClockMap::new(&[]).host_ns(5, 7), 5);
    }
}
