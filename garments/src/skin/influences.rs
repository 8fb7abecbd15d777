//! Skin weights as dense rows, and back to few influences for each vertex.

use rayon::prelude::*;
use toile_character::{SkinWeights, joint::JOINT_COUNT, skin::INFLUENCES};
use toile_geometry::{Mesh, surface_solve::SurfaceSystem};

/// Weight of every joint at a vertex.
pub(super) type Row = [f32; JOINT_COUNT];

/// The weights of vertex `v` as a row.
pub(super) fn row(weights: &SkinWeights, v: usize) -> Row {
    let mut row = [0.0; JOINT_COUNT];
    weights.of(v).for_each(|(j, w)| row[j as usize] += w);
    row
}

/// Rows smoothed over the surface of `mesh`, at each vertex over one of `lengths` (metres).
pub(super) fn smoothed(mesh: &Mesh, mut rows: Vec<Row>, lengths: &[f32]) -> Vec<Row> {
    let system = SurfaceSystem::new(mesh);
    let anchors: Vec<f32> = lengths.iter().map(|l| 1.0 / (l * l)).collect();
    let used: Vec<usize> = (0..JOINT_COUNT).filter(|&j| rows.iter().any(|row| row[j] > 0.0)).collect();
    let column = |&j: &usize| system.smoothed(&rows.iter().map(|row| row[j]).collect::<Vec<_>>(), &anchors);
    let columns: Vec<Vec<f32>> = used.par_iter().map(column).collect();
    for (j, column) in used.into_iter().zip(columns) {
        rows.iter_mut().zip(column).for_each(|(row, w)| row[j] = w);
    }
    rows
}

/// Weights with at most [`INFLUENCES`] joints a vertex: see [`push_continuous`].
pub(super) fn to_weights(rows: &[Row]) -> SkinWeights {
    let mut out = SkinWeights::default();
    rows.iter().for_each(|row| push_continuous(&mut out, (0u8..).zip(row.iter().copied())));
    out
}

/// Adds a vertex with at most [`INFLUENCES`] of its `influences` (joint, weight; each joint once). The largest one that is
/// dropped is subtracted from those that stay: where two neighbours keep different joints, these then weigh next to
/// nothing. Cut off plainly, a shin that weighs 0.016 on every other vertex stretches a hem's triangles threefold.
pub(super) fn push_continuous(out: &mut SkinWeights, influences: impl Iterator<Item = (u8, f32)>) {
    let mut sorted: Vec<(u8, f32)> = influences.filter(|i| i.1 > 0.0).collect();
    sorted.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    let dropped = sorted.get(INFLUENCES).map_or(0.0, |i| i.1);
    let kept: Vec<(u8, f32)> = sorted.iter().take(INFLUENCES).map(|&(j, w)| (j, w - dropped)).collect();
    // Equal weights give nothing to choose by: then the plain rule.
    out.push(if kept.iter().any(|i| i.1 > 0.0) { &kept } else { &sorted });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_change_of_weights_changes_little_though_other_joints_are_kept() {
        let kept = |fourth: f32, fifth: f32| {
            let mut out = SkinWeights::default();
            push_continuous(
                &mut out,
                [0.6, 0.2, 0.168, fourth, fifth].into_iter().enumerate().map(|(j, w)| (j as u8, w)),
            );
            let mut row = [0.0; JOINT_COUNT];
            out.of(0).for_each(|(j, w)| row[j as usize] += w);
            assert!((row.iter().sum::<f32>() - 1.0).abs() < 1e-5);
            row
        };
        let (a, b) = (kept(0.0161, 0.0159), kept(0.0159, 0.0161));
        let change = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(change < 5e-4, "{change}");
        // Weights do not change where nothing is dropped, and equal weights are kept too.
        assert!((kept(0.032, 0.0)[3] - 0.032).abs() < 1e-6);
        let mut out = SkinWeights::default();
        push_continuous(&mut out, (0..8).map(|j| (j, 0.125)));
        assert_eq!(out.of(0).collect::<Vec<_>>(), [(0, 0.25), (1, 0.25), (2, 0.25), (3, 0.25)]);
    }
}
