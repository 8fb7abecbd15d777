//! A texture carried over from one surface to the atlas of another that lies on it: from a scan to the garment that was cut out of
//! it, or to the body that was fitted to it.

use nalgebra::{Point3, Vector3};
use toile_geometry::{Mesh, bvh::Bvh, triangle};

use crate::{Atlas, Texture, pad::pad, raster, report::TextureReport};

/// A triangle faces the other surface above this cosine between their normals, as in `geometry::color_transfer`.
const MIN_COSINE: f32 = 0.2;
/// Added around a triangle where what lies on it is looked for, metres: the surfaces cut each other's triangles.
const AROUND: f32 = 0.001;

/// More triangles than this around one are not tried each in turn: where the surfaces lie far apart.
const MANY: usize = 64;

/// A surface that has a texture.
#[derive(Debug, Clone, Copy)]
pub struct Painted<'a> {
    /// The surface, in the frame and pose of the mesh that the texture is carried to.
    pub mesh: &'a Mesh,
    /// Where each triangle's corners lie in the picture: 0 to 1 to the right and downwards.
    pub corners: &'a [[[f32; 2]; 3]],
    /// Texels along an edge of the picture.
    pub size: u32,
    /// The picture, sRGB, row by row.
    pub pixels: &'a [[u8; 3]],
    /// What of it was seen (255) and what filled (less); empty where all was.
    pub seen: &'a [u8],
    /// Whether a triangle may give its colours; empty where all may.
    pub is_usable: &'a [bool],
}

/// How far a texture is carried.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CarrySettings {
    /// Up to this distance between the surfaces the texture counts whole, metres; at twice the distance it counts no more, and the colours of the mesh's
    /// own vertices stand there.
    pub reach: f32,
}

/// The texture of `mesh` in its `atlas`, with the colours that `from` has at the nearest place that faces the same way; where there is
/// none, with those of the mesh's own vertices (grey where it has none).
///
/// `seen` of the result is 255 where a seen place gave the colour. Between texels the picture is read by cubic splines through them
/// (Catmull and Rom 1974), which keep fine stripes. Parallel, the same for any number of threads.
pub fn carry(mesh: &Mesh, atlas: &Atlas, from: &Painted, settings: &CarrySettings) -> Texture {
    let bvh = Bvh::new(&from.mesh.positions, &from.mesh.triangles);
    let normals = from.mesh.triangle_normals();
    let carrier = Carrier { mesh, from, bvh, normals, reach: settings.reach.max(1e-6) };
    let size = atlas.size as usize;
    let mut texels = vec![[0u8; 4]; size * size];
    raster::draw(atlas, &mut texels, |t| carrier.piece(t), |piece, w, texel| *texel = carrier.texel(piece, w));
    let seen: Vec<u8> = texels.iter().map(|texel| texel[3]).collect();
    let report = TextureReport::carried(mesh, atlas, &seen);
    let mut pixels = pad(texels, size);
    pixels.shrink_to_fit();
    Texture { size: atlas.size, pixels, seen, report }
}

/// Everything that a texel is made of.
struct Carrier<'a> {
    mesh: &'a Mesh,
    from: &'a Painted<'a>,
    bvh: Bvh,
    normals: Vec<Vector3<f32>>,
    reach: f32,
}

/// A triangle and what of the other surface lies on it.
struct Piece {
    corners: [Point3<f32>; 3],
    normal: Vector3<f32>,
    colors: [[f32; 3]; 3],
    /// Nothing of the other surface lies farther from it, metres; `None` where nothing of it is near.
    farthest: Option<f32>,
    /// Triangles of the other surface that may be the nearest; empty where they are too many.
    near: Vec<Near>,
}

/// A triangle of the other surface as a piece sees it: everything about the piece's point with barycentric coordinates `w` is a sum over its corners,
/// weighted by `w`.
struct Near {
    triangle: u32,
    /// Barycentric coordinates of the foot of each of the piece's corners.
    feet: [[f32; 3]; 3],
    /// Height of each over the triangle's plane, metres.
    heights: [f32; 3],
}

