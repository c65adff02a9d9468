//! Owns what all solutions of a continuum-molecular scene start from: points, families, bodies, what is held.

mod directions;

use super::{Conduction, Elasticity, KnownField, Molecular};
use crate::discretisation::plane::Points;
use crate::discretisation::plane::family::Family;
use crate::error::{Error, Result};
use crate::physics::continuum_molecular::attenuation::Attenuation;
use crate::physics::continuum_molecular::body::Body;
use crate::physics::continuum_molecular::bond::{Bond, bonds};
use crate::physics::continuum_molecular::conductivity::calibration;
use crate::physics::continuum_molecular::crack_tip::CrackTip;
use crate::physics::continuum_molecular::elastic_law::ElasticLaw;
use crate::physics::continuum_molecular::micromoduli::Micromoduli;
use crate::physics::continuum_molecular::tensor::PlaneTensor;
use crate::scene::setting::{Inputs, Setting};

/// A conducting body, and the micro-conductivity of each bond of the stencil.
pub type Conductor = (Body<1>, Vec<f64>);

/// Points, their families without the bonds that cracks cut, and the bonds of a full family.
pub struct Setup {
    pub points: Points,
    pub family: Family,
    pub bonds: Vec<Bond>,
    /// Volume of a cell per unit thickness.
    pub cell: f64,
    attenuation: Attenuation,
    /// Volumes (in cells) of the families of points in boundary layers, where the body goes on beyond its points; only
    /// cracks cut them.
    layer: Vec<Option<f64>>,
}

#[cfg(test)]
thread_local! {
    /// How many set-ups this thread has built.
    pub static SETUPS: std::cell::Cell<usize> = const { std::cell::Cell::new(0) };
}

impl Setup {
    pub fn new(scene: &Setting, model: &Molecular, inputs: &Inputs) -> Result<Self> {
        #[cfg(test)]
        SETUPS.set(SETUPS.get() + 1);
        let points = scene.points(inputs)?;
        let stencil = scene.stencil()?;
        let all = bonds(&stencil);
        let cell = stencil.spacing * stencil.spacing;
        let mut family = Family::new(&points, points.len(), stencil);
        if !model.cracks.is_empty() {
            family.retain(|i, j| {
                let (a, b) = (points.position(i), points.position(j));
                !model.cracks.iter().any(|crack| crosses(crack, a, b))
            });
        }
        let mut layer = vec![None; points.len()];
        for (k, known) in model.known.iter().enumerate() {
            let key = format!("known[{k}].region");
            let chosen = known.region.select(&points, points.len(), &key)?;
            for p in chosen {
                let here = points.position(p);
                let bonds = family.stencil.bonds.iter();
                let cut = |xi: [f64; 2]| {
                    let there = [here[0] + xi[0], here[1] + xi[1]];
                    model.cracks.iter().any(|c| crosses(c, here, there))
                };
                let kept = bonds.filter(|b| !cut(b.xi)).map(|b| b.share);
                layer[p] = Some(kept.sum());
            }
        }
        Ok(Setup {
            points,
            family,
            bonds: all,
            cell,
            attenuation: model.attenuation,
            layer,
        })
    }

    pub fn horizon(&self) -> f64 {
        self.family.stencil.horizon
    }

    /// Λ of a bond.
    pub fn attenuation(&self, bond: &Bond) -> f64 {
        self.attenuation.at(bond.length_mm / self.horizon())
    }

    /// What Λ leaves of the elastic energy at equal micromoduli.
    pub fn elastic_share(&self) -> f64 {
        self.attenuation.elastic_share()
    }

    /// Micromoduli by direction, without Λ.
    ///
    /// # Errors
    /// A stencil that cannot be calibrated, a tensor that the law of `exponent` cannot have.
    pub fn micromoduli(&self, elasticity: &Elasticity, tensor: &PlaneTensor) -> Result<ElasticLaw> {
        let law = match (elasticity.exponent, elasticity.calibrated) {
            (None, true) => {
                let attenuated = |b: &Bond| Bond {
                    volume_mm2: self.attenuation(b) * b.volume_mm2,
                    ..*b
                };
                let bonds: Vec<Bond> = self.bonds.iter().map(attenuated).collect();
                return Ok(ElasticLaw::Tensor(Micromoduli::calibrated(tensor, &bonds)?));
            }
            (None, false) => ElasticLaw::Tensor(Micromoduli::new(tensor, self.horizon())),
            (Some(_), true) => {
                return Err(Error::setting(
                    "elasticity.calibrated",
                    "true with elasticity.exponent: that law has four values for the six sums of a stencil",
                    "leave one of them out",
                ));
            }
            (Some(n), false) => {
                let zeta = elasticity.angle_deg.to_radians();
                ElasticLaw::cosine(tensor, self.horizon(), n, zeta)?
            }
        };
        Ok(law.scaled(self.attenuation.elastic_share().recip()))
    }

