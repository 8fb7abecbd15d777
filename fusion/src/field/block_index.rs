//! Where the blocks of a field are: a dense grid of slots that grows.

/// Marker of a block that does not exist.
pub(crate) const NONE: u32 = u32::MAX;
/// Entries of the block index at most (four bytes each).
const MAX_INDEX: usize = 64 << 20;

/// Slots by block coordinates.
#[derive(Debug, Clone, Default)]
pub(crate) struct BlockIndex {
    origin: [i32; 3],
    dims: [usize; 3],
    pub slots: Vec<u32>,
}

impl BlockIndex {
    /// Slot of the block with these coordinates; [`NONE`] where there is none.
    #[inline]
    pub(crate) fn slot(&self, b: [i32; 3]) -> u32 {
        let l = [b[0] - self.origin[0], b[1] - self.origin[1], b[2] - self.origin[2]];
        let inside = (0..3).all(|k| (l[k] as u32 as usize) < self.dims[k]);
        if inside { self.slots[self.flat(l)] } else { NONE }
    }

    #[inline]
    fn flat(&self, l: [i32; 3]) -> usize {
        (l[2] as usize * self.dims[1] + l[1] as usize) * self.dims[0] + l[0] as usize
    }

    /// Index of a block's slot, which must be covered.
    #[inline]
    pub(crate) fn cell(&self, b: [i32; 3]) -> usize {
        self.flat([b[0] - self.origin[0], b[1] - self.origin[1], b[2] - self.origin[2]])
    }

    /// Grows to cover `lo..=hi` with some slack; the largest extent in blocks where that is too much.
    pub(crate) fn cover(&mut self, lo: [i32; 3], hi: [i32; 3]) -> Result<(), usize> {
        let has = |b: [i32; 3]| (0..3).all(|k| b[k] >= self.origin[k] && b[k] < self.origin[k] + self.dims[k] as i32);
        if !self.slots.is_empty() && has(lo) && has(hi) {
            return Ok(());
        }
        let (mut from, mut to) = (lo.map(|c| c - 4), hi.map(|c| c + 5));
        if !self.slots.is_empty() {
            for k in 0..3 {
                from[k] = from[k].min(self.origin[k]);
                to[k] = to[k].max(self.origin[k] + self.dims[k] as i32);
            }
        }
        let dims: [usize; 3] = std::array::from_fn(|k| (to[k] - from[k]) as usize);
        let count = dims.iter().try_fold(1usize, |n, &d| n.checked_mul(d)).filter(|&n| n <= MAX_INDEX);
        let Some(count) = count else {
            return Err(dims.into_iter().max().unwrap_or(0));
        };
        let mut grown = Self { origin: from, dims, slots: vec![NONE; count] };
        for (i, &slot) in self.slots.iter().enumerate().filter(|(_, s)| **s != NONE) {
            let x = i % self.dims[0];
            let y = i / self.dims[0] % self.dims[1];
            let z = i / self.dims[0] / self.dims[1];
            let b = [x as i32 + self.origin[0], y as i32 + self.origin[1], z as i32 + self.origin[2]];
            let cell = grown.cell(b);
            grown.slots[cell] = slot;
        }
        *self = grown;
        Ok(())
    }
}
