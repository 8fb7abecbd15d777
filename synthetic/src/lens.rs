//! The ideal picture seen through a lens that bends rays, and pictures smeared while they are exposed.

use toile_geometry::camera::PinholeCamera;

use crate::sensor::{EDGE_M, TrueImage};

/// A picture: the truth of each pixel, and its colour.
pub(crate) type Picture = (TrueImage, Vec<[u8; 3]>);

/// The picture that a `bent` camera takes where an ideal one of the same focal lengths takes `ideal`. Inverse depth is linear
/// along planes, so it is blended between neighbours of one surface; the rest is the nearest pixel's. What the ideal
/// camera does not see is empty.
pub(crate) fn through_lens(ideal: &Picture, bent: &PinholeCamera) -> Picture {
    let (truth, colors) = ideal;
    let (width, height) = (bent.width as usize, bent.height as usize);
    let mut seen = (TrueImage::default(), Vec::with_capacity(colors.len()));
    for [x, y] in bent.rays() {
        let (u, v) = (f64::from(x) * bent.fx + bent.cx, f64::from(y) * bent.fy + bent.cy);
        let is_inside = u > -0.5 && v > -0.5 && u < width as f64 - 0.5 && v < height as f64 - 0.5;
        let i = if is_inside { v.round() as usize * width + u.round() as usize } else { usize::MAX };
        seen.0.depth.push(if is_inside { depth_at(truth, width, u, v).unwrap_or(truth.depth[i]) } else { 0.0 });
        seen.0.cosine.push(truth.cosine.get(i).copied().unwrap_or(0.0));
        seen.0.albedo.push(truth.albedo.get(i).copied().unwrap_or(0.0));
        seen.1.push(colors.get(i).copied().unwrap_or_default());
    }
    seen
}

/// Depth between four pixels of one surface; `None` across an edge.
fn depth_at(truth: &TrueImage, width: usize, u: f64, v: f64) -> Option<f32> {
    let (x, y) = (u.max(0.0) as usize, v.max(0.0) as usize);
    let (f, g) = (u.max(0.0).fract(), v.max(0.0).fract());
    if x + 1 >= width || (y + 1) * width >= truth.depth.len() {
        return None;
    }
    let corner = |dx: usize, dy: usize| truth.depth[(y + dy) * width + x + dx];
    let corners = [corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1)];
    let near = corners.iter().copied().fold(f32::INFINITY, f32::min);
    let far = corners.iter().copied().fold(0.0, f32::max);
    if near <= 0.0 || far - near > EDGE_M {
        return None;
    }
    let [a, b, c, d] = corners.map(|z| 1.0 / f64::from(z));
    let inverse = (a * (1.0 - f) + b * f) * (1.0 - g) + (c * (1.0 - f) + d * f) * g;
    Some((1.0 / inverse) as f32)
}

/// The picture of several moments in one exposure: depth is the mean of what was seen, the rest that of the middle moment.
pub(crate) fn smear(moments: Vec<Picture>) -> Picture {
    let depths: Vec<Vec<f32>> = moments.iter().map(|m| m.0.depth.clone()).collect();
    let middle = moments.len() / 2;
    let Some((mut truth, colors)) = moments.into_iter().nth(middle) else { return Picture::default() };
    for (i, depth) in truth.depth.iter_mut().enumerate() {
        let seen: Vec<f32> = depths.iter().map(|d| d[i]).filter(|z| *z > 0.0).collect();
        *depth = seen.iter().sum::<f32>() / seen.len().max(1) as f32;
    }
    (truth, colors)
}
