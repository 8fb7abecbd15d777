//! Lanes as plain arrays: what every other kind must equal.

use super::{LANES, Lanes};

/// Lanes as plain arrays.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scalar;

#[inline(always)]
fn each<T>(f: impl FnMut(usize) -> T) -> [T; LANES] {
    std::array::from_fn(f)
}

impl Lanes for Scalar {
    type F = [f32; LANES];
    type M = [bool; LANES];

    #[inline(always)]
    fn load(self, values: &[f32; LANES]) -> Self::F {
        *values
    }
    #[inline(always)]
    fn store(self, a: Self::F) -> [f32; LANES] {
        a
    }
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
    fn transpose(self, records: [&[f32; 4]; LANES]) -> [Self::F; 4] {
        std::array::from_fn(|c| each(|k| records[k][c]))
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
