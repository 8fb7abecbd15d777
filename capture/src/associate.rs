//! Pairing two lists by time.

use std::{cmp::Reverse, collections::BinaryHeap};

/// For each time of `a` the position in `b` of its partner: the closest pairs first, each used once, none further apart
/// than `max_apart_ns`. Both lists must rise (equal times are allowed).
///
/// The closest pair that is left has nothing between its two times, so only neighbours in the merged order need to be
/// looked at: O(n log n) time and O(n) memory, for any times.
pub(crate) fn associate(a: &[i64], b: &[i64], max_apart_ns: i64) -> Vec<Option<usize>> {
    let mut merged = Merged::new(a, b);
    let mut candidates = BinaryHeap::new();
    let add = |merged: &Merged, left: usize, candidates: &mut BinaryHeap<_>| {
        let Some((apart, i, j)) = merged.candidate(left).filter(|(apart, ..)| *apart <= max_apart_ns) else { return };
        candidates.push(Reverse((apart, i, j, left)));
    };
    (0..merged.events.len()).for_each(|left| add(&merged, left, &mut candidates));
    let mut partner = vec![None; a.len()];
    while let Some(Reverse((apart, i, j, left))) = candidates.pop() {
        if merged.candidate(left) != Some((apart, i, j)) {
            continue;
        }
        partner[i] = Some(j);
        if let Some(before) = merged.remove_pair(left) {
            add(&merged, before, &mut candidates);
        }
    }
    partner
}

/// Nowhere: before the first and behind the last event.
const NONE: usize = usize::MAX;

/// Both lists in one order, from which pairs are taken out.
struct Merged {
    events: Vec<Event>,
}

#[derive(Clone, Copy)]
struct Event {
    time_ns: i64,
    is_b: bool,
    /// Position in its list.
    position: usize,
    previous: usize,
    next: usize,
    is_taken: bool,
}

impl Merged {
    fn new(a: &[i64], b: &[i64]) -> Self {
        let mut keyed: Vec<(i64, usize, bool, usize)> = Vec::with_capacity(a.len() + b.len());
        for (list, is_b) in [(a, false), (b, true)] {
            let mut rank = 0;
            for (position, &time_ns) in list.iter().enumerate() {
                // Of equal times, the first of both lists come first, then the second ones, ...
                rank = if position > 0 && list[position - 1] == time_ns { rank + 1 } else { 0 };
                keyed.push((time_ns, rank, is_b, position));
            }
        }
        keyed.sort_unstable();
        let last = keyed.len().saturating_sub(1);
        let event = |(at, &(time_ns, _, is_b, position)): (usize, &(i64, usize, bool, usize))| Event {
            time_ns,
            is_b,
            position,
            previous: if at == 0 { NONE } else { at - 1 },
            next: if at == last { NONE } else { at + 1 },
            is_taken: false,
        };
        Self { events: keyed.iter().enumerate().map(event).collect() }
    }

    /// How far apart the event and the one behind it are, and their positions in `a` and `b`; `None` where they are not
    /// a pair.
    fn candidate(&self, left: usize) -> Option<(i64, usize, usize)> {
        let first = self.events[left];
        let second = *self.events.get(first.next).filter(|_| !first.is_taken)?;
        let (i, j) = match (first.is_b, second.is_b) {
            (false, true) => (first.position, second.position),
            (true, false) => (second.position, first.position),
            _ => return None,
        };
        Some((second.time_ns.saturating_sub(first.time_ns), i, j))
    }

    /// Takes the event and the one behind it out; gives the event before them.
    fn remove_pair(&mut self, left: usize) -> Option<usize> {
        let (first, right) = (self.events[left], self.events[left].next);
        let behind = self.events[right].next;
        self.events[left].is_taken = true;
        self.events[right].is_taken = true;
        if let Some(event) = self.events.get_mut(behind) {
            event.previous = first.previous;
        }
        let before = self.events.get_mut(first.previous)?;
        before.next = behind;
        Some(first.previous)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// All pairs, closest first.
    fn brute_force(a: &[i64], b: &[i64], max_apart: i64) -> Vec<Option<usize>> {
        let near = |(i, j): &(usize, usize)| (a[*i] - b[*j]).abs();
        let mut pairs: Vec<(usize, usize)> = (0..a.len()).flat_map(|i| (0..b.len()).map(move |j| (i, j))).collect();
        pairs.retain(|pair| near(pair) <= max_apart);
        pairs.sort_by_key(|pair| (near(pair), *pair));
        let (mut partner, mut taken) = (vec![None; a.len()], vec![false; b.len()]);
        for (i, j) in pairs {
            if partner[i].is_none() && !taken[j] {
                (partner[i], taken[j]) = (Some(j), true);
            }
        }
        partner
    }

    #[test]
    fn many_equal_times_are_paired_in_their_order() {
        let times = vec![5; 200_000];
        let partner = associate(&times, &times, 20);
        assert!(partner.iter().enumerate().all(|(i, j)| *j == Some(i)));
    }

    proptest! {
        #[test]
        fn as_brute_force_does(
            mut a in proptest::collection::vec(0_i64..10_000, 0..30),
            mut b in proptest::collection::vec(0_i64..10_000, 0..30),
        ) {
            a.sort_unstable();
            b.sort_unstable();
            let apart = |partner: &[Option<usize>]| -> Vec<i64> {
                let mut apart: Vec<i64> =
                    partner.iter().enumerate().filter_map(|(i, j)| Some((a[i] - b[(*j)?]).abs())).collect();
                apart.sort_unstable();
                apart
            };
            // Where two pairs are equally close, either may come first; how close the pairs are is the same.
            let (fast, slow) = (associate(&a, &b, 500), brute_force(&a, &b, 500));
            prop_assert!(apart(&fast).first() == apart(&slow).first());
            let mut differences: Vec<i64> = a.iter().flat_map(|x| b.iter().map(move |y| (x - y).abs())).collect();
            differences.sort_unstable();
            let all_differ = differences.windows(2).all(|pair| pair[0] != pair[1]);
            if all_differ {
                prop_assert_eq!(fast, slow);
            }
        }
    }
}
