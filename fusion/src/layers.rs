//! What the pixels of a view say about the voxels of an octant, one layer of sixteen at a time.

use std::array::from_fn;

use crate::{
    element::Element,
    integrate::Touched,
    lanes::{LANES, Lanes},
    normals::PAGE,
    projection::Projection,
    tsdf::{Block, ColorBlock, OCTANT, SIDE, VOXELS, WEIGHT_ONE},
};

/// Colour is taken this far from the surface, voxels: what extraction reads, and a little for surfaces that move.
const COLOR_VOXELS: f32 = 2.0;

/// Most of a block's radius, as a share of its depth, at which inverse depths follow from its centre's.
const NEAR: f32 = 0.1;

// The lanes are one layer of an octant.
const _: () = assert!(OCTANT * OCTANT == LANES);

/// A view in lanes. Everything here that is the same for all voxels is kept in registers' shape.
pub(crate) struct Layers<'a, L: Lanes> {
    lanes: L,
    projection: &'a Projection<'a>,
    /// Camera coordinates of a layer's voxels less those of the first, and from a layer to the next.
    steps: [L::F; 3],
    up: [L::F; 3],
    /// The centres of the cells of two octants side by side, from the first's first voxel, and the distance of their
    /// voxels from them, metres.
    cells: [L::F; 3],
    cell_radius: L::F,
    /// Last column and row, width of the image, principal point, and widths of a pixel at unit depth.
    last: [L::F; 2],
    width: L::F,
    center: [L::F; 2],
    pitch: [L::F; 2],
    /// The truncation distance and its opposite, metres; farther before the surface than `far` its slant says nothing.
    truncation: [L::F; 2],
    far: L::F,
    nearest: L::F,
    /// Units of the field a metre; how far from the surface colour is taken, units, and its opposite.
    scale: L::F,
    color_band: [L::F; 2],
}

/// Camera coordinates of a layer's voxels, x and y times the focal lengths.
type Points<L> = [<L as Lanes>::F; 3];

/// The colours of a block, and those of the view's pixels.
type Colors<'a> = (&'a mut ColorBlock, &'a [[u8; 4]]);

/// What all voxels of a block share.
struct Place<P, L: Lanes> {
    pixels: P,
    /// Inverse depth of the block's centre, from which those of its voxels follow unless it is too near.
    guess: Option<L::F>,
    /// Index of the pixel that the others are counted from.
    offset: L::F,
}

/// Where a layer's voxels are seen.
struct Seen<L: Lanes> {
    /// Their pixels, counted from the first of the page.
    index: [u32; LANES],
    /// Inverse depth.
    inverse: L::F,
    /// From the pixels' centres, on the plane of unit depth.
    aside: [L::F; 2],
}

/// What the pixels of a layer say about its voxels.
struct Measured<L: Lanes> {
    /// In units of the field.
    distance: L::F,
    /// 0 where it does not count.
    weight: L::F,
    counts: L::M,
}

impl<'a, L: Lanes> Layers<'a, L> {
    #[inline(always)]
    pub(crate) fn new(l: L, p: &'a Projection<'a>) -> Self {
        let step = |r: usize, x: usize| p.axes[0][r] * (x % OCTANT) as f32 + p.axes[1][r] * (x / OCTANT) as f32;
        let steps: [[f32; LANES]; 3] = from_fn(|r| from_fn(|x| step(r, x)));
        let cell =
            |x: usize, axis: usize| 0.5 + (2 * (x >> axis & 1) + if axis == 0 { OCTANT * (x >> 3) } else { 0 }) as f32;
        let cells: [[f32; LANES]; 3] =
            from_fn(|r| from_fn(|x| (0..3).map(|axis| p.axes[axis][r] * cell(x, axis)).sum()));
        let [width, height] = p.size.map(|s| s as f32);
        let color_band = (COLOR_VOXELS * p.voxel_size).min(p.truncation) / p.unit;
        Self {
            lanes: l,
            projection: p,
            steps: [l.load(&steps[0]), l.load(&steps[1]), l.load(&steps[2])],
            cells: [l.load(&cells[0]), l.load(&cells[1]), l.load(&cells[2])],
            cell_radius: l.splat(0.5 * 3f32.sqrt() * p.voxel_size),
            up: [l.splat(p.axes[2][0]), l.splat(p.axes[2][1]), l.splat(p.axes[2][2])],
            last: [l.splat(width - 1.0), l.splat(height - 1.0)],
            width: l.splat(width),
            center: [l.splat(p.center[0]), l.splat(p.center[1])],
            pitch: [l.splat(p.pitch[0]), l.splat(p.pitch[1])],
            truncation: [l.splat(p.truncation), l.splat(-p.truncation)],
            far: l.splat(4.0 * p.truncation),
            nearest: l.splat(p.nearest),
            scale: l.splat(1.0 / p.unit),
            color_band: [l.splat(color_band), l.splat(-color_band)],
        }
    }

