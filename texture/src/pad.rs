//! Colours between charts: those of the nearest texels, so that filtering and mip levels bring nothing foreign in.
//!
//! Pull and push: coarser and coarser means of what is known, then from coarse to fine into what is not.

use rayon::prelude::*;

/// Fills texels whose fourth value is 0; `size` is a power of two.
pub(crate) fn pad(texels: Vec<[u8; 4]>, size: usize) -> Vec<[u8; 3]> {
    let mut levels = vec![texels];
    let mut edge = size;
    while edge > 1 {
        let fine = &levels[levels.len() - 1];
        let half = edge / 2;
        let coarse: Vec<[u8; 4]> =
            (0..half * half).into_par_iter().map(|i| mean(fine, edge, i % half, i / half)).collect();
        levels.push(coarse);
        edge = half;
    }
    for level in (0..levels.len() - 1).rev() {
        let edge = size >> level;
        let (fine, coarse) = levels.split_at_mut(level + 1);
        let coarse = &coarse[0];
        fine[level].par_chunks_mut(edge).enumerate().for_each(|(y, row)| {
            for (x, texel) in row.iter_mut().enumerate().filter(|(_, texel)| texel[3] == 0) {
                let from = coarse[y / 2 * (edge / 2) + x / 2];
                *texel = [from[0], from[1], from[2], 0];
            }
        });
    }
    levels.swap_remove(0).into_par_iter().map(|[r, g, b, _]| [r, g, b]).collect()
}

fn mean(fine: &[[u8; 4]], edge: usize, x: usize, y: usize) -> [u8; 4] {
    let (mut sum, mut count) = ([0u32; 3], 0u32);
    for v in 2 * y..2 * y + 2 {
        for texel in &fine[v * edge + 2 * x..v * edge + 2 * x + 2] {
            if texel[3] > 0 {
                (0..3).for_each(|k| sum[k] += u32::from(texel[k]));
                count += 1;
            }
        }
    }
    let [r, g, b] = sum.map(|s| ((s + count / 2) / count.max(1)) as u8);
    [r, g, b, u8::from(count > 0) * 255]
}
