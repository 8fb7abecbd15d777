//! The voxels of an octant by the pixels of a view, one layer of sixteen at a time.

use std::array::from_fn;

use toile_geometry::{
    element::Element,
    lanes::floats::{LANES, Lanes},
};

use super::{
    block::{Block, ColorBlock, OCTANT, VOXELS, WEIGHT_ONE},
    pixels::Pixels,
    projection::Projection,
};

/// Colour is taken this far from the surface, voxels: what extraction reads, and a little for surfaces that move.
const COLOR_VOXELS: f32 = 2.0;

/// Largest radius of a block, as a share of its depth, at which its voxels' inverse depths follow from its centre's.
const NEAR: f32 = 0.1;

// The lanes are one layer of an octant.
const _: () = assert!(OCTANT * OCTANT == LANES);

/// The voxels that an integration touched.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Touched {
    /// Voxels of the slabs (half octants) in the frame's truncation band.
    pub voxels: usize,
    /// Voxels whose values the frame changed, in steps of an octant's layer.
    pub updated: usize,
}

impl Touched {
    pub(crate) fn plus(self, other: Self) -> Self {
        Self { voxels: self.voxels + other.voxels, updated: self.updated + other.updated }
    }
}

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
    /// The truncation distance and its opposite, metres; farther before the surface than `far` its root says nothing.
    truncation: [L::F; 2],
    far: L::F,
    nearest: L::F,
    /// Weight units that fall with the incidence angle, and those that do not.
    weights: [L::F; 2],
    /// Units of the field a metre; how far from the surface colour is taken, units, and its opposite.
    scale: L::F,
    color_band: [L::F; 2],
}

/// Camera coordinates of a layer's voxels, x and y times the focal lengths.
type Points<L> = [<L as Lanes>::F; 3];

/// The colours of a block, and those of the view's pixels.
pub(crate) type Colors<'a> = (&'a mut ColorBlock, &'a [[u8; 4]]);

/// Shared by all voxels of a block.
struct BlockView<P, L: Lanes> {
    pixels: P,
    /// Inverse depth of the block's centre, from which those of its voxels follow unless it is too near.
    guess: Option<L::F>,
    /// Index of the pixel that the others are counted from.
    offset: L::F,
}

/// Where a layer's voxels are seen.
struct LookUp<L: Lanes> {
    /// Their pixels, counted from the first of the page.
    index: [u32; LANES],
    /// Inverse depth.
    inverse: L::F,
    /// From the pixels' centres, on the plane of unit depth.
    aside: [L::F; 2],
}