    /// Updates the voxels of a block in the truncation band; how many lie there, and how many changed. `at` is the block's
    /// first voxel.
    #[inline(always)]
    pub(crate) fn update(&self, at: [i32; 3], block: &mut Block, colors: Option<Colors<'_>>) -> Touched {
        let p = self.projection;
        let half = 0.5 * (SIDE - 1) as f32;
        let center = p.camera_point(at.map(|c| c as f32 + half));
        match p.page(center) {
            Some(first) => self.update_from(Page(first), at, center[2], block, colors),
            None => self.update_from(Everywhere, at, center[2], block, colors),
        }
    }

    #[inline(always)]
    fn update_from<P: Pixels>(
        &self,
        pixels: P,
        at: [i32; 3],
        depth: f32,
        block: &mut Block,
        mut colors: Option<Colors<'_>>,
    ) -> Touched {
        let l = self.lanes;
        let guess = (self.projection.block_radius < NEAR * depth).then(|| l.splat(1.0 / depth));
        let place = Place { pixels, guess, offset: l.splat(pixels.first() as f32) };
        let slabs = self.slabs_in_band(&place, at);
        let mut updated = 0;
        for octant in (0..8).filter(|o| slabs >> (2 * o) & 3 != 0) {
            let first = from_fn(|axis| (at[axis] + (OCTANT * (octant >> axis & 1)) as i32) as f32);
            let colors = colors.as_mut().map(|(field, image)| (&mut **field, *image));
            updated += self.update_octant(&place, octant, slabs, first, block, colors);
        }
        Touched { voxels: slabs.count_ones() as usize * OCTANT.pow(3) / 2, updated }
    }

    /// The slabs of a block in the truncation band, bit by bit: of each octant, in their order, the lower and the upper half.
    /// Looked at are the centres of its cells of 2³ voxels, with room for the voxels around them.
    #[inline(always)]
    fn slabs_in_band<P: Pixels>(&self, place: &Place<P, L>, at: [i32; 3]) -> u16 {
        let (l, p) = (self.lanes, self.projection);
        let mut slabs = 0;
        for pair in 0..4 {
            let first = [at[0], at[1] + (OCTANT * (pair & 1)) as i32, at[2] + (OCTANT * (pair >> 1)) as i32];
            let start = p.camera_point(first.map(|c| c as f32));
            let [x, y, z] = self.cells;
            let points = [l.add(l.splat(start[0]), x), l.add(l.splat(start[1]), y), l.add(l.splat(start[2]), z)];
            let seen = self.look_up(&points, place.guess, place.offset);
            let [depth, facing, nx, ny] = l.unpack(place.pixels.fetch(p.elements, &seen.index));
            let to_plane = self.to_plane(l.sub(depth, points[2]), facing, [nx, ny], &points, &seen);
            // Half a pixel further the plane is so much nearer or farther.
            let tilt = l.add(l.mul(l.abs(nx), self.pitch[0]), l.mul(l.abs(ny), self.pitch[1]));
            let room = l.add(self.cell_radius, l.mul(l.splat(0.5), l.mul(points[2], tilt)));
            let band = l.sub(room, l.mul(facing, self.truncation[0]));
            let bits = l.bits(l.and(l.ge(band, l.abs(to_plane)), l.ge(depth, self.nearest)));
            // A slab is four cells.
            let any = bits | bits >> 1;
            let any = any | any >> 2;
            slabs |= (((any & 1) | (any >> 3 & 2) | (any >> 6 & 4) | (any >> 9 & 8)) as u16) << (4 * pair);
        }
        slabs
    }

