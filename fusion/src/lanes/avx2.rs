//! Lanes in two AVX2 registers.

use std::arch::x86_64::{__m128, __m128i, __m256};

use pulp::{cast, x86::V3};

use super::{LANES, Lanes};

/// Lanes in two AVX2 registers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Avx2(pub V3);

impl Lanes for Avx2 {
    type F = [__m256; 2];
    type M = [__m256; 2];

    #[inline(always)]
    fn load(self, values: &[f32; LANES]) -> Self::F {
        cast(*values)
    }
    #[inline(always)]
    fn store(self, a: Self::F) -> [f32; LANES] {
        cast(a)
    }
    #[inline(always)]
    fn splat(self, value: f32) -> Self::F {
        [self.0.avx._mm256_set1_ps(value); 2]
    }
    #[inline(always)]
    fn add(self, a: Self::F, b: Self::F) -> Self::F {
        [self.0.avx._mm256_add_ps(a[0], b[0]), self.0.avx._mm256_add_ps(a[1], b[1])]
    }
    #[inline(always)]
    fn sub(self, a: Self::F, b: Self::F) -> Self::F {
        [self.0.avx._mm256_sub_ps(a[0], b[0]), self.0.avx._mm256_sub_ps(a[1], b[1])]
    }
    #[inline(always)]
    fn mul(self, a: Self::F, b: Self::F) -> Self::F {
        [self.0.avx._mm256_mul_ps(a[0], b[0]), self.0.avx._mm256_mul_ps(a[1], b[1])]
    }
    #[inline(always)]
    fn div(self, a: Self::F, b: Self::F) -> Self::F {
        [self.0.avx._mm256_div_ps(a[0], b[0]), self.0.avx._mm256_div_ps(a[1], b[1])]
    }
    #[inline(always)]
    fn sqrt(self, a: Self::F) -> Self::F {
        [self.0.avx._mm256_sqrt_ps(a[0]), self.0.avx._mm256_sqrt_ps(a[1])]
    }
    #[inline(always)]
    fn min(self, a: Self::F, b: Self::F) -> Self::F {
        [self.0.avx._mm256_min_ps(a[0], b[0]), self.0.avx._mm256_min_ps(a[1], b[1])]
    }
    #[inline(always)]
    fn max(self, a: Self::F, b: Self::F) -> Self::F {
        [self.0.avx._mm256_max_ps(a[0], b[0]), self.0.avx._mm256_max_ps(a[1], b[1])]
    }
    #[inline(always)]
    fn ge(self, a: Self::F, b: Self::F) -> Self::M {
        // 29 = ordered, greater or equal, quiet.
        [self.0.avx._mm256_cmp_ps::<29>(a[0], b[0]), self.0.avx._mm256_cmp_ps::<29>(a[1], b[1])]
    }
    #[inline(always)]
    fn gt(self, a: Self::F, b: Self::F) -> Self::M {
        // 30 = ordered, greater, quiet.
        [self.0.avx._mm256_cmp_ps::<30>(a[0], b[0]), self.0.avx._mm256_cmp_ps::<30>(a[1], b[1])]
    }
    #[inline(always)]
    fn and(self, a: Self::M, b: Self::M) -> Self::M {
        [self.0.avx._mm256_and_ps(a[0], b[0]), self.0.avx._mm256_and_ps(a[1], b[1])]
    }
    #[inline(always)]
    fn or(self, a: Self::M, b: Self::M) -> Self::M {
        [self.0.avx._mm256_or_ps(a[0], b[0]), self.0.avx._mm256_or_ps(a[1], b[1])]
    }
    #[inline(always)]
    fn any(self, a: Self::M) -> bool {
        self.0.avx._mm256_movemask_ps(self.0.avx._mm256_or_ps(a[0], a[1])) != 0
    }
    #[inline(always)]
    fn select(self, mask: Self::M, a: Self::F, b: Self::F) -> Self::F {
        [self.0.avx._mm256_blendv_ps(b[0], a[0], mask[0]), self.0.avx._mm256_blendv_ps(b[1], a[1], mask[1])]
    }
    #[inline(always)]
    fn indices(self, a: Self::F) -> [u32; LANES] {
        cast([self.0.avx._mm256_cvttps_epi32(a[0]), self.0.avx._mm256_cvttps_epi32(a[1])])
    }
    #[inline(always)]
    fn transpose(self, records: [&[f32; 4]; LANES]) -> [Self::F; 4] {
        let ([a, b, c, d], [e, f, g, h]) = (eight_records(self.0, &records, 0), eight_records(self.0, &records, 8));
        [[a, e], [b, f], [c, g], [d, h]]
    }
    #[inline(always)]
    fn from_i16(self, values: &[i16; LANES]) -> Self::F {
        let packed: [__m128i; 2] = cast(*values);
        let wide = [self.0.avx2._mm256_cvtepi16_epi32(packed[0]), self.0.avx2._mm256_cvtepi16_epi32(packed[1])];
        [self.0.avx._mm256_cvtepi32_ps(wide[0]), self.0.avx._mm256_cvtepi32_ps(wide[1])]
    }
    #[inline(always)]
    fn from_u16(self, values: &[u16; LANES]) -> Self::F {
        let packed: [__m128i; 2] = cast(*values);
        let wide = [self.0.avx2._mm256_cvtepu16_epi32(packed[0]), self.0.avx2._mm256_cvtepu16_epi32(packed[1])];
        [self.0.avx._mm256_cvtepi32_ps(wide[0]), self.0.avx._mm256_cvtepi32_ps(wide[1])]
    }
    #[inline(always)]
    fn to_i16(self, a: Self::F) -> [i16; LANES] {
        let ([a, b], [c, d]) = (whole_numbers(self.0, a[0]), whole_numbers(self.0, a[1]));
        cast([self.0.sse2._mm_packs_epi32(a, b), self.0.sse2._mm_packs_epi32(c, d)])
    }
    #[inline(always)]
    fn to_u16(self, a: Self::F) -> [u16; LANES] {
        let ([a, b], [c, d]) = (whole_numbers(self.0, a[0]), whole_numbers(self.0, a[1]));
        cast([self.0.sse4_1._mm_packus_epi32(a, b), self.0.sse4_1._mm_packus_epi32(c, d)])
    }
}

