//! Seeded random streams: one for every use, so that adding one leaves the others as they were.
//!
//! A stream is named (`accelerometer.x/white`); its generator starts from a hash of the run's seed and that name.
//! Normals come from Marsaglia's polar method (Marsaglia & Bray 1964, SIAM Review 6, 260–264) with `libm`'s logarithm:
//! the same bits on every machine.

use rand::Rng;
use rand_pcg::Pcg64Mcg;

/// An independent source of random numbers.
#[derive(Clone, Debug)]
pub struct Stream {
    generator: Pcg64Mcg,
    spare: Option<f64>,
}

impl Stream {
    /// Stream with this name in the run with this seed.
    pub fn new(seed: u64, name: &str) -> Self {
        let mut state = seed ^ fnv1a(name.as_bytes());
        // Two rounds of whitening of seed and name together, then 128 bits of state.
        state = split_mix(&mut state) ^ seed.rotate_left(32);
        let high = split_mix(&mut state);
        let low = split_mix(&mut state);
        Self {
            generator: Pcg64Mcg::new((u128::from(high) << 64) | u128::from(low)),
            spare: None,
        }
    }

    /// Uniform on [0, 1).
    pub fn uniform(&mut self) -> f64 {
        const TWO_TO_MINUS_53: f64 = 1.0 / 9_007_199_254_740_992.0;
        (self.generator.next_u64() >> 11) as f64 * TWO_TO_MINUS_53
    }

    /// Normal with mean 0 and standard deviation 1.
    pub fn normal(&mut self) -> f64 {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        loop {
            let u = 2.0 * self.uniform() - 1.0;
            let v = 2.0 * self.uniform() - 1.0;
            let s = u * u + v * v;
            if s < 1.0 && s > 0.0 {
                let factor = (-2.0 * libm::log(s) / s).sqrt();
                self.spare = Some(v * factor);
                return u * factor;
            }
        }
    }
}

/// FNV-1a, 64 bit (Fowler, Noll, Vo).
fn fnv1a(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

/// SplitMix64 (Steele, Lea, Flood 2014, OOPSLA, figure 17).
fn split_mix(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    const N: usize = 400_000;

    /// Moments of the standard normal: 0, 1, 0, 3; the estimators have variances 1/N, 2/N, 15/N, 96/N.
    #[test]
    fn normals_have_the_moments_of_the_normal_distribution() {
        let mut stream = Stream::new(1, "moments");
        let mut sums = [0.0; 4];
        let mut beyond_3_sigma = 0;
        for _ in 0..N {
            let x = stream.normal();
            for (power, sum) in sums.iter_mut().enumerate() {
                *sum += x.powi(power as i32 + 1);
            }
            beyond_3_sigma += usize::from(x.abs() > 3.0);
        }
        let n = N as f64;
        for ((sum, expected), variance) in sums
            .iter()
            .zip([0.0, 1.0, 0.0, 3.0])
            .zip([1.0, 2.0, 15.0, 96.0])
        {
            let bound = 5.0 * f64::sqrt(variance / n);
            assert!(
                (sum / n - expected).abs() < bound,
                "{} is not {expected} ± {bound}",
                sum / n
            );
        }
        // P(|x| > 3) = 0.0026998
        let p = 0.002_699_8;
        assert!((beyond_3_sigma as f64 / n - p).abs() < 5.0 * f64::sqrt(p / n));
    }

    #[test]
    fn uniforms_fill_the_unit_interval_evenly() {
        let mut stream = Stream::new(2, "uniform");
        let mut bins = [0.0; 16];
        for _ in 0..N {
            let x = stream.uniform();
            assert!((0.0..1.0).contains(&x));
            bins[(x * 16.0) as usize] += 1.0;
        }
        let expected = N as f64 / 16.0;
        let chi2: f64 = bins
            .iter()
            .map(|b| (b - expected) * (b - expected) / expected)
            .sum();
        // χ² of 15 degrees of freedom: mean 15, variance 30.
        assert!(chi2 < 15.0 + 5.0 * f64::sqrt(30.0), "χ² = {chi2}");
    }

    /// Neighbouring seeds, swapped names and names one letter apart must have nothing in common.
    #[test]
    fn streams_of_other_names_and_seeds_are_uncorrelated() {
        let ids = [
            (1, "gyro.x"),
            (1, "gyro.y"),
            (2, "gyro.x"),
            (3, "gyro.x"),
            (1, ""),
            (0, ""),
        ];
        let n = 20_000;
        let draws: Vec<Vec<f64>> = ids
            .iter()
            .map(|(seed, name)| {
                let mut stream = Stream::new(*seed, name);
                (0..n).map(|_| stream.normal()).collect()
            })
            .collect();
        for (i, a) in draws.iter().enumerate() {
            for b in &draws[..i] {
                let r: f64 = a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>() / n as f64;
                assert!(r.abs() < 5.0 / f64::sqrt(n as f64), "correlation {r}");
            }
        }
    }

    #[test]
    fn the_same_seed_and_name_give_the_same_bits() {
        let (mut a, mut b) = (Stream::new(7, "x"), Stream::new(7, "x"));
        for _ in 0..1000 {
            assert_eq!(a.normal().to_bits(), b.normal().to_bits());
        }
    }

    /// Reference values published with the two hash functions.
    #[test]
    fn hashes_agree_with_their_published_vectors() {
        assert_eq!(fnv1a(b"a"), 0xaf63_dc4c_8601_ec8c);
        assert_eq!(fnv1a(b"foobar"), 0x8594_4171_f739_67e8);
        let mut state = 1_234_567;
        assert_eq!(split_mix(&mut state), 6_457_827_717_110_365_317);
        assert_eq!(split_mix(&mut state), 3_203_168_211_198_807_973);
    }
}
