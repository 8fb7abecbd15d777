//! Random numbers that depend on nothing but the seed and a place: the same for any number of threads.

/// Mixes 64 bits (the finaliser of SplitMix64, Steele, Lea and Flood 2014).
#[inline]
fn mix(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// The random bits of place (`a`, `b`) under `seed`.
#[inline]
pub fn bits_at(seed: u64, a: u64, b: u64) -> u64 {
    const STEP: u64 = 0x9e37_79b9_7f4a_7c15;
    mix(mix(mix(seed.wrapping_add(STEP)).wrapping_add(a.wrapping_mul(STEP))).wrapping_add(b.wrapping_mul(STEP)))
}

/// Uniform in [0, 1) at place (`a`, `b`).
#[inline]
pub fn uniform_at(seed: u64, a: u64, b: u64) -> f64 {
    (bits_at(seed, a, b) >> 11) as f64 / (1u64 << 53) as f64
}

/// Standard normal at place (`a`, `b`) (Box and Muller 1958).
#[inline]
pub fn normal_at(seed: u64, a: u64, b: u64) -> f64 {
    let bits = bits_at(seed, a, b);
    let u = ((bits >> 32) as f64 + 1.0) / 4_294_967_297.0;
    let v = (bits & 0xffff_ffff) as f64 / 4_294_967_296.0;
    (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}

/// A stream of random numbers.
#[derive(Debug, Clone)]
pub struct Random {
    seed: u64,
    stream: u64,
    next: u64,
}

impl Random {
    /// The stream called `name` under `seed`: streams of other names are independent.
    pub fn new(seed: u64, name: &str) -> Self {
        let stream =
            name.bytes().fold(0xcbf2_9ce4_8422_2325, |h: u64, b| (h ^ u64::from(b)).wrapping_mul(0x100_0000_01b3));
        Self { seed, stream, next: 0 }
    }

    /// Uniform in [0, 1).
    pub fn uniform(&mut self) -> f64 {
        self.next += 1;
        uniform_at(self.seed, self.stream, self.next)
    }

    /// Uniform in [`low`, `high`).
    pub fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    /// Normal with standard deviation 1, cut at ±`limit`.
    pub fn normal(&mut self, limit: f64) -> f64 {
        self.next += 1;
        normal_at(self.seed, self.stream, self.next).clamp(-limit, limit)
    }

    /// A seed for something below.
    pub fn seed(&mut self) -> u64 {
        self.next += 1;
        bits_at(self.seed, self.stream, self.next)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_are_right_and_streams_differ() {
        let n = 20_000;
        let values: Vec<f64> = (0..n).map(|i| normal_at(3, 5, i)).collect();
        let mean = values.iter().sum::<f64>() / n as f64;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n as f64;
        assert!(mean.abs() < 0.03 && (variance - 1.0).abs() < 0.05, "{mean} {variance}");
        let (mut a, mut b) = (Random::new(1, "pose"), Random::new(1, "noise"));
        assert_ne!(a.uniform(), b.uniform());
        assert_eq!(Random::new(1, "pose").uniform(), Random::new(1, "pose").uniform());
    }
}
