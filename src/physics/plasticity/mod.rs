//! Owns plastic flow at a point: small strains, isotropic elasticity, associated flow, linear isotropic hardening. From a strain and
//! the state at the start of a step follow stress, state and tangent at its end, in closed form (radial return; Simo & Hughes 1998,
//! §3.3). The tangent is that of the update, so it is symmetric.
//!
//! Stresses in MPa. Tensors have the components 11, 22, 33, 23, 13, 12; shears of strains are engineering shears.

mod drucker_prager;
mod setting;
mod von_mises;

pub use drucker_prager::DruckerPrager;
pub use setting::{LabelLaw, Plasticity};
pub use von_mises::VonMises;

use serde::{Deserialize, Serialize};

/// Six components of a symmetric tensor.
pub type Tensor = [f64; 6];

/// Isotropic elasticity, MPa.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Elastic {
    pub bulk_mpa: f64,
    pub shear_mpa: f64,
}

/// What a point remembers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Point {
    pub plastic_strain: Tensor,
    /// Sum of the plastic multipliers, which hardening grows with.
    pub hardening: f64,
}

/// A law of yield and flow.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum YieldLaw {
    /// Equal yield in tension and compression.
    VonMises(VonMises),
    /// Unlike yield in tension and compression.
    Asymmetric(DruckerPrager),
}

/// The elastic stress of a strain, were there no flow in the step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trial {
    pub deviator: Tensor,
    /// Mean of the normal stresses.
    pub pressure: f64,
    /// `√(3/2 s:s)`.
    pub equivalent: f64,
}

/// Flow from a trial stress back to the yield surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flow {
    /// What the trial's deviator is multiplied by.
    pub deviator: f64,
    pub pressure: f64,
    pub multiplier: f64,
    pub softening: Softening,
}

/// How much softer than the elastic stiffness `C` the tangent is, `C − deviatoric P + nn n⊗n + ni (n⊗1 + 1⊗n) + ii 1⊗1`: `P` takes
/// the deviator of a strain, `n` is the unit direction of the trial's deviator.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Softening {
    pub deviatoric: f64,
    pub n: Tensor,
    pub nn: f64,
    pub ni: f64,
    pub ii: f64,
}

/// A point at the end of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Response {
    pub stress: Tensor,
    pub after: Point,
    /// None where nothing flowed.
    pub softening: Option<Softening>,
}

impl Elastic {
    pub fn of(young_mpa: f64, poisson: f64) -> Self {
        Elastic {
            bulk_mpa: young_mpa / (3.0 * (1.0 - 2.0 * poisson)),
            shear_mpa: young_mpa / (2.0 * (1.0 + poisson)),
        }
    }

    /// Stress of an elastic strain.
    pub fn stress(&self, strain: &Tensor) -> Tensor {
        let volume = strain[0] + strain[1] + strain[2];
        let lambda = (self.bulk_mpa - 2.0 / 3.0 * self.shear_mpa) * volume;
        std::array::from_fn(|i| match i {
            0..3 => lambda + 2.0 * self.shear_mpa * strain[i],
            _ => self.shear_mpa * strain[i],
        })
    }
}

impl Trial {
    fn of(stress: &Tensor) -> Trial {
        let pressure = (stress[0] + stress[1] + stress[2]) / 3.0;
        let deviator: Tensor = std::array::from_fn(|i| match i {
            0..3 => stress[i] - pressure,
            _ => stress[i],
        });
        let [xx, yy, zz, yz, xz, xy] = deviator.map(|v| v * v);
        Trial {
            deviator,
            pressure,
            equivalent: (1.5 * (xx + yy + zz) + 3.0 * (yz + xz + xy)).sqrt(),
        }
    }

    /// The deviator over its norm.
    fn direction(&self) -> Tensor {
        let norm = (2.0f64 / 3.0).sqrt() * self.equivalent;
        self.deviator.map(|s| s / norm)
    }
}

