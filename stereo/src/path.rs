//! Path costs of semi-global matching (Hirschmüller 2008, eq. 13): what a disparity costs along one direction.

use toile_geometry::lanes::bytes::{LANES, Lanes};

/// The cost before the first and after the last disparity of a vector of path costs: a sentinel that never wins.
pub(crate) const SENTINELS: usize = 2;

/// Penalties for a change of disparity by one, and by more.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Penalties {
    pub small: u8,
    pub large: u8,
}

/// Path costs of the pixels of a row along one direction, `N` vectors of disparities each, with a pixel more on either
/// side whose costs stay zero: a path begins there.
pub(crate) struct PathRow<const N: usize> {
    costs: Vec<u8>,
    smallest: Vec<u8>,
}

impl<const N: usize> PathRow<N> {
    /// Bytes of a pixel.
    const STRIDE: usize = N * LANES + SENTINELS;

    /// A row of `pixels` paths that begin.
    pub fn new(pixels: usize) -> Self {
        let mut costs = vec![0; (pixels + 2) * Self::STRIDE];
        for vector in costs.chunks_exact_mut(Self::STRIDE) {
            vector[0] = u8::MAX;
            vector[Self::STRIDE - 1] = u8::MAX;
        }
        Self { costs, smallest: vec![0; pixels + 2] }
    }

    /// Paths that begin again.
    pub fn clear(&mut self) {
        for vector in self.costs.chunks_exact_mut(Self::STRIDE) {
            vector[1..=N * LANES].fill(0);
        }
        self.smallest.fill(0);
    }

    /// Costs at `place`; pixel x is at place x + 1.
    #[inline(always)]
    pub fn at(&self, place: usize) -> PathCosts<'_> {
        PathCosts { costs: &self.costs[place * Self::STRIDE..][..Self::STRIDE], smallest: self.smallest[place] }
    }

    /// Writes the costs at `place`; the smallest of their lanes are given too.
    #[inline(always)]
    pub fn put<L: Lanes>(&mut self, lanes: L, place: usize, costs: [L::Bytes; N], smallest: L::Bytes) {
        let (slots, _) = self.costs[place * Self::STRIDE + 1..][..N * LANES].as_chunks_mut();
        for (slot, costs) in slots.iter_mut().zip(costs) {
            lanes.store(costs, slot);
        }
        self.smallest[place] = lanes.smallest(smallest);
    }
}

/// Path costs of one pixel between sentinels.
#[derive(Clone, Copy)]
pub(crate) struct PathCosts<'a> {
    costs: &'a [u8],
    smallest: u8,
}

/// `cost + min(same, neighbours + small, smallest + large) − smallest` for every disparity, and the smallest of the
/// lanes. No sum overflows: a path cost is at most the largest matching cost plus the large penalty, and sentinels saturate.
#[inline(always)]
pub(crate) fn step<L: Lanes, const N: usize>(
    lanes: L,
    cost: [L::Bytes; N],
    before: PathCosts<'_>,
    p: Penalties,
) -> ([L::Bytes; N], L::Bytes) {
    let small = lanes.splat(p.small);
    let floor = lanes.splat(before.smallest);
    let jump = lanes.splat(before.smallest.saturating_add(p.large));
    let mut out = cost;
    let mut smallest = lanes.splat(u8::MAX);
    for (k, out) in out.iter_mut().enumerate() {
        let (below, same, above) = around(lanes, &before.costs[k * LANES..][..LANES + SENTINELS]);
        let near = lanes.add_saturating(lanes.min(below, above), small);
        let best = lanes.min(lanes.min(same, near), jump);
        *out = lanes.add(*out, lanes.sub(best, floor));
        smallest = lanes.min(smallest, *out);
    }
    (out, smallest)
}

#[inline(always)]
fn around<L: Lanes>(lanes: L, costs: &[u8]) -> (L::Bytes, L::Bytes, L::Bytes) {
    let vector = |from: usize| match costs[from..].first_chunk() {
        Some(bytes) => lanes.load(bytes),
        None => lanes.splat(u8::MAX),
    };
    (vector(0), vector(1), vector(2))
}
