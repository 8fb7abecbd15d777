//! The joint bilateral filter: each phasor becomes the mean of its neighbours with like delay.
//!
//! Constants and rules are libfreenect2's (`src/depth_packet_processor.cpp`, `src/cpu_depth_packet_processor.cpp`
//! `filterPixelStage1`), which has them from the vendor's shader.

use super::{
    COLUMNS, Row,
    curves::exp,
    phasor::{LIGHT_PER_LENGTH, PhasorRow},
};

/// Weight of the middle, of a neighbour beside it, and of one at a corner.
const MIDDLE: f32 = 0.119_571_6;
const BESIDE: f32 = 0.113_109_8;
const CORNER: f32 = 0.106_997_3;
/// A neighbour's weight falls by e^(−this · distance), where the distance is 0 for like delays and 1 for opposite ones.
const FALL: f32 = std::f32::consts::LOG2_E * 5.0;
/// Below this light a neighbour is left out; a pixel below it takes all its neighbours alike.
const LEAST_LIGHT: f32 = 3.0;
/// A pixel whose neighbours are farther than this together lies on an edge.
const MOST_DISTANCE: f32 = 2.5;

/// Filters the middle one of three rows of one frequency; where a pixel lies on an edge, `smooth` becomes false.
#[inline(always)]
pub fn smooth_row(rows: [&PhasorRow; 3], out_a: &mut Row<f32>, out_b: &mut Row<f32>, smooth: &mut Row<bool>) {
    const LEAST_SQUARE: f32 = (LEAST_LIGHT * LEAST_LIGHT) / (LIGHT_PER_LENGTH * LIGHT_PER_LENGTH);
    let [above, here, below] = rows;
    for x in 1..COLUMNS - 1 {
        let is_weak = here.square[x] < LEAST_SQUARE;
        let (least, fall) = if is_weak { (0.0, 0.0) } else { (LEAST_SQUARE, FALL) };
        let mut sums = [MIDDLE, MIDDLE * here.a[x], MIDDLE * here.b[x], 0.0];
        let unit = [here.unit_a[x], here.unit_b[x]];
        let mut add = |row: &PhasorRow, at: usize, share: f32| {
            let distance = 0.5 - 0.5 * (row.unit_a[at] * unit[0] + row.unit_b[at] * unit[1]);
            let counts = row.square[at] >= least;
            let weight = if counts { share * exp(-fall * distance) } else { 0.0 };
            sums[0] += weight;
            sums[1] += weight * row.a[at];
            sums[2] += weight * row.b[at];
            sums[3] += if counts { distance } else { 0.0 };
        };
        add(above, x - 1, CORNER);
        add(above, x, BESIDE);
        add(above, x + 1, CORNER);
        add(here, x - 1, BESIDE);
        add(here, x + 1, BESIDE);
        add(below, x - 1, CORNER);
        add(below, x, BESIDE);
        add(below, x + 1, CORNER);
        // NaN (a weak pixel beside one without any light) is neither.
        let sound = sums[0] > 0.0;
        out_a[x] = if sound { sums[1] / sums[0] } else { 0.0 };
        out_b[x] = if sound { sums[2] / sums[0] } else { 0.0 };
        smooth[x] &= sums[3] < MOST_DISTANCE;
    }
    for x in [0, COLUMNS - 1] {
        (out_a[x], out_b[x]) = (here.a[x], here.b[x]);
    }
}
