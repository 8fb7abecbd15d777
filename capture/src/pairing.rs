//! Depth and colour of one time made one pair. Nothing is dropped: an image without a partner goes on alone.

use std::collections::VecDeque;

/// Depth and colour that belong together, or one of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Pair<D, C> {
    /// Depth and its time, nanoseconds of the device's clock.
    pub depth: Option<(i64, D)>,
    /// Colour and its time.
    pub color: Option<(i64, C)>,
}

impl<D, C> Pair<D, C> {
    /// Time of the depth, or of the colour where there is no depth.
    pub fn time_ns(&self) -> i64 {
        self.depth.as_ref().map(|d| d.0).or(self.color.as_ref().map(|c| c.0)).unwrap_or(0)
    }
}

/// At most this many of a stream wait for the other to bring their partners; beyond that the oldest goes on alone.
const MAX_WAITING: usize = 3;

/// Pairs what is at most `max_apart_ns` apart. Each stream comes in the order of its time, and may come a few frames
/// after the other.
#[derive(Debug)]
pub struct Pairing<D, C> {
    max_apart_ns: i64,
    depth: VecDeque<(i64, D)>,
    color: VecDeque<(i64, C)>,
    ready: VecDeque<Pair<D, C>>,
    alone: [u64; 2],
}

impl<D, C> Pairing<D, C> {
    /// For streams whose partners are at most `max_apart_ns` apart: half the time between frames.
    pub fn new(max_apart_ns: i64) -> Self {
        let (depth, color, ready) = (VecDeque::new(), VecDeque::new(), VecDeque::new());
        Self { max_apart_ns, depth, color, ready, alone: [0; 2] }
    }

    /// Takes depth.
    pub fn push_depth(&mut self, time_ns: i64, depth: D) {
        self.depth.push_back((time_ns, depth));
        self.meet(MAX_WAITING);
    }

    /// Takes colour.
    pub fn push_color(&mut self, time_ns: i64, color: C) {
        self.color.push_back((time_ns, color));
        self.meet(MAX_WAITING);
    }

    /// Pictures that wait for a partner go on alone: no more will come.
    pub fn finish(&mut self) {
        self.meet(0);
    }

    /// The next pair that is ready.
    pub fn pop(&mut self) -> Option<Pair<D, C>> {
        self.ready.pop_front()
    }

    /// How many depth and colour images went on alone.
    pub fn alone(&self) -> [u64; 2] {
        self.alone
    }

    /// Pairs the oldest two where they are near, and lets the older one go where they are not: what follows in the
    /// other stream is farther still. At most `waiting` of one stream wait for the other.
    fn meet(&mut self, waiting: usize) {
        loop {
            let later = self.depth.front().zip(self.color.front()).map(|(d, c)| d.0.saturating_sub(c.0));
            let (gives_depth, gives_color) = match later {
                Some(later) if later.abs() <= self.max_apart_ns => (true, true),
                Some(later) => (later < 0, later > 0),
                None => (self.depth.len() > waiting, self.color.len() > waiting),
            };
            if !gives_depth && !gives_color {
                return;
            }
            let depth = if gives_depth { self.depth.pop_front() } else { None };
            let color = if gives_color { self.color.pop_front() } else { None };
            self.alone[0] += u64::from(color.is_none());
            self.alone[1] += u64::from(depth.is_none());
            self.ready.push_back(Pair { depth, color });
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    type Times = (Option<i64>, Option<i64>);

    fn run(events: &[(bool, i64)]) -> (Vec<Times>, [u64; 2]) {
        let mut pairing = Pairing::new(16);
        for &(is_depth, time) in events {
            if is_depth { pairing.push_depth(time, ()) } else { pairing.push_color(time, ()) }
        }
        pairing.finish();
        let pairs = std::iter::from_fn(|| pairing.pop()).map(|p| (p.depth.map(|d| d.0), p.color.map(|c| c.0)));
        let pairs = pairs.collect();
        (pairs, pairing.alone())
    }

    #[test]
    fn near_ones_pair_and_a_lost_one_leaves_its_partner_alone() {
        let (pairs, alone) = run(&[(true, 0), (false, 3), (false, 36), (true, 66), (false, 69), (true, 99)]);
        assert_eq!(pairs, [(Some(0), Some(3)), (None, Some(36)), (Some(66), Some(69)), (Some(99), None)]);
        assert_eq!(alone, [1, 1]);
    }

    #[test]
    fn a_stream_that_comes_a_few_frames_after_the_other_still_pairs() {
        let ahead = (0..3).map(|i| (false, i * 33 + 3));
        let then = (0..20).flat_map(|i| [(true, i * 33), (false, (i + 3) * 33 + 3)]);
        let (pairs, alone) = run(&ahead.chain(then).collect::<Vec<_>>());
        assert!(pairs[..20].iter().all(|p| p.0.is_some() && p.1.is_some()));
        assert_eq!(alone, [0, 3]);
    }

    proptest! {
        #[test]
        fn everything_comes_out_once_and_pairs_are_near(steps in prop::collection::vec((any::<bool>(), 0..40i64), 0..60)) {
            let mut times = [0, 0];
            let events: Vec<(bool, i64)> = steps.into_iter().map(|(is_depth, step)| {
                times[usize::from(is_depth)] += step;
                (is_depth, times[usize::from(is_depth)])
            }).collect();
            let (pairs, _) = run(&events);
            let depths: Vec<i64> = pairs.iter().filter_map(|p| p.0).collect();
            let colors: Vec<i64> = pairs.iter().filter_map(|p| p.1).collect();
            prop_assert_eq!(depths, events.iter().filter(|e| e.0).map(|e| e.1).collect::<Vec<_>>());
            prop_assert_eq!(colors, events.iter().filter(|e| !e.0).map(|e| e.1).collect::<Vec<_>>());
            prop_assert!(pairs.iter().all(|p| p.0.zip(p.1).is_none_or(|(d, c)| (d - c).abs() <= 16)));
        }
    }
}