/// Rounded to nearest even, as two groups of four integers.
#[inline(always)]
fn whole_numbers(simd: V3, a: __m256) -> [__m128i; 2] {
    cast(simd.avx._mm256_cvtps_epi32(a))
}

/// The components of eight records from `at` on: a transposition of two 4 × 4 blocks side by side.
#[inline(always)]
fn eight_records(simd: V3, records: &[&[f32; 4]; LANES], at: usize) -> [__m256; 4] {
    let avx = simd.avx;
    let r = &records[at..at + 8];
    let (a, b) = (two_records(simd, r[0], r[4]), two_records(simd, r[1], r[5]));
    let (c, d) = (two_records(simd, r[2], r[6]), two_records(simd, r[3], r[7]));
    let (ab, cd) = (avx._mm256_unpacklo_ps(a, b), avx._mm256_unpacklo_ps(c, d));
    let (ef, gh) = (avx._mm256_unpackhi_ps(a, b), avx._mm256_unpackhi_ps(c, d));
    [
        avx._mm256_shuffle_ps::<0x44>(ab, cd),
        avx._mm256_shuffle_ps::<0xEE>(ab, cd),
        avx._mm256_shuffle_ps::<0x44>(ef, gh),
        avx._mm256_shuffle_ps::<0xEE>(ef, gh),
    ]
}

#[inline(always)]
fn two_records(simd: V3, low: &[f32; 4], high: &[f32; 4]) -> __m256 {
    let (low, high): (__m128, __m128) = (cast(*low), cast(*high));
    simd.avx._mm256_insertf128_ps::<1>(simd.avx._mm256_castps128_ps256(low), high)
}
