//! Owns bone's density law: stiffness that follows density, and density that follows energy.
//!
//! Schaller et al. (2022), eqs 11, 12 and 16: energies are weighted by `(ρ/ρ*)^n`, and
//! `dρ/dt = c [(ρ/ρ*)^−m Ψ − Ψ*]` with Ψ the weighted energy density.

/// How energy depends on density.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weight {
    /// Reference density ρ*.
    pub reference: f64,
    /// Exponent `n`.
    pub exponent: f64,
}

impl Weight {
    /// `(ρ/ρ*)^n` and its derivative.
    pub fn at(&self, density: f64) -> (f64, f64) {
        let r = density / self.reference;
        // The usual exponent, without the cost of a general power.
        let w = if self.exponent == 2.0 {
            r * r
        } else {
            r.powf(self.exponent)
        };
        (w, self.exponent * w / density)
    }
}

/// The mass source.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Growth {
    pub reference: f64,
    /// Rate `c`.
    pub rate: f64,
    /// Attractor stimulus Ψ*.
    pub stimulus: f64,
    /// Exponent `m`.
    pub exponent: f64,
    /// Density below which nothing is resorbed; minus infinity: no bound.
    pub floor: f64,
}

/// Residual of one implicit Euler step of the balance of mass, and its derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Balance {
    pub residual: f64,
    /// By the density, at fixed Ψ.
    pub by_density: f64,
    /// By Ψ.
    pub by_energy: f64,
}

impl Growth {
    /// `−ρ + ρ_old + c Δt [(ρ/ρ*)^−m Ψ − Ψ*]` (eq 17), or `floor − ρ` where that is more: zero where the balance holds
    /// above the floor, or at the floor while the balance would have less.
    pub fn balance(&self, density: f64, old: f64, energy: f64, dt: f64) -> Balance {
        let r = density / self.reference;
        // The usual exponent, without the cost of a general power.
        let power = if self.exponent == 3.0 {
            (r * r * r).recip()
        } else {
            r.powf(-self.exponent)
        };
        let by_energy = self.rate * dt * power;
        let residual = old - density + by_energy * energy - self.rate * dt * self.stimulus;
        if residual < self.floor - density {
            return Balance {
                residual: self.floor - density,
                by_density: -1.0,
                by_energy: 0.0,
            };
        }
        Balance {
            residual,
            by_density: -1.0 - self.exponent / density * by_energy * energy,
            by_energy,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_match_differences() {
        let (d, e, h) = (1.4, 0.02, 1e-6);
        for exponent in [3.0, 3.5] {
            derivatives_of_growth(exponent, d, e, h);
        }
        for exponent in [2.0, 2.5] {
            let w = Weight {
                reference: 1.2,
                exponent,
            };
            let by = (w.at(d + h).0 - w.at(d - h).0) / (2.0 * h);
            assert!((w.at(d).1 - by).abs() < 1e-9);
        }
    }

    fn derivatives_of_growth(exponent: f64, d: f64, e: f64, h: f64) {
        let growth = Growth {
            reference: 1.2,
            rate: 3.0,
            stimulus: 0.01,
            exponent,
            floor: 0.1,
        };
        let at = |d: f64, e: f64| growth.balance(d, 1.0, e, 0.3);
        let by_density = (at(d + h, e).residual - at(d - h, e).residual) / (2.0 * h);
        let by_energy = (at(d, e + h).residual - at(d, e - h).residual) / (2.0 * h);
        assert!((at(d, e).by_density - by_density).abs() < 1e-9);
        assert!((at(d, e).by_energy - by_energy).abs() < 1e-8);
        let power = (d / 1.2f64).powf(-exponent);
        assert!((at(d, e).by_energy - 3.0 * 0.3 * power).abs() < 1e-12);
    }
}
