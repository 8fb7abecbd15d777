//! Every kind of lanes equals plain arrays.

use super::*;

/// Every operation.
#[derive(Clone)]
struct Everything([[f32; LANES]; 4]);

type Results = (Vec<u32>, [i16; LANES], [u16; LANES], [u32; LANES], u32, bool);

impl Kernel for Everything {
    type Output = Results;

    #[inline(always)]
    fn run<L: Lanes>(self, l: L) -> Results {
        let [a, b, c, d] = [l.load(&self.0[0]), l.load(&self.0[1]), l.load(&self.0[2]), l.load(&self.0[3])];
        let mask = l.or(l.and(l.ge(a, b), l.ge(d, c)), l.gt(c, a));
        let sum = l.add(l.mul(a, b), l.div(c, l.sub(d, a)));
        let chosen = l.select(mask, l.min(sum, d), l.max(b, l.sqrt(l.abs(sum))));
        let bounded = l.max(l.min(a, l.splat(1e5)), l.splat(-1e5));
        let unit = l.max(l.min(b, l.splat(1.0)), l.splat(-1.0));
        let packed = l.pack([bounded, l.sub(l.abs(unit), l.splat(1.5)), unit, l.mul(unit, unit)]);
        let halves = [*packed.first_chunk().unwrap(), *packed.last_chunk().unwrap()];
        let parts = l.unpack(halves);
        let bytes = l.bytes(halves.map(|half| half.map(|e| ((e.0 >> 32) as u32).to_le_bytes())));
        let (small, positive) = (l.to_i16(bounded), l.to_u16(bounded));
        let back = l.keep(mask, l.add(l.from_i16(&small), l.from_u16(&positive)));
        let index = l.indices(l.max(l.min(l.round(bounded), l.splat(9.0)), l.splat(0.0)));
        let [p, q, r, s] = parts;
        let [t, u, v, w] = bytes;
        let floats = [sum, chosen, back, p, q, r, s, t, u, v, w];
        let bits = floats.iter().flat_map(|f| l.store(*f)).map(|x| if x.is_nan() { 1 } else { x.to_bits() });
        (bits.collect(), small, positive, index, l.bits(mask), l.any(mask))
    }
}

/// Floats of all bit patterns, of everyday size, and of few values, by turns.
fn inputs() -> impl Iterator<Item = Everything> {
    let mut seed = 1u32;
    let mut next = move || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        seed
    };
    (0..3000).map(move |round| {
        let mut value = || match round % 3 {
            0 => f32::from_bits(next()),
            1 => (next() >> 8) as f32 / 65536.0 - 128.0,
            _ => (next() >> 30) as f32 + 0.5,
        };
        Everything(std::array::from_fn(|_| std::array::from_fn(|_| value())))
    })
}

#[test]
#[cfg(target_arch = "x86_64")]
fn registers_agree_with_plain_arrays_to_the_last_bit() {
    let (v3, v4) = (pulp::x86::V3::try_new(), pulp::x86::V4::try_new());
    for input in inputs() {
        let plain = input.clone().run(Scalar);
        if let Some(simd) = v3 {
            let found = pulp::Simd::vectorize(simd, Using(avx2::Avx2(simd), input.clone()));
            assert_eq!(found, plain, "AVX2 of {:?}", input.0);
        }
        if let Some(simd) = v4 {
            let found = pulp::Simd::vectorize(simd, Using(avx512::Avx512(simd), input.clone()));
            assert_eq!(found, plain, "AVX-512 of {:?}", input.0);
        }
    }
}

#[test]
fn plain_arrays_compute_what_the_names_say() {
    let a: [f32; LANES] = std::array::from_fn(|k| k as f32 - 3.5);
    let l = Scalar;
    assert_eq!(l.round(a)[..4], [-4.0, -2.0, -2.0, 0.0]);
    assert_eq!(l.to_u16(a)[..6], [0, 0, 0, 0, 0, 2]);
    assert_eq!(l.abs(a)[0], 3.5);
    assert_eq!(l.keep(l.gt(a, l.splat(0.0)), a)[3..5], [0.0, 0.5]);
    assert_eq!(l.indices([7.0; LANES])[15], 7);
}
