//! Notices when rounds do not help.

/// Rounds without progress after which layers are made smooth around what is left.
const PATIENCE: usize = 4;
/// They are made smooth this many times wider at most.
const MAX_FAIR: usize = 3;

/// Counts rounds without progress.
#[derive(Default)]
pub(super) struct Patience {
    best: Option<usize>,
    since: usize,
    left_then: usize,
    /// How many times it was lost since less than half was left.
    pub lost: usize,
    /// Rounds of pushing since it was lost.
    pub rounds: usize,
}

impl Patience {
    /// Takes note of the contacts left; false when they have not become fewer for some rounds.
    pub fn goes_on(&mut self, left: usize) -> bool {
        if self.best.is_none_or(|best| left < best) {
            (self.best, self.since) = (Some(left), 0);
        } else {
            self.since += 1;
        }
        self.rounds += 1;
        if self.since <= PATIENCE {
            return true;
        }
        let lost = if 2 * left < self.left_then { 1 } else { (self.lost + 1).min(MAX_FAIR) };
        *self = Self { lost, left_then: left, ..Self::default() };
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patience_is_lost_without_progress_and_wider_each_time() {
        let mut patience = Patience::default();
        let lost = |patience: &mut Patience| (0..20).position(|_| !patience.goes_on(10)).map(|at| (at, patience.lost));
        assert_eq!(lost(&mut patience), Some((PATIENCE + 1, 1)));
        assert_eq!(lost(&mut patience), Some((PATIENCE + 1, 2)));
        assert!((0..20).all(|k| Patience { best: Some(30), ..Patience::default() }.goes_on(29 - k)));
    }
}
