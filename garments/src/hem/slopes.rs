//! Slopes: what lies low against the cloth behind the border.

use toile_geometry::statistics::{Rank, quantile_by};

use super::border::Border;

/// Below this share of the cloth's height near the hem a vertex lies on the slope.
const SLOPE_SHARE: f32 = 0.45;
/// The cloth must stand off by this many times the noise before a slope is believed.
const SLOPE_NOISE: f32 = 3.0;
/// The slope's width, as a share of the greatest depth of a step: cloth heights are read beyond it.
const SLOPE_WIDTH: f32 = 0.5;
/// Quantile of the heights beyond the slope that counts as the cloth's height.
const PLATEAU: f64 = 0.6;
/// A quantile of fewer heights is not believed.
const FEWEST_HEIGHTS: usize = 5;

/// Vertices near the border that lie low against the cloth further in.
pub(super) fn slope_vertices(border: &Border) -> Vec<u32> {
    let (height, near) = (&border.on.evidence.height, SLOPE_WIDTH * border.depth);
    let stands_off = SLOPE_NOISE * border.on.evidence.height_noise;
    let is_low = |&v: &u32| {
        let at = v as usize;
        let low = |plateau: f32| plateau > stands_off && height[at] < SLOPE_SHARE * plateau;
        height[at].is_finite() && border.distance[at] < near && plateau(heights_behind(border, v)).is_some_and(low)
    };
    (0..border.on.graph.len() as u32).filter(is_low).collect()
}

/// Heights of the garment around `center` that lie beyond the slope.
fn heights_behind(border: &Border, center: u32) -> Vec<f32> {
    let height = |v: u32| border.on.evidence.height[v as usize];
    let beyond = |v: &u32| border.distance[*v as usize] > SLOPE_WIDTH * border.depth && height(*v).is_finite();
    border.around(center).into_iter().filter(beyond).map(height).collect()
}

/// The height of the cloth behind a slope; `None` for fewer than [`FEWEST_HEIGHTS`].
fn plateau(mut heights: Vec<f32>) -> Option<f32> {
    if heights.len() < FEWEST_HEIGHTS { None } else { quantile_by(&mut heights, PLATEAU, Rank::Count) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plateau_needs_a_few_heights() {
        assert_eq!(plateau(vec![1.0; 4]), None);
        assert_eq!(plateau(vec![5.0, 1.0, 4.0, 2.0, 3.0]), Some(4.0));
    }
}
