//! Thirty-two bytes or 16-bit words at a time: AVX2 where the machine has it, plain arrays elsewhere, chosen at run time.
//!
//! [`Portable`] is plain Rust for every machine. All operations are integer arithmetic, so that both implementations
//! give the same result to the bit; a test compares them.

#[cfg(target_arch = "x86_64")]
mod avx2;

/// Number of lanes: the bytes of an AVX2 register.
pub const LANES: usize = 32;

/// Vector operations on bytes and on 16-bit words.
pub trait Lanes: Copy {
    /// `LANES` bytes.
    type Bytes: Copy;
    /// `LANES` words.
    type Words: Copy;

    /// Bytes from memory.
    fn load(self, from: &[u8; LANES]) -> Self::Bytes;
    /// Bytes to memory.
    fn store(self, bytes: Self::Bytes, to: &mut [u8; LANES]);
    /// The same byte in every lane.
    fn splat(self, value: u8) -> Self::Bytes;
    /// Sum, wrapping.
    fn add(self, a: Self::Bytes, b: Self::Bytes) -> Self::Bytes;
    /// Sum, at most 255.
    fn add_saturating(self, a: Self::Bytes, b: Self::Bytes) -> Self::Bytes;
    /// Difference, wrapping.
    fn sub(self, a: Self::Bytes, b: Self::Bytes) -> Self::Bytes;
    /// The smaller of both.
    fn min(self, a: Self::Bytes, b: Self::Bytes) -> Self::Bytes;
    /// Number of bits in which the lanes differ.
    fn differing_bits(self, a: Self::Bytes, b: Self::Bytes) -> Self::Bytes;
    /// The smallest lane.
    fn smallest(self, a: Self::Bytes) -> u8;

    /// Words from memory.
    fn load_words(self, from: &[u16; LANES]) -> Self::Words;
    /// Words to memory.
    fn store_words(self, words: Self::Words, to: &mut [u16; LANES]);
    /// The same word in every lane.
    fn splat_words(self, value: u16) -> Self::Words;
    /// `base`, `base` + 1, `base` + 2, ...
    fn ramp(self, base: u16) -> Self::Words;
    /// Bytes as words.
    fn widen(self, bytes: Self::Bytes) -> Self::Words;
    /// Sum, wrapping.
    fn add_words(self, a: Self::Words, b: Self::Words) -> Self::Words;
    /// The smaller of both.
    fn min_words(self, a: Self::Words, b: Self::Words) -> Self::Words;
    /// Lanes of `yes` where `a <= b`, of `no` elsewhere.
    fn select_le(self, a: Self::Words, b: Self::Words, yes: Self::Words, no: Self::Words) -> Self::Words;
    /// The smallest lane.
    fn smallest_word(self, a: Self::Words) -> u16;
    /// `count` plus 1 in every lane where `a` <= `b`.
    fn count_le(self, count: Self::Words, a: Self::Words, b: Self::Words) -> Self::Words;
    /// Sum of the lanes, wrapping.
    fn sum_words(self, a: Self::Words) -> u16;
}

/// A computation that is compiled for every kind of byte lanes.
pub trait Kernel {
    /// Its result.
    type Output;

    /// Computes; must be `#[inline(always)]`, with all that it calls per lane.
    fn run<L: Lanes>(self, lanes: L) -> Self::Output;
}

/// Runs a kernel on the best lanes that this machine has.
#[inline]
pub fn dispatch<K: Kernel>(kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    if let Some(simd) = pulp::x86::V3::try_new() {
        return simd.vectorize(Using(simd, kernel));
    }
    kernel.run(Portable)
}

/// A kernel and the lanes that it runs on, called inside a function that is compiled for them.
#[cfg(target_arch = "x86_64")]
struct Using<L, K>(L, K);

#[cfg(target_arch = "x86_64")]
impl<L: Lanes, K: Kernel> pulp::NullaryFnOnce for Using<L, K> {
    type Output = K::Output;

    #[inline(always)]
    fn call(self) -> K::Output {
        self.1.run(self.0)
    }
}

/// Lanes as plain arrays: what every other implementation must equal.
#[derive(Debug, Clone, Copy)]
pub struct Portable;

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

    /// Bytes of all values, different for every seed.
    fn noise(seed: u64) -> [u8; 2 * LANES] {
        let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        std::array::from_fn(|_| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 32) as u8
        })
    }

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
        // A processor without AVX2 has only one implementation to test.
        let Some(simd) = pulp::x86::V3::try_new() else { return };
        for seed in 0..200 {
            let bytes = noise(seed);
            let (a, b) = bytes.split_at(LANES);
            let (mut a, b): ([u8; LANES], [u8; LANES]) = (a.try_into().unwrap(), b.try_into().unwrap());
            a[(seed % 32) as usize] = b[(seed % 32) as usize];
            assert_eq!(all_of(simd, &a, &b), all_of(Portable, &a, &b), "seed {seed}");
        }
    }
}
