//! Integration of a view into the signed distance field (Curless and Levoy 1996), octant by octant.

use rayon::prelude::*;
use toile_geometry::Rigid;

use crate::{
    FusionError,
    band::touch,
    lanes::{Kernel, Lanes, dispatch},
    layers::Layers,
    projection::Projection,
    tsdf::{Block, ColorBlock, SIDE, Tsdf},
    view::View,
};

/// Blocks of a parallel task.
const CHUNK: usize = 32;

/// What an integration touched.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Touched {
    /// Voxels of the slabs (half octants) in the frame's truncation band.
    pub voxels: usize,
    /// Voxels whose values the frame changed, in steps of an octant's layer.
    pub updated: usize,
}

impl Touched {
    fn plus(self, other: Self) -> Self {
        Self { voxels: self.voxels + other.voxels, updated: self.updated + other.updated }
    }
}

/// Integrates `view` seen from `scan_from_camera`. Distances are to the plane of each pixel's surface element, so
/// that slanted surfaces do not smear; weights fall with the incidence angle and the square of the range.
/// The result does not depend on the number of threads, nor on the machine's instruction set.
///
/// # Errors
/// [`FusionError::TooLarge`] where the block index would not fit.
pub fn integrate(tsdf: &mut Tsdf, view: &View, scan_from_camera: &Rigid) -> Result<Touched, FusionError> {
    let projection = Projection::new(tsdf, view, scan_from_camera);
    let touched = touch(tsdf, view, scan_from_camera, &projection)?;
    let (coords, touched, projection) = (&tsdf.coords, &touched, &projection);
    let all = if view.colors.is_empty() || !tsdf.has_color() {
        let chunks = tsdf.blocks.par_chunks_mut(CHUNK).enumerate();
        let update =
            |(chunk, blocks)| dispatch(UpdateBlocks { projection, coords, touched, chunk, blocks, colors: None });
        chunks.map(update).reduce(Touched::default, Touched::plus)
    } else {
        let both = tsdf.blocks.par_chunks_mut(CHUNK).zip(tsdf.colors.par_chunks_mut(CHUNK));
        let update = |(chunk, (blocks, fields))| {
            let colors = Some((fields, view.colors.as_slice()));
            dispatch(UpdateBlocks { projection, coords, touched, chunk, blocks, colors })
        };
        both.enumerate().map(update).reduce(Touched::default, Touched::plus)
    };
    Ok(all)
}

/// The touched ones of a chunk of blocks.
struct UpdateBlocks<'a> {
    projection: &'a Projection<'a>,
    coords: &'a [[i32; 3]],
    touched: &'a [bool],
    chunk: usize,
    blocks: &'a mut [Block],
    /// The blocks' colours and the pixels'.
    colors: Option<(&'a mut [ColorBlock], &'a [[u8; 4]])>,
}

impl Kernel for UpdateBlocks<'_> {
    type Output = Touched;

    #[inline(always)]
    fn run<L: Lanes>(mut self, l: L) -> Touched {
        let first = self.chunk * CHUNK;
        let layers = Layers::new(l, self.projection);
        let mut sum = Touched::default();
        for (k, block) in self.blocks.iter_mut().enumerate().filter(|(k, _)| self.touched[first + k]) {
            let colors = self.colors.as_mut().map(|(fields, pixels)| (&mut fields[k], *pixels));
            let at = self.coords[first + k].map(|c| c * SIDE as i32);
            sum = sum.plus(layers.update(at, block, colors));
        }
        sum
    }
}