impl YieldLaw {
    /// What is refused as no law, in words.
    pub fn wrong(&self) -> Option<&'static str> {
        match self {
            YieldLaw::VonMises(law) => law.wrong(),
            YieldLaw::Asymmetric(law) => law.wrong(),
        }
    }

    fn flow(&self, elastic: &Elastic, trial: &Trial, hardening: f64) -> Option<Flow> {
        match self {
            YieldLaw::VonMises(law) => law.flow(elastic, trial, hardening),
            YieldLaw::Asymmetric(law) => law.flow(elastic, trial, hardening),
        }
    }

    /// Stress, state and tangent of a strain, from the state at the start of the step.
    pub fn respond(&self, elastic: &Elastic, strain: &Tensor, before: &Point) -> Response {
        let stored: Tensor = std::array::from_fn(|i| strain[i] - before.plastic_strain[i]);
        let stress = elastic.stress(&stored);
        let trial = Trial::of(&stress);
        let Some(flow) = self.flow(elastic, &trial, before.hardening) else {
            return Response {
                stress,
                after: *before,
                softening: None,
            };
        };
        let sheared = (1.0 - flow.deviator) / (2.0 * elastic.shear_mpa);
        let swollen = (trial.pressure - flow.pressure) / (3.0 * elastic.bulk_mpa);
        Response {
            stress: std::array::from_fn(|i| match i {
                0..3 => flow.deviator * trial.deviator[i] + flow.pressure,
                _ => flow.deviator * trial.deviator[i],
            }),
            after: Point {
                plastic_strain: std::array::from_fn(|i| {
                    let flowed = match i {
                        0..3 => sheared * trial.deviator[i] + swollen,
                        _ => 2.0 * sheared * trial.deviator[i],
                    };
                    before.plastic_strain[i] + flowed
                }),
                hardening: before.hardening + flow.multiplier,
            },
            softening: Some(flow.softening),
        }
    }

    /// Whether an elastic strain passes the yield surface of a point that has never flowed: what the cheap look at elements asks.
    pub fn yields(&self, elastic: &Elastic, strain: &Tensor) -> bool {
        self.excess_at_first(&Trial::of(&elastic.stress(strain))) > 0.0
    }

    /// The share of an elastic strain at which a point that has never flowed begins to; infinite where none does. Both yield functions
    /// are in proportion to the stress, but for a constant.
    pub fn share_that_yields(&self, elastic: &Elastic, strain: &Tensor) -> f64 {
        let resists = -self.excess_at_first(&Trial::of(&[0.0; 6]));
        let driven = resists + self.excess_at_first(&Trial::of(&elastic.stress(strain)));
        match driven > 0.0 {
            true => resists / driven,
            false => f64::INFINITY,
        }
    }

    /// The yield function of a point that has never flowed, MPa; above 0 it flows.
    fn excess_at_first(&self, trial: &Trial) -> f64 {
        match self {
            YieldLaw::VonMises(law) => law.excess(trial, 0.0),
            YieldLaw::Asymmetric(law) => law.excess(trial, 0.0),
        }
    }
}

impl Softening {
    /// The tangent, row by row: change of stress per change of strain (engineering shears).
    pub fn tangent(&self, elastic: &Elastic) -> [Tensor; 6] {
        let unit = |i: usize| if i < 3 { 1.0 } else { 0.0 };
        let mut tangent = [[0.0; 6]; 6];
        for (i, row) in tangent.iter_mut().enumerate() {
            for (j, entry) in row.iter_mut().enumerate() {
                let own = if i == j { [1.0, 0.5][i / 3] } else { 0.0 };
                let deviator = own - unit(i) * unit(j) / 3.0;
                *entry = (2.0 * elastic.shear_mpa - self.deviatoric) * deviator
                    + (elastic.bulk_mpa + self.ii) * unit(i) * unit(j)
                    + self.nn * self.n[i] * self.n[j]
                    + self.ni * (self.n[i] * unit(j) + unit(i) * self.n[j]);
            }
        }
        tangent
    }
}
