//! Removes small islands of disparities.

/// Sets islands of fewer than `area` pixels to 0. Two neighbours (left, right, above, below) with answers belong to one
/// island where they differ by at most `step`.
pub(crate) fn remove_speckles(values: &mut [f32], width: usize, area: usize, step: f32) {
    if area <= 1 {
        return;
    }
    let mut islands = Islands { parent: (0..values.len() as u32).collect() };
    let joined = |a: f32, b: f32| a > 0.0 && b > 0.0 && (a - b).abs() <= step;
    for i in 1..values.len() {
        if i % width != 0 && joined(values[i], values[i - 1]) {
            islands.join(i, i - 1);
        }
        if i >= width && joined(values[i], values[i - width]) {
            islands.join(i, i - width);
        }
    }
    let mut sizes = vec![0u32; values.len()];
    for i in 0..values.len() {
        sizes[islands.root(i)] += 1;
    }
    for i in 0..values.len() {
        if (sizes[islands.root(i)] as usize) < area {
            values[i] = 0.0;
        }
    }
}

/// Sets of pixels, each known by its first.
struct Islands {
    parent: Vec<u32>,
}

impl Islands {
    fn root(&mut self, i: usize) -> usize {
        let mut at = i;
        while self.parent[at] as usize != at {
            // Every second step is cut short, so that later walks are short.
            self.parent[at] = self.parent[self.parent[at] as usize];
            at = self.parent[at] as usize;
        }
        at
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.parent[a.max(b)] = a.min(b) as u32;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn islands_go_by_area_and_step() {
        #[rustfmt::skip]
        let mut values = vec![
            5.0, 5.2, 0.0, 9.0,
            5.4, 7.0, 0.0, 9.5,
            0.0, 7.5, 8.0, 8.5,
        ];
        let all = values.clone();
        remove_speckles(&mut values, 4, 2, 0.5);
        assert_eq!(values, all);
        remove_speckles(&mut values, 4, 3, 0.5);
        assert_eq!(values, [5.0, 5.2, 0.0, 0.0, 5.4, 7.0, 0.0, 0.0, 0.0, 7.5, 8.0, 8.5]);
        remove_speckles(&mut values, 4, 4, 0.5);
        assert_eq!(values, [0.0, 0.0, 0.0, 0.0, 0.0, 7.0, 0.0, 0.0, 0.0, 7.5, 8.0, 8.5]);
    }

    #[test]
    fn rows_do_not_join_across_the_border() {
        let mut values = vec![0.0, 0.0, 3.0, 3.0, 0.0, 0.0];
        remove_speckles(&mut values, 3, 2, 1.0);
        assert_eq!(values, vec![0.0; 6]);
    }
}
