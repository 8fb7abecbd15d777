//! From a surface as a file gives it to a scan as fusion gives one.

use std::collections::BTreeSet;

use nalgebra::{Isometry3, Matrix4, Point3, Translation3, UnitQuaternion};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use toile_geometry::{
    Mesh,
    bvh::Bvh,
    components::{keep_components, make_manifold},
    decimate::decimate,
    holes::{FILLED, fill_holes},
    topology::{Edges, VertexNeighbors},
};

use crate::{
    Surface,
    repair::{cut_ground, drop_needless, middle, orient, pieces_of_a_person, refine},
};

/// Edges longer than this are split so that the colours of pictures are seen, metres: one and a half times those of a fused
/// scan of 80,000 triangles over 1.6 m².
const LONGEST_EDGE: f32 = 0.01;
/// Before decimation a mesh may have this many times the triangles it ends with.
const REFINED: usize = 4;
/// Share of the vertices that may lie below the floor: stray points.
const STRAY: usize = 5000;

/// How a surface becomes a scan.
#[derive(Debug, Clone, PartialEq)]
pub struct CleanSettings {
    /// Metres in one unit of the surface.
    pub unit: f64,
    /// The rotation that stands the surface upright (+Y up).
    pub upright: UnitQuaternion<f64>,
    /// Close holes.
    pub fill_holes: bool,
    /// Decimate to this many triangles; 0 keeps all.
    pub target_triangles: usize,
}

/// What was done to a surface.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Cleaned {
    /// Triangles in the file.
    pub triangles_raw: usize,
    /// Triangles of the scan.
    pub triangles: usize,
    /// Triangles without area, and triangles that were there twice.
    pub dropped: [usize; 2],
    /// Triangles at edges that more than two share, which were left out.
    pub not_manifold: usize,
    /// Triangles that faced inward and were turned.
    pub turned: usize,
    /// Height over the file's lowest point of a floor or disk that was cut away, metres.
    pub ground_m: Option<f64>,
    /// Loose pieces removed.
    pub pieces_removed: usize,
    /// Holes closed.
    pub holes_filled: usize,
    /// Share of the scan's area that was filled, percent.
    pub filled_percent: f64,
    /// True when no edge is open.
    pub watertight: bool,
    /// True where the file says which colours the surface has.
    pub has_colors: bool,
    /// `scan_from_file`, row by row: from the file's units and axes to the scan's frame.
    pub scan_from_file: [f64; 16],
}

/// Makes a scan of a surface: metres, +Y up, the lowest point at height 0, the middle of the person over the origin; one side
/// outward, without ground, loose pieces and holes; colours at vertices; the attribute `filled` as fusion writes it.
///
/// # Errors
/// A sentence where nothing is left.
pub fn clean(surface: &Surface, settings: &CleanSettings) -> Result<(Mesh, Cleaned), String> {
    let mut surface = surface.clone();
    surface.weld();
    let mut cleaned =
        Cleaned { triangles_raw: surface.triangles.len(), has_colors: surface.has_colors(), ..Cleaned::default() };
    let turn = settings.upright.cast::<f32>();
    surface.positions.iter_mut().for_each(|p| *p = turn * (*p * settings.unit as f32));
    let target = if settings.target_triangles == 0 { usize::MAX } else { settings.target_triangles };
    let mesh = person(&surface, target.saturating_mul(REFINED), &mut cleaned);
    let mut mesh = mesh.ok_or("nothing of a surface is left after cleaning")?;
    let scan_from_upright = placed(&mesh);
    if mesh.triangles.len() > target {
        mesh = decimate(&mesh, target);
    }
    paint(&mut mesh, &surface);
    if settings.fill_holes {
        let (filled, report) = fill_holes(&mesh, f32::INFINITY);
        cleaned.holes_filled = report.holes;
        mesh = filled;
    } else {
        mesh.attributes.insert(FILLED.into(), vec![0.0; mesh.positions.len()]);
    }
    mesh = mesh.transformed(&scan_from_upright);
    mesh.positions.iter_mut().filter(|p| p.y < 0.0).for_each(|p| p.y = 0.0);
    mesh.recompute_normals();
    cleaned.triangles = mesh.triangles.len();
    cleaned.filled_percent = filled_percent(&mesh);
    cleaned.watertight = Edges::new(&mesh.triangles).is_closed();
    let upright = settings.upright.to_homogeneous() * Matrix4::new_scaling(settings.unit);
    let all = (scan_from_upright.to_homogeneous() * upright).transpose();
    cleaned.scan_from_file.copy_from_slice(all.as_slice());
    Ok((mesh, cleaned))
}

