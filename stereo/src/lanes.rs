//! Thirty-two disparities at a time: the few vector operations that matching needs.
//!
//! [`Portable`] is plain Rust for every machine; [`crate::lanes_avx2`] the same in AVX2. All is integer arithmetic, so both
//! give the same result to the bit; tests hold them equal.

/// Disparities of a vector: the bytes of an AVX2 register.
pub(crate) const LANES: usize = 32;

/// Vector operations on bytes and on 16-bit words.
pub(crate) trait Lanes: Copy {
    /// `LANES` bytes.
    type Bytes: Copy;
    /// `LANES` words.
    type Words: Copy;

    fn load(self, from: &[u8; LANES]) -> Self::Bytes;
    fn store(self, bytes: Self::Bytes, to: &mut [u8; LANES]);
    fn splat(self, value: u8) -> Self::Bytes;
    /// Sum, wrapping: the caller knows that it fits.
    fn add(self, a: Self::Bytes, b: Self::Bytes) -> Self::Bytes;
    fn add_saturating(self, a: Self::Bytes, b: Self::Bytes) -> Self::Bytes;
    /// Difference, wrapping.
    fn sub(self, a: Self::Bytes, b: Self::Bytes) -> Self::Bytes;
    fn min(self, a: Self::Bytes, b: Self::Bytes) -> Self::Bytes;
    /// Bits in which the lanes differ.
    fn differing_bits(self, a: Self::Bytes, b: Self::Bytes) -> Self::Bytes;
    /// The smallest lane.
    fn smallest(self, a: Self::Bytes) -> u8;

    fn load_words(self, from: &[u16; LANES]) -> Self::Words;
    fn store_words(self, words: Self::Words, to: &mut [u16; LANES]);
    fn splat_words(self, value: u16) -> Self::Words;
    /// `base`, `base` + 1, `base` + 2, ...
    fn ramp(self, base: u16) -> Self::Words;
    fn widen(self, bytes: Self::Bytes) -> Self::Words;
    fn add_words(self, a: Self::Words, b: Self::Words) -> Self::Words;
    fn min_words(self, a: Self::Words, b: Self::Words) -> Self::Words;
    /// Lanes of `yes` where `a <= b`, of `no` elsewhere.
    fn select_le(self, a: Self::Words, b: Self::Words, yes: Self::Words, no: Self::Words) -> Self::Words;
    /// The smallest lane.
    fn smallest_word(self, a: Self::Words) -> u16;
    /// How many lanes of `a` are at most the same lane of `b`, added to `count` lane by lane.
    fn count_le(self, count: Self::Words, a: Self::Words, b: Self::Words) -> Self::Words;
    /// Sum of the lanes, wrapping.
    fn sum_words(self, a: Self::Words) -> u16;
}

/// Every machine's way.
#[derive(Clone, Copy)]
pub(crate) struct Portable;

#[inline(always)]
fn zip<T: Copy + Default>(a: [T; LANES], b: [T; LANES], f: impl Fn(T, T) -> T) -> [T; LANES] {
    let mut out = [T::default(); LANES];
    for ((out, a), b) in out.iter_mut().zip(a).zip(b) {
        *out = f(a, b);
    }
    out
}

impl Lanes for Portable {
    type Bytes = [u8; LANES];
    type Words = [u16; LANES];

    #[inline(always)]
    fn load(self, from: &[u8; LANES]) -> Self::Bytes {
        *from
    }
    #[inline(always)]
    fn store(self, bytes: Self::Bytes, to: &mut [u8; LANES]) {
        *to = bytes;
    }
    #[inline(always)]
    fn splat(self, value: u8) -> Self::Bytes {
        [value; LANES]
    }
    #[inline(always)]
    fn add(self, a: Self::Bytes, b: Self::Bytes) -> Self::Bytes {
        zip(a, b, u8::wrapping_add)
    }
    #[inline(always)]
    fn add_saturating(self, a: Self::Bytes, b: Self::Bytes) -> Self::Bytes {
        zip(a, b, u8::saturating_add)
    }
    #[inline(always)]
    fn sub(self, a: Self::Bytes, b: Self::Bytes) -> Self::Bytes {
        zip(a, b, u8::wrapping_sub)
    }
    #[inline(always)]
    fn min(self, a: Self::Bytes, b: Self::Bytes) -> Self::Bytes {
        zip(a, b, u8::min)
    }
    #[inline(always)]
    fn differing_bits(self, a: Self::Bytes, b: Self::Bytes) -> Self::Bytes {
        zip(a, b, |a, b| (a ^ b).count_ones() as u8)
    }
    #[inline(always)]
    fn smallest(self, a: Self::Bytes) -> u8 {
        a.into_iter().fold(u8::MAX, u8::min)
    }