    /// Bonds of the body, each once.
    pub fn bond_count(&self) -> usize {
        self.family.len() / 2
    }

    /// With the surface correction, where asked for.
    pub fn finish<const D: usize>(&self, model: &Molecular, mut body: Body<D>) -> Body<D> {
        if model.correct_surfaces {
            body.correct_surfaces(|p| self.layer[p]);
        }
        body
    }

    /// The conducting body.
    pub fn conductor(&self, model: &Molecular, conduction: &Conduction) -> Result<Conductor> {
        let tensor = conduction.tensor()?;
        let law = tensor.microconductivity(self.horizon(), conduction.exponent)?;
        let share = self.attenuation.conducted_share();
        let at = |b: &Bond| self.attenuation(b) / share * law.at(b.psi());
        let mut k: Vec<f64> = self.bonds.iter().map(at).collect();
        if conduction.calibrated {
            let c = calibration(&self.bonds, &k, tensor.k())?;
            k.iter_mut()
                .zip(&self.bonds)
                .for_each(|(k, b)| *k *= b.second_harmonic(c));
        }
        let blocks = self
            .bonds
            .iter()
            .zip(&k)
            .map(|(b, k)| b.conductance(*k, self.cell))
            .collect();
        Ok((
            self.finish(model, Body::new(self.family.clone(), blocks)),
            k,
        ))
    }

    /// Values held by `hold` and `known`, at time `t`; `names` are the components.
    ///
    /// # Errors
    /// A component of a point that both hold.
    pub fn held<const D: usize>(
        &self,
        scene: &Setting,
        model: &Molecular,
        names: [&[&str]; D],
        t: f64,
        tensor: Option<&PlaneTensor>,
    ) -> Result<Vec<Option<f64>>> {
        let mut held = self.holds(scene, names, t)?;
        let known = self.known::<D>(model, tensor)?;
        for (v, (held, known)) in held.iter_mut().zip(known).enumerate() {
            if let (Some(_), Some((k, _))) = (*held, known) {
                let [x, y] = self.points.position(v / D);
                return Err(Error::setting(
                    format!("known[{k}].region"),
                    format!(
                        "[[hold]] and known both prescribe {} of the point at [{x}, {y}]",
                        names[v % D].join(" or ")
                    ),
                    "part their regions",
                ));
            }
            *held = held.or(known.map(|(_, value)| value));
        }
        Ok(held)
    }

    /// Values held by `hold` alone, at time `t`: the later one of the file holds. Components of other physics are no
    /// part of this body.
    pub fn holds<const D: usize>(
        &self,
        scene: &Setting,
        names: [&[&str]; D],
        t: f64,
    ) -> Result<Vec<Option<f64>>> {
        let mut held = vec![None; self.points.len() * D];
        for (k, hold) in scene.hold.iter().enumerate() {
            hold.value.check(&format!("hold[{k}].value"))?;
            let component = hold.component.as_str();
            let Some(d) = names.iter().position(|n| n.contains(&component)) else {
                continue;
            };
            let key = format!("hold[{k}].region");
            for p in hold.region.select(&self.points, self.points.len(), &key)? {
                held[p * D + d] = Some(hold.value.at(t));
            }
        }
        Ok(held)
    }

    /// The one field that all of `known` prescribe, at every point; None where there is none, or several.
    pub fn known_field<const D: usize>(
        &self,
        model: &Molecular,
        tensor: Option<&PlaneTensor>,
    ) -> Option<Vec<[f64; D]>> {
        let known = model.one_known()?;
        let turn = known.angle_deg.to_radians();
        let tip = tensor.map(|t| CrackTip::new(&t.turned(-turn)));
        let at = |p: usize| {
            let values = known_values(&known.field, self.points.position(p), turn, tip.as_ref());
            values.map(|v| v.unwrap_or(0.0))
        };
        Some((0..self.points.len()).map(at).collect())
    }

