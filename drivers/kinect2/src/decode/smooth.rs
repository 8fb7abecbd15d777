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
const MIN_LIGHT: f32 = 3.0;
/// A pixel whose neighbours are farther than this together lies on an edge.
const MAX_DISTANCE: f32 = 2.5;

/// Columns with neighbours on both sides.
const INNER: usize = COLUMNS - 2;

/// Weights, weighted phasors and distances of a row's neighbours so far.
struct Sums {
    weight: [f32; INNER],
    a: [f32; INNER],
    b: [f32; INNER],
    distance: [f32; INNER],
}

/// The inner columns of a row, or those `shift` columns further.
#[inline(always)]
fn inner(row: &Row<f32>, shift: usize) -> &[f32; INNER] {
    match shift {
        0 => &row.as_chunks::<INNER>().0[0],
        1 => &row[1..].as_chunks::<INNER>().0[0],
        _ => &row[2..].as_chunks::<INNER>().0[0],
    }
}

/// Filters the middle one of three rows of one frequency; where a pixel lies on an edge, `smooth` becomes false.
#[inline(always)]
pub fn smooth_row(rows: [&PhasorRow; 3], out_a: &mut Row<f32>, out_b: &mut Row<f32>, smooth: &mut Row<bool>) {
    const MIN_SQUARE: f32 = (MIN_LIGHT * MIN_LIGHT) / (LIGHT_PER_LENGTH * LIGHT_PER_LENGTH);
    let here = rows[1];
    let (mut min, mut fall) = ([0.0; INNER], [0.0; INNER]);
    let mut sums =
        Sums { weight: [MIDDLE; INNER], a: *inner(&here.a, 1), b: *inner(&here.b, 1), distance: [0.0; INNER] };
    let square = inner(&here.square, 1);
    for x in 0..INNER {
        min[x] = if square[x] < MIN_SQUARE { 0.0 } else { MIN_SQUARE };
        fall[x] = if square[x] < MIN_SQUARE { 0.0 } else { -FALL };
        sums.a[x] *= MIDDLE;
        sums.b[x] *= MIDDLE;
    }
    for (row, corners) in [(rows[0], true), (rows[2], true), (here, false)] {
        let (beside, middle) = if corners { (CORNER, BESIDE) } else { (BESIDE, 0.0) };
        add(here, row, 0, beside, &min, &fall, &mut sums);
        add(here, row, 2, beside, &min, &fall, &mut sums);
        if corners {
            add(here, row, 1, middle, &min, &fall, &mut sums);
        }
    }
    for x in 0..INNER {
        // NaN (a weak pixel beside one without any light) is neither.
        let inverse = if sums.weight[x] > 0.0 { 1.0 / sums.weight[x] } else { 0.0 };
        sums.weight[x] = inverse;
    }
    for x in 0..INNER {
        let inverse = sums.weight[x];
        out_a[x + 1] = if inverse > 0.0 { sums.a[x] * inverse } else { 0.0 };
        out_b[x + 1] = if inverse > 0.0 { sums.b[x] * inverse } else { 0.0 };
        smooth[x + 1] &= sums.distance[x] < MAX_DISTANCE;
    }
    for x in [0, COLUMNS - 1] {
        (out_a[x], out_b[x]) = (here.a[x], here.b[x]);
    }
}

/// Adds one neighbour of each pixel.
#[inline(always)]
fn add(
    here: &PhasorRow,
    other: &PhasorRow,
    shift: usize,
    share: f32,
    min: &[f32; INNER],
    fall: &[f32; INNER],
    sums: &mut Sums,
) {
    let (unit_a, unit_b) = (inner(&here.unit_a, 1), inner(&here.unit_b, 1));
    let (other_a, other_b) = (inner(&other.unit_a, shift), inner(&other.unit_b, shift));
    let (a, b, square) = (inner(&other.a, shift), inner(&other.b, shift), inner(&other.square, shift));
    for x in 0..INNER {
        let counts = square[x] >= min[x];
        let distance = 0.5 - 0.5 * (other_a[x] * unit_a[x] + other_b[x] * unit_b[x]);
        let distance = if counts { distance } else { 0.0 };
        let weight = if counts { share } else { 0.0 } * exp(fall[x] * distance);
        sums.weight[x] += weight;
        sums.a[x] += weight * a[x];
        sums.b[x] += weight * b[x];
        sums.distance[x] += distance;
    }
}
