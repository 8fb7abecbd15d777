//! From the raw surface to the scan: the person's pieces, closed, smooth, light.

use std::collections::BTreeSet;

use nalgebra::Point3;
use toile_geometry::{
    Mesh,
    components::{Piece, keep_components, make_manifold, trim_border},
    decimate::decimate,
    holes::{FILLED, fill_holes},
    smooth::taubin,
    topology::{Edges, boundary_loops, loop_length},
};

use crate::{
    field::WEIGHT,
    settings::{FusionSettings, Volume},
};

/// A hole whose border stays below this height over where the subject was cut from the disk is a sole, metres: the rows of
/// triangles that are trimmed from a border, twice.
const SOLE_HEIGHT: f32 = 0.025;
/// A sole reaches the disk within this distance of its border, metres.
const SOLE_EDGE: f32 = 0.008;

/// A loose piece of at least this share of the largest one's area belongs to the subject: a hand below a wide sleeve has 1 to 2 %.
const MIN_PIECE: f64 = 0.008;
/// A loose piece lower than this is a remnant of the disk, metres.
const FLAT: f32 = 0.06;

/// The effect of the clean-up.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Cleaned {
    /// Loose pieces removed.
    pub pieces_removed: usize,
    /// Holes closed.
    pub holes: usize,
    /// Share of the area that was filled, percent.
    pub filled_percent: f64,
    /// True when no edge is open.
    pub watertight: bool,
}

/// Cleans a raw surface in the scan's frame. Where the subject was cut from the level that it stands on (at the height `cut`,
/// metres), soles are closed flat at height 0.
pub fn clean_up(mut raw: Mesh, settings: &FusionSettings, cut: Option<f32>) -> (Mesh, Cleaned) {
    raw.attributes.remove(WEIGHT);
    raw.normals.clear();
    let closed = settings.fill_holes && settings.volume == Volume::Auto;
    let mut mesh = make_manifold(&raw);
    drop(raw);
    let mut cleaned = Cleaned::default();
    if settings.volume == Volume::Auto {
        let (one, pieces) = keep_components(&mesh, subject_pieces);
        mesh = trim_border(one, 3);
        mesh = make_manifold(&mesh);
        mesh = keep_components(&mesh, subject_pieces).0;
        cleaned.pieces_removed = pieces.saturating_sub(1);
    }
    if closed {
        let sole_height = cut.map(|cut| cut + SOLE_HEIGHT);
        let soles = sole_height.map_or_else(Vec::new, |height| sole_borders(&mesh, height));
        let (filled, report) = fill_holes(&mesh, f32::INFINITY);
        cleaned.holes = report.holes;
        mesh = filled;
        flatten_soles(&mut mesh, &soles, sole_height.unwrap_or(0.0));
    } else {
        mesh.attributes.insert(FILLED.into(), vec![0.0; mesh.positions.len()]);
    }
    let triangles = std::mem::take(&mut mesh.triangles);
    taubin(&mut mesh.positions, &triangles, settings.smoothing_passes, &[]);
    mesh.triangles = triangles;
    if settings.target_triangles > 0 && mesh.triangles.len() > settings.target_triangles {
        mesh = decimate(&mesh, settings.target_triangles);
    }
    round_filled(&mut mesh);
    mesh.recompute_normals();
    cleaned.filled_percent = filled_percent(&mesh);
    cleaned.watertight = Edges::new(&mesh.triangles).is_closed();
    (mesh, cleaned)
}

/// The largest piece, and others that are large and no flat remains of a disk: legs below a skirt, hands below sleeves.
fn subject_pieces(pieces: &[Piece]) -> Vec<bool> {
    let largest = pieces.iter().map(|p| p.area).fold(0.0, f64::max);
    let belongs = |p: &Piece| p.area >= largest || (p.area > MIN_PIECE * largest && p.high.y - p.low.y > FLAT);
    pieces.iter().map(belongs).collect()
}

/// Border positions of the holes that lie on the disk.
fn sole_borders(mesh: &Mesh, sole_height: f32) -> Vec<nalgebra::Point3<f32>> {
    let low = |l: &Vec<u32>| l.iter().all(|&v| mesh.positions[v as usize].y < sole_height);
    let soles = boundary_loops(&mesh.triangles).into_iter().filter(low);
    let large = soles.filter(|l| loop_length(&mesh.positions, l) > 0.05);
    large.flatten().collect::<BTreeSet<u32>>().into_iter().map(|v| mesh.positions[v as usize]).collect()
}

/// Lets filled vertices near the disk go down to it, and not below.
fn flatten_soles(mesh: &mut Mesh, borders: &[nalgebra::Point3<f32>], sole_height: f32) {
    if borders.is_empty() {
        return;
    }
    let filled = mesh.attributes.get(FILLED).cloned().unwrap_or_default();
    for (p, _) in mesh.positions.iter_mut().zip(&filled).filter(|(p, f)| **f == 1.0 && p.y < sole_height) {
        let nearest = borders.iter().map(|b| (b.x - p.x).hypot(b.z - p.z)).fold(f32::INFINITY, f32::min);
        let share = (1.0 - nearest / SOLE_EDGE).clamp(0.0, 1.0);
        p.y = p.y.max(0.0) * share;
    }
}

/// Decimation blends the mark; it is a yes or a no.
fn round_filled(mesh: &mut Mesh) {
    if let Some(marks) = mesh.attributes.get_mut(FILLED) {
        marks.iter_mut().for_each(|m| *m = if *m > 0.5 { 1.0 } else { 0.0 });
    }
}

fn filled_percent(mesh: &Mesh) -> f64 {
    let Some(marks) = mesh.attributes.get(FILLED) else { return 0.0 };
    let (mut filled, mut all) = (0.0, 0.0);
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = mesh.corners(t).map(Point3::cast::<f64>);
        let area = (b - a).cross(&(c - a)).norm();
        all += area;
        filled += area * triangle.iter().map(|&v| f64::from(marks[v as usize])).sum::<f64>() / 3.0;
    }
    100.0 * filled / f64::max(all, 1e-12)
}