    /// Values held by `known`, each with the place in the list of what prescribes it: the last.
    fn known<const D: usize>(
        &self,
        model: &Molecular,
        tensor: Option<&PlaneTensor>,
    ) -> Result<Vec<Option<(usize, f64)>>> {
        let mut held = vec![None; self.points.len() * D];
        for (k, known) in model.known.iter().enumerate() {
            let turn = known.angle_deg.to_radians();
            let tip = tensor.map(|t| CrackTip::new(&t.turned(-turn)));
            let key = format!("known[{k}].region");
            for p in known.region.select(&self.points, self.points.len(), &key)? {
                let x = self.points.position(p);
                let values = known_values::<D>(&known.field, x, turn, tip.as_ref());
                for (d, value) in values.into_iter().enumerate() {
                    if let Some(value) = value {
                        held[p * D + d] = Some((k, value));
                    }
                }
            }
        }
        Ok(held)
    }
}

/// What a known field prescribes at `x`, by component; a crack tip's lies along `turn` (radians).
fn known_values<const D: usize>(
    field: &KnownField,
    x: [f64; 2],
    turn: f64,
    tip: Option<&CrackTip>,
) -> [Option<f64>; D] {
    let mut values = [None; D];
    let mut put = |given: &[f64]| {
        values
            .iter_mut()
            .zip(given)
            .for_each(|(v, g)| *v = Some(*g));
    };
    match (field, tip) {
        (KnownField::CrackTip(k), Some(tip)) if D > 1 => {
            let (s, c) = turn.sin_cos();
            let ahead = [c * x[0] + s * x[1], c * x[1] - s * x[0]];
            let [u, v] = tip.displacement(ahead, *k);
            put(&[c * u - s * v, s * u + c * v, tip.rotation(ahead, *k)]);
        }
        (KnownField::Strain([e11, e22, shear]), _) if D > 1 => {
            put(&[
                e11 * x[0] + 0.5 * shear * x[1],
                0.5 * shear * x[0] + e22 * x[1],
                0.0,
            ]);
        }
        (KnownField::Polynomial(terms), _) if D == 1 => {
            put(&[terms
                .iter()
                .map(|[a, b, c]| c * x[0].powf(*a) * x[1].powf(*b))
                .sum()]);
        }
        _ => {}
    }
    values
}

/// Whether the bond from `a` to `b` crosses the segment; through its very end it does not. A point on the segment belongs
/// to its left side. The same from either end, to the last bit.
fn crosses(segment: &[f64; 4], a: [f64; 2], b: [f64; 2]) -> bool {
    let [a, b] = if a <= b { [a, b] } else { [b, a] };
    // Shortened by a trifle, so that rounding does not decide on bonds through the ends.
    let at = |share: f64| [0, 1].map(|i| segment[i] + share * (segment[i + 2] - segment[i]));
    let (c, d) = (at(1e-9), at(1.0 - 1e-9));
    let side = |p: [f64; 2], q: [f64; 2], r: [f64; 2]| {
        (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
    };
    let left = |p: [f64; 2]| side(c, d, p) >= 0.0;
    side(a, b, c) * side(a, b, d) < 0.0 && left(a) != left(b)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points on a crack are cut off from one of its sides only; bonds next to it or through its end stay.
    #[test]
    fn a_crack_through_points_parts_its_two_sides() {
        let crack = [-2.0, -2.0, 1.0, 1.0];
        let cut = |a, b| crosses(&crack, a, b) && crosses(&crack, b, a);
        assert!(cut([0.0, 0.0], [1.0, 0.0]) && cut([0.0, 1.0], [1.0, 0.0]));
        assert!(!crosses(&crack, [0.0, 0.0], [0.0, 1.0]));
        assert!(!crosses(&crack, [-1.0, -1.0], [0.0, 0.0]));
        assert!(!crosses(&crack, [1.0, 2.0], [2.0, 1.0]));
        assert!(!crosses(&crack, [0.0, 2.0], [2.0, 0.0]));
    }

    /// Points that a crack passes by a rounding error: a bond is cut from both of its ends or from none.
    #[test]
    fn a_bond_is_cut_from_both_ends_or_from_none() {
        let position = |i: i32| -3.0 + (f64::from(i) + 0.5) * 0.3;
        let crack = [position(1), position(4), position(10), position(10)];
        for (i, j) in (0..20).flat_map(|i| (0..20).map(move |j| (i, j))) {
            for (u, v) in (-5..=5).flat_map(|u| (-5..=5).map(move |v| (u, v))) {
                let a = [position(i), position(j)];
                let b = [position(i + u), position(j + v)];
                assert_eq!(crosses(&crack, a, b), crosses(&crack, b, a), "{a:?} {b:?}");
            }
        }
    }
}