impl Near {
    fn new(
        triangle: u32,
        [a, b, c]: [Point3<f32>; 3],
        normal: &Vector3<f32>,
        corners: &[Point3<f32>; 3],
    ) -> Option<Self> {
        let double = (b - a).cross(&(c - a)).norm();
        let foot = |p: &Point3<f32>| {
            let area = |q: &Point3<f32>, r: &Point3<f32>| (q - p).cross(&(r - p)).dot(normal) / double;
            let (first, second) = (area(&b, &c), area(&c, &a));
            [first, second, 1.0 - first - second]
        };
        let heights = corners.map(|p| (p - a).dot(normal));
        (double > 1e-12).then(|| Self {
            triangle,
            feet: [foot(&corners[0]), foot(&corners[1]), foot(&corners[2])],
            heights,
        })
    }

    /// The foot of the point `w` and its distance, where it lies inside.
    #[inline]
    fn foot(&self, w: [f32; 3]) -> Option<([f32; 3], f32)> {
        let at: [f32; 3] = std::array::from_fn(|k| (0..3).map(|i| self.feet[i][k] * w[i]).sum());
        let height: f32 = (0..3).map(|i| self.heights[i] * w[i]).sum();
        (at[0] >= 0.0 && at[1] >= 0.0 && at[2] >= 0.0).then_some((at, height.abs()))
    }
}

impl Carrier<'_> {
    fn fits(&self, triangle: u32, normal: &Vector3<f32>) -> bool {
        let is_usable = self.from.is_usable.is_empty() || self.from.is_usable[triangle as usize];
        is_usable && self.normals[triangle as usize].dot(normal) > MIN_COSINE
    }

    /// A triangle with all that can be nearest to one of its points: nothing is farther from it than from its corners and its middle,
    /// by more than its own size.
    fn piece(&self, t: usize) -> Piece {
        let corners = self.mesh.corners(t);
        let [a, b, c] = corners;
        let normal = (b - a).cross(&(c - a)).try_normalize(1e-30).unwrap_or_default();
        let middle = Point3::from((a.coords + b.coords + c.coords) / 3.0);
        let distance = |p: &Point3<f32>| {
            self.bvh.closest_where(p, 2.0 * self.reach, |s| self.fits(s, &normal)).map(|hit| hit.distance)
        };
        let found = [a, b, c, middle]
            .iter()
            .filter_map(distance)
            .fold(None, |most: Option<f32>, d| Some(most.map_or(d, |m| m.max(d))));
        let mut near = Vec::new();
        if let Some(most) = found {
            let around = Vector3::repeat(most + AROUND);
            let (lo, hi) = (a.inf(&b).inf(&c) - around, a.sup(&b).sup(&c) + around);
            self.bvh.overlapping(&lo, &hi, |s| {
                if self.fits(s, &normal) {
                    near.push(s);
                }
            });
            near.sort_unstable();
        }
        if near.len() > MANY {
            near.clear();
        }
        let seen = |&s: &u32| Near::new(s, self.from.mesh.corners(s as usize), &self.normals[s as usize], &corners);
        let own = |v: u32| self.mesh.colors.get(v as usize).map_or([128.0; 3], |c| c.map(f32::from));
        let near = near.iter().filter_map(seen).collect();
        Piece {
            corners,
            normal,
            colors: self.mesh.triangles[t].map(own),
            farthest: found.map(|most| most + AROUND),
            near,
        }
    }

    /// sRGB and whether it was seen.
    fn texel(&self, piece: &Piece, w: [f32; 3]) -> [u8; 4] {
        let [a, b, c] = &piece.corners;
        let own: [f32; 3] = std::array::from_fn(|k| (0..3).map(|i| piece.colors[i][k] * w[i]).sum());
        let nearest = piece.foot(w).or_else(|| self.nearest(piece, &triangle::at(w, a, b, c)));
        let Some((triangle, at, distance)) = nearest else {
            return coded(own, 128);
        };
        let share = (2.0 - distance / self.reach).clamp(0.0, 1.0);
        let corners = &self.from.corners[triangle as usize];
        let place: [f32; 2] = std::array::from_fn(|k| (0..3).map(|i| corners[i][k] * at[i]).sum());
        let carried = self.picture(place);
        let is_seen = share > 0.5 && self.is_seen(place);
        coded(std::array::from_fn(|k| own[k] + share * (carried[k] - own[k])), if is_seen { 255 } else { 128 })
    }

    /// The nearest place of the other surface to a point of a piece: which triangle, where in it, how far.
    fn nearest(&self, piece: &Piece, p: &Point3<f32>) -> Option<(u32, [f32; 3], f32)> {
        if piece.near.is_empty() {
            piece.farthest?;
            let hit = self.bvh.closest_where(p, 2.0 * self.reach, |s| self.fits(s, &piece.normal))?;
            return Some((hit.triangle, hit.barycentric, hit.distance));
        }
        let mut best: Option<(u32, [f32; 3], f32)> = None;
        for near in &piece.near {
            let [a, b, c] = self.from.mesh.corners(near.triangle as usize);
            let at = triangle::closest_barycentric(p, &a, &b, &c);
            let squared = (triangle::at(at, &a, &b, &c) - p).norm_squared();
            if best.is_none_or(|b| squared < b.2) {
                best = Some((near.triangle, at, squared));
            }
        }
        best.map(|(t, at, squared)| (t, at, squared.sqrt()))
    }

    /// Whether the nearest texel was seen.
    fn is_seen(&self, place: [f32; 2]) -> bool {
        let size = self.from.size as usize;
        let [x, y] = place.map(|c| ((c * size as f32) as usize).min(size - 1));
        self.from.seen.get(y * size + x).is_none_or(|&seen| seen == 255)
    }

    /// The picture between its texels.
    fn picture(&self, place: [f32; 2]) -> [f32; 3] {
        let size = self.from.size as i64;
        let at = place.map(|c| c * size as f32 - 0.5);
        let first = at.map(f32::floor);
        let [columns, rows] = std::array::from_fn(|k| spline(at[k] - first[k]));
        let texel = |x: i64, y: i64| {
            let [x, y] = [x, y].map(|c| c.clamp(0, size - 1) as usize);
            self.from.pixels[y * size as usize + x].map(f32::from)
        };
        let mut sum = [0.0f32; 3];
        for (j, row) in (-1..).zip(rows) {
            for (i, column) in (-1..).zip(columns) {
                let color = texel(first[0] as i64 + i, first[1] as i64 + j);
                (0..3).for_each(|k| sum[k] += row * column * color[k]);
            }
        }
        sum
    }
}

