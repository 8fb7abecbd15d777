//! UV atlas of a mesh: charts, laid flat and packed.

use toile_geometry::Mesh;

use crate::{
    TextureError, TextureSettings,
    atlas::Atlas,
    charts::Faces,
    pack::{Flat, pack},
    raster,
};

/// Rounds in which triangles that fold over others of their chart are given charts of their own.
const ROUNDS: usize = 6;

/// Unwraps a mesh: no triangle is turned over, no texel belongs to two places.
///
/// Charts are parts inside a cone of normals, projected along its axis (so nothing can turn over) and stretched less than twice. A part
/// that folds over itself there is taken apart. O(n log n) and a scan's 80,000 triangles in some tenths of a second.
///
/// # Errors
/// [`TextureError::Unwrap`] where the charts do not fit into the picture.
pub fn unwrap(mesh: &Mesh, settings: &TextureSettings) -> Result<Atlas, TextureError> {
    unwrap_from(mesh, &[], settings)
}

/// As [`unwrap`], with charts that begin at the triangles `first`, one after the other, before any other: what must not be cut by a border lies around
/// one of them.
///
/// # Errors
/// As [`unwrap`].
pub fn unwrap_from(mesh: &Mesh, first: &[u32], settings: &TextureSettings) -> Result<Atlas, TextureError> {
    settings.check()?;
    let faces = Faces::new(mesh);
    let all: Vec<u32> = first.iter().copied().chain(0..mesh.triangles.len() as u32).collect();
    let mut charts = faces.charts(&all);
    let mut finest = f32::MAX;
    for _ in 0..ROUNDS {
        let mut out = Vec::new();
        let flats = lay_flat(mesh, &faces, &mut charts, &mut out);
        let (places, scale) = pack(mesh, &flats, settings.size, settings.texels_around(), finest)
            .ok_or_else(|| TextureError::Unwrap(format!("its charts do not fit into {} texels", settings.size)))?;
        let atlas = Atlas::new(mesh, &flats, &places, scale, settings.size);
        // What lies beside a fold comes with it, or the next packing would find its rim.
        out.extend(faces.with_neighbours(&raster::folded(&atlas)));
        if out.is_empty() {
            return Ok(atlas);
        }
        take_out(&mut charts, &faces, out);
        finest = scale;
    }
    Err(TextureError::Unwrap("parts of it fold over each other however they are cut".into()))
}

/// Projects all charts; triangles that cannot lie in theirs go to `out`.
fn lay_flat(mesh: &Mesh, faces: &Faces, charts: &mut [Vec<u32>], out: &mut Vec<u32>) -> Vec<Flat> {
    let flat = |chart: &mut Vec<u32>| {
        let axis = faces.axis(chart);
        if chart.len() > 1 {
            let (keep, lost) = chart.iter().partition(|&&t| faces.fits(t, &axis));
            *chart = keep;
            let lost: Vec<u32> = lost;
            out.extend(lost);
        }
        Flat::new(mesh, chart.clone(), &axis)
    };
    charts.iter_mut().map(flat).collect()
}

/// Takes triangles out of their charts and makes charts of them alone.
fn take_out(charts: &mut Vec<Vec<u32>>, faces: &Faces, mut out: Vec<u32>) {
    out.sort_unstable();
    out.dedup();
    for chart in charts.iter_mut() {
        chart.retain(|t| out.binary_search(t).is_err());
    }
    charts.retain(|chart| !chart.is_empty());
    charts.extend(faces.charts(&out));
}
