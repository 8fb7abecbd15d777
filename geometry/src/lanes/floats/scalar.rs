//! Lanes as plain arrays: what every other kind must equal.

use super::{LANES, Lanes};
use crate::element::Element;

/// Lanes as plain arrays.
#[derive(Debug, Clone, Copy)]
pub struct Scalar;

#[inline(always)]
fn each<T>(f: impl FnMut(usize) -> T) -> [T; LANES] {
    std::array::from_fn(f)
}

impl Lanes for Scalar {
    type F = [f32; LANES];
    type M = [bool; LANES];

    #[inline(always)]
    fn splat(self, value: f32) -> Self::F {
        [value; LANES]
    }
    #[inline(always)]
    fn add(self, a: Self::F, b: Self::F) -> Self::F {
        each(|k| a[k] + b[k])
    }
    #[inline(always)]
    fn sub(self, a: Self::F, b: Self::F) -> Self::F {
        each(|k| a[k] - b[k])
    }
    #[inline(always)]
    fn mul(self, a: Self::F, b: Self::F) -> Self::F {
        each(|k| a[k] * b[k])
    }
    #[inline(always)]
    fn div(self, a: Self::F, b: Self::F) -> Self::F {
        each(|k| a[k] / b[k])
    }
    #[inline(always)]
    fn sqrt(self, a: Self::F) -> Self::F {
        a.map(f32::sqrt)
    }
    #[inline(always)]
    fn min(self, a: Self::F, b: Self::F) -> Self::F {
        each(|k| if a[k] < b[k] { a[k] } else { b[k] })
    }
    #[inline(always)]
    fn max(self, a: Self::F, b: Self::F) -> Self::F {
        each(|k| if a[k] > b[k] { a[k] } else { b[k] })
    }
    #[inline(always)]
    fn ge(self, a: Self::F, b: Self::F) -> Self::M {
        each(|k| a[k] >= b[k])
    }
    #[inline(always)]
    fn gt(self, a: Self::F, b: Self::F) -> Self::M {
        each(|k| a[k] > b[k])
    }
    #[inline(always)]
    fn and(self, a: Self::M, b: Self::M) -> Self::M {
        each(|k| a[k] & b[k])
    }
    #[inline(always)]
    fn or(self, a: Self::M, b: Self::M) -> Self::M {
        each(|k| a[k] | b[k])
    }
    #[inline(always)]
    fn bits(self, a: Self::M) -> u32 {
        (0..LANES).fold(0, |bits, k| bits | u32::from(a[k]) << k)
    }
    #[inline(always)]
    fn any(self, a: Self::M) -> bool {
        a.contains(&true)
    }
    #[inline(always)]
    fn select(self, mask: Self::M, a: Self::F, b: Self::F) -> Self::F {
        each(|k| if mask[k] { a[k] } else { b[k] })
    }
    #[inline(always)]
    fn indices(self, a: Self::F) -> [u32; LANES] {
        a.map(|x| x as u32)
    }
    #[inline(always)]
    fn pack(self, [depth, slant, nx, ny]: [Self::F; 4]) -> [Element; LANES] {
        each(|k| Element::new(depth[k], slant[k], [nx[k], ny[k]]))
    }
    #[inline(always)]
    fn unpack(self, elements: [[Element; LANES / 2]; 2]) -> [Self::F; 4] {
        let parts = elements.map(|half| half.map(Element::parts));
        std::array::from_fn(|c| each(|k| parts[k / (LANES / 2)][k % (LANES / 2)][c]))
    }
    #[inline(always)]
    fn bytes(self, values: [[[u8; 4]; LANES / 2]; 2]) -> [Self::F; 4] {
        std::array::from_fn(|c| each(|k| f32::from(values[k / (LANES / 2)][k % (LANES / 2)][c])))
    }
    #[inline(always)]
    fn from_i16(self, values: &[i16; LANES]) -> Self::F {
        values.map(f32::from)
    }
    #[inline(always)]
    fn from_u16(self, values: &[u16; LANES]) -> Self::F {
        values.map(f32::from)
    }
    #[inline(always)]
    fn to_i16(self, a: Self::F) -> [i16; LANES] {
        self.round(a).map(|x| x as i16)
    }
    #[inline(always)]
    fn to_u16(self, a: Self::F) -> [u16; LANES] {
        self.round(a).map(|x| x as u16)
    }
}
