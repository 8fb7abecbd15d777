//! Islands dropped, holes closed.

use nalgebra::Point3;
use toile_geometry::{
    Mesh,
    bvh::Bvh,
    intersection::self_crossings,
    topology::{VertexNeighbors, boundary_loops, loop_length, vertex_components},
    triangle::ray_hit,
};

use crate::{ExtractSettings, evidence::Evidence, labels::Labels, push::grow, scan_graph::ScanGraph};

/// An island of old surface inside the garment is turned new up to this share of `least_area`, whatever it says.
const ISLAND_SHARE: f32 = 0.2;
/// Loops with more vertices than this are not closed: triangulating costs the cube.
const MOST_RIM_VERTICES: usize = 450;
/// Rings around the inside of a mesh that are no strip.
const STRIP_REACH: usize = 3;
/// A patch or hole belongs to the garment when this share of its surroundings does.
const SURROUNDED: f64 = 0.95;
/// Closed by fusion and within this angle (cosine) of what was worn before, a patch may be cloth: a membrane is not.
const ALONG: f32 = 0.8;
/// A membrane spans hollows: cloth that nobody saw is believed up to this height over what was worn before, metres.
const NEAR: f32 = 0.05;
/// A vertex between others is said to belong, or not to, from this share of [`BY_HAND`] on.
const SAID: f32 = 0.3;

/// Vertex attribute of what strokes decided: 1 where somebody said that it belongs, −1 that it does not.
pub const BY_HAND: &str = "by_hand";

/// Labels with small islands of either kind turned over, and of the garment's pieces only the large ones kept.
/// Returns how many pieces are left.
pub fn drop_islands(graph: &ScanGraph, labels: &mut Labels, settings: &ExtractSettings) -> usize {
    let (set, areas) = graph.components(|v| !labels.garment[v]);
    for v in 0..graph.len() {
        if set[v] != u32::MAX && areas[set[v] as usize] < ISLAND_SHARE * settings.least_area {
            flip(labels, v);
        }
    }
    let (set, areas) = graph.components(|v| labels.garment[v]);
    let largest = areas.iter().copied().fold(0.0, f32::max);
    let keep = |a: f32| a >= settings.least_area && a >= settings.piece_share * largest;
    for v in 0..graph.len() {
        if set[v] != u32::MAX && !keep(areas[set[v] as usize]) {
            flip(labels, v);
        }
    }
    areas.iter().filter(|&&a| keep(a)).count()
}

fn flip(labels: &mut Labels, v: usize) {
    labels.garment[v] = !labels.garment[v];
    labels.confidence[v] = 0.5;
}

/// Filled vertices take part in the garment only where no bone passes through their patch: below a skirt's hem and in a
/// collar the scan is closed by a membrane that is no cloth. A patch that the garment surrounds belongs to it; of one
/// that it shares with its surroundings (on top of a shoulder, beside the neck) those vertices stay that were labelled so
/// and lie along what was worn before; where a bone passes through the patch elsewhere, they must lie along the body too.
pub fn settle_filled(
    scan: &Mesh,
    graph: &ScanGraph,
    evidence: &Evidence,
    labels: &mut Labels,
    bones: &[[Point3<f32>; 2]],
) {
    let filled = |v: usize| graph.filled[v] > 0.5;
    let (patch, areas) = graph.components(filled);
    let mut around = vec![[0u32; 2]; areas.len()];
    for v in (0..graph.len()).filter(|&v| filled(v)) {
        for &n in graph.neighbors.of(v).iter().filter(|&&n| !filled(n as usize)) {
            around[patch[v] as usize][usize::from(labels.garment[n as usize])] += 1;
        }
    }
    let mut passed = vec![false; areas.len()];
    for (t, tri) in scan.triangles.iter().enumerate() {
        // One filled corner will do: the patch's rim was seen.
        if let Some(&v) = tri.iter().find(|&&v| filled(v as usize)) {
            passed[patch[v as usize] as usize] |= bones.iter().any(|b| crosses(b, &scan.corners(t)));
        }
    }
    for v in (0..graph.len()).filter(|&v| filled(v)) {
        let [old, new] = around[patch[v] as usize];
        let surrounded = f64::from(new) > SURROUNDED * f64::from(old + new);
        let along = evidence.facing[v] > ALONG && evidence.height[v].abs() < NEAR;
        let along_body = evidence.body_facing[v] > ALONG && evidence.body_distance[v] < 2.0 * NEAR;
        labels.garment[v] = match passed[patch[v] as usize] {
            true => labels.garment[v] && along && along_body,
            false => surrounded || (labels.garment[v] && along),
        };
    }
}

fn crosses([from, to]: &[Point3<f32>; 2], corners: &[Point3<f32>; 3]) -> bool {
    ray_hit(from, &(to - from), corners).is_some_and(|(t, _)| t <= 1.0)
}

