//! How far two surfaces of one layer are from each other.

use std::{fs, path::Path};

use rayon::prelude::*;
use serde::Serialize;
use toile_capture::files::is_there;
use toile_geometry::{Mesh, areas::vertex_areas, bvh::Bvh};
use toile_pipeline::{Folders, read_mesh};

use crate::ArchiveError;

/// Surface within this of the other one counts as common, metres: one voxel of fusion, below which a scan says nothing.
const COMMON: f32 = 0.004;

/// How far a layer's surface is from what it was.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SurfaceChange {
    /// The layer: `body`, or the folder name of its take.
    pub layer: String,
    /// Distance between both surfaces, both ways, by area: mean and the value that 95 % stay below, millimetres.
    pub mean_mm: f64,
    /// As above.
    pub p95_mm: f64,
    /// Area that both have in common (within 4 mm of the other) over the area of both together: 1 where they are the same.
    pub iou: f64,
}

/// Every surface that both have, and sentences about those that only one has.
pub(super) fn compare(before: &Folders, now: &Folders) -> Result<(Vec<SurfaceChange>, Vec<String>), ArchiveError> {
    let mut names: Vec<String> = [before, now].into_iter().flat_map(garments).collect();
    names.sort();
    names.dedup();
    let (mut changes, mut only) = (Vec::new(), Vec::new());
    let layers = names.iter().map(|name| (name.as_str(), before.garment(name), now.garment(name)));
    for (name, was, is) in std::iter::once(("body", before.body_mesh(), now.body_mesh())).chain(layers) {
        match (is_there(&was), is_there(&is)) {
            (true, true) => changes.push(between(name, &was, &is)?),
            (true, false) => only.push(format!("{name} is gone")),
            (false, true) => only.push(format!("{name} is new")),
            (false, false) => {}
        }
    }
    Ok((changes, only))
}

fn garments(folders: &Folders) -> Vec<String> {
    let entries = fs::read_dir(folders.build()).into_iter().flatten().flatten();
    let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
    names.filter(|name| is_there(&folders.garment(name))).collect()
}

fn between(name: &str, was: &Path, is: &Path) -> Result<SurfaceChange, ArchiveError> {
    let layer = name.to_string();
    if fs::read(was).ok() == fs::read(is).ok() {
        return Ok(SurfaceChange { layer, mean_mm: 0.0, p95_mm: 0.0, iou: 1.0 });
    }
    Ok(change(layer, &read_mesh(was)?, &read_mesh(is)?))
}

fn change(layer: String, was: &Mesh, is: &Mesh) -> SurfaceChange {
    let mut samples = distances(was, is);
    samples.extend(distances(is, was));
    let area: f64 = samples.iter().map(|sample| sample.1).sum::<f64>().max(f64::MIN_POSITIVE);
    let common: f64 = samples.iter().filter(|sample| sample.0 <= COMMON).map(|sample| sample.1).sum::<f64>() / 2.0;
    samples.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut below = 0.0;
    let p95 = samples.iter().find(|sample| {
        below += sample.1;
        below >= 0.95 * area
    });
    let mean = samples.iter().map(|sample| f64::from(sample.0) * sample.1).sum::<f64>() / area;
    SurfaceChange {
        layer,
        mean_mm: 1e3 * mean,
        p95_mm: 1e3 * f64::from(p95.map_or(0.0, |sample| sample.0)),
        iou: common / (area - common),
    }
}

/// Distance to the other surface, metres, and area, square metres, of every vertex.
pub(super) fn distances(from: &Mesh, to: &Mesh) -> Vec<(f32, f64)> {
    let bvh = Bvh::new(&to.positions, &to.triangles);
    let distance = |p| bvh.closest(p, f32::INFINITY).map_or(1.0, |hit| hit.distance);
    from.positions.par_iter().map(distance).zip(vertex_areas(from)).map(|(d, area)| (d, f64::from(area))).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;

    /// A square of a metre at a height, in a hundred by a hundred.
    fn sheet(height: f32, width: usize) -> Mesh {
        let at = |k: usize| Point3::new((k % 101) as f32 * 0.01, height, (k / 101) as f32 * 0.01);
        let corner = |k: usize| (k / width) * 101 + k % width;
        let cells = (0..width * 100).map(|k| corner(k) as u32);
        let triangles = cells.flat_map(|a| [[a, a + 101, a + 1], [a + 1, a + 101, a + 102]]).collect();
        Mesh::new((0..101 * 101).map(at).collect(), triangles)
    }

    #[test]
    fn a_sheet_that_moved_by_two_millimetres_is_still_the_same_and_half_a_sheet_is_half() {
        let moved = change("a".into(), &sheet(0.0, 100), &sheet(0.002, 100));
        assert!((moved.mean_mm - 2.0).abs() < 1e-3 && (moved.p95_mm - 2.0).abs() < 1e-3, "{moved:?}");
        assert!((moved.iou - 1.0).abs() < 1e-9);
        let half = change("a".into(), &sheet(0.0, 100), &sheet(0.0, 50));
        assert!((half.iou - 0.5).abs() < 0.02, "{half:?}");
        assert!(change("a".into(), &sheet(0.0, 100), &sheet(0.1, 100)).iou < 1e-9);
    }
}
