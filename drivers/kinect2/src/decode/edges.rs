//! The edge filter: where light and depth jump together, a pixel sees two things at once and its depth is between them.
//!
//! Rules and constants are libfreenect2's (`src/cpu_depth_packet_processor.cpp` `filterPixelStage2`,
//! `src/depth_packet_processor.cpp`).

use super::{COLUMNS, Row};

/// Light counts as at least this when its spread is set in relation to it.
const MIN_LIGHT: f32 = 50.0;
/// Light spreads by at least this part on an edge.
const MIN_SPREAD: f32 = 0.05;
/// On an edge the nearest neighbour is nearer by more than this, the farthest farther, and one of them beyond the third;
/// millimetres.
const CLOSER: f32 = 50.0;
const FARTHER: f32 = 30.0;
const EITHER: f32 = 100.0;

/// One row before the edge filter.
#[derive(Clone)]
pub struct DepthRow {
    /// Depth, millimetres.
    pub depth: Row<f32>,
    /// The same, 0 where the bilateral filter found an edge.
    pub smooth: Row<f32>,
    /// Light of the three frequencies together.
    pub light: Row<f32>,
}

impl Default for DepthRow {
    fn default() -> Self {
        Self { depth: [0.0; COLUMNS], smooth: [0.0; COLUMNS], light: [0.0; COLUMNS] }
    }
}

/// Depth of the middle one of three rows without edges.
#[allow(clippy::needless_range_loop)]
#[inline(always)]
pub fn edge_row(rows: [&DepthRow; 3], out: &mut Row<f32>) {
    let here = rows[1];
    for x in 1..COLUMNS - 1 {
        let depth = here.depth[x];
        let (mut sum, mut squares, mut nearest, mut farthest) = (0.0_f32, 0.0_f32, depth, depth);
        for row in rows {
            for at in [x - 1, x, x + 1] {
                let (light, other) = (row.light[at], row.smooth[at]);
                sum += light;
                squares += light * light;
                nearest = if other > 0.0 && other < nearest { other } else { nearest };
                farthest = if other > farthest { other } else { farthest };
            }
        }
        let spread = (squares * 9.0 - sum * sum).max(0.0).sqrt() / (sum.max(9.0 * MIN_LIGHT));
        let (closer, farther) = (depth - nearest, farthest - depth);
        let is_edge = spread >= MIN_SPREAD && closer > CLOSER && farther > FARTHER && closer.max(farther) > EITHER;
        out[x] = if is_edge { 0.0 } else { here.smooth[x] };
    }
    for x in [0, COLUMNS - 1] {
        out[x] = here.depth[x];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The middle pixel at `middle` between a near and a far surface whose light differs by `contrast`.
    fn between(middle: f32, contrast: f32) -> f32 {
        let mut row = DepthRow::default();
        for x in 0..COLUMNS {
            row.depth[x] = if x < 256 { 1000.0 } else { 1300.0 };
            row.light[x] = if x < 256 { 400.0 } else { 400.0 * contrast };
        }
        row.depth[256] = middle;
        row.smooth = row.depth;
        let mut out = [0.0; COLUMNS];
        edge_row([&row, &row, &row], &mut out);
        assert_eq!((out[0], out[100], out[400]), (1000.0, 1000.0, 1300.0));
        out[256]
    }

    #[test]
    fn a_pixel_between_two_surfaces_is_dropped_where_light_jumps_too() {
        assert_eq!(between(1150.0, 0.5), 0.0);
        assert_eq!(between(1150.0, 1.0), 1150.0);
        // Beside one of them it is not a mix.
        assert_eq!(between(1300.0, 0.5), 1300.0);
        assert_eq!(between(1040.0, 0.5), 1040.0);
    }
}