/// Closes the scan's own holes whose rims belong to the garment all round, unless a bone passes through them: what
/// another garment, an arm or the camera's angle hid. Returns how many were closed.
pub fn close_hidden(mesh: &mut Mesh, garment: &[bool], bones: &[[Point3<f32>; 2]]) -> usize {
    let belongs = |rim: &[u32]| {
        let inside = rim.iter().filter(|&&v| garment[v as usize]).count();
        inside as f64 > SURROUNDED * rim.len() as f64
    };
    fill_where(mesh, |mesh, rim| belongs(rim) && !bones.iter().any(|b| passes(&mesh.positions, rim, b)))
}

/// The mesh without pieces smaller than `share` of its largest one (by area), but for those that strokes added.
pub fn keep_large_pieces(mesh: &Mesh, share: f32) -> Mesh {
    let (set, count) = vertex_components(mesh.positions.len(), &mesh.triangles);
    let mut areas = vec![0.0f32; count];
    for (t, tri) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = mesh.corners(t);
        areas[set[tri[0] as usize] as usize] += 0.5 * (b - a).cross(&(c - a)).norm();
    }
    let largest = areas.iter().copied().fold(0.0, f32::max);
    let mut kept: Vec<bool> = areas.iter().map(|a| *a >= share * largest).collect();
    let by_hand = mesh.attributes.get(BY_HAND).map_or(&[][..], Vec::as_slice);
    by_hand.iter().zip(&set).filter(|(said, _)| **said > SAID).for_each(|(_, s)| kept[*s as usize] = true);
    mesh.filter_triangles(|t| kept[set[mesh.triangles[t][0] as usize] as usize]).0
}

/// The mesh without strips of a few triangles' width: threads that fusion spun across an opening. What lies within
/// `STRIP_REACH` rings of a vertex further than one ring from every rim stays.
pub fn drop_strips(mesh: &Mesh) -> Mesh {
    let neighbors = VertexNeighbors::new(mesh.positions.len(), &mesh.triangles);
    let rims: Vec<u32> = boundary_loops(&mesh.triangles).concat();
    let mut inner = vec![true; mesh.positions.len()];
    grow(rims, &neighbors, 1).iter().for_each(|&v| inner[v as usize] = false);
    let core: Vec<u32> = (0..mesh.positions.len() as u32).filter(|&v| inner[v as usize]).collect();
    let mut kept = vec![false; mesh.positions.len()];
    grow(core, &neighbors, STRIP_REACH).iter().for_each(|&v| kept[v as usize] = true);
    let by_hand = mesh.attributes.get(BY_HAND);
    let stays = |v: u32| kept[v as usize] || by_hand.is_some_and(|said| said[v as usize] > SAID);
    mesh.filter_triangles(|t| mesh.triangles[t].iter().all(|&v| stays(v))).0
}

/// Cuts away, with a ring of triangles, what crosses itself within `depth` metres of a rim: crumpled membrane that
/// fusion drew into a sleeve or behind a hem. Returns whether anything was cut.
pub fn cut_crumpled(mesh: &mut Mesh, depth: f32) -> bool {
    let pairs = self_crossings(mesh, &Bvh::new(&mesh.positions, &mesh.triangles));
    let rims: Vec<Point3<f32>> =
        boundary_loops(&mesh.triangles).iter().flatten().map(|&v| mesh.positions[v as usize]).collect();
    let at_rim = |t: &u32| {
        let corner = mesh.corners(*t as usize)[0];
        rims.iter().any(|p| (p - corner).norm() < depth)
    };
    let crumpled: Vec<u32> = pairs.into_iter().flatten().filter(at_rim).collect();
    let mut cut = vec![false; mesh.positions.len()];
    crumpled.iter().flat_map(|&t| mesh.triangles[t as usize]).for_each(|v| cut[v as usize] = true);
    if !crumpled.is_empty() {
        *mesh = mesh.filter_triangles(|t| mesh.triangles[t].iter().all(|&v| !cut[v as usize])).0;
    }
    !crumpled.is_empty()
}

/// Closes boundary loops up to `longest` (metres) unless one of `bones` passes through them or strokes cut them. New triangles are few;
/// remeshing refines them. Marks the rims of closed holes in the attribute `filled` and returns how many were closed.
pub fn fill_holes(mesh: &mut Mesh, bones: &[[Point3<f32>; 2]], longest: f32) -> usize {
    fill_where(mesh, |mesh, rim| {
        loop_length(&mesh.positions, rim) <= longest
            && !bones.iter().any(|b| passes(&mesh.positions, rim, b))
            && !is_cut_by_hand(mesh, rim)
    })
}

/// True where most of a rim was made by strokes.
fn is_cut_by_hand(mesh: &Mesh, rim: &[u32]) -> bool {
    let Some(by_hand) = mesh.attributes.get(BY_HAND) else { return false };
    2 * rim.iter().filter(|&&v| by_hand[v as usize] < -SAID).count() > rim.len()
}

