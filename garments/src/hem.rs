//! The hem within the step from the cloth down to what lies below it.
//!
//! A fused scan draws a slope, as wide as a pixel of the camera, from the cloth's edge to the skin below. The colour of
//! that slope is a mixture. The cloth's edge is half-way down: lower vertices near the border become unlikely.

use std::collections::VecDeque;

use toile_geometry::Mesh;

use crate::{ExtractSettings, evidence::Evidence, labels::Labels, scan_graph::ScanGraph};

/// A vertex whose normal is further than this (cosine) from the earlier surface's lies on a step.
const STEP_FACING: f32 = 0.75;
/// What has the garment's colour by more than this, nats, is its folded rim and no step.
const STEP_COLOR: f32 = 1.0;
/// Below this share of the cloth's height near the hem a vertex lies on the slope.
const SLOPE_SHARE: f32 = 0.45;
/// The cloth must stand off by this many times the noise for its slope to be told.
const SLOPE_NOISE: f32 = 3.0;
/// Log odds given to the slope, nats.
const SLOPE_ODDS: f32 = -2.0;
/// The slope's width, as a share of the greatest depth of a step: cloth heights are read beyond it.
const SLOPE_WIDTH: f32 = 0.5;
/// Quantile of the heights beyond the slope that counts as the cloth's height.
const PLATEAU: f32 = 0.6;

/// Lowers the log odds of the steps at the garment's border.
pub fn lower_steps(
    scan: &Mesh,
    graph: &ScanGraph,
    evidence: &Evidence,
    labels: &mut Labels,
    color_odds: &[f32],
    settings: &ExtractSettings,
) {
    let depth = settings.hem_depth;
    let reached = border_distance(scan, graph, labels, depth);
    let steps = step_vertices(graph, evidence, labels, color_odds, &reached);
    let slopes = slope_vertices(scan, graph, evidence, labels, &reached, depth);
    for v in steps.into_iter().chain(slopes) {
        labels.log_odds[v as usize] = labels.log_odds[v as usize].min(SLOPE_ODDS);
    }
}

/// Distance over the garment from its border (infinite beyond `depth` and outside), along edges.
fn border_distance(scan: &Mesh, graph: &ScanGraph, labels: &Labels, depth: f32) -> Vec<f32> {
    let border = |v: &u32| {
        labels.garment[*v as usize] && graph.neighbors.of(*v as usize).iter().any(|&n| !labels.garment[n as usize])
    };
    let open = graph.open_vertices(scan);
    let at_border = |v: &u32| border(v) || (labels.garment[*v as usize] && open[*v as usize]);
    let starts: Vec<u32> = (0..graph.len() as u32).filter(at_border).collect();
    spread(scan, graph, &starts, depth, |v| labels.garment[v as usize])
}

/// Length of the shortest way along edges from any of `starts`, up to `farthest`, through vertices that `may`.
fn spread(scan: &Mesh, graph: &ScanGraph, starts: &[u32], farthest: f32, may: impl Fn(u32) -> bool) -> Vec<f32> {
    let mut reached = vec![f32::INFINITY; graph.len()];
    let mut queue: VecDeque<u32> = starts.iter().copied().collect();
    starts.iter().for_each(|&v| reached[v as usize] = 0.0);
    while let Some(v) = queue.pop_front() {
        for &n in graph.neighbors.of(v as usize) {
            let far = reached[v as usize] + (scan.positions[n as usize] - scan.positions[v as usize]).norm();
            if may(n) && far < farthest && far < reached[n as usize] {
                reached[n as usize] = far;
                queue.push_back(n);
            }
        }
    }
    reached
}

/// From the border inward, every vertex that faces away from the earlier surface and does not have the garment's
/// colour.
fn step_vertices(
    graph: &ScanGraph,
    evidence: &Evidence,
    labels: &Labels,
    color_odds: &[f32],
    reached: &[f32],
) -> Vec<u32> {
    let steep = |v: u32| {
        let v = v as usize;
        labels.garment[v] && evidence.facing[v] <= STEP_FACING && color_odds[v] <= STEP_COLOR && reached[v].is_finite()
    };
    let mut taken = vec![false; graph.len()];
    let mut stack: Vec<u32> = (0..graph.len() as u32).filter(|&v| reached[v as usize] == 0.0 && steep(v)).collect();
    stack.iter().for_each(|&v| taken[v as usize] = true);
    let mut steps = Vec::new();
    while let Some(v) = stack.pop() {
        steps.push(v);
        for &n in graph.neighbors.of(v as usize) {
            if !taken[n as usize] && steep(n) {
                taken[n as usize] = true;
                stack.push(n);
            }
        }
    }
    steps
}

/// Vertices near the border that lie low against the cloth further in.
fn slope_vertices(
    scan: &Mesh,
    graph: &ScanGraph,
    evidence: &Evidence,
    labels: &Labels,
    reached: &[f32],
    depth: f32,
) -> Vec<u32> {
    let near = SLOPE_WIDTH * depth;
    let low = |v: u32| evidence.height[v as usize].is_finite() && reached[v as usize] < near;
    let mut slopes = Vec::new();
    for v in (0..graph.len() as u32).filter(|&v| low(v)) {
        let heights = heights_around(scan, graph, evidence, labels, reached, v, depth);
        let Some(plateau) = quantile(heights, PLATEAU) else { continue };
        let told = plateau > SLOPE_NOISE * evidence.height_noise;
        if told && evidence.height[v as usize] < SLOPE_SHARE * plateau {
            slopes.push(v);
        }
    }
    slopes
}

/// Heights of the garment within `radius` of `center` that lie beyond the slope.
fn heights_around(
    scan: &Mesh,
    graph: &ScanGraph,
    evidence: &Evidence,
    labels: &Labels,
    reached: &[f32],
    center: u32,
    radius: f32,
) -> Vec<f32> {
    let origin = scan.positions[center as usize];
    let mut visited = std::collections::BTreeSet::from([center]);
    let mut stack = vec![center];
    let mut heights = Vec::new();
    while let Some(v) = stack.pop() {
        let height = evidence.height[v as usize];
        if reached[v as usize] > SLOPE_WIDTH * radius && height.is_finite() {
            heights.push(height);
        }
        for &n in graph.neighbors.of(v as usize) {
            let near = (scan.positions[n as usize] - origin).norm() < radius;
            if near && labels.garment[n as usize] && visited.insert(n) {
                stack.push(n);
            }
        }
    }
    heights
}

fn quantile(mut values: Vec<f32>, share: f32) -> Option<f32> {
    let last = values.len().saturating_sub(1);
    let k = ((values.len() as f32 * share) as usize).min(last);
    (last >= 4).then(|| *values.select_nth_unstable_by(k, f32::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_need_a_few_values() {
        assert_eq!(quantile(vec![1.0; 4], 0.5), None);
        assert_eq!(quantile(vec![5.0, 1.0, 4.0, 2.0, 3.0], 0.6), Some(4.0));
    }
}
