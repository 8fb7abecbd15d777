//! How much one caller may ask for: nobody may disturb the others.

use std::{
    sync::{Mutex, PoisonError},
    time::Instant,
};

/// A bucket of requests that fills evenly.
#[derive(Debug)]
pub struct Bucket {
    rate: f64,
    most: f64,
    state: Mutex<(f64, Instant)>,
}

impl Bucket {
    /// `rate` requests a second, and `most` at once after a rest.
    pub fn new(rate: f64, most: f64) -> Self {
        Self { rate, most, state: Mutex::new((most, Instant::now())) }
    }

    /// Takes one request out; false where none is left.
    pub fn take(&self) -> bool {
        self.take_at(Instant::now())
    }

    fn take_at(&self, now: Instant) -> bool {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let (left, then) = *state;
        let left = (left + self.rate * now.saturating_duration_since(then).as_secs_f64()).min(self.most);
        let is_let = left >= 1.0;
        *state = (if is_let { left - 1.0 } else { left }, now);
        is_let
    }
}

/// What one connection may ask for; what it asks beyond that comes out of a bucket that all connections share. So whoever
/// asks at a person's pace is never refused because of somebody who floods.
#[derive(Debug)]
pub struct Share(Bucket);

impl Default for Share {
    fn default() -> Self {
        Self(Bucket::new(50.0, 200.0))
    }
}

/// The bucket that all connections share.
#[derive(Debug)]
pub struct Common(Bucket);

impl Default for Common {
    fn default() -> Self {
        Self(Bucket::new(500.0, 1000.0))
    }
}

impl Common {
    /// True where a request may be answered.
    pub fn lets(&self, share: Option<&Share>) -> bool {
        share.is_some_and(|share| share.0.take()) || self.0.take()
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn a_flood_gets_the_rate_and_a_calm_caller_everything() {
        let (bucket, start) = (Bucket::new(50.0, 200.0), Instant::now());
        let flood = (0..100_000).filter(|i| bucket.take_at(start + Duration::from_micros(100 * i))).count();
        assert!((690..=702).contains(&flood), "ten seconds: {flood}");
        let common = Common::default();
        let flooding: Vec<Share> = (0..20).map(|_| Share::default()).collect();
        let asked = flooding.iter().flat_map(|share| std::iter::repeat_n(share, 1000));
        let let_in = asked.filter(|share| common.lets(Some(share))).count();
        assert!((5000..6000).contains(&let_in), "{let_in}");
        let calm = Share::default();
        assert!((0..100).all(|_| common.lets(Some(&calm))));
    }
}