fn fill_where(mesh: &mut Mesh, wanted: impl Fn(&Mesh, &[u32]) -> bool) -> usize {
    let mut closed = 0;
    for rim in boundary_loops(&mesh.triangles) {
        if rim.len() < 3 || rim.len() > MOST_RIM_VERTICES || !wanted(mesh, &rim) {
            continue;
        }
        // The loop runs along the surface's triangles; the filling runs against it.
        let against: Vec<u32> = rim.iter().rev().copied().collect();
        mesh.triangles.extend(triangulate(&mesh.positions, &against));
        let count = mesh.positions.len();
        let filled = mesh.attributes.entry("filled".into()).or_insert_with(|| vec![0.0; count]);
        rim.iter().for_each(|&v| filled[v as usize] = 1.0);
        closed += 1;
    }
    closed
}

/// True where the segment goes through the fan from the loop's centre.
fn passes(positions: &[Point3<f32>], rim: &[u32], bone: &[Point3<f32>; 2]) -> bool {
    let sum = rim.iter().fold(nalgebra::Vector3::zeros(), |s, &v| s + positions[v as usize].coords);
    let center = Point3::from(sum / rim.len() as f32);
    (0..rim.len()).any(|i| {
        let (a, b) = (positions[rim[i] as usize], positions[rim[(i + 1) % rim.len()] as usize]);
        crosses(bone, &[center, a, b])
    })
}

/// Triangulation of least area of a closed polygon in space (Barequet and Sharir 1995). O(n³).
fn triangulate(positions: &[Point3<f32>], polygon: &[u32]) -> Vec<[u32; 3]> {
    let n = polygon.len();
    let p = |i: usize| positions[polygon[i] as usize];
    let area = |i: usize, j: usize, k: usize| (p(j) - p(i)).cross(&(p(k) - p(i))).norm();
    let mut cost = vec![0.0f32; n * n];
    let mut split = vec![0usize; n * n];
    for width in 2..n {
        for i in 0..n - width {
            let k = i + width;
            let (best, at) = (i + 1..k)
                .map(|j| (cost[i * n + j] + cost[j * n + k] + area(i, j, k), j))
                .min_by(|a, b| a.0.total_cmp(&b.0))
                .unwrap_or((0.0, i + 1));
            (cost[i * n + k], split[i * n + k]) = (best, at);
        }
    }
    let mut triangles = Vec::with_capacity(n - 2);
    let mut stack = vec![(0, n - 1)];
    while let Some((i, k)) = stack.pop() {
        if k - i < 2 {
            continue;
        }
        let j = split[i * n + k];
        triangles.push([polygon[i], polygon[j], polygon[k]]);
        stack.extend([(i, j), (j, k)]);
    }
    triangles
}

#[cfg(test)]
mod tests {
    use toile_geometry::topology::Edges;

    use super::*;

    fn tube_end() -> Mesh {
        let n = 12u32;
        let ring = |y: f32| {
            (0..n).map(move |i| {
                let a = i as f32 / n as f32 * std::f32::consts::TAU;
                Point3::new(0.03 * a.sin(), y, 0.03 * a.cos())
            })
        };
        let positions = ring(0.0).chain(ring(0.1)).collect();
        let triangles = (0..n)
            .flat_map(|i| {
                let j = (i + 1) % n;
                [[i, j, n + i], [j, n + j, n + i]]
            })
            .collect();
        Mesh::new(positions, triangles)
    }

    #[test]
    fn holes_are_closed_but_not_where_a_limb_passes() {
        let mut mesh = tube_end();
        let bone = [Point3::new(0.0, -0.2, 0.0), Point3::new(0.0, 0.05, 0.0)];
        assert_eq!(fill_holes(&mut mesh, &[bone], 0.3), 1);
        assert_eq!(boundary_loops(&mesh.triangles).len(), 1);
        assert_eq!(fill_holes(&mut mesh, &[], 0.3), 1);
        assert!(Edges::new(&mesh.triangles).is_closed());
        let volume = mesh.signed_volume();
        assert!((volume - 0.1 * 12.0 * 0.5 * 0.0009 * 0.5).abs() < 1e-5, "{volume}");
    }

    #[test]
    fn a_thread_across_a_hole_is_dropped_and_the_sheet_stays() {
        let n = 31u32;
        let at = |i: u32| Point3::new((i % n) as f32 * 0.006, (i / n) as f32 * 0.006, 0.0);
        let triangles = (0..n - 1)
            .flat_map(|j| (0..n - 1).map(move |i| j * n + i))
            .flat_map(|a| [[a, a + 1, a + n + 1], [a, a + n + 1, a + n]])
            .collect();
        let sheet = Mesh::new((0..n * n).map(at).collect(), triangles);
        // No more than the tips of its corners is lost.
        assert!(drop_strips(&sheet).triangles.len() + 4 >= sheet.triangles.len());
        let far = |p: &Point3<f32>| (p - Point3::new(0.09, 0.09, 0.0)).norm() > 0.05 || (p.x - 0.09).abs() < 0.007;
        let (threaded, _) = sheet.filter_triangles(|t| sheet.corners(t).iter().all(far));
        assert_eq!(boundary_loops(&threaded.triangles).len(), 3);
        assert_eq!(boundary_loops(&drop_strips(&threaded).triangles).len(), 2);
    }

    #[test]
    fn long_rims_stay_open() {
        let mut mesh = tube_end();
        assert_eq!(fill_holes(&mut mesh, &[], 0.1), 0);
    }
}