/// The values that the pixels of a layer give to its voxels.
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
            weights: if p.is_even { [l.splat(0.0), l.splat(WEIGHT_ONE)] } else { [l.splat(WEIGHT_ONE), l.splat(0.0)] },
            scale: l.splat(1.0 / p.unit),
            color_band: [l.splat(color_band), l.splat(-color_band)],
        }
    }

    /// Updates the voxels of a block in the truncation band, layer by layer; how many lie there, and how many changed. `at` is
    /// the block's first voxel, `depth` that of its centre.
    #[inline(always)]
    pub(crate) fn update_block<P: Pixels>(
        &self,
        pixels: P,
        at: [i32; 3],
        depth: f32,
        block: &mut Block,
        mut colors: Option<Colors<'_>>,
    ) -> Touched {
        let l = self.lanes;
        let guess = (self.projection.block_radius < NEAR * depth).then(|| l.splat(1.0 / depth));
        let place = BlockView { pixels, guess, offset: l.splat(pixels.first() as f32) };
        let slabs = self.slabs_in_band(&place, at);
        let [x, y, z] = self.steps;
        let mut updated = 0;
        for octant in (0..8).filter(|o| slabs >> (2 * o) & 3 != 0) {
            let first = from_fn(|axis| (at[axis] + (OCTANT * (octant >> axis & 1)) as i32) as f32);
            let start = self.projection.camera_point(first);
            let mut points = [l.add(l.splat(start[0]), x), l.add(l.splat(start[1]), y), l.add(l.splat(start[2]), z)];
            for layer in octant * OCTANT..(octant + 1) * OCTANT {
                if slabs >> (layer / 2) & 1 != 0 {
                    let colors = colors.as_mut().map(|(field, image)| (&mut **field, *image));
                    updated += self.update_row(&place, layer, &points, block, colors);
                }
                let [a, b, c] = points;
                points = [l.add(a, self.up[0]), l.add(b, self.up[1]), l.add(c, self.up[2])];
            }
        }
        Touched { voxels: slabs.count_ones() as usize * OCTANT.pow(3) / 2, updated }
    }

    /// The slabs of a block in the truncation band, bit by bit: of each octant, in their order, the lower and the upper half.
    /// Looked at are the centres of its cells of 2³ voxels, with room for the voxels around them.
    #[inline(always)]
    fn slabs_in_band<P: Pixels>(&self, place: &BlockView<P, L>, at: [i32; 3]) -> u16 {
        let (l, p) = (self.lanes, self.projection);
        let mut slabs = 0;
        for pair in 0..4 {
            let first = [at[0], at[1] + (OCTANT * (pair & 1)) as i32, at[2] + (OCTANT * (pair >> 1)) as i32];
            let start = p.camera_point(first.map(|c| c as f32));
            let [x, y, z] = self.cells;
            let points = [l.add(l.splat(start[0]), x), l.add(l.splat(start[1]), y), l.add(l.splat(start[2]), z)];
            let seen = self.look_up(&points, place.guess, place.offset);
            let [depth, slant, nx, ny] = l.unpack(place.pixels.fetch(p.elements, &seen.index));
            let to_plane = self.to_plane(l.sub(depth, points[2]), slant, [nx, ny], &points, &seen);
            // Half a pixel further the plane is so much nearer or farther.
            let tilt = l.add(l.mul(l.abs(nx), self.pitch[0]), l.mul(l.abs(ny), self.pitch[1]));
            let room = l.add(self.cell_radius, l.mul(l.splat(0.5), l.mul(points[2], tilt)));
            let band = l.sub(room, l.mul(slant, self.truncation[0]));
            let bits = l.bits(l.and(l.ge(band, l.abs(to_plane)), l.ge(depth, self.nearest)));
            // A slab is four cells.
            let any = bits | bits >> 1;
            let any = any | any >> 2;
            slabs |= (((any & 1) | (any >> 3 & 2) | (any >> 6 & 4) | (any >> 9 & 8)) as u16) << (4 * pair);
        }
        slabs
    }

    /// Updates the sixteen voxels of a layer. Returns how many changed: all or none.
    #[inline(always)]
    fn update_row<P: Pixels>(
        &self,
        place: &BlockView<P, L>,
        layer: usize,
        points: &Points<L>,
        block: &mut Block,
        colors: Option<Colors<'_>>,
    ) -> usize {
        let (l, pixels) = (self.lanes, place.pixels);
        let seen = self.look_up(points, place.guess, place.offset);
        let measured = self.measure(pixels.fetch(self.projection.elements, &seen.index), points, &seen);
        if !l.any(measured.counts) {
            return 0;
        }
        self.blend(layer_of(&mut block.sdf, layer), layer_of(&mut block.weight, layer), &measured);
        if let Some((field, image)) = colors {
            let weight = self.color_weight(&measured);
            if l.any(l.gt(weight, l.splat(0.0))) {
                self.blend_color(field, layer, weight, pixels.fetch(image, &seen.index));
            }
        }
        LANES
    }

    /// Points outside the image are seen on its border, which is empty. From a guess, two of Newton's steps are exact to
    /// the fourth power of half a block's share of the depth: a thirtieth of a pixel at worst.
    #[inline(always)]
    fn look_up(&self, [x, y, z]: &Points<L>, guess: Option<L::F>, offset: L::F) -> LookUp<L> {
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
        LookUp { index, inverse, aside }
    }

    /// Signed distances to the planes of the elements.
    #[inline(always)]
    fn to_plane(&self, ahead: L::F, slant: L::F, n: [L::F; 2], points: &Points<L>, seen: &LookUp<L>) -> L::F {
        let l = self.lanes;
        let aside = l.add(l.mul(n[0], seen.aside[0]), l.mul(n[1], seen.aside[1]));
        l.sub(l.mul(points[2], aside), l.mul(slant, ahead))
    }

    /// Signed distances to the planes of the elements, capped, and their weights.
    #[inline(always)]
    fn measure(&self, elements: [[Element; LANES / 2]; 2], points: &Points<L>, seen: &LookUp<L>) -> Measured<L> {
        let (l, z, [t, minus_t]) = (self.lanes, points[2], self.truncation);
        let [depth, slant, nx, ny] = l.unpack(elements);
        let ahead = l.sub(depth, z);
        let to_plane = self.to_plane(ahead, slant, [nx, ny], points, seen);
        let distance = l.select(l.ge(ahead, self.far), t, l.max(l.min(to_plane, t), minus_t));
        let counts = l.and(l.ge(ahead, minus_t), l.ge(depth, self.nearest));
        let root = l.mul(slant, seen.inverse);
        let [slanted, even] = self.weights;
        let near = l.mul(seen.inverse, seen.inverse);
        let weight = l.add(l.mul(l.mul(root, root), slanted), l.mul(near, even));
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

/// One layer of an octant.
#[inline(always)]
fn layer_of<T>(values: &mut [T; VOXELS], layer: usize) -> &mut [T; LANES] {
    let (layers, _) = values.as_chunks_mut::<LANES>();
    &mut layers[layer]
}
