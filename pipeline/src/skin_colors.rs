//! Colours of a body of which clothes, or the end of the scan, hide a part.

use toile_fitting::BodyFit;
use toile_geometry::{Mesh, color_transfer::closest_colors, topology::VertexNeighbors};

/// Rounds of averaging over neighbours by which hidden skin goes over into what is seen: some centimetres.
const SOFT: usize = 60;
/// What was not scanned at all looks like a figure in a shop window: nobody takes it for the person's.
const UNSCANNED: [f32; 3] = [160.0; 3];
/// Fewest vertices that a colour of skin is taken from.
const FEWEST: usize = 20;

/// sRGB colours of `body`, the fit's body in the pose and frame of `scan`: those of the bare scan where the body is bare, the
/// person's skin under clothes, and grey below the scan's lower end. Empty where the scan has no colours.
pub fn body_colors(scan: &Mesh, is_cloth: &[bool], body: &Mesh, fit: &BodyFit) -> Vec<[u8; 3]> {
    let is_bare = |t: usize| scan.triangles[t].iter().all(|&v| !is_cloth.get(v as usize).copied().unwrap_or(false));
    let (bare, _) = scan.filter_triangles(is_bare);
    let seen = closest_colors(&bare, &body.positions, &body.normals);
    if seen.is_empty() {
        return seen;
    }
    let cut = fit.report.part.as_ref().map_or(f64::NEG_INFINITY, |part| part.cut_m) as f32;
    let is_fixed: Vec<bool> = (0..seen.len()).map(|v| fit.seen[v]).collect();
    let as_float = |c: [u8; 3]| c.map(f32::from);
    let skin = typical(&seen, &is_fixed);
    let start = |v: usize| match () {
        () if is_fixed[v] => as_float(seen[v]),
        () if body.positions[v].y < cut => UNSCANNED,
        () => skin,
    };
    let mut colors: Vec<[f32; 3]> = (0..seen.len()).map(start).collect();
    let neighbors = VertexNeighbors::new(colors.len(), &body.triangles);
    for _ in 0..SOFT {
        let mean = |v: usize| {
            let around = neighbors.of(v);
            if is_fixed[v] || around.is_empty() || body.positions[v].y < cut {
                return colors[v];
            }
            let sum = |k: usize| around.iter().map(|&n| colors[n as usize][k]).sum::<f32>();
            std::array::from_fn(|k| sum(k) / around.len() as f32)
        };
        colors = (0..colors.len()).map(mean).collect();
    }
    colors.iter().map(|c| c.map(|x| (x + 0.5).clamp(0.0, 255.0) as u8)).collect()
}

/// The colour of the person's skin: the middle one of what is seen, by lightness; the lighter half, since hair and brows are
/// darker than skin more often than not.
fn typical(seen: &[[u8; 3]], is_fixed: &[bool]) -> [f32; 3] {
    let mut colors: Vec<[u8; 3]> = seen.iter().zip(is_fixed).filter(|(_, fixed)| **fixed).map(|(c, _)| *c).collect();
    if colors.len() < FEWEST {
        return UNSCANNED;
    }
    colors.sort_by_key(|c| (c.iter().map(|&x| u32::from(x)).sum::<u32>(), *c));
    colors[colors.len() * 2 / 3].map(f32::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_typical_colour_is_one_of_those_seen_and_not_the_hairs() {
        let seen = [vec![[30, 25, 20]; 40], vec![[200, 150, 125]; 60], vec![[10, 250, 10]; 100]].concat();
        let is_fixed: Vec<bool> = (0..seen.len()).map(|v| v < 100).collect();
        assert_eq!(typical(&seen, &is_fixed), [200.0, 150.0, 125.0]);
        assert_eq!(typical(&seen, &[false; 200]), UNSCANNED);
    }
}
