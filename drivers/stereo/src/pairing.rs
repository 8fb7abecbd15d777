//! Pairs the pictures of two cameras by their times. Pure: pictures go in, pairs and lonely pictures come out.

use std::{collections::VecDeque, fmt, sync::Arc};

use toile_capture::RgbImage;

/// One of the two cameras.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// The camera that depth belongs to.
    Left,
    /// The other one.
    Right,
}

impl fmt::Display for Side {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Left => "left",
            Self::Right => "right",
        })
    }
}

/// A picture of one camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Its pixels.
    pub image: Arc<RgbImage>,
    /// The camera's own number of it.
    pub sequence: u64,
    /// The camera's clock, nanoseconds; both cameras of a rig have the same clock.
    pub time_ns: i64,
    /// Host clock (Unix), nanoseconds, of arrival.
    pub host_time_ns: i64,
}

/// The event of one time.
#[derive(Debug, Clone, PartialEq)]
pub enum Moment {
    /// Both cameras took a picture.
    Pair(Picture, Picture),
    /// Only one did, or the other's was lost.
    Alone(Side, Picture),
}

/// Pictures of one camera that may wait for the other. A camera that lags further behind is taken for silent.
const MAX_WAITING: usize = 8;

/// Two queues of pictures, each in the order of time.
#[derive(Debug)]
pub struct Pairer {
    period_ns: i64,
    waiting: [VecDeque<Picture>; 2],
    ended: [bool; 2],
}

impl Pairer {
    /// Pairs pictures that are nearest to each other and at most half of `period_ns` (nanoseconds a frame) apart.
    pub fn new(period_ns: i64) -> Self {
        Self { period_ns: period_ns.max(1), waiting: Default::default(), ended: [false; 2] }
    }

    /// The next picture of one camera.
    pub fn push(&mut self, side: Side, picture: Picture) {
        self.waiting[side as usize].push_back(picture);
    }

    /// No more pictures come from this camera.
    pub fn end(&mut self, side: Side) {
        self.ended[side as usize] = true;
    }

    /// Which camera's next picture decides what comes next.
    pub fn wants(&self) -> Side {
        match (self.waiting[0].front(), self.waiting[1].front()) {
            (None, _) if !self.ended[0] => Side::Left,
            (_, None) if !self.ended[1] => Side::Right,
            (Some(left), Some(right)) if left.time_ns > right.time_ns => Side::Right,
            _ => Side::Left,
        }
    }

    /// The next moment that is decided; `None` where another picture is needed first, or all has been given.
    pub fn pop(&mut self) -> Option<Moment> {
        let (left, right) = match (self.waiting[0].front(), self.waiting[1].front()) {
            (Some(left), Some(right)) => (left.time_ns, right.time_ns),
            (Some(_), None) => return self.alone_if_silent(Side::Left, Side::Right),
            (None, Some(_)) => return self.alone_if_silent(Side::Right, Side::Left),
            (None, None) => return None,
        };
        let apart = left.saturating_sub(right).saturating_abs();
        let earlier = if left <= right { Side::Left } else { Side::Right };
        if apart > self.period_ns / 2 {
            return self.alone(earlier);
        }
        // A picture further away than a quarter may have a nearer rival behind it.
        if apart > self.period_ns / 4 {
            match self.waiting[earlier as usize].get(1) {
                Some(rival) if (rival.time_ns - left.max(right)).abs() < apart => return self.alone(earlier),
                None if !self.ended[earlier as usize] => return None,
                _ => {}
            }
        }
        let left = self.waiting[0].pop_front()?;
        self.waiting[1].pop_front().map(|right| Moment::Pair(left, right))
    }

    fn alone_if_silent(&mut self, side: Side, other: Side) -> Option<Moment> {
        let is_silent = self.ended[other as usize] || self.waiting[side as usize].len() > MAX_WAITING;
        if is_silent { self.alone(side) } else { None }
    }

    fn alone(&mut self, side: Side) -> Option<Moment> {
        self.waiting[side as usize].pop_front().map(|picture| Moment::Alone(side, picture))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(time_ns: i64) -> Picture {
        let image = Arc::new(RgbImage { width: 1, height: 1, pixels: vec![[0; 3]] });
        Picture { image, sequence: 0, time_ns, host_time_ns: time_ns }
    }

    /// Moments of two lists of times at a period of 100, as (left, right).
    fn paired(left: &[i64], right: &[i64]) -> Vec<(Option<i64>, Option<i64>)> {
        let mut pairer = Pairer::new(100);
        let mut queues = [left.to_vec(), right.to_vec()];
        queues.iter_mut().for_each(|q| q.reverse());
        let mut moments = Vec::new();
        for _ in 0..1000 {
            match pairer.pop() {
                Some(Moment::Pair(l, r)) => moments.push((Some(l.time_ns), Some(r.time_ns))),
                Some(Moment::Alone(Side::Left, l)) => moments.push((Some(l.time_ns), None)),
                Some(Moment::Alone(Side::Right, r)) => moments.push((None, Some(r.time_ns))),
                None => {
                    let side = pairer.wants();
                    match queues[side as usize].pop() {
                        Some(time) => pairer.push(side, picture(time)),
                        None => pairer.end(side),
                    }
                }
            }
        }
        moments
    }

    #[test]
    fn pairs_are_nearest_within_half_a_period_and_nothing_is_dropped() {
        let (l, r) = (Some, Some);
        assert_eq!(paired(&[0, 100, 200], &[10, 90, 210]), [(l(0), r(10)), (l(100), r(90)), (l(200), r(210))]);
        assert_eq!(paired(&[0, 200], &[0, 100, 200]), [(l(0), r(0)), (None, r(100)), (l(200), r(200))]);
        assert_eq!(paired(&[0, 100, 200], &[60]), [(l(0), None), (l(100), r(60)), (l(200), None)]);
        assert_eq!(paired(&[51, 151], &[0, 100]), [(None, r(0)), (l(51), r(100)), (l(151), None)]);
        assert_eq!(paired(&[50], &[0]), [(l(50), r(0))]);
        assert_eq!(paired(&[45], &[0, 80]), [(None, r(0)), (l(45), r(80))]);
        assert_eq!(paired(&[], &[5, 105]), [(None, r(5)), (None, r(105))]);
    }

    #[test]
    fn a_silent_camera_does_not_hold_the_other_for_ever() {
        let mut pairer = Pairer::new(100);
        (0..=MAX_WAITING as i64).for_each(|k| pairer.push(Side::Left, picture(100 * k)));
        assert!(matches!(pairer.pop(), Some(Moment::Alone(Side::Left, p)) if p.time_ns == 0));
        assert_eq!(pairer.pop(), None);
    }
}
