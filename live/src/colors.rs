//! Depth as colours, for people.

use toile_capture::DepthImage;
use toile_render::colormap::viridis;

/// The distances that colours are spread over, metres: nearer and farther ones have the colour of the end.
const RANGE: (f32, f32) = (0.5, 4.5);
/// What was not measured.
const NOTHING: [u8; 3] = [16, 16, 20];

/// A colour for each pixel of `depth`, whose unit is `scale` metres; near is bright.
pub fn depth_colors(depth: &DepthImage, scale: f64) -> Vec<[u8; 3]> {
    let table = table(scale);
    depth.values.iter().map(|value| table[usize::from(*value)]).collect()
}

/// The colour of every value that a depth can have.
fn table(scale: f64) -> Vec<[u8; 3]> {
    // Coarse steps of a few millimetres look the same and are made much faster.
    const STEP: usize = 8;
    let color = |value: usize| match value {
        0 => NOTHING,
        value => viridis(RANGE.0 + RANGE.1 - (value as f64 * scale) as f32, RANGE),
    };
    let mut table = vec![NOTHING; 1 << 16];
    for start in (0..1 << 16).step_by(STEP) {
        let middle = color(start + STEP / 2);
        table[start..start + STEP].fill(middle);
    }
    table[0] = NOTHING;
    table
}

/// The same for many pictures of one camera.
#[derive(Debug, Clone)]
pub struct DepthColors(Vec<[u8; 3]>);

impl DepthColors {
    /// For depth whose unit is `scale` metres.
    pub fn new(scale: f64) -> Self {
        Self(table(scale))
    }

    /// A colour for each pixel of `depth`; pixels that `is_subject` does not hold are grey. All are held where it is empty.
    pub fn of(&self, depth: &DepthImage, is_subject: &[bool]) -> Vec<[u8; 3]> {
        let grey = |color: [u8; 3]| {
            let light = (u16::from(color[0]) + 2 * u16::from(color[1]) + u16::from(color[2])) / 12;
            [light as u8 + 16; 3]
        };
        let held = |k: usize| is_subject.get(k).copied().unwrap_or(true);
        let color = |(k, value): (usize, &u16)| {
            let color = self.0[usize::from(*value)];
            if held(k) || *value == 0 { color } else { grey(color) }
        };
        depth.values.iter().enumerate().map(color).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_is_bright_far_is_dark_and_nothing_is_neither() {
        let depth = DepthImage { width: 4, height: 1, values: vec![0, 600, 2500, 4400] };
        let light = |c: &[u8; 3]| c.iter().map(|v| u32::from(*v)).sum::<u32>();
        let colors = depth_colors(&depth, 0.001);
        assert_eq!(colors[0], NOTHING);
        assert!(light(&colors[1]) > light(&colors[2]) && light(&colors[2]) > light(&colors[3]), "{colors:?}");
        let cut = DepthColors::new(0.001).of(&depth, &[false, false, true, false]);
        assert!(cut[2] == colors[2] && cut[1][0] == cut[1][1], "{cut:?}");
    }
}
