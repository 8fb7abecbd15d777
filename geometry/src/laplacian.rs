//! The cotangent Laplacian of a triangle mesh (Pinkall and Polthier 1993).

use std::collections::BTreeMap;

/// A sparse row: (column, value), columns ascending.
pub type Row = Vec<(u32, f64)>;

/// Rows of the cotangent Laplacian C of vertices 0 to `rows`, positive semidefinite: C_pq = −w_pq and C_pp = Σ_q w_pq,
/// where w_pq is the sum of ½ cot over the corners opposite to the edge pq.
///
/// `half_cotangent(t, k)` gives ½ cot of the angle at corner k of triangle t; callers bound it so that slivers stay
/// harmless. Sums run in the triangles' order. O(n log n).
pub fn cotangent_laplacian(
    triangles: &[[u32; 3]],
    rows: usize,
    half_cotangent: impl Fn(usize, usize) -> f64,
) -> Vec<Row> {
    let mut sums: Vec<BTreeMap<u32, f64>> = vec![BTreeMap::new(); rows];
    for (t, corners) in triangles.iter().enumerate() {
        for k in 0..3 {
            let (i, j) = (corners[k], corners[(k + 1) % 3]);
            let w = half_cotangent(t, (k + 2) % 3);
            for (p, q) in [(i, j), (j, i)] {
                if let Some(row) = sums.get_mut(p as usize) {
                    *row.entry(q).or_default() -= w;
                    *row.entry(p).or_default() += w;
                }
            }
        }
    }
    sums.into_iter().map(|row| row.into_iter().collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_laplacian_of_a_flat_grid_is_that_of_finite_differences() {
        // Right angles have no cotangent, so the diagonals of the squares drop out: 4 in the middle, −1 around it.
        let at = |x: u32, y: u32| y * 3 + x;
        let squares = [(0, 0), (1, 0), (0, 1), (1, 1)];
        let triangles: Vec<[u32; 3]> = squares
            .iter()
            .flat_map(|&(x, y)| {
                let (a, b, c, d) = (at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1));
                [[a, b, c], [a, c, d]]
            })
            .collect();
        let place = |v: u32| nalgebra::Vector2::new(f64::from(v % 3), f64::from(v / 3));
        let rows = cotangent_laplacian(&triangles, 9, |t, k| {
            let [apex, i, j] = [0, 1, 2].map(|step| place(triangles[t][(k + step) % 3]));
            let (a, b) = (i - apex, j - apex);
            0.5 * a.dot(&b) / a.perp(&b).abs()
        });
        let middle: BTreeMap<u32, f64> = rows[4].iter().copied().filter(|e| e.1.abs() > 1e-12).collect();
        assert_eq!(middle, BTreeMap::from([(1, -1.0), (3, -1.0), (4, 4.0), (5, -1.0), (7, -1.0)]));
        assert!(rows.iter().all(|row| row.iter().map(|e| e.1).sum::<f64>().abs() < 1e-12));
    }
}
