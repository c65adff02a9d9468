//! Owns an elastic body: the moduli of its bonds and what is held of it.

use super::setup::Setup;
use super::{Bending, Elasticity, Molecular, Problem};
use crate::error::Result;
use crate::physics::continuum_molecular::body::Body;
use crate::physics::continuum_molecular::bond::{Bond, Deformation, Moduli};
use crate::physics::continuum_molecular::conductivity::{Conductivity, calibration};
use crate::physics::continuum_molecular::cosine::CosineLaw;
use crate::physics::continuum_molecular::elastic_law::ElasticLaw;
use crate::physics::continuum_molecular::tensor::PlaneTensor;
use crate::physics::continuum_molecular::thermal::ThermalStrain;
use crate::scene::setting::Setting;

/// An elastic body and what is held of it at time 1 or at the end.
pub struct Solid<const D: usize> {
    pub body: Body<D>,
    pub tensor: PlaneTensor,
    /// Of each bond of the stencil.
    pub moduli: Vec<Moduli>,
    pub held: Vec<Option<f64>>,
    pub thermal: Option<ThermalStrain>,
}

pub const DISPLACEMENT: [&[&str]; 3] = [&["x"], &["y"], &["rotation"]];

impl Elasticity {
    /// Whether points turn: without shear and bending micromoduli there is nothing to turn, and two unknowns per point.
    pub fn turns(&self, micro: &ElasticLaw) -> bool {
        !micro.is_central() || self.bending.is_some()
    }
}

impl<const D: usize> Solid<D> {
    pub fn new(
        scene: &Setting,
        model: &Molecular,
        elasticity: &Elasticity,
        tensor: &PlaneTensor,
        setup: &Setup,
    ) -> Result<Self> {
        let micro = setup.micromoduli(elasticity, tensor)?;
        let bending = match &elasticity.bending {
            Some(b) => bending_moduli(b, elasticity, setup)?,
            None => vec![0.0; setup.bonds.len()],
        };
        let law = |(b, bending): (&Bond, f64)| {
            let attenuation = setup.attenuation(b);
            Moduli {
                axial: attenuation * micro.axial(b.psi()),
                shear: match D {
                    2 => 0.0,
                    _ => attenuation * micro.shear(b.psi()),
                },
                bending,
            }
        };
        let moduli: Vec<Moduli> = setup.bonds.iter().zip(bending).map(law).collect();
        let blocks = setup
            .bonds
            .iter()
            .zip(&moduli)
            .map(|(b, k)| b.stiffness(k, setup.cell))
            .collect();
        let body = setup.finish(model, Body::new(setup.family.clone(), blocks));
        let names: [&[&str]; D] = std::array::from_fn(|d| DISPLACEMENT[d]);
        let t = scene.time.as_ref().map_or(1.0, |time| time.end);
        let held = setup.held(scene, model, names, t, Some(tensor))?;
        Ok(Solid {
            body,
            tensor: *tensor,
            moduli,
            held,
            thermal: match &model.problem {
                Problem::Static {
                    thermal: Some(thermal),
                    ..
                } => thermal.rise.map(|rise| ThermalStrain {
                    expansion: thermal.expansion,
                    rise: setup
                        .points
                        .positions()
                        .iter()
                        .map(|x| linear(rise, *x))
                        .collect(),
                }),
                _ => None,
            },
        })
    }

    /// What bond `b` from `p` to `q` carries: its deformation less the thermal one, s - αT (eq. 176).
    pub fn strained(&self, x: &[[f64; D]], p: usize, q: usize, b: &Bond) -> Deformation {
        let mut d = b.deformation(&x[p], &x[q]);
        if let Some(thermal) = &self.thermal {
            let [stretch, shear] = thermal.of(p, q, b);
            (d.stretch, d.shear) = (d.stretch - stretch, d.shear - shear);
        }
        d
    }
}

/// A temperature rise `[T0, dT/dx, dT/dy]` at `x`.
fn linear(rise: [f64; 3], x: [f64; 2]) -> f64 {
    rise[0] + rise[1] * x[0] + rise[2] * x[1]
}

/// k_b of each bond: E = (δ³/6) ∫ k_b n nᵀ dψ, of which eqs. 180, 181 are the case n = 2; calibrated,
/// E = ½ Σ L k_b n nᵀ α Δv for the stencil.
pub fn bending_moduli(
    bending: &Bending,
    elasticity: &Elasticity,
    setup: &Setup,
) -> Result<Vec<f64>> {
    let Bending {
        first,
        second,
        exponent,
    } = *bending;
    let zeta = elasticity.angle_deg.to_radians();
    let scale = 6.0 / setup.horizon().powi(3);
    let law = CosineLaw::of_second_moment(scale * first, scale * second, exponent, zeta)?;
    let share = setup.elastic_share();
    let at = |b: &Bond| setup.attenuation(b) / share * law.at(b.psi());
    let mut k: Vec<f64> = setup.bonds.iter().map(at).collect();
    if elasticity.calibrated {
        let conducted: Vec<f64> = k
            .iter()
            .zip(&setup.bonds)
            .map(|(k, b)| k * b.length_mm)
            .collect();
        let wanted = Conductivity::principal(first, second, zeta)?;
        let c = calibration(&setup.bonds, &conducted, wanted.k())?;
        k.iter_mut()
            .zip(&setup.bonds)
            .for_each(|(k, b)| *k *= b.second_harmonic(c));
    }
    Ok(k)
}
