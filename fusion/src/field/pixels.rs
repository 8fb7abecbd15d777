//! The pixels among which a block's voxels look up theirs.

use std::array::from_fn;

use toile_geometry::lanes::floats::LANES;

use crate::frame::PAGE;

/// The pixels among which a block's voxels look up theirs, counted from one of them.
pub(crate) trait Pixels: Copy {
    /// Index of the pixel that they are counted from.
    fn first(self) -> usize;

    /// The values at these places, in halves.
    fn fetch<T: Copy>(self, image: &[T], index: &[u32; LANES]) -> [[T; LANES / 2]; 2];
}

/// [`PAGE`] pixels from this one on: an index of 16 bits needs no check.
#[derive(Clone, Copy)]
pub(crate) struct Page(pub usize);

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
pub(crate) struct Everywhere;

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
