//! Owns the law by which elastic bonds follow their direction: that of the tensor (eqs. 48, 49), or cosⁿ of an orthotropic one.

use super::cosine::{CosineLaw, even, full_cosine};
use super::micromoduli::{self, Micromoduli, Negative};
use super::small::solve_dense;
use super::tensor::PlaneTensor;
use crate::error::{Error, Result};

/// Axial and shear micromoduli by direction (N/mm⁶ per mm of thickness).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ElasticLaw {
    /// The angular form of the elasticity tensor itself.
    Tensor(Micromoduli),
    /// k_n and k_t each as `a₂ + (a₁ - a₂) cosⁿ(ψ - ζ)`, the form of eq. 93 (end of Sect. 3).
    Cosine { axial: CosineLaw, shear: CosineLaw },
}

/// Share of the largest entry below which C1112 and C2212 count as zero: rounding of a turned tensor.
const ORTHOTROPIC: f64 = 1e-9;

impl ElasticLaw {
    /// The cosⁿ law that stores the energy of `tensor`, orthotropic in axes at `zeta` (radians), for an influence function of one:
    /// four values for its four moduli by W = (δ³/12) ∫ (k_n s² + k_t γ²) dψ (eqs. 51, 54).
    ///
    /// # Errors
    /// An odd exponent, a tensor that is not orthotropic in these axes, and n = 2, for which the four moduli are not independent.
    pub fn cosine(tensor: &PlaneTensor, horizon_mm: f64, exponent: u32, zeta: f64) -> Result<Self> {
        even(exponent)?;
        let [[c11, c12, c16], [_, c22, c26], [_, _, c66]] = *tensor.turned(-zeta).c();
        if c16.abs().max(c26.abs()) > ORTHOTROPIC * c11.max(c22) {
            return Err(Error::setting(
                "elasticity.exponent",
                format!(
                    "C1112 = {c16} and C2212 = {c26} MPa in the material's axes: the law is of orthotropic bodies"
                ),
                "give moduli with C1112 = C2212 = 0, or leave the exponent out",
            ));
        }
        // Moments of cosⁿ and of 1 with cos⁴, sin⁴, cos² sin² and ¼ cos² 2ψ = ¼ - cos² sin².
        let moments = |n: u32| {
            let [zero, two, four] = [0, 2, 4].map(|k| full_cosine(n + k));
            let both = two - four;
            [four, zero - 2.0 * two + four, both, 0.25 * zero - both]
        };
        let (raised, flat) = (moments(exponent), moments(0));
        let row = |axial: [f64; 2], shear: [f64; 2]| {
            [axial[0], axial[1] - axial[0], shear[0], shear[1] - shear[0]]
        };
        let of = |k: usize| [raised[k], flat[k]];
        let negative = of(2).map(|v| -v);
        // Unknowns: values of k_n along the first axis and along the second, of k_t the same.
        let a = [
            row(of(0), of(2)),
            row(of(1), of(2)),
            row(of(2), negative),
            row(of(2), of(3)),
        ];
        let scale = 6.0 / horizon_mm.powi(3);
        let k = solve_dense(a, [c11, c22, c12, c66].map(|c| scale * c)).ok_or_else(|| {
            Error::setting(
                "elasticity.exponent",
                format!(
                    "n = {exponent}: the four moduli are not independent of each other in this law"
                ),
                "give an even exponent from 4 on",
            )
        })?;
        let law = |first: f64, second: f64| CosineLaw {
            first,
            second,
            exponent,
            frequency: 1,
            zeta,
        };
        Ok(ElasticLaw::Cosine {
            axial: law(k[0], k[1]),
            shear: law(k[2], k[3]),
        })
    }

    /// All micromoduli times `by`.
    pub fn scaled(self, by: f64) -> Self {
        let cosine = |law: CosineLaw| CosineLaw {
            first: by * law.first,
            second: by * law.second,
            ..law
        };
        match self {
            ElasticLaw::Tensor(k) => ElasticLaw::Tensor(k.scaled(by)),
            ElasticLaw::Cosine { axial, shear } => ElasticLaw::Cosine {
                axial: cosine(axial),
                shear: cosine(shear),
            },
        }
    }

