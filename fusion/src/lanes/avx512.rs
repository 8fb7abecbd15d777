//! Lanes in one AVX-512 register.

use std::arch::x86_64::{__m128, __m512, __mmask16};

use pulp::{cast, x86::V4};

use super::{LANES, Lanes};

/// Lanes in one AVX-512 register.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Avx512(pub V4);

impl Lanes for Avx512 {
    type F = __m512;
    type M = __mmask16;

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
        self.0.avx512f._mm512_set1_ps(value)
    }
    #[inline(always)]
    fn add(self, a: Self::F, b: Self::F) -> Self::F {
        self.0.avx512f._mm512_add_ps(a, b)
    }
    #[inline(always)]
    fn sub(self, a: Self::F, b: Self::F) -> Self::F {
        self.0.avx512f._mm512_sub_ps(a, b)
    }
    #[inline(always)]
    fn mul(self, a: Self::F, b: Self::F) -> Self::F {
        self.0.avx512f._mm512_mul_ps(a, b)
    }
    #[inline(always)]
    fn div(self, a: Self::F, b: Self::F) -> Self::F {
        self.0.avx512f._mm512_div_ps(a, b)
    }
    #[inline(always)]
    fn sqrt(self, a: Self::F) -> Self::F {
        self.0.avx512f._mm512_sqrt_ps(a)
    }
    #[inline(always)]
    fn min(self, a: Self::F, b: Self::F) -> Self::F {
        self.0.avx512f._mm512_min_ps(a, b)
    }
    #[inline(always)]
    fn max(self, a: Self::F, b: Self::F) -> Self::F {
        self.0.avx512f._mm512_max_ps(a, b)
    }
    #[inline(always)]
    fn ge(self, a: Self::F, b: Self::F) -> Self::M {
        // 29 = ordered, greater or equal, quiet.
        self.0.avx512f._mm512_cmp_ps_mask::<29>(a, b)
    }
    #[inline(always)]
    fn gt(self, a: Self::F, b: Self::F) -> Self::M {
        // 30 = ordered, greater, quiet.
        self.0.avx512f._mm512_cmp_ps_mask::<30>(a, b)
    }
    #[inline(always)]
    fn and(self, a: Self::M, b: Self::M) -> Self::M {
        a & b
    }
    #[inline(always)]
    fn or(self, a: Self::M, b: Self::M) -> Self::M {
        a | b
    }
    #[inline(always)]
    fn any(self, a: Self::M) -> bool {
        a != 0
    }
    #[inline(always)]
    fn select(self, mask: Self::M, a: Self::F, b: Self::F) -> Self::F {
        self.0.avx512f._mm512_mask_blend_ps(mask, b, a)
    }
    #[inline(always)]
    fn indices(self, a: Self::F) -> [u32; LANES] {
        cast(self.0.avx512f._mm512_cvttps_epi32(a))
    }
    #[inline(always)]
    fn transpose(self, records: [&[f32; 4]; LANES]) -> [Self::F; 4] {
        let simd = self.0.avx512f;
        let (a, b) = (four_records(self.0, &records, 0), four_records(self.0, &records, 1));
        let (c, d) = (four_records(self.0, &records, 2), four_records(self.0, &records, 3));
        let (ab, cd) = (simd._mm512_unpacklo_ps(a, b), simd._mm512_unpacklo_ps(c, d));
        let (ef, gh) = (simd._mm512_unpackhi_ps(a, b), simd._mm512_unpackhi_ps(c, d));
        [
            simd._mm512_shuffle_ps::<0x44>(ab, cd),
            simd._mm512_shuffle_ps::<0xEE>(ab, cd),
            simd._mm512_shuffle_ps::<0x44>(ef, gh),
            simd._mm512_shuffle_ps::<0xEE>(ef, gh),
        ]
    }
    #[inline(always)]
    fn from_i16(self, values: &[i16; LANES]) -> Self::F {
        self.0.avx512f._mm512_cvtepi32_ps(self.0.avx512f._mm512_cvtepi16_epi32(cast(*values)))
    }
    #[inline(always)]
    fn from_u16(self, values: &[u16; LANES]) -> Self::F {
        self.0.avx512f._mm512_cvtepi32_ps(self.0.avx512f._mm512_cvtepu16_epi32(cast(*values)))
    }
    #[inline(always)]
    fn to_i16(self, a: Self::F) -> [i16; LANES] {
        cast(self.0.avx512f._mm512_cvtsepi32_epi16(self.0.avx512f._mm512_cvtps_epi32(a)))
    }
    #[inline(always)]
    fn to_u16(self, a: Self::F) -> [u16; LANES] {
        let positive = self
            .0
            .avx512f
            ._mm512_max_epi32(self.0.avx512f._mm512_cvtps_epi32(a), self.0.avx512f._mm512_setzero_si512());
        cast(self.0.avx512f._mm512_cvtusepi32_epi16(positive))
    }
}

/// Records k, k + 4, k + 8 and k + 12 side by side.
#[inline(always)]
fn four_records(simd: V4, records: &[&[f32; 4]; LANES], k: usize) -> __m512 {
    let (a, b): (__m128, __m128) = (cast(*records[k]), cast(*records[k + 4]));
    let (c, d): (__m128, __m128) = (cast(*records[k + 8]), cast(*records[k + 12]));
    let ab = simd.avx512f._mm512_insertf32x4::<1>(simd.avx512f._mm512_castps128_ps512(a), b);
    simd.avx512f._mm512_insertf32x4::<3>(simd.avx512f._mm512_insertf32x4::<2>(ab, c), d)
}
