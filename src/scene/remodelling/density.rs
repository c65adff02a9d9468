//! Owns density settings shared by the bond-based and the continuum model, and the numbers drawn from densities.

use crate::discretisation::plane::Points;
use crate::error::{Error, Result};
use crate::physics::growth::Growth;
use crate::scene::frame::{Field, Frame, Values};
use crate::scene::remodelling::body::Body;
use crate::scene::setting::{Inputs, Probe};
use serde::{Deserialize, Serialize};

/// Density at the start, and how stiffness follows it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DensityParams {
    /// ρ*: the density at which `young` holds.
    pub reference: f64,
    /// Uniform density at the start; by default the reference.
    pub initial: Option<f64>,
    /// Density from the grey values of the geometry's file instead.
    pub grey: Option<GreyParams>,
    /// `n` of `(ρ/ρ*)^n`.
    pub exponent: f64,
    /// Uniform noise on the initial density, relative, drawn with `noise_seed`.
    pub noise: f64,
    pub noise_seed: u64,
}

impl Default for DensityParams {
    fn default() -> Self {
        DensityParams {
            reference: 1.0,
            initial: None,
            grey: None,
            exponent: 2.0,
            noise: 0.0,
            noise_seed: 1,
        }
    }
}

/// A straight line from grey values to density: `empty` is no density, `full` is the reference density.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GreyParams {
    pub empty: f64,
    pub full: f64,
    /// Least relative density: cells of the mask are bone, however dark.
    #[serde(default = "least")]
    pub least: f64,
}

fn least() -> f64 {
    0.05
}

/// The mass source `c [(ρ/ρ*)^−m Ψ − Ψ*]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GrowthParams {
    pub rate: f64,
    /// Attractor stimulus Ψ*.
    pub stimulus: f64,
    /// `m`; must exceed the density exponent `n`.
    #[serde(default = "three")]
    pub exponent: f64,
    /// Least relative density: there, resorption stops. Absent: bone that nothing loads fades until the scene stops.
    #[serde(default)]
    pub least: Option<f64>,
}

fn three() -> f64 {
    3.0
}

impl GrowthParams {
    /// The mass source, refused where it has no stable equilibrium.
    pub fn checked(&self, density: &DensityParams) -> Result<Growth> {
        let (n, m) = (density.exponent, self.exponent);
        if n >= m || !m.is_finite() {
            return Err(Error::setting(
                "growth.exponent",
                format!("n = {n} is not below m = {m}"),
                "take m > n (the paper has n = 2, m = 3): with n >= m stiffening raises the stimulus faster than growth \
                 lowers it, so densities drift or run away instead of settling",
            ));
        }
        let positive = [
            ("growth.rate", self.rate),
            ("growth.stimulus", self.stimulus),
        ];
        for (key, value) in positive {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::setting(
                    key,
                    format!("found {value}"),
                    "give a positive number",
                ));
            }
        }
        if self.least.is_some_and(|l| !(1e-6..1.0).contains(&l)) {
            return Err(Error::setting(
                "growth.least",
                format!("found {:?}", self.least),
                "give a relative density from 1e-6 to below 1, or leave it out",
            ));
        }
        Ok(Growth {
            reference: density.reference,
            rate: self.rate,
            stimulus: self.stimulus,
            exponent: m,
            floor: self
                .least
                .map_or(f64::NEG_INFINITY, |l| l * density.reference),
        })
    }
}

impl DensityParams {
    /// Density of each material point at the start.
    pub fn initial(&self, points: &Points, inputs: &Inputs) -> Result<Vec<f64>> {
        self.check()?;
        let uniform = self.initial.unwrap_or(self.reference);
        let mut density = match &self.grey {
            None => vec![uniform; points.len()],
            Some(grey) => self.grey_densities(grey, points, inputs)?,
        };
        if self.noise > 0.0 {
            use rand::{Rng, SeedableRng};
            let mut random = rand_pcg::Pcg64::seed_from_u64(self.noise_seed);
            for rho in &mut density {
                let unit = random.next_u64() as f64 / u64::MAX as f64;
                *rho *= 1.0 + self.noise * (2.0 * unit - 1.0);
            }
        }
        Ok(density)
    }

