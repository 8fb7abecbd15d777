//! The colour picture nearest in time to each depth frame. Pure: depth and colour go in, depth with its colour comes out.

use std::collections::VecDeque;

/// Depth frames that wait for later pictures; beyond that the oldest goes on with what there is.
const MAX_WAITING: usize = 3;
/// Pictures that wait for depth; beyond that the oldest is dropped.
const MAX_PICTURES: usize = 32;

/// Depth and colour, each in the order of its time.
#[derive(Debug)]
pub(crate) struct Nearest<D, C> {
    max_apart_ns: i64,
    depth: VecDeque<(i64, D)>,
    color: VecDeque<(i64, C)>,
    color_ended: bool,
    /// Depth frames at the front that do not wait any longer.
    due: usize,
}

impl<D, C: Clone> Nearest<D, C> {
    /// For pictures that are at most `max_apart_ns` nanoseconds from their depth frame.
    pub(crate) fn new(max_apart_ns: i64) -> Self {
        Self { max_apart_ns, depth: VecDeque::new(), color: VecDeque::new(), color_ended: false, due: 0 }
    }

    /// Takes a depth frame.
    pub(crate) fn push_depth(&mut self, time_ns: i64, depth: D) {
        self.depth.push_back((time_ns, depth));
    }

    /// Takes a picture.
    pub(crate) fn push_color(&mut self, time_ns: i64, color: C) {
        self.color.push_back((time_ns, color));
        if self.color.len() > MAX_PICTURES {
            self.color.pop_front();
        }
    }

    /// No more pictures come.
    pub(crate) fn end_color(&mut self) {
        self.color_ended = true;
    }

    /// Depth frames that are here do not wait for later pictures.
    pub(crate) fn flush(&mut self) {
        self.due = self.depth.len();
    }

    /// True where the oldest depth frame could still get a nearer picture than those that are here.
    pub(crate) fn wants_color(&self) -> bool {
        let Some((time, _)) = self.depth.front() else { return false };
        !self.color_ended && self.color.back().is_none_or(|(last, _)| last < time)
    }

    /// The next depth frame that is decided, with the picture nearest to it; one picture may be nearest to several.
    pub(crate) fn pop(&mut self) -> Option<(D, Option<C>)> {
        if self.wants_color() && self.due == 0 && self.depth.len() <= MAX_WAITING {
            return None;
        }
        let (time, depth) = self.depth.pop_front()?;
        self.due = self.due.saturating_sub(1);
        let apart = |color: &(i64, C)| color.0.saturating_sub(time).saturating_abs();
        while self.color.len() > 1 && apart(&self.color[1]) <= apart(&self.color[0]) {
            self.color.pop_front();
        }
        let nearest = self.color.front().filter(|color| apart(color) <= self.max_apart_ns);
        Some((depth, nearest.map(|(_, color)| color.clone())))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_frame_waits_until_no_nearer_picture_can_come() {
        let mut nearest = Nearest::new(20);
        nearest.push_depth(100, 'a');
        nearest.push_color(90, 1);
        assert_eq!(nearest.pop(), None);
        nearest.push_color(104, 2);
        assert_eq!(nearest.pop(), Some(('a', Some(2))));
        // The same picture again where it is the nearest, and none where all are too far.
        nearest.push_depth(110, 'b');
        nearest.push_depth(170, 'c');
        nearest.push_color(148, 3);
        nearest.push_color(195, 4);
        assert_eq!([nearest.pop(), nearest.pop()], [Some(('b', Some(2))), Some(('c', None))]);
    }

    #[test]
    fn a_webcam_that_is_late_or_gone_does_not_hold_depth_up() {
        let mut nearest = Nearest::new(20);
        (0..4).for_each(|k| nearest.push_depth(100 * k, k));
        assert_eq!(nearest.pop(), Some((0, None::<u8>)));
        assert_eq!(nearest.pop(), None);
        nearest.flush();
        assert_eq!(nearest.pop(), Some((1, None)));
        nearest.end_color();
        assert_eq!([nearest.pop(), nearest.pop(), nearest.pop()], [Some((2, None)), Some((3, None)), None]);
    }

    #[test]
    fn pictures_without_depth_do_not_pile_up() {
        let mut nearest = Nearest::<(), i64>::new(20);
        (0..10_000).for_each(|k| nearest.push_color(k, k));
        assert_eq!(nearest.color.len(), MAX_PICTURES);
    }

    proptest! {
        /// Against looking at all pictures.
        #[test]
        fn where_all_pictures_are_here_each_frame_gets_the_nearest(
            depth_steps in prop::collection::vec(1..60i64, 1..30), color_steps in prop::collection::vec(1..60i64, 0..30),
        ) {
            let times = |steps: &[i64]| steps.iter().scan(0, |at, step| { *at += step; Some(*at) }).collect::<Vec<_>>();
            let (depth, color) = (times(&depth_steps), times(&color_steps));
            let mut nearest = Nearest::new(25);
            let mut waiting = color.iter().peekable();
            let mut seen = Vec::new();
            for time in &depth {
                nearest.push_depth(*time, *time);
                while let Some(color) = waiting.next_if(|_| nearest.wants_color()) {
                    nearest.push_color(*color, *color);
                }
                seen.extend(nearest.pop());
            }
            nearest.end_color();
            seen.extend(std::iter::from_fn(|| nearest.pop()));
            prop_assert_eq!(seen.len(), depth.len());
            for (time, found) in seen {
                let best = color.iter().map(|c| (c - time).abs()).min().filter(|apart| *apart <= 25);
                prop_assert_eq!(found.map(|c| (c - time).abs()), best);
            }
        }
    }
}
