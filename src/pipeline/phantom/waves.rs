//! Owns a Gaussian random field as a sum of plane waves, from arithmetic alone: the same on every machine.

use std::f64::consts::TAU;

/// A counter-based generator (SplitMix64, Steele, Lea and Flood 2014): the `n`th number of a seed, in any order.
#[derive(Debug, Clone, Copy)]
pub struct Numbers {
    seed: u64,
}

impl Numbers {
    /// A stream of its own for each `purpose`.
    pub fn new(seed: u64, purpose: u64) -> Self {
        let seed = mix(seed ^ mix(purpose.wrapping_add(0x9E37_79B9_7F4A_7C15)));
        Numbers { seed }
    }

    pub fn bits(&self, n: u64) -> u64 {
        mix(self
            .seed
            .wrapping_add(n.wrapping_mul(0x9E37_79B9_7F4A_7C15)))
    }

    /// Uniform in [0, 1).
    pub fn uniform(&self, n: u64) -> f64 {
        (self.bits(n) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Mean 0, variance 1, close to normal: the sum of four 16-bit uniform numbers, tails end at 3.46.
    pub fn normal(&self, n: u64) -> f64 {
        let bits = self.bits(n);
        let sum: u64 = (0..4).map(|i| bits >> (16 * i) & 0xFFFF).sum();
        // Mean 4 · 65535/2; variance 4 · 65536²/12.
        (sum as f64 - 131_070.0) / 37_837.23
    }
}

fn mix(mut z: u64) -> u64 {
    z = z.wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// `(cos, sin)` of a number of turns. Error below 1e-9.
pub fn turn(turns: f64) -> [f64; 2] {
    let x = (turns - turns.round()) * TAU / 8.0;
    let x2 = x * x;
    let mut c = 1.0 - x2 / 2.0 * (1.0 - x2 / 12.0 * (1.0 - x2 / 30.0 * (1.0 - x2 / 56.0)));
    let mut s = x * (1.0 - x2 / 6.0 * (1.0 - x2 / 20.0 * (1.0 - x2 / 42.0 * (1.0 - x2 / 72.0))));
    for _ in 0..3 {
        (c, s) = (c * c - s * s, 2.0 * c * s);
    }
    [c, s]
}

/// `√(2/N) Σ cos 2π(q·x + φ)`: mean 0, variance 1.
#[derive(Debug, Clone)]
pub struct Waves {
    /// Waves per mm along x, y, z.
    q: Vec<[f64; 3]>,
    phase: Vec<f64>,
}

/// Waves enough that the field is Gaussian to the eye; cost goes with them.
const WAVES: usize = 192;
/// Spread of wavelengths about the mean, ± this share: none is a crystal, more is noise.
const SPREAD: f64 = 0.3;

impl Waves {
    /// Isotropic directions stretched along z by `stretch`, `per_mm` waves per mm sideways on average.
    pub fn new(numbers: Numbers, per_mm: f64, stretch: f64) -> Self {
        let direction = |n: u64| {
            // Directions evenly spread in z (stratified), so that a few waves are isotropic.
            let z = 2.0 * (n as f64 + numbers.uniform(4 * n)) / WAVES as f64 - 1.0;
            let [c, s] = turn(numbers.uniform(4 * n + 1));
            let r = (1.0 - z * z).max(0.0).sqrt();
            let q = per_mm * (1.0 + SPREAD * (2.0 * numbers.uniform(4 * n + 2) - 1.0));
            [q * r * c, q * r * s, q * z / stretch]
        };
        let n = 0..WAVES as u64;
        Waves {
            q: n.clone().map(direction).collect(),
            phase: n.map(|n| numbers.uniform(4 * n + 3)).collect(),
        }
    }

    /// Field and gradient (per mm) on `n` points from `from` in steps of `step` along x.
    pub fn line(
        &self,
        from: [f64; 3],
        step: f64,
        n: usize,
        mut each: impl FnMut(usize, f64, [f64; 3]),
    ) {
        let amplitude = (2.0 / WAVES as f64).sqrt();
        let at = |w: usize| {
            let q = self.q[w];
            turn(q[0] * from[0] + q[1] * from[1] + q[2] * from[2] + self.phase[w])
        };
        let (mut c, mut s): (Vec<f64>, Vec<f64>) = (0..WAVES).map(at).map(|[c, s]| (c, s)).unzip();
        let (dc, ds): (Vec<f64>, Vec<f64>) = self
            .q
            .iter()
            .map(|q| turn(q[0] * step))
            .map(|[c, s]| (c, s))
            .unzip();
        for i in 0..n {
            // Four sums at once, each in a fixed order.
            let mut sums = [[0.0f64; 4]; 4];
            for w in 0..WAVES {
                let (lane, q) = (w % 4, self.q[w]);
                sums[0][lane] += c[w];
                sums[1][lane] -= s[w] * q[0];
                sums[2][lane] -= s[w] * q[1];
                sums[3][lane] -= s[w] * q[2];
                (c[w], s[w]) = (c[w] * dc[w] - s[w] * ds[w], c[w] * ds[w] + s[w] * dc[w]);
            }
            let [f, gx, gy, gz] = sums.map(|s| ((s[0] + s[1]) + (s[2] + s[3])) * amplitude);
            each(i, f, [gx, gy, gz].map(|g| g * TAU));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_are_cosines_and_sines() {
        for i in -300..300 {
            let t = f64::from(i) * 0.0137;
            let [c, s] = turn(t);
            assert!((c - (TAU * t).cos()).abs() < 1e-9 && (s - (TAU * t).sin()).abs() < 1e-9);
        }
    }

    #[test]
    fn numbers_have_mean_0_and_variance_1() {
        let numbers = Numbers::new(7, 1);
        let n = 200_000;
        let (sum, square) = (0..n)
            .map(|i| numbers.normal(i))
            .fold((0.0, 0.0), |(a, b), v| (a + v, b + v * v));
        // Standard errors 0.0022 and 0.0027.
        assert!((sum / n as f64).abs() < 0.01 && (square / n as f64 - 1.0).abs() < 0.015);
    }

    #[test]
    fn the_gradient_is_the_fields() {
        let waves = Waves::new(Numbers::new(3, 0), 1.2, 1.5);
        let value = |p: [f64; 3]| {
            let mut at = (0.0, [0.0; 3]);
            waves.line(p, 0.1, 1, |_, f, g| at = (f, g));
            at
        };
        let p = [0.3, -1.1, 2.0];
        let (_, g) = value(p);
        for a in 0..3 {
            let h = 1e-4;
            let shifted =
                |d: f64| value(std::array::from_fn(|b| p[b] + if a == b { d } else { 0.0 })).0;
            let difference = (shifted(h) - shifted(-h)) / (2.0 * h);
            // turn() is good to 1e-9: differences over 2e-4 to about 1e-5.
            assert!((g[a] - difference).abs() < 1e-4, "{g:?} {difference}");
        }
        let mut last = 0.0;
        waves.line(p, 0.1, 50, |_, f, _| last = f);
        assert!((last - value([p[0] + 4.9, p[1], p[2]]).0).abs() < 1e-7);
    }
}
