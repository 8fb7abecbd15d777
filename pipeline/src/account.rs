//! How far a run is and how long it will take, from what its [`Observer`](crate::Observer) hears.

use std::time::{Duration, Instant};

use toile_capture::printable;

/// Too little is done for an estimate before this share of the work, and before this time.
const KNOWN_SHARE: f64 = 0.02;
const KNOWN_AFTER: Duration = Duration::from_secs(1);

/// What is done and what lies ahead. Costs are expected seconds; only their proportions matter. The share that is done never
/// shrinks, unless more work is planned.
#[derive(Debug, Clone)]
pub struct Account {
    label: String,
    /// Cost of what is still to be done, the running step included.
    ahead: f64,
    /// Cost of what this run has done itself.
    done: f64,
    step: f64,
    fraction: f64,
    /// The share that was told already.
    floor: f64,
    started: Instant,
}

impl Default for Account {
    fn default() -> Self {
        let (ahead, done, step, fraction, floor) = (0.0, 0.0, 0.0, 0.0, 0.0);
        Self { label: String::new(), ahead, done, step, fraction, floor, started: Instant::now() }
    }
}

impl Account {
    /// Steps of this cost lie ahead.
    pub fn plan(&mut self, cost: f64) {
        self.ahead += cost;
        self.floor = 0.0;
    }

    /// A planned step of this cost need not run.
    pub fn skip(&mut self, cost: f64) {
        self.ahead = (self.ahead - cost).max(0.0);
    }

    /// A step begins.
    pub fn begin(&mut self, label: &str, cost: f64) {
        (self.floor, self.step, self.fraction) = (self.share(), cost, 0.0);
        self.label = printable(label).into_owned();
        self.ahead = self.ahead.max(cost);
    }

    /// The running step is this far, 0 to 1; it does not go back.
    pub fn at(&mut self, fraction: f64) {
        self.fraction = fraction.clamp(self.fraction, 1.0);
    }

    /// The running step is called so, and is this far.
    pub fn tell(&mut self, label: &str, fraction: f64) {
        self.label = printable(label).into_owned();
        self.at(fraction);
    }

    /// The running step ends.
    pub fn end(&mut self) {
        self.ahead = (self.ahead - self.step).max(0.0);
        self.done += self.step;
        (self.step, self.fraction) = (0.0, 0.0);
    }

    /// What is being done; nothing in it steers a terminal.
    pub fn label(&self) -> &str {
        &self.label
    }

    /// How much is done, 0 to 1.
    pub fn share(&self) -> f64 {
        let whole = (self.done + self.ahead).max(1e-9);
        (self.behind() / whole).clamp(self.floor, 1.0)
    }

    /// Expected seconds until the end, where that can be told.
    pub fn seconds_left(&self) -> Option<f64> {
        self.left_after(self.started.elapsed())
    }

    /// Since the account was opened.
    pub fn elapsed(&self) -> Duration {
        self.started.elapsed()
    }

    fn left_after(&self, elapsed: Duration) -> Option<f64> {
        let (share, behind) = (self.share(), self.behind());
        let is_known = share >= KNOWN_SHARE && elapsed >= KNOWN_AFTER && behind > 0.0;
        is_known.then(|| elapsed.as_secs_f64() * (self.done + self.ahead - behind).max(0.0) / behind)
    }

    fn behind(&self) -> f64 {
        self.done + self.fraction * self.step
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn skipped_steps_do_not_count_as_done() {
        let mut account = Account::default();
        account.plan(10.0);
        account.skip(4.0);
        account.begin("fuse", 6.0);
        account.at(0.5);
        assert!((account.share() - 0.5).abs() < 1e-12);
        account.end();
        assert_eq!((account.ahead, account.done, account.share()), (0.0, 6.0, 1.0));
    }

    #[test]
    fn steps_that_nobody_planned_do_not_move_it_back() {
        let mut account = Account::default();
        account.plan(10.0);
        let mut before = 0.0;
        for (cost, fraction) in [(8.0, 1.0), (1.0, 0.5), (30.0, 0.0), (5.0, 0.2)] {
            account.begin("fit", cost);
            account.at(fraction);
            assert!(account.share() >= before, "{} after {before}", account.share());
            before = account.share();
            account.end();
        }
        account.plan(100.0);
        assert!(account.share() < 0.5);
    }

    #[test]
    fn time_left_scales_with_what_is_left() {
        let left = |elapsed: u64, done: f64, whole: f64| {
            let mut account = Account::default();
            account.plan(whole);
            account.begin("fit", done);
            account.end();
            account.left_after(Duration::from_secs(elapsed))
        };
        assert_eq!(left(10, 1.0, 2.0), Some(10.0));
        assert_eq!(left(100, 1.0, 4.0), Some(300.0));
        assert_eq!((left(0, 1.0, 4.0), left(10, 0.0, 4.0)), (None, None));
    }

    #[test]
    fn a_label_cannot_steer_the_terminal() {
        let mut account = Account::default();
        account.begin("a\u{1b}[2J\nb\u{202e}: fuse", 1.0);
        assert_eq!(account.label(), "a\\u{1b}[2J\\u{a}b\\u{202e}: fuse");
    }
}
