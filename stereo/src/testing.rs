//! Images for tests.

use crate::{GrayImage, MatchSettings};

/// Even noise from a seed.
pub(crate) fn noise(width: u32, height: u32, seed: u64) -> GrayImage {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 32) as u8
    };
    GrayImage { width, height, pixels: (0..width * height).map(|_| next()).collect() }
}

/// `left` moved to the left by `shift`, with noise where nothing comes from.
pub(crate) fn shifted(left: &GrayImage, shift: u32, seed: u64) -> GrayImage {
    let mut right = noise(left.width, left.height, seed + 1000);
    for v in 0..left.height as usize {
        let kept = left.width.saturating_sub(shift) as usize;
        let start = v * left.width as usize;
        right.pixels[start..][..kept].copy_from_slice(&left.row(v)[left.width as usize - kept..]);
    }
    right
}

/// Semi-global matching as the paper writes it, slow and plain, over whole images.
pub(crate) fn brute_force(left: &GrayImage, right: &GrayImage, s: &MatchSettings) -> Vec<f32> {
    let (w, h) = (left.width as i64, left.height as i64);
    let (first, count) = (i64::from(s.min_disparity), i64::from(s.disparities));
    let at = |i: &GrayImage, x: i64, y: i64| i.pixels[(y.clamp(0, h - 1) * w + x.clamp(0, w - 1)) as usize];
    let bit = |i: &GrayImage, x: i64, y: i64, k: i64| {
        let (dx, dy) = (k % 7 - 3, k / 7 - 3);
        at(i, x + dx, y + dy) < at(i, x - dx, y - dy)
    };
    let cost = |x: i64, y: i64, d: i64| match x - first - d {
        other if other < 0 => 24,
        other => (0..24).filter(|&k| bit(left, x, y, k) != bit(right, other, y, k)).count() as i64,
    };
    let cells: Vec<(i64, i64)> = (0..h).flat_map(|y| (0..w).map(move |x| (x, y))).collect();
    let costs: Vec<Vec<i64>> = cells.iter().map(|&(x, y)| (0..count).map(|d| cost(x, y, d)).collect()).collect();
    let mut sums = vec![vec![0; count as usize]; cells.len()];
    for (rx, ry) in [(1, 0), (-1, 0), (1, 1), (0, 1), (-1, 1)] {
        add_path(&costs, (w, h), (rx, ry), s, &mut sums);
    }
    let index_of_right = |xr: i64, y: i64| {
        // Of equals, the one found from the rightmost left pixel: the largest disparity.
        let candidates = (0..count).filter(|d| xr + first + d < w);
        candidates.rev().min_by_key(|d| sums[(y * w + xr + first + d) as usize][*d as usize])
    };
    cells.iter().zip(&sums).map(|(&(x, y), sums)| answer(x, y, sums, first, s, &index_of_right)).collect()
}

fn add_path(costs: &[Vec<i64>], (w, h): (i64, i64), (rx, ry): (i64, i64), s: &MatchSettings, sums: &mut [Vec<i64>]) {
    let (small, large) = ((24.0 * s.small_penalty).round() as i64, (24.0 * s.large_penalty).round() as i64);
    let mut paths: Vec<Vec<i64>> = vec![Vec::new(); costs.len()];
    for i in 0..w * h {
        let (x, y) = (if rx < 0 { w - 1 - i % w } else { i % w }, i / w);
        let (px, py) = (x - rx, y - ry);
        let here = (y * w + x) as usize;
        let mut path = costs[here].clone();
        if (0..w).contains(&px) && (0..h).contains(&py) {
            let before = &paths[(py * w + px) as usize];
            let lowest = before.iter().min().copied().unwrap_or(0);
            for d in 0..path.len() {
                let near = |k: usize| before.get(k).map_or(i64::MAX, |c| c + small);
                let best = before[d].min(near(d.wrapping_sub(1))).min(near(d + 1)).min(lowest + large);
                path[d] += best - lowest;
            }
        }
        sums[here].iter_mut().zip(&path).for_each(|(sum, cost)| *sum += cost);
        paths[here] = path;
    }
}

fn answer(x: i64, y: i64, sums: &[i64], first: i64, s: &MatchSettings, right: &dyn Fn(i64, i64) -> Option<i64>) -> f32 {
    let best = sums.iter().min().copied().unwrap_or(0);
    let index = sums.iter().position(|&c| c == best).unwrap_or(0);
    let limit = (best as f32 * (1.0 + s.uniqueness)) as i64;
    let rivals = sums.iter().enumerate().filter(|&(d, &c)| d.abs_diff(index) > 1 && c <= limit).count();
    let disparity = first + index as i64;
    if rivals > 0 || index == 0 || index + 1 >= sums.len() || disparity > x {
        return 0.0;
    }
    if right(x - disparity, y).is_none_or(|d| d.abs_diff(index as i64) > u64::from(s.left_right)) {
        return 0.0;
    }
    let (a, c) = (sums[index - 1] as f32, sums[index + 1] as f32);
    let slope = a.max(c) - best as f32;
    disparity as f32 + if slope == 0.0 { 0.0 } else { (a - c) / (2.0 * slope) }
}