    /// Axial micromodulus of bonds along `psi`.
    pub fn axial(&self, psi: f64) -> f64 {
        match self {
            ElasticLaw::Tensor(k) => k.axial(psi),
            ElasticLaw::Cosine { axial, .. } => axial.at(psi),
        }
    }

    /// Shear micromodulus of bonds along `psi`.
    pub fn shear(&self, psi: f64) -> f64 {
        match self {
            ElasticLaw::Tensor(k) => k.shear(psi),
            ElasticLaw::Cosine { shear, .. } => shear.at(psi),
        }
    }

    /// Whether k_t vanishes in every direction: the model then has no rotations.
    pub fn is_central(&self) -> bool {
        micromoduli::is_central(|psi| self.axial(psi), |psi| self.shear(psi))
    }

    /// The micromoduli that are negative in some direction, if any.
    pub fn negative(&self) -> Vec<Negative> {
        micromoduli::negative(|psi| self.axial(psi), |psi| self.shear(psi))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// Twice the energy of a strain (ε11, ε22, 2 ε12) by the integral over all directions, horizon 1.
    fn stored(law: &ElasticLaw, e: [f64; 3]) -> f64 {
        let n = 512;
        let at = |i: i32| {
            let psi = 2.0 * PI * f64::from(i) / f64::from(n);
            let (s, c) = psi.sin_cos();
            let stretch = e[0] * c * c + e[1] * s * s + e[2] * s * c;
            let shear = 0.5 * e[2] * (c * c - s * s) + (e[1] - e[0]) * s * c;
            law.axial(psi) * stretch * stretch + law.shear(psi) * shear * shear
        };
        (0..n).map(at).sum::<f64>() * 2.0 * PI / f64::from(n) / 6.0
    }

    /// Bovine bone (eq. 108), turned: every strain stores what the tensor does, for any even exponent.
    #[test]
    fn the_cosine_law_stores_the_energy_of_the_tensor() {
        let bone =
            PlaneTensor::from_moduli([25_000.0, 16_250.0, 5_890.0, 6_650.0, 0.0, 0.0]).unwrap();
        for (n, zeta) in [(4, 0.0), (8, 0.4), (16, 1.1)] {
            let tensor = bone.turned(zeta);
            let law = ElasticLaw::cosine(&tensor, 1.0, n, zeta).unwrap();
            for e in [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.3, -0.7, 0.4]] {
                let exact = 2.0 * tensor.energy_density(e);
                let found = stored(&law, e);
                assert!(
                    (found / exact - 1.0).abs() < 1e-12,
                    "n = {n}: {found} {exact}"
                );
            }
        }
    }

    /// Isotropy leaves nothing to the exponent: k_n and k_t of eqs. 71, 72 in every direction.
    #[test]
    fn an_isotropic_body_has_constant_micromoduli() {
        let c = PlaneTensor::isotropic(
            4000.0,
            0.2,
            crate::physics::continuum_molecular::tensor::Plane::Stress,
        )
        .unwrap();
        let tensor = Micromoduli::new(&c, 2.0);
        let law = ElasticLaw::cosine(&c, 2.0, 8, 0.3).unwrap();
        for psi in [0.0, 0.5, 1.3] {
            assert!((law.axial(psi) / tensor.axial(psi) - 1.0).abs() < 1e-12);
            assert!((law.shear(psi) / tensor.shear(psi) - 1.0).abs() < 1e-11);
        }
    }

    #[test]
    fn other_bodies_and_exponents_are_refused() {
        let skew = PlaneTensor::from_moduli([1.0, 0.8, 0.2, 0.3, 0.1, 0.0]).unwrap();
        let words = |n, tensor: &PlaneTensor| {
            ElasticLaw::cosine(tensor, 1.0, n, 0.0)
                .unwrap_err()
                .to_string()
        };
        assert!(words(4, &skew).contains("orthotropic"));
        let bone = PlaneTensor::from_moduli([25.0, 16.25, 5.89, 6.65, 0.0, 0.0]).unwrap();
        assert!(words(3, &bone).contains("even"));
    }
}
