//! The vector operations in AVX2, through `pulp`'s proof that the processor has it: no `unsafe` of ours.

use std::arch::x86_64::{__m128i, __m256i};

use pulp::{cast, x86::V3};

use super::{LANES, Lanes};

/// 0, 1, ... 31.
const RAMP: [u16; LANES] = {
    let mut ramp = [0; LANES];
    let mut i = 0;
    while i < LANES {
        ramp[i] = i as u16;
        i += 1;
    }
    ramp
};

/// Set bits of the numbers 0 to 15, once for each half of a register.
const BITS_OF_NIBBLE: [u8; LANES] =
    [0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4, 0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4];

#[inline(always)]
fn halves(simd: V3, a: __m256i) -> (__m128i, __m128i) {
    (simd.avx._mm256_castsi256_si128(a), simd.avx2._mm256_extracti128_si256::<1>(a))
}

/// All ones where a lane of `a` is at most that of `b`.
#[inline(always)]
fn at_most(simd: V3, a: [__m256i; 2], b: [__m256i; 2]) -> [__m256i; 2] {
    let min = simd.min_words(a, b);
    [simd.avx2._mm256_cmpeq_epi16(min[0], a[0]), simd.avx2._mm256_cmpeq_epi16(min[1], a[1])]
}

impl Lanes for V3 {
    type Bytes = __m256i;
    type Words = [__m256i; 2];

    #[inline(always)]
    fn load(self, from: &[u8; LANES]) -> Self::Bytes {
        cast(*from)
    }
    #[inline(always)]
    fn store(self, bytes: Self::Bytes, to: &mut [u8; LANES]) {
        *to = cast(bytes);
    }
    #[inline(always)]
    fn splat(self, value: u8) -> Self::Bytes {
        self.avx._mm256_set1_epi8(value.cast_signed())
    }
    #[inline(always)]
    fn add(self, a: Self::Bytes, b: Self::Bytes) -> Self::Bytes {
        self.avx2._mm256_add_epi8(a, b)
    }
    #[inline(always)]
    fn add_saturating(self, a: Self::Bytes, b: Self::Bytes) -> Self::Bytes {
        self.avx2._mm256_adds_epu8(a, b)
    }
    #[inline(always)]
    fn sub(self, a: Self::Bytes, b: Self::Bytes) -> Self::Bytes {
        self.avx2._mm256_sub_epi8(a, b)
    }
    #[inline(always)]
    fn min(self, a: Self::Bytes, b: Self::Bytes) -> Self::Bytes {
        self.avx2._mm256_min_epu8(a, b)
    }
    #[inline(always)]
    fn differing_bits(self, a: Self::Bytes, b: Self::Bytes) -> Self::Bytes {
        let table: __m256i = cast(BITS_OF_NIBBLE);
        let nibble = self.splat(0x0f);
        let bits = self.avx2._mm256_xor_si256(a, b);
        let low = self.avx2._mm256_and_si256(bits, nibble);
        let high = self.avx2._mm256_and_si256(self.avx2._mm256_srli_epi16::<4>(bits), nibble);
        self.add(self.avx2._mm256_shuffle_epi8(table, low), self.avx2._mm256_shuffle_epi8(table, high))
    }
    #[inline(always)]
    fn smallest(self, a: Self::Bytes) -> u8 {
        let (low, high) = halves(self, a);
        let half = self.sse2._mm_min_epu8(low, high);
        let even = self.sse2._mm_min_epu8(half, self.sse2._mm_srli_epi16::<8>(half));
        self.sse2._mm_cvtsi128_si32(self.sse4_1._mm_minpos_epu16(even)) as u8
    }

    #[inline(always)]
    fn load_words(self, from: &[u16; LANES]) -> Self::Words {
        cast(*from)
    }
    #[inline(always)]
    fn store_words(self, words: Self::Words, to: &mut [u16; LANES]) {
        *to = cast(words);
    }
    #[inline(always)]
    fn splat_words(self, value: u16) -> Self::Words {
        [self.avx._mm256_set1_epi16(value.cast_signed()); 2]
    }
    #[inline(always)]
    fn ramp(self, base: u16) -> Self::Words {
        self.add_words(cast(RAMP), self.splat_words(base))
    }
    #[inline(always)]
    fn widen(self, bytes: Self::Bytes) -> Self::Words {
        let (low, high) = halves(self, bytes);
        [self.avx2._mm256_cvtepu8_epi16(low), self.avx2._mm256_cvtepu8_epi16(high)]
    }
    #[inline(always)]
    fn add_words(self, a: Self::Words, b: Self::Words) -> Self::Words {
        [self.avx2._mm256_add_epi16(a[0], b[0]), self.avx2._mm256_add_epi16(a[1], b[1])]
    }
    #[inline(always)]
    fn min_words(self, a: Self::Words, b: Self::Words) -> Self::Words {
        [self.avx2._mm256_min_epu16(a[0], b[0]), self.avx2._mm256_min_epu16(a[1], b[1])]
    }
    #[inline(always)]
    fn select_le(self, a: Self::Words, b: Self::Words, yes: Self::Words, no: Self::Words) -> Self::Words {
        let le = at_most(self, a, b);
        [self.avx2._mm256_blendv_epi8(no[0], yes[0], le[0]), self.avx2._mm256_blendv_epi8(no[1], yes[1], le[1])]
    }
    #[inline(always)]
    fn smallest_word(self, a: Self::Words) -> u16 {
        let (low, high) = halves(self, self.avx2._mm256_min_epu16(a[0], a[1]));
        let half = self.sse4_1._mm_min_epu16(low, high);
        self.sse2._mm_cvtsi128_si32(self.sse4_1._mm_minpos_epu16(half)) as u16
    }
    #[inline(always)]
    fn count_le(self, count: Self::Words, a: Self::Words, b: Self::Words) -> Self::Words {
        let le = at_most(self, a, b);
        // A true lane is all ones, which is minus one.
        [self.avx2._mm256_sub_epi16(count[0], le[0]), self.avx2._mm256_sub_epi16(count[1], le[1])]
    }
    #[inline(always)]
    fn sum_words(self, a: Self::Words) -> u16 {
        let words: [u16; 16] = cast(self.avx2._mm256_add_epi16(a[0], a[1]));
        words.into_iter().fold(0, u16::wrapping_add)
    }
}