/// The person's own pieces, a manifold that faces outward, coarse parts refined as long as it has at most `most` triangles;
/// positions alone. `None` where nothing is left.
fn person(surface: &Surface, most: usize, cleaned: &mut Cleaned) -> Option<Mesh> {
    let mut mesh = Mesh::new(surface.positions.clone(), surface.triangles.clone());
    cleaned.dropped = drop_needless(&mut mesh);
    let before = mesh.triangles.len();
    mesh = make_manifold(&mesh);
    cleaned.not_manifold = before - mesh.triangles.len();
    cleaned.turned = orient(&mut mesh);
    mesh = refine(mesh, LONGEST_EDGE, most);
    let lowest = mesh.bounds()?.0.y;
    if let Some((cut, ground)) = cut_ground(&mesh) {
        cleaned.ground_m = Some(f64::from(ground - lowest));
        mesh = make_manifold(&cut);
    }
    let (kept, pieces) = keep_components(&mesh, pieces_of_a_person);
    let left = keep_components(&kept, |pieces| vec![true; pieces.len()]).1;
    cleaned.pieces_removed = pieces - left;
    (!kept.is_empty()).then_some(kept)
}

/// The scan's frame from the upright surface's: its lowest point on the floor, its middle over the origin.
fn placed(mesh: &Mesh) -> Isometry3<f64> {
    let middle = middle(mesh);
    let mut heights: Vec<f32> = mesh.positions.iter().map(|p| p.y).collect();
    let cut = heights.len() / STRAY;
    let floor = heights.select_nth_unstable_by(cut, f32::total_cmp).1;
    Isometry3::from_parts(Translation3::new(-middle.x, -f64::from(*floor), -middle.z), UnitQuaternion::identity())
}

/// Colours at vertices: the mean over a vertex and points a third of the way to its neighbours, so that a picture finer than
/// the mesh is not sampled at single pixels. A surface without colours gives none.
fn paint(mesh: &mut Mesh, surface: &Surface) {
    if !surface.has_colors() {
        return;
    }
    let bvh = Bvh::new(&surface.positions, &surface.triangles);
    let neighbors = VertexNeighbors::new(mesh.positions.len(), &mesh.triangles);
    let color = |p: &Point3<f32>| {
        let hit = bvh.closest(p, f32::INFINITY)?;
        surface.color_at(hit.triangle as usize, hit.barycentric)
    };
    let mean = |v: usize| {
        let here = mesh.positions[v];
        let around = neighbors.of(v).iter().map(|&n| here + (mesh.positions[n as usize] - here) / 3.0);
        let colors: Vec<[u8; 3]> = std::iter::once(here).chain(around).filter_map(|p| color(&p)).collect();
        let sum = |k: usize| colors.iter().map(|c| u32::from(c[k])).sum::<u32>();
        let count = (colors.len() as u32).max(1);
        // Where a material has no colour it is shown in a middle grey.
        if colors.is_empty() { [128; 3] } else { [0, 1, 2].map(|k| ((sum(k) + count / 2) / count) as u8) }
    };
    mesh.colors = (0..mesh.positions.len()).into_par_iter().map(mean).collect();
}

fn filled_percent(mesh: &Mesh) -> f64 {
    let Some(marks) = mesh.attributes.get(FILLED) else { return 0.0 };
    let filled: BTreeSet<u32> = (0..marks.len() as u32).filter(|&v| marks[v as usize] > 0.5).collect();
    let patch = mesh.filter_triangles(|t| mesh.triangles[t].iter().any(|v| filled.contains(v))).0;
    100.0 * (patch.area() / mesh.area().max(1e-12)).max(0.0)
}

#[cfg(test)]
mod tests;
