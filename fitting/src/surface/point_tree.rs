//! Finds the nearest of many points that meets a condition: a k-d tree (Bentley 1975; bounds by axis after Arya and Mount 1993).
//!
//! Points are arranged in place: the middle one of each range splits it along the widest axis. Building is deterministic
//! for any number of threads.

use nalgebra::Point3;

/// Ranges of at most this many points are searched one by one.
const LEAF: usize = 8;
/// Ranges larger than this are arranged by two threads.
const PARALLEL: usize = 4096;

#[derive(Debug, Clone, Copy)]
struct Entry {
    point: [f32; 3],
    item: u32,
}

/// Points arranged for nearest-point queries.
#[derive(Debug, Clone)]
pub(crate) struct PointTree {
    entries: Vec<Entry>,
    /// Axis along which each entry splits its range; unused in leaves.
    axes: Vec<u8>,
}

impl PointTree {
    /// O(n log n). Coordinates must be finite.
    pub fn new(points: &[Point3<f32>]) -> Self {
        let entry = |(i, p): (usize, &Point3<f32>)| Entry { point: [p.x, p.y, p.z], item: i as u32 };
        let mut entries: Vec<Entry> = points.iter().enumerate().map(entry).collect();
        let mut axes = vec![0; entries.len()];
        arrange(&mut entries, &mut axes);
        Self { entries, axes }
    }

    /// Index of the nearest point within `max_distance` (metres) that `accept` returns true for, and its squared distance.
    pub fn nearest(&self, p: &Point3<f32>, max_distance: f32, accept: impl Fn(u32) -> bool) -> Option<(u32, f32)> {
        let from = [p.x, p.y, p.z];
        let mut search = Search { tree: self, from, accept, limit: max_distance * max_distance, best: None };
        search.range(0, self.entries.len(), [0.0; 3]);
        search.best.map(|item| (item, search.limit))
    }
}

fn arrange(entries: &mut [Entry], axes: &mut [u8]) {
    let count = entries.len();
    if count <= LEAF {
        return;
    }
    let (axis, middle) = (widest(entries), count / 2);
    entries.select_nth_unstable_by(middle, |a, b| a.point[axis].total_cmp(&b.point[axis]).then(a.item.cmp(&b.item)));
    axes[middle] = axis as u8;
    let ((left, right), (left_axes, right_axes)) = (entries.split_at_mut(middle), axes.split_at_mut(middle));
    let (mut low, mut high) = (|| arrange(left, left_axes), || arrange(&mut right[1..], &mut right_axes[1..]));
    if count > PARALLEL {
        rayon::join(low, high);
    } else {
        low();
        high();
    }
}

fn widest(entries: &[Entry]) -> usize {
    let (mut low, mut high) = (entries[0].point, entries[0].point);
    for e in entries {
        for k in 0..3 {
            low[k] = low[k].min(e.point[k]);
            high[k] = high[k].max(e.point[k]);
        }
    }
    let width = |k: &usize| high[*k] - low[*k];
    (0..3).reduce(|a, b| if width(&b) > width(&a) { b } else { a }).unwrap_or(0)
}

struct Search<'a, F> {
    tree: &'a PointTree,
    from: [f32; 3],
    accept: F,
    /// Squared distance of the best so far.
    limit: f32,
    best: Option<u32>,
}

impl<F: Fn(u32) -> bool> Search<'_, F> {
    /// Searches the entries `first..end`, whose box lies `away` from the query along each axis.
    fn range(&mut self, first: usize, end: usize, away: [f32; 3]) {
        if end - first <= LEAF {
            return (first..end).for_each(|i| self.look_at(i));
        }
        let middle = first + (end - first) / 2;
        let axis = usize::from(self.tree.axes[middle]);
        let beyond = self.from[axis] - self.tree.entries[middle].point[axis];
        let (low, high) = ((first, middle), (middle + 1, end));
        let (near, far) = if beyond < 0.0 { (low, high) } else { (high, low) };
        self.range(near.0, near.1, away);
        let mut across = away;
        across[axis] = beyond;
        if across.iter().map(|d| d * d).sum::<f32>() <= self.limit {
            self.look_at(middle);
            self.range(far.0, far.1, across);
        }
    }

    fn look_at(&mut self, i: usize) {
        let Entry { point, item } = self.tree.entries[i];
        let squared: f32 = (0..3).map(|k| (point[k] - self.from[k]).powi(2)).sum();
        let nearer = squared < self.limit || (squared == self.limit && self.best.is_none());
        if nearer && (self.accept)(item) {
            (self.limit, self.best) = (squared, Some(item));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_accepted_point_agrees_with_brute_force() {
        let number = |i: u32, k: u32| ((i * 7919 + k * 104_729) % 2003) as f32 / 2003.0;
        for count in [1, 8, 9, 100, 5000] {
            let points: Vec<_> = (0..count).map(|i| Point3::new(number(i, 1), number(i, 2), number(i, 3))).collect();
            let tree = PointTree::new(&points);
            for q in 0..200 {
                let p = Point3::new(number(q, 5), number(q, 6), 1.2 * number(q, 7));
                let accept = |i: u32| i % 3 != q % 3;
                let all = (0..count).filter(|&i| accept(i)).map(|i| (points[i as usize] - p).norm_squared());
                let brute = all.filter(|d| *d <= 0.04).fold(f32::INFINITY, f32::min);
                let found = tree.nearest(&p, 0.2, accept);
                assert_eq!(found.map_or(f32::INFINITY, |f| f.1), brute, "{count} points, query {q}");
                assert!(found.is_none_or(|f| accept(f.0) && (points[f.0 as usize] - p).norm_squared() == f.1));
            }
        }
        assert!(PointTree::new(&[]).nearest(&Point3::origin(), 1.0, |_| true).is_none());
    }
}
