//! Ray-casting of the signed distance field: the model's points and normals as a camera would see them.

use nalgebra::Point3;
use rayon::prelude::*;
use toile_geometry::{Rigid, camera::PinholeCamera};

use super::{block::SIDE, tsdf::Tsdf};
use crate::frame::{dot, unproject};

/// Edge of the image tiles that bound where rays begin and end, pixels.
const TILE: usize = 8;

/// The model seen from a camera: hits of every `stride`-th pixel, scan frame.
#[derive(Debug, Clone)]
pub struct ModelView {
    /// The camera of the full image.
    pub camera: PinholeCamera,
    /// Pixels between rays.
    pub stride: usize,
    /// Columns of the arrays below.
    pub width: usize,
    /// Rows of the arrays below.
    pub height: usize,
    /// Hit and unit normal (outward), scan frame; `None` where the ray meets nothing.
    pub hits: Vec<Option<Hit>>,
}

/// One hit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Point on the model's surface, scan frame.
    pub point: [f32; 3],
    /// Outward unit normal, scan frame.
    pub normal: [f32; 3],
}

/// Ray-casts the zero crossing of the trilinear field for every `stride`-th pixel.
///
/// The crossing is found by bisecting secants on the interpolated field itself, so a view tracked against its own
/// model does not move.
pub fn ray_cast(tsdf: &Tsdf, camera: &PinholeCamera, model_from_camera: &Rigid, stride: usize) -> ModelView {
    let (width, height) = ((camera.width as usize).div_ceil(stride), (camera.height as usize).div_ceil(stride));
    let ranges = tile_ranges(tsdf, camera, model_from_camera);
    let tiles_wide = (camera.width as usize).div_ceil(TILE);
    let rotation = model_from_camera.rotation.to_rotation_matrix();
    let r: [[f32; 3]; 3] = std::array::from_fn(|i| std::array::from_fn(|j| rotation[(i, j)] as f32));
    let origin = Point3::from(model_from_camera.translation.vector.cast::<f32>());
    let mut hits = vec![None; width * height];
    hits.par_chunks_mut(width).enumerate().for_each(|(row, out)| {
        let v = row * stride;
        for (column, hit) in out.iter_mut().enumerate() {
            let u = column * stride;
            let Some((near, far)) = ranges[v / TILE * tiles_wide + u / TILE] else { continue };
            let ray = unproject(camera, u as f32, v as f32, 1.0);
            let direction: [f32; 3] = std::array::from_fn(|k| dot(r[k], ray));
            *hit = march(tsdf, &origin, direction, near, far);
        }
    });
    ModelView { camera: *camera, stride, width, height, hits }
}

/// Depth range of the blocks that project into each tile.
fn tile_ranges(tsdf: &Tsdf, camera: &PinholeCamera, model_from_camera: &Rigid) -> Vec<Option<(f32, f32)>> {
    let (tw, th) = ((camera.width as usize).div_ceil(TILE), (camera.height as usize).div_ceil(TILE));
    let mut ranges: Vec<Option<(f32, f32)>> = vec![None; tw * th];
    let camera_from_model = model_from_camera.inverse();
    let size = f64::from(tsdf.voxel_size()) * SIDE as f64;
    let radius = size * 0.87 + f64::from(tsdf.voxel_size());
    for c in &tsdf.coords {
        let center = Point3::new(f64::from(c[0]) + 0.5, f64::from(c[1]) + 0.5, f64::from(c[2]) + 0.5) * size;
        let p = camera_from_model * center;
        if p.z < radius + 0.05 {
            continue;
        }
        let Some(q) = camera.project(&p) else { continue };
        let reach = radius * camera.fx.max(camera.fy) / (p.z - radius);
        let tile = |c: f64, n: usize| (c / TILE as f64).floor().clamp(0.0, (n - 1) as f64) as usize;
        if q.x + reach < 0.0 || q.y + reach < 0.0 {
            continue;
        }
        if q.x - reach >= f64::from(camera.width) || q.y - reach >= f64::from(camera.height) {
            continue;
        }
        let (near, far) = ((p.z - radius) as f32, (p.z + radius) as f32);
        for y in tile(q.y - reach, th)..=tile(q.y + reach, th) {
            for x in tile(q.x - reach, tw)..=tile(q.x + reach, tw) {
                let slot = &mut ranges[y * tw + x];
                *slot = Some(slot.map_or((near, far), |(a, b)| (a.min(near), b.max(far))));
            }
        }
    }
    ranges
}

/// Marches `origin + t * direction` (direction has unit depth) through the band and refines the first crossing from
/// outside to inside.
fn march(tsdf: &Tsdf, origin: &Point3<f32>, direction: [f32; 3], near: f32, far: f32) -> Option<Hit> {
    let length = dot(direction, direction).sqrt();
    let at =
        |t: f32| Point3::new(origin.x + direction[0] * t, origin.y + direction[1] * t, origin.z + direction[2] * t);
    let voxel = tsdf.voxel_size() / length;
    let (mut t, mut before): (f32, Option<(f32, f32)>) = (near, None);
    while t < far {
        let distance = tsdf.distance(&at(t));
        match (before, distance) {
            (Some((t0, d0)), Some(d)) if d0 > 0.0 && d <= 0.0 => {
                let point = at(crossing(tsdf, &at, (t0, d0), (t, d)));
                let normal = tsdf.normal(&point)?;
                return Some(Hit { point: point.into(), normal });
            }
            _ => {}
        }
        before = distance.map(|d| (t, d));
        t += match distance {
            Some(d) if d > 0.0 => (0.8 * d / length).max(voxel * 0.5),
            Some(_) => voxel,
            None => voxel * 2.0,
        };
    }
    None
}

fn crossing(tsdf: &Tsdf, at: &impl Fn(f32) -> Point3<f32>, outside: (f32, f32), inside: (f32, f32)) -> f32 {
    let ((mut t0, mut d0), (mut t1, mut d1)) = (outside, inside);
    let mut t = t0;
    for _ in 0..4 {
        t = t0 + (t1 - t0) * d0 / (d0 - d1).max(1e-12);
        let Some(d) = tsdf.distance(&at(t)) else { break };
        if d.abs() < 1e-6 {
            break;
        }
        if d > 0.0 { (t0, d0) = (t, d) } else { (t1, d1) = (t, d) }
    }
    t
}