    /// Updates an octant's slabs among these. `first` is the octant's first voxel. Returns how many voxels changed.
    #[inline(always)]
    fn update_octant<P: Pixels>(
        &self,
        place: &Place<P, L>,
        octant: usize,
        slabs: u16,
        first: [f32; 3],
        block: &mut Block,
        mut colors: Option<Colors<'_>>,
    ) -> usize {
        let (l, pixels, start) = (self.lanes, place.pixels, self.projection.camera_point(first));
        let [x, y, z] = self.steps;
        let mut points = [l.add(l.splat(start[0]), x), l.add(l.splat(start[1]), y), l.add(l.splat(start[2]), z)];
        let mut updated = 0;
        for layer in octant * OCTANT..(octant + 1) * OCTANT {
            let here = points;
            points = [l.add(here[0], self.up[0]), l.add(here[1], self.up[1]), l.add(here[2], self.up[2])];
            if slabs >> (layer / 2) & 1 == 0 {
                continue;
            }
            let seen = self.look_up(&here, place.guess, place.offset);
            let measured = self.measure(pixels.fetch(self.projection.elements, &seen.index), &here, &seen);
            if !l.any(measured.counts) {
                continue;
            }
            updated += LANES;
            self.blend(layer_of(&mut block.sdf, layer), layer_of(&mut block.weight, layer), &measured);
            if let Some((field, image)) = &mut colors {
                let weight = self.color_weight(&measured);
                if l.any(l.gt(weight, l.splat(0.0))) {
                    self.blend_color(field, layer, weight, pixels.fetch(image, &seen.index));
                }
            }
        }
        updated
    }

    /// What lies outside the image is seen on its border, which is empty. From a guess, two of Newton's steps are exact to
    /// the fourth power of half a block's share of the depth: a thirtieth of a pixel at worst.
    #[inline(always)]
    fn look_up(&self, [x, y, z]: &Points<L>, guess: Option<L::F>, offset: L::F) -> Seen<L> {
        let (l, zero, one, two) = (self.lanes, self.lanes.splat(0.0), self.lanes.splat(1.0), self.lanes.splat(2.0));
        let inverse = match guess {
            Some(guess) => {
                let near = l.mul(guess, l.sub(two, l.mul(*z, guess)));
                l.mul(near, l.sub(two, l.mul(*z, near)))
            }
            None => l.div(one, *z),
        };
        let exact = [l.add(l.mul(*x, inverse), self.center[0]), l.add(l.mul(*y, inverse), self.center[1])];
        let u = l.round(l.min(l.max(exact[0], zero), self.last[0]));
        let v = l.round(l.min(l.max(exact[1], zero), self.last[1]));
        let index = l.indices(l.add(l.mul(v, self.width), l.sub(u, offset)));
        let aside = [l.mul(l.sub(exact[0], u), self.pitch[0]), l.mul(l.sub(exact[1], v), self.pitch[1])];
        Seen { index, inverse, aside }
    }

    /// Signed distances to the planes of the elements.
    #[inline(always)]
    fn to_plane(&self, ahead: L::F, facing: L::F, n: [L::F; 2], points: &Points<L>, seen: &Seen<L>) -> L::F {
        let l = self.lanes;
        let aside = l.add(l.mul(n[0], seen.aside[0]), l.mul(n[1], seen.aside[1]));
        l.sub(l.mul(points[2], aside), l.mul(facing, ahead))
    }

    /// Signed distances to the planes of the elements, capped, and their weights.
    #[inline(always)]
    fn measure(&self, elements: [[Element; LANES / 2]; 2], points: &Points<L>, seen: &Seen<L>) -> Measured<L> {
        let (l, z, [t, minus_t]) = (self.lanes, points[2], self.truncation);
        let [depth, facing, nx, ny] = l.unpack(elements);
        let ahead = l.sub(depth, z);
        let to_plane = self.to_plane(ahead, facing, [nx, ny], points, seen);
        let distance = l.select(l.ge(ahead, self.far), t, l.max(l.min(to_plane, t), minus_t));
        let counts = l.and(l.ge(ahead, minus_t), l.ge(depth, self.nearest));
        let slant = l.mul(facing, seen.inverse);
        let weight = l.mul(l.mul(slant, slant), l.splat(WEIGHT_ONE));
        let weight = l.min(l.max(weight, l.splat(1.0)), l.splat(4.0 * WEIGHT_ONE));
        Measured { distance: l.mul(distance, self.scale), weight: l.keep(counts, weight), counts }
    }

