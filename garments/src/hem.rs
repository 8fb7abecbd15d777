//! The hem within the step from the cloth down to what lies below it.
//!
//! A fused scan draws a slope, as wide as a pixel of the camera, from the cloth's edge to the skin below. The colour of
//! that slope is a mixture. The cloth's edge is half-way down: lower vertices near the border become unlikely.

use std::collections::VecDeque;

use nalgebra::{Point3, Vector3};
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
/// Lips are looked for within this share of the greatest depth of a step; the cloth is read beyond it.
const LIP_WIDTH: f32 = 0.7;
/// A lip's normal is further than this (cosine) from the cloth's.
const LIP_FACING: f32 = 0.7;
/// A lip lies at least this far below the cloth's plane, metres.
const LIP_DROP: f32 = 0.002;
/// Cloth behind a hem must have this area to be believed, square metres.
const LEAST_BEHIND: f32 = 5e-5;

/// What faces up or down more than this (cosine) was not seen by a camera that circles the subject: its colour is carried
/// over from the front of the cloth and tells nothing.
const LEVEL: f32 = 0.7;
/// Nearer to what was worn before, a pixel's blur colours a step, metres.
const LEDGE: f32 = 0.006;

/// Lowers the log odds of the steps at the garment's border: what faces away from what was worn before. What has the
/// garment's colour stays, but for ledges; where it has a `facing` (jackets and coats), these too.
pub fn lower_steps(
    scan: &Mesh,
    graph: &ScanGraph,
    evidence: &Evidence,
    labels: &mut Labels,
    color_odds: &[f32],
    facing: bool,
    settings: &ExtractSettings,
) {
    let depth = settings.hem_depth;
    let reached = border_distance(scan, graph, labels, depth);
    let ledge = |v: usize| !facing && level(graph, v) && evidence.clearance[v] > LEDGE;
    let steps = step_vertices(graph, evidence, labels, &reached, |v| color_odds[v] > STEP_COLOR && !ledge(v));
    lower(labels, steps.into_iter());
}

/// Lowers the log odds of what lies low against the cloth behind the border, and of what is turned away from it. Where
/// the garment has a `facing`, what has its colour past a fold, and was seen, is its turned-in edge and stays.
pub fn lower_slopes(
    scan: &Mesh,
    graph: &ScanGraph,
    evidence: &Evidence,
    labels: &mut Labels,
    color_odds: &[f32],
    facing: bool,
    settings: &ExtractSettings,
) {
    let depth = settings.hem_depth;
    let reached = border_distance(scan, graph, labels, depth);
    let slopes = slope_vertices(scan, graph, evidence, labels, &reached, depth);
    let lips = lip_vertices(scan, graph, labels, &reached, depth);
    let seen = |v: usize| graph.filled[v] < 0.5 && !level(graph, v);
    let turned_in = |v: &u32| facing && color_odds[*v as usize] > STEP_COLOR && seen(*v as usize);
    lower(labels, slopes.into_iter().chain(lips.into_iter().filter(|v| !turned_in(v))));
}

fn level(graph: &ScanGraph, v: usize) -> bool {
    graph.normals[v].y.abs() > LEVEL
}

fn lower(labels: &mut Labels, vertices: impl Iterator<Item = u32>) {
    vertices.for_each(|v| labels.log_odds[v as usize] = labels.log_odds[v as usize].min(SLOPE_ODDS));
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

/// From the border inward, every vertex that faces away from the earlier surface and is not `colored` as the garment is.
fn step_vertices(
    graph: &ScanGraph,
    evidence: &Evidence,
    labels: &Labels,
    reached: &[f32],
    colored: impl Fn(usize) -> bool,
) -> Vec<u32> {
    let steep = |v: u32| {
        let v = v as usize;
        labels.garment[v] && evidence.facing[v] <= STEP_FACING && !colored(v) && reached[v].is_finite()
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
    let beyond = |v: &u32| reached[*v as usize] > SLOPE_WIDTH * radius && evidence.height[*v as usize].is_finite();
    let near = around(scan, graph, labels, center, radius);
    near.into_iter().filter(beyond).map(|v| evidence.height[v as usize]).collect()
}

/// The garment's vertices within `radius` of `center` that are connected to it there.
fn around(scan: &Mesh, graph: &ScanGraph, labels: &Labels, center: u32, radius: f32) -> Vec<u32> {
    let origin = scan.positions[center as usize];
    let mut visited = std::collections::BTreeSet::from([center]);
    let mut found = vec![center];
    let mut next = 0;
    while next < found.len() {
        for &n in graph.neighbors.of(found[next] as usize) {
            let near = (scan.positions[n as usize] - origin).norm() < radius;
            if near && labels.garment[n as usize] && visited.insert(n) {
                found.push(n);
            }
        }
        next += 1;
    }
    found
}

/// Vertices near the border that lie past a fold: below the plane of the cloth further in and turned away from it. A
/// fused scan closes the space behind a hanging hem by such a lip.
fn lip_vertices(scan: &Mesh, graph: &ScanGraph, labels: &Labels, reached: &[f32], depth: f32) -> Vec<u32> {
    let turned = |&v: &u32| {
        let v = v as usize;
        if !(labels.garment[v] && reached[v] < LIP_WIDTH * depth) {
            return false;
        }
        let Some((center, normal)) = cloth_behind(scan, graph, labels, reached, v as u32, depth) else { return false };
        graph.normals[v].dot(&normal) < LIP_FACING && (scan.positions[v] - center).dot(&normal) < -LIP_DROP
    };
    (0..graph.len() as u32).filter(turned).collect()
}

/// Middle and normal of the cloth between half and the whole of `radius` from the border, around `center`.
fn cloth_behind(
    scan: &Mesh,
    graph: &ScanGraph,
    labels: &Labels,
    reached: &[f32],
    center: u32,
    radius: f32,
) -> Option<(Point3<f32>, Vector3<f32>)> {
    let (mut area, mut sum, mut normal) = (0.0, Vector3::zeros(), Vector3::zeros());
    for v in around(scan, graph, labels, center, radius).into_iter().map(|v| v as usize) {
        if reached[v] > LIP_WIDTH * radius {
            area += graph.areas[v];
            sum += scan.positions[v].coords * graph.areas[v];
            normal += graph.normals[v] * graph.areas[v];
        }
    }
    // Cloth that is itself bent all ways tells no direction.
    let told = normal.norm() > 0.7 * area && area > LEAST_BEHIND;
    told.then(|| (Point3::from(sum / area), normal.normalize()))
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
