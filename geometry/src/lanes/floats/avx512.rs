//! Lanes in one AVX-512 register.

use std::arch::x86_64::{__m512, __m512i, __mmask16};

use pulp::{cast, x86::V4};

use super::{LANES, Lanes};
use crate::element::{Element, NORMAL_SCALE, SLANT_MASK, SLANT_SCALE, X_SHIFT, Y_MASK, Y_SHIFT};

/// Lanes in one AVX-512 register.
#[derive(Debug, Clone, Copy)]
pub struct Avx512(pub(super) V4);

impl Lanes for Avx512 {
    type F = __m512;
    type M = __mmask16;

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
    fn bits(self, a: Self::M) -> u32 {
        u32::from(a)
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
    fn pack(self, [depth, slant, nx, ny]: [Self::F; 4]) -> [Element; LANES] {
        let simd = self.0.avx512f;
        let whole = |a: __m512, scale: f32| simd._mm512_cvtps_epi32(simd._mm512_mul_ps(a, simd._mm512_set1_ps(scale)));
        let low_bits = |a: __m512i, bits: i32| simd._mm512_and_si512(a, simd._mm512_set1_epi32(bits));
        let x = simd._mm512_slli_epi32::<X_SHIFT>(whole(nx, NORMAL_SCALE));
        let y = simd._mm512_slli_epi32::<Y_SHIFT>(low_bits(whole(ny, NORMAL_SCALE), Y_MASK));
        let slant_bits = low_bits(whole(slant, -SLANT_SCALE), SLANT_MASK);
        let normal = simd._mm512_or_si512(simd._mm512_or_si512(x, y), slant_bits);
        let depth = simd._mm512_castps_si512(depth);
        let (a, b) = (simd._mm512_unpacklo_epi32(depth, normal), simd._mm512_unpackhi_epi32(depth, normal));
        let first = simd._mm512_permutex2var_epi64(a, cast([0u64, 1, 8, 9, 2, 3, 10, 11]), b);
        let last = simd._mm512_permutex2var_epi64(a, cast([4u64, 5, 12, 13, 6, 7, 14, 15]), b);
        let packed: [u64; LANES] = cast([first, last]);
        packed.map(Element)
    }
    #[inline(always)]
    fn unpack(self, [a, b]: [[Element; LANES / 2]; 2]) -> [Self::F; 4] {
        let simd = self.0.avx512f;
        let (even, odd): ([u32; LANES], [u32; LANES]) = const { (every_other(0), every_other(1)) };
        let (a, b): (__m512, __m512) = (cast(a.map(|e| e.0)), cast(b.map(|e| e.0)));
        let depth = simd._mm512_permutex2var_ps(a, cast(even), b);
        let normal = simd._mm512_permutex2var_ps(a, cast(odd), b);
        let normal = simd._mm512_castps_si512(normal);
        let x = simd._mm512_srai_epi32::<{ X_SHIFT }>(normal);
        let y = simd._mm512_srai_epi32::<{ X_SHIFT }>(simd._mm512_slli_epi32::<{ X_SHIFT - Y_SHIFT }>(normal));
        let slant_bits = simd._mm512_and_si512(normal, simd._mm512_set1_epi32(SLANT_MASK));
        let scaled = |a: __m512i, unit: f32| simd._mm512_mul_ps(simd._mm512_cvtepi32_ps(a), simd._mm512_set1_ps(unit));
        [depth, scaled(slant_bits, -1.0 / SLANT_SCALE), scaled(x, 1.0 / NORMAL_SCALE), scaled(y, 1.0 / NORMAL_SCALE)]
    }
    #[inline(always)]
    fn bytes(self, values: [[[u8; 4]; LANES / 2]; 2]) -> [Self::F; 4] {
        let simd = self.0.avx512f;
        let (v, low): (__m512i, __m512i) = (cast(values), simd._mm512_set1_epi32(0xFF));
        [
            simd._mm512_cvtepi32_ps(simd._mm512_and_si512(v, low)),
            simd._mm512_cvtepi32_ps(simd._mm512_and_si512(simd._mm512_srli_epi32::<8>(v), low)),
            simd._mm512_cvtepi32_ps(simd._mm512_and_si512(simd._mm512_srli_epi32::<16>(v), low)),
            simd._mm512_cvtepi32_ps(simd._mm512_srli_epi32::<24>(v)),
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

/// first, first + 2, first + 4, ...
const fn every_other(first: u32) -> [u32; LANES] {
    let mut all = [0; LANES];
    let mut k = 0;
    while k < LANES {
        all[k] = first + 2 * k as u32;
        k += 1;
    }
    all
}