    /// Running weighted means.
    #[inline(always)]
    fn blend(&self, sdf: &mut [i16; LANES], weights: &mut [u16; LANES], measured: &Measured<L>) {
        let l = self.lanes;
        let old = l.from_u16(weights);
        let sum = l.add(old, measured.weight);
        let value = l.add(l.mul(l.from_i16(sdf), old), l.mul(measured.distance, measured.weight));
        *sdf = l.to_i16(l.div(value, l.max(sum, l.splat(1e-9))));
        *weights = l.to_u16(l.min(sum, l.splat(f32::from(u16::MAX))));
    }

    /// The weights of the voxels near enough to the surface to take its colour, 0 elsewhere.
    #[inline(always)]
    fn color_weight(&self, measured: &Measured<L>) -> L::F {
        let (l, [most, least]) = (self.lanes, self.color_band);
        l.keep(l.and(l.ge(measured.distance, least), l.ge(most, measured.distance)), measured.weight)
    }

    /// Running weighted means of a layer's colours, where pixels have one.
    #[inline(always)]
    fn blend_color(&self, field: &mut ColorBlock, layer: usize, weight: L::F, pixels: [[[u8; 4]; LANES / 2]; 2]) {
        let l = self.lanes;
        let [red, green, blue, seen] = l.bytes(pixels);
        let weight = l.keep(l.gt(seen, l.splat(0.0)), weight);
        let weights = layer_of(&mut field.weight, layer);
        let sum = l.add(l.from_u16(weights), weight);
        let share = l.div(weight, l.max(sum, l.splat(1e-9)));
        *weights = l.to_u16(l.min(sum, l.splat(f32::from(u16::MAX))));
        let [r, g, b] = &mut field.channels;
        self.approach(layer_of(r, layer), red, share);
        self.approach(layer_of(g, layer), green, share);
        self.approach(layer_of(b, layer), blue, share);
    }

    /// Moves a channel towards its pixels by a share of the way.
    #[inline(always)]
    fn approach(&self, channel: &mut [u16; LANES], pixel: L::F, share: L::F) {
        let l = self.lanes;
        let old = l.from_u16(channel);
        let way = l.sub(l.mul(pixel, l.splat(256.0)), old);
        *channel = l.to_u16(l.add(old, l.mul(way, share)));
    }
}

/// The pixels among which a block's voxels look up theirs, counted from one of them.
trait Pixels: Copy {
    /// Index of the pixel that they are counted from.
    fn first(self) -> usize;

    /// What stands at these places, in halves.
    fn fetch<T: Copy>(self, image: &[T], index: &[u32; LANES]) -> [[T; LANES / 2]; 2];
}

/// [`PAGE`] pixels from this one on: an index of 16 bits needs no check.
#[derive(Clone, Copy)]
struct Page(usize);

impl Pixels for Page {
    #[inline(always)]
    fn first(self) -> usize {
        self.0
    }

    #[inline(always)]
    fn fetch<T: Copy>(self, image: &[T], index: &[u32; LANES]) -> [[T; LANES / 2]; 2] {
        let Some(page) = image[self.0..].first_chunk::<PAGE>() else { unreachable!("images end with a page") };
        // Through memory: that is cheaper than putting registers together piece by piece.
        std::hint::black_box(from_fn(|h| from_fn(|k| page[index[h * LANES / 2 + k] as u16 as usize])))
    }
}

/// All pixels of the image.
#[derive(Clone, Copy)]
struct Everywhere;

impl Pixels for Everywhere {
    #[inline(always)]
    fn first(self) -> usize {
        0
    }

    #[inline(always)]
    fn fetch<T: Copy>(self, image: &[T], index: &[u32; LANES]) -> [[T; LANES / 2]; 2] {
        from_fn(|h| from_fn(|k| image[index[h * LANES / 2 + k] as usize]))
    }
}

