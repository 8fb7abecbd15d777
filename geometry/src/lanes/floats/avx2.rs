//! Lanes in two AVX2 registers.

use std::arch::x86_64::{__m128i, __m256, __m256i};

use pulp::{cast, x86::V3};

use super::{LANES, Lanes};
use crate::element::{Element, NORMAL_SCALE, SLANT_MASK, SLANT_SCALE, X_SHIFT, Y_MASK, Y_SHIFT};

/// Lanes in two AVX2 registers.
#[derive(Debug, Clone, Copy)]
pub struct Avx2(pub(super) V3);

impl Lanes for Avx2 {
    type F = [__m256; 2];
    type M = [__m256; 2];

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
    fn bits(self, a: Self::M) -> u32 {
        let [low, high] = a.map(|half| self.0.avx._mm256_movemask_ps(half) as u32);
        low | high << 8
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
    fn pack(self, [depth, slant, nx, ny]: [Self::F; 4]) -> [Element; LANES] {
        let halves: [[u64; 8]; 2] =
            [pack_half(self.0, depth[0], slant[0], nx[0], ny[0]), pack_half(self.0, depth[1], slant[1], nx[1], ny[1])];
        let packed: [u64; LANES] = cast(halves);
        packed.map(Element)
    }
    #[inline(always)]
    fn unpack(self, [low, high]: [[Element; LANES / 2]; 2]) -> [Self::F; 4] {
        let ([d, f, x, y], [e, g, u, v]) =
            (unpack_half(self.0, low.map(|e| e.0)), unpack_half(self.0, high.map(|e| e.0)));
        [[d, e], [f, g], [x, u], [y, v]]
    }
    #[inline(always)]
    fn bytes(self, [low, high]: [[[u8; 4]; LANES / 2]; 2]) -> [Self::F; 4] {
        let ([a, b, c, d], [e, f, g, h]) = (bytes_of(self.0, cast(low)), bytes_of(self.0, cast(high)));
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

#[inline(always)]
fn pack_half(simd: V3, depth: __m256, slant: __m256, nx: __m256, ny: __m256) -> [u64; 8] {
    let (avx, avx2) = (simd.avx, simd.avx2);
    let whole = |a: __m256, scale: f32| avx._mm256_cvtps_epi32(avx._mm256_mul_ps(a, avx._mm256_set1_ps(scale)));
    let low_bits = |a: __m256i, bits: i32| avx2._mm256_and_si256(a, avx._mm256_set1_epi32(bits));
    let x = avx2._mm256_slli_epi32::<{ X_SHIFT as i32 }>(whole(nx, NORMAL_SCALE));
    let y = avx2._mm256_slli_epi32::<{ Y_SHIFT as i32 }>(low_bits(whole(ny, NORMAL_SCALE), Y_MASK));
    let slant_bits = low_bits(whole(slant, -SLANT_SCALE), SLANT_MASK);
    let normal = avx2._mm256_or_si256(avx2._mm256_or_si256(x, y), slant_bits);
    let depth = avx._mm256_castps_si256(depth);
    let [a, c]: [__m128i; 2] = cast(avx2._mm256_unpacklo_epi32(depth, normal));
    let [b, d]: [__m128i; 2] = cast(avx2._mm256_unpackhi_epi32(depth, normal));
    cast([a, b, c, d])
}

#[inline(always)]
fn unpack_half(simd: V3, e: [u64; 8]) -> [__m256; 4] {
    let (avx, avx2) = (simd.avx, simd.avx2);
    let [a, b]: [__m256; 2] = cast(e);
    // 0, 1, 4, 5 and 2, 3, 6, 7 to order.
    let ordered = |a: __m256| avx2._mm256_permute4x64_epi64::<0xD8>(avx._mm256_castps_si256(a));
    let depth = avx._mm256_castsi256_ps(ordered(avx._mm256_shuffle_ps::<0x88>(a, b)));
    let normal = ordered(avx._mm256_shuffle_ps::<0xDD>(a, b));
    let x = avx2._mm256_srai_epi32::<{ X_SHIFT as i32 }>(normal);
    let y =
        avx2._mm256_srai_epi32::<{ X_SHIFT as i32 }>(avx2._mm256_slli_epi32::<{ (X_SHIFT - Y_SHIFT) as i32 }>(normal));
    let slant_bits = avx2._mm256_and_si256(normal, avx._mm256_set1_epi32(SLANT_MASK));
    let scaled = |a: __m256i, unit: f32| avx._mm256_mul_ps(avx._mm256_cvtepi32_ps(a), avx._mm256_set1_ps(unit));
    [depth, scaled(slant_bits, -1.0 / SLANT_SCALE), scaled(x, 1.0 / NORMAL_SCALE), scaled(y, 1.0 / NORMAL_SCALE)]
}

#[inline(always)]
fn bytes_of(simd: V3, v: __m256i) -> [__m256; 4] {
    let (avx, avx2) = (simd.avx, simd.avx2);
    let low = avx._mm256_set1_epi32(0xFF);
    [
        avx._mm256_cvtepi32_ps(avx2._mm256_and_si256(v, low)),
        avx._mm256_cvtepi32_ps(avx2._mm256_and_si256(avx2._mm256_srli_epi32::<8>(v), low)),
        avx._mm256_cvtepi32_ps(avx2._mm256_and_si256(avx2._mm256_srli_epi32::<16>(v), low)),
        avx._mm256_cvtepi32_ps(avx2._mm256_srli_epi32::<24>(v)),
    ]
}