    #[inline(always)]
    fn load_words(self, from: &[u16; LANES]) -> Self::Words {
        *from
    }
    #[inline(always)]
    fn store_words(self, words: Self::Words, to: &mut [u16; LANES]) {
        *to = words;
    }
    #[inline(always)]
    fn splat_words(self, value: u16) -> Self::Words {
        [value; LANES]
    }
    #[inline(always)]
    fn ramp(self, base: u16) -> Self::Words {
        std::array::from_fn(|i| base.wrapping_add(i as u16))
    }
    #[inline(always)]
    fn widen(self, bytes: Self::Bytes) -> Self::Words {
        bytes.map(u16::from)
    }
    #[inline(always)]
    fn add_words(self, a: Self::Words, b: Self::Words) -> Self::Words {
        zip(a, b, u16::wrapping_add)
    }
    #[inline(always)]
    fn min_words(self, a: Self::Words, b: Self::Words) -> Self::Words {
        zip(a, b, u16::min)
    }
    #[inline(always)]
    fn select_le(self, a: Self::Words, b: Self::Words, yes: Self::Words, no: Self::Words) -> Self::Words {
        std::array::from_fn(|i| if a[i] <= b[i] { yes[i] } else { no[i] })
    }
    #[inline(always)]
    fn smallest_word(self, a: Self::Words) -> u16 {
        a.into_iter().fold(u16::MAX, u16::min)
    }
    #[inline(always)]
    fn count_le(self, count: Self::Words, a: Self::Words, b: Self::Words) -> Self::Words {
        std::array::from_fn(|i| count[i].wrapping_add(u16::from(a[i] <= b[i])))
    }
    #[inline(always)]
    fn sum_words(self, a: Self::Words) -> u16 {
        a.into_iter().fold(0, u16::wrapping_add)
    }
}

#[cfg(all(test, target_arch = "x86_64"))]
mod tests {
    use super::*;
    use crate::testing::noise;

    /// Every operation of `L` on two vectors, as bytes.
    fn all_of<L: Lanes>(lanes: L, a: &[u8; LANES], b: &[u8; LANES]) -> Vec<u16> {
        let (x, y) = (lanes.load(a), lanes.load(b));
        let bytes = [
            lanes.add(x, y),
            lanes.add_saturating(x, y),
            lanes.sub(x, y),
            lanes.min(x, y),
            lanes.differing_bits(x, y),
            lanes.splat(a[0]),
        ];
        let mut out = vec![u16::from(lanes.smallest(x))];
        for v in bytes {
            let mut slot = [0; LANES];
            lanes.store(v, &mut slot);
            out.extend(slot.map(u16::from));
        }
        let wide = std::array::from_fn(|i| u16::from_le_bytes([a[i], b[i]]));
        let (p, q) = (lanes.load_words(&wide), lanes.widen(y));
        let words = [
            lanes.add_words(p, q),
            lanes.min_words(p, q),
            lanes.select_le(p, q, q, p),
            lanes.count_le(p, q, p),
            lanes.count_le(q, q, q),
            lanes.ramp(wide[3]),
            lanes.splat_words(wide[4]),
            q,
        ];
        out.extend([lanes.smallest_word(p), lanes.sum_words(p)]);
        for v in words {
            let mut slot = [0; LANES];
            lanes.store_words(v, &mut slot);
            out.extend(slot);
        }
        out
    }

    #[test]
    fn avx2_and_plain_rust_are_equal_to_the_bit() {
        let Some(simd) = pulp::x86::V3::try_new() else {
            println!("skipped: this processor has no AVX2");
            return;
        };
        for seed in 0..200 {
            let bytes = noise(LANES as u32, 2, seed).pixels;
            let (a, b) = bytes.split_at(LANES);
            let (mut a, b): ([u8; LANES], [u8; LANES]) = (a.try_into().unwrap(), b.try_into().unwrap());
            a[(seed % 32) as usize] = b[(seed % 32) as usize];
            assert_eq!(all_of(simd, &a, &b), all_of(Portable, &a, &b), "seed {seed}");
        }
    }
}
