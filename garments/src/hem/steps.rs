//! Steps: what faces away from what was worn before.

use super::border::Border;

/// A vertex whose normal is further than this (cosine) from the earlier surface's lies on a step.
const STEP_ALIGNMENT: f32 = 0.75;

/// From the border inward, every vertex that faces away from the earlier surface and is not `colored` as the garment is.
pub(super) fn step_vertices(border: &Border, colored: impl Fn(usize) -> bool) -> Vec<u32> {
    let on = border.on;
    let steep = |v: u32| {
        let v = v as usize;
        let near = border.garment[v] && border.distance[v].is_finite();
        near && on.evidence.alignment[v] <= STEP_ALIGNMENT && !colored(v)
    };
    let starts = (0..on.graph.len() as u32).filter(|&v| border.distance[v as usize] == 0.0 && steep(v));
    let mut stack: Vec<u32> = starts.collect();
    let mut taken = vec![false; on.graph.len()];
    stack.iter().for_each(|&v| taken[v as usize] = true);
    let mut steps = Vec::new();
    while let Some(v) = stack.pop() {
        steps.push(v);
        for &n in on.graph.neighbors.of(v as usize) {
            if !taken[n as usize] && steep(n) {
                taken[n as usize] = true;
                stack.push(n);
            }
        }
    }
    steps
}