    fn check(&self) -> Result<()> {
        let uniform = self.initial.unwrap_or(self.reference);
        let positive = [
            ("density.reference", self.reference),
            ("density.initial", uniform),
        ];
        for (key, value) in positive {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::setting(
                    key,
                    format!("found {value}"),
                    "a density must be positive",
                ));
            }
        }
        if !(0.0..1.0).contains(&self.noise) {
            return Err(Error::setting(
                "density.noise",
                format!("found {}", self.noise),
                "noise is relative, from 0 to below 1: a density must stay positive",
            ));
        }
        if !self.exponent.is_finite() {
            return Err(Error::setting(
                "density.exponent",
                format!("found {}", self.exponent),
                "give a finite number",
            ));
        }
        Ok(())
    }

    fn grey_densities(
        &self,
        grey: &GreyParams,
        points: &Points,
        inputs: &Inputs,
    ) -> Result<Vec<f64>> {
        let (Some(values), Some(bitmap)) = (&inputs.grey, &inputs.bitmap) else {
            return Err(Error::setting(
                "density.grey",
                "this geometry has no grey values",
                "take a slice of a scan (geometry.slice with grey), or an image",
            ));
        };
        let line = [grey.empty, grey.full, grey.least];
        if grey.full == grey.empty || grey.least <= 0.0 || line.iter().any(|v| !v.is_finite()) {
            return Err(Error::setting(
                "density.grey",
                format!(
                    "found empty = {}, full = {}, least = {}",
                    line[0], line[1], line[2]
                ),
                "give two different grey values, and a least density above 0",
            ));
        }
        let unknown = |p: &usize| {
            let [i, j] = points.cell(*p);
            !values[j as usize * bitmap.n[0] + i as usize].is_finite()
        };
        let unknown = (0..points.len()).filter(unknown).count();
        if unknown > 0 {
            return Err(Error::setting(
                "density.grey",
                format!("{unknown} cells of the geometry have no grey value (NaN or infinite)"),
                "take a slice without gaps, or leave them out of the mask",
            ));
        }
        let at = |p: usize| {
            let [i, j] = points.cell(p);
            let value = values[j as usize * bitmap.n[0] + i as usize];
            self.reference * ((value - grey.empty) / (grey.full - grey.empty)).max(grey.least)
        };
        Ok((0..points.len()).map(at).collect())
    }
}

/// A probe's name becomes part of column names.
fn check_name(probes: &[Probe], k: usize) -> Result<()> {
    let name = &probes[k].name;
    let plain = |c: char| c.is_alphanumeric() || "_- ".contains(c);
    let found = match probes[..k].iter().any(|p| p.name == *name) {
        true => format!("\"{name}\" is also the name of an earlier probe"),
        false if name.is_empty() || !name.chars().all(plain) => format!("found \"{name}\""),
        false => return Ok(()),
    };
    Err(Error::setting(
        format!("probe[{k}].name"),
        found,
        "give each probe a name of its own, of letters, digits, spaces, - and _",
    ))
}

/// The whole body and the probes' points.
pub struct Probes {
    regions: Vec<(String, Vec<usize>)>,
    /// Area each point stands for; only ratios matter.
    area: Vec<f64>,
}

impl Probes {
    /// `area` is each point's weight.
    pub fn new(probes: &[Probe], points: &Points, area: Vec<f64>) -> Result<Self> {
        let mut regions = vec![(String::new(), (0..points.len()).collect())];
        for (k, probe) in probes.iter().enumerate() {
            check_name(probes, k)?;
            let key = format!("probe[{k}].region");
            let chosen = probe.region.select(points, points.len(), &key)?;
            regions.push((format!("{}.", probe.name), chosen));
        }
        Ok(Probes { regions, area })
    }

    /// Mean, 5 % and 95 % quantiles, least and largest density change over each region, and each probe's mean
    /// displacement; with the fields themselves where they are due.
    pub fn frame(
        &self,
        t: f64,
        body: &Body,
        values: &[f64],
        change: Vec<f64>,
        with_fields: bool,
    ) -> Frame {
        let mut numbers = Vec::new();
        for (name, region) in &self.regions {
            let row = self.summary(region, &change);
            numbers.extend(row.map(|(what, v)| (format!("{name}{what}"), v)));
            if !name.is_empty() {
                let mean = |d: usize| {
                    let sum: f64 = region
                        .iter()
                        .map(|&p| body.displacement(values, p)[d])
                        .sum();
                    sum / region.len() as f64
                };
                numbers.push((format!("{name}ux"), mean(0)));
                numbers.push((format!("{name}uy"), mean(1)));
            }
        }
        let mut fields = Vec::new();
        if with_fields {
            let moved = (0..body.material).map(|p| body.displacement(values, p));
            let moved = Values::Vector(moved.collect());
            fields.push(Field {
                name: "density_change",
                values: Values::Scalar(change),
            });
            fields.push(Field {
                name: "displacement",
                values: moved,
            });
        }
        Frame {
            time: t,
            numbers,
            fields,
        }
    }

    fn summary(&self, region: &[usize], values: &[f64]) -> [(&'static str, f64); 5] {
        let area: f64 = region.iter().map(|&p| self.area[p]).sum();
        let mean = region
            .iter()
            .map(|&p| self.area[p] * values[p])
            .sum::<f64>()
            / area;
        let mut sorted: Vec<f64> = region.iter().map(|&p| values[p]).collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let at = |share: f64| sorted[((sorted.len() - 1) as f64 * share).round() as usize];
        [
            ("mean", mean),
            ("p05", at(0.05)),
            ("p95", at(0.95)),
            ("min", at(0.0)),
            ("max", at(1.0)),
        ]
    }
}