impl Piece {
    /// The nearest of the feet of its point `w`; `None` where the nearest place lies on an edge.
    #[inline]
    fn foot(&self, w: [f32; 3]) -> Option<(u32, [f32; 3], f32)> {
        let mut best: Option<(u32, [f32; 3], f32)> = None;
        for near in &self.near {
            if let Some((at, distance)) = near.foot(w)
                && best.is_none_or(|best| distance < best.2)
            {
                best = Some((near.triangle, at, distance));
            }
        }
        best.filter(|best| self.farthest.is_some_and(|farthest| best.2 <= farthest))
    }
}

/// Weights of four values in a row for the place `t` between the middle two.
fn spline(t: f32) -> [f32; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [0.5 * (2.0 * t2 - t - t3), 0.5 * (3.0 * t3 - 5.0 * t2 + 2.0), 0.5 * (4.0 * t2 + t - 3.0 * t3), 0.5 * (t3 - t2)]
}

fn coded(color: [f32; 3], seen: u8) -> [u8; 4] {
    let [r, g, b] = color.map(|c| (c + 0.5).clamp(0.0, 255.0) as u8);
    [r, g, b, seen]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{TextureSettings, unwrap};

    /// A sheet of 0.4 m with a vertex every `step` metres, at height `z`, facing +Z.
    fn sheet(step: f32, z: f32) -> Mesh {
        let side = (0.4 / step).round() as usize + 1;
        let point = |i: usize| Point3::new((i % side) as f32 * step, (i / side) as f32 * step, z);
        let cell = |k: usize| {
            let v = (k / (side - 1) * side + k % (side - 1)) as u32;
            [[v, v + 1, v + side as u32], [v + 1, v + side as u32 + 1, v + side as u32]]
        };
        Mesh::new((0..side * side).map(point).collect(), (0..(side - 1) * (side - 1)).flat_map(cell).collect())
    }

    /// Stripes of 10 mm across x, a step of one along y.
    fn own_color(p: &Point3<f32>) -> [u8; 3] {
        let stripe = 128.0 + 100.0 * (std::f32::consts::TAU * p.x / 0.01).sin();
        [stripe as u8, (p.y * 500.0) as u8, 40]
    }

    /// What the picture of 1024 texels over the sheet shows.
    fn picture() -> Vec<[u8; 3]> {
        let at = |i: usize| Point3::new((i % 1024) as f32 + 0.5, (i / 1024) as f32 + 0.5, 0.0) * (0.4 / 1024.0);
        (0..1024 * 1024).map(|i| own_color(&at(i))).collect()
    }

    fn corners(mesh: &Mesh) -> Vec<[[f32; 2]; 3]> {
        (0..mesh.triangles.len()).map(|t| mesh.corners(t).map(|p| [p.x / 0.4, p.y / 0.4])).collect()
    }

    /// Texture of a sheet of other triangles, at `z`, and its atlas; triangles beyond x = 0.3 of the painted one may not be used.
    fn carried(z: f32) -> (Mesh, Atlas, Texture) {
        let (painted, pixels) = (sheet(0.02, 0.0), picture());
        let is_usable: Vec<bool> = (0..painted.triangles.len()).map(|t| painted.corners(t)[0].x < 0.299).collect();
        let mut mesh = sheet(0.016, z);
        mesh.colors = vec![[7, 8, 9]; mesh.positions.len()];
        let atlas = unwrap(&mesh, &TextureSettings { size: 1024, ..TextureSettings::default() }).unwrap();
        let from = Painted {
            mesh: &painted,
            corners: &corners(&painted),
            size: 1024,
            pixels: &pixels,
            seen: &vec![255; pixels.len()],
            is_usable: &is_usable,
        };
        let texture = carry(&mesh, &atlas, &from, &CarrySettings { reach: 0.005 });
        (mesh, atlas, texture)
    }

    /// Largest difference from the own colours inside of triangles up to x = 0.28, and the colour at the far end.
    fn worst(mesh: &Mesh, atlas: &Atlas, texture: &Texture) -> (i32, [u8; 3]) {
        let (mut worst, mut end) = (0, [0; 3]);
        for (t, places) in atlas.triangles.iter().enumerate() {
            let [a, b, c] = mesh.corners(t);
            let p = Point3::from((a.coords + b.coords + c.coords) / 3.0);
            let uv = [0, 1].map(|k| places.iter().map(|&v| atlas.uv[v as usize][k]).sum::<f32>() / 3.0);
            let [x, y] = uv.map(|c| (c * 1024.0) as usize);
            let found = texture.pixels[y * 1024 + x];
            // A texel's middle is up to 0.3 mm aside: 20 of 255 where a stripe is steepest.
            if p.x < 0.28 && (p.x / 0.01 % 0.5 - 0.25).abs() < 0.1 {
                worst =
                    worst.max((0..3).map(|k| (i32::from(found[k]) - i32::from(own_color(&p)[k])).abs()).max().unwrap());
            }
            if p.x > 0.35 {
                end = found;
            }
        }
        (worst, end)
    }

    #[test]
    fn colours_stay_where_they_are_on_other_triangles() {
        let (mesh, atlas, texture) = carried(0.001);
        let (worst, end) = worst(&mesh, &atlas, &texture);
        assert!(worst < 30, "{worst}");
        assert_eq!(end, [7, 8, 9], "what may not be used gives no colour");
        assert!((70.0..80.0).contains(&texture.report.seen_percent), "{}", texture.report.seen_percent);
        assert!(texture.seen.contains(&255) && texture.seen.contains(&128));
    }

    #[test]
    fn what_is_far_away_or_faces_away_gives_no_colour() {
        assert_eq!(carried(0.011).2.report.seen_percent, 0.0);
        let near = carried(0.0075).2;
        let mixed = near.pixels.iter().filter(|p| p[2] > 15 && p[2] < 35).count();
        assert!(mixed > near.pixels.len() / 4, "half-way both count half: {mixed}");
    }
}