/// One layer of an octant.
#[inline(always)]
fn layer_of<T>(values: &mut [T; VOXELS], layer: usize) -> &mut [T; LANES] {
    let (layers, _) = values.as_chunks_mut::<LANES>();
    &mut layers[layer]
}

#[cfg(test)]
mod tests {
    use nalgebra::{Translation3, UnitQuaternion, Vector3};
    use toile_geometry::{Rigid, camera::PinholeCamera};

    use super::*;
    use crate::{integrate::integrate, lanes::Scalar, tsdf::Tsdf, view::View};

    /// A slanted wall with a hole, seen from a turned camera.
    fn wall(focal: f64) -> (View, Rigid) {
        let camera = PinholeCamera::ideal(120, 90, focal, focal, 59.5, 44.5);
        let depth = |i: usize| {
            let (u, v) = (i % 120, i / 120);
            let hole = (50..58).contains(&u) && (30..50).contains(&v);
            let ray = [(u as f64 - 59.5) / focal, (v as f64 - 44.5) / focal];
            if hole { 0.0 } else { (1.5 / (1.0 - 0.5 * ray[0] - 0.3 * ray[1])) as f32 }
        };
        let depth: Vec<f32> = (0..120 * 90).map(depth).collect();
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.2, 2.4, -0.3));
        (View::new(&camera, &depth, 2), Rigid::from_parts(Translation3::new(0.4, 0.9, -0.2), turn))
    }

    /// Every voxel of touched blocks about which a pixel says something within the band is updated: compared with a plain
    /// loop over all voxels. The rim may be a voxel off.
    #[test]
    fn slabs_in_the_band_hold_all_voxels_in_the_band() {
        for focal in [110.0, 200.0, 400.0] {
            let (view, pose) = wall(focal);
            let mut field = Tsdf::new(0.012, 0.048, false);
            integrate(&mut field, &view, &pose).unwrap();
            let (camera_from_scan, mut inside) = (pose.inverse(), 0);
            for (block, at) in field.blocks.iter().zip(&field.coords) {
                for k in 0..VOXELS as i32 {
                    let v = [k & 7, k >> 3 & 7, k >> 6].map(f64::from);
                    let p: nalgebra::Point3<f64> =
                        std::array::from_fn(|i| (f64::from(8 * at[i]) + v[i]) * 0.012).into();
                    let q = camera_from_scan * p;
                    let pixel = [q.x / q.z * focal + 59.5, q.y / q.z * focal + 44.5].map(f64::round);
                    if !(5.0..115.0).contains(&pixel[0]) || !(5.0..85.0).contains(&pixel[1]) {
                        continue;
                    }
                    let at_pixel = pixel[1] as usize * 120 + pixel[0] as usize;
                    let element = view.elements[at_pixel];
                    let around = (0..81).map(|d| at_pixel + d % 9 + d / 9 * 120 - 4 * 121);
                    let within = around.into_iter().all(|i| view.elements[i].is_some());
                    if within && (f64::from(element.depth()) - q.z).abs() < 0.047 {
                        let index = crate::tsdf::local_index([k & 7, k >> 3 & 7, k >> 6]);
                        let facts = (element.parts(), q.z, pixel);
                        assert!(block.weight[index] > 0, "{p} of focal length {focal}: {facts:?}");
                        inside += 1;
                    }
                }
            }
            assert!(inside > 1000, "{inside} with focal length {focal}");
        }
    }

    #[test]
    fn lanes_of_any_kind_fuse_the_same_field() {
        let (view, pose) = wall(110.0);
        let mut field = Tsdf::new(0.006, 0.024, false);
        integrate(&mut field, &view, &pose).unwrap();
        let projection = Projection::new(&field, &view, &pose);
        let layers = Layers::new(Scalar, &projection);
        let mut changed = 0;
        for (found, at) in field.blocks.iter().zip(&field.coords) {
            let mut plain = Block::EMPTY;
            changed += layers.update(at.map(|c| c * SIDE as i32), &mut plain, None).updated;
            assert!(plain.sdf == found.sdf && plain.weight == found.weight, "block {at:?}");
        }
        assert!(changed > 2000);
    }
}
