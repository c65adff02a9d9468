//! Owns the lattice element: central springs in two shells and a volumetric term per shell.
//!
//! Source: Zojaji et al. 2024, eqs 2–7. The paper prints one volumetric sum over all neighbours (eq 5), with which its
//! own eq 7 is wrong; squaring the sum shell by shell (Chen & Liu 2016) makes eq 7 exact, and is what stands here:
//!
//! `U = Σ_i w_i [ ½ Σ_s k_s Σ_{j∈s} dl_ij² + ½ T Σ_s (Σ_{j∈s} dl_ij)² ]`, `dl_ij = ½ n_ij · (u_j − u_i)`,
//!
//! with `w_i = 1`, or the bone fraction of the site's cell on graded lattices.

use crate::error::{Error, Result};
use crate::operator::Operator;
use crate::par::{CHUNK, sum_chunks};
use crate::topology::sites::Sites;
use crate::topology::stencil::Structure;
use rayon::prelude::*;
use std::sync::Mutex;

/// Moduli of a lattice: springs of both shells and the volumetric one, all in N/mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moduli {
    pub k: [f64; 2],
    pub t: f64,
}

impl Moduli {
    /// Eq 7: the lattice whose fully bonded site stores the energy of the isotropic solid (E in MPa, ν) exactly.
    ///
    /// # Errors
    /// E or ν outside the solid's range, or ν below the lattice's: a site's energy stays non-negative only while
    /// `k_s + N_s T >= 0` on both shells (SC ν ≥ −½, BCC ν ≥ −⅝, FCC ν ≥ 0).
    pub fn new(structure: Structure, lp_mm: f64, young_mpa: f64, poisson: f64) -> Result<Self> {
        check_solid(young_mpa, poisson)?;
        let least = match structure {
            Structure::Sc => -0.5,
            Structure::Bcc => -0.625,
            Structure::Fcc => 0.0,
        };
        if poisson < least {
            return Err(Error::setting(
                "poisson",
                format!(
                    "a {} lattice is stable for ν >= {least}, found {poisson}: below it a site's energy can be negative",
                    structure.name().to_uppercase()
                ),
                "use sc or bcc for ν < 0, or the voxel-fe method",
            ));
        }
        let (nu, le) = (poisson, lp_mm * young_mpa);
        let shear = le / (1.0 + nu);
        let volumetric = if nu == 0.25 {
            0.0
        } else {
            le * (4.0 * nu - 1.0) / ((1.0 + nu) * (1.0 - 2.0 * nu))
        };
        Ok(match structure {
            Structure::Sc => Moduli {
                k: [shear, shear],
                t: volumetric / 18.0,
            },
            Structure::Bcc => Moduli {
                k: [1.5 * shear, shear],
                t: 3.0 * volumetric / 28.0,
            },
            Structure::Fcc => Moduli {
                k: [shear, 0.25 * shear],
                t: volumetric / 24.0,
            },
        })
    }
}

/// Refuses moduli no isotropic solid has.
pub fn check_solid(young_mpa: f64, poisson: f64) -> Result<()> {
    if !(young_mpa > 0.0 && young_mpa.is_finite()) {
        return Err(Error::setting(
            "young_mpa",
            format!("expected a positive modulus in MPa, found {young_mpa}"),
            "give the tissue's Young's modulus, such as 1000",
        ));
    }
    if !(poisson > -1.0 && poisson < 0.5) {
        return Err(Error::setting(
            "poisson",
            format!(
                "expected -1 < ν < 0.5, found {poisson}: at 0.5 the solid is incompressible and the moduli are infinite"
            ),
            "use a value such as 0.3, or 0.49 for nearly incompressible tissue",
        ));
    }
    Ok(())
}

/// One opposite pair of bonds: its direction in grid steps and the moduli scaled for it.
#[derive(Debug, Clone, Copy)]
struct Pair {
    d: [f64; 3],
    shell: usize,
    /// `k / (2 |d|²)`: a bond pulls by `spring · d (d · Δu)`.
    spring: f64,
    /// `1 / (2 |d|)`: a bond adds `half · d · Δu` to its site's volumetric sum.
    half: f64,
}

/// The linearised lattice as an operator: `K u` is the gradient of the energy. N and mm.
pub struct Lattice<'a> {
    sites: &'a Sites,
    moduli: Moduli,
    pairs: Vec<Pair>,
    /// `w_i T θ_{s,i}` of the last application; empty at ν = ¼, where no volumetric pass is made.
    volumetric: Mutex<Vec<[f64; 2]>>,
}

impl<'a> Lattice<'a> {
    pub fn new(sites: &'a Sites, moduli: Moduli) -> Self {
        let stencil = sites.frame.structure.stencil();
        let pair = |(p, d): (usize, &[i32; 3])| {
            let d = d.map(f64::from);
            let squared: f64 = d.iter().map(|c| c * c).sum();
            let shell = usize::from(p >= stencil.first_shell_pairs);
            Pair {
                d,
                shell,
                spring: 0.5 * moduli.k[shell] / squared,
                half: 0.5 / squared.sqrt(),
            }
        };
        let pairs = stencil.pairs.iter().enumerate().map(pair).collect();
        let scratch = if moduli.t == 0.0 { 0 } else { sites.len() };
        Lattice {
            sites,
            moduli,
            pairs,
            volumetric: Mutex::new(vec![[0.0; 2]; scratch]),
        }
    }

    fn weight(&self, site: usize) -> f64 {
        self.sites.weights.as_ref().map_or(1.0, |w| w[site])
    }

    /// Both neighbours along pair `p`; a missing one is the site itself.
    fn ends(&self, site: usize, p: usize) -> (usize, usize) {
        let row = site * 2 * self.pairs.len() + 2 * p;
        (
            self.sites.neighbours[row] as usize,
            self.sites.neighbours[row + 1] as usize,
        )
    }

    /// Volumetric sums `θ_s = Σ_{j∈s} dl_ij` of one site.
    fn volumetric_sums(&self, u: &[[f64; 3]], site: usize) -> [f64; 2] {
        let mut theta = [0.0; 2];
        for (p, pair) in self.pairs.iter().enumerate() {
            let (plus, minus) = self.ends(site, p);
            theta[pair.shell] += pair.half * along(pair.d, u[plus], u[minus]);
        }
        theta
    }

    /// `Σ_j ½ k n (n · (u_i − u_j))`: the springs' part of `K u` at one site.
    fn spring_force(&self, u: &[[f64; 3]], site: usize) -> [f64; 3] {
        let (here, mut f) = (u[site], [0.0; 3]);
        match &self.sites.weights {
            None => {
                for (p, pair) in self.pairs.iter().enumerate() {
                    let (plus, minus) = self.ends(site, p);
                    let (a, b) = (u[plus], u[minus]);
                    let stretch = pair.d[0] * (a[0] + b[0] - 2.0 * here[0])
                        + pair.d[1] * (a[1] + b[1] - 2.0 * here[1])
                        + pair.d[2] * (a[2] + b[2] - 2.0 * here[2]);
                    pull(&mut f, pair.d, -pair.spring * stretch);
                }
            }
            Some(w) => {
                for (p, pair) in self.pairs.iter().enumerate() {
                    let (plus, minus) = self.ends(site, p);
                    let stretch = 0.5 * (w[site] + w[plus]) * along(pair.d, u[plus], here)
                        + 0.5 * (w[site] + w[minus]) * along(pair.d, u[minus], here);
                    pull(&mut f, pair.d, -pair.spring * stretch);
                }
            }
        }
        f
    }

    /// `−Σ_j ½ n (T θ_i + T θ_j)` over existing bonds.
    fn volumetric_force(&self, t: &[[f64; 2]], site: usize, f: &mut [f64; 3]) {
        let here = t[site];
        for (p, pair) in self.pairs.iter().enumerate() {
            let (plus, minus) = self.ends(site, p);
            let s = pair.shell;
            let ahead = if plus == site {
                0.0
            } else {
                here[s] + t[plus][s]
            };
            let behind = if minus == site {
                0.0
            } else {
                here[s] + t[minus][s]
            };
            pull(f, pair.d, -pair.half * (ahead - behind));
        }
    }

    /// Elastic energy in N mm.
    pub fn energy(&self, u: &[[f64; 3]]) -> f64 {
        sum_chunks(self.sites.len(), |range| {
            range.map(|s| self.site_energy(u, s)).sum()
        })
    }

    /// Energy of one site in N mm, by the formula of the module's head.
    pub fn site_energy(&self, u: &[[f64; 3]], site: usize) -> f64 {
        let mut springs = 0.0;
        for (p, pair) in self.pairs.iter().enumerate() {
            let (plus, minus) = self.ends(site, p);
            for end in [plus, minus] {
                let dl = pair.half * along(pair.d, u[end], u[site]);
                springs += self.moduli.k[pair.shell] * dl * dl;
            }
        }
        let [a, b] = self.volumetric_sums(u, site);
        self.weight(site) * 0.5 * (springs + self.moduli.t * (a * a + b * b))
    }

    /// `V_i σ_aa,i` in N mm along the load axis: the derivative of the site's energy by a strain along it. Of a bond,
    /// only the part between the innermost gripped planes counts.
    pub fn site_virial(&self, u: &[[f64; 3]], site: usize) -> f64 {
        let (axis, grips) = (self.sites.frame.axis.index(), self.sites.grips);
        let theta = if self.moduli.t == 0.0 {
            [0.0; 2]
        } else {
            self.volumetric_sums(u, site)
        };
        let plane = self.sites.plane(site);
        let mut sum = 0.0;
        for (p, pair) in self.pairs.iter().enumerate() {
            if pair.d[axis] == 0.0 {
                continue;
            }
            let (plus, minus) = self.ends(site, p);
            for (end, sign) in [(plus, 1.0), (minus, -1.0)] {
                if end == site {
                    continue;
                }
                let other = plane + (sign * pair.d[axis]) as i32;
                let inside = plane.max(other).min(grips.high) - plane.min(other).max(grips.low);
                if inside <= 0 {
                    continue;
                }
                let dl = sign * pair.half * along(pair.d, u[end], u[site]);
                let share = f64::from(inside) / pair.d[axis].abs();
                let lever = pair.half * pair.d[axis] * pair.d[axis] * self.sites.frame.step_mm;
                sum += share
                    * lever
                    * (self.moduli.k[pair.shell] * dl + self.moduli.t * theta[pair.shell]);
            }
        }
        self.weight(site) * sum
    }
}

/// `d · (a − b)`.
fn along(d: [f64; 3], a: [f64; 3], b: [f64; 3]) -> f64 {
    d[0] * (a[0] - b[0]) + d[1] * (a[1] - b[1]) + d[2] * (a[2] - b[2])
}

fn pull(f: &mut [f64; 3], d: [f64; 3], amount: f64) {
    for c in 0..3 {
        f[c] += amount * d[c];
    }
}

impl Operator<3> for Lattice<'_> {
    fn sites(&self) -> usize {
        self.sites.len()
    }

    fn apply(&self, x: &[[f64; 3]], y: &mut [[f64; 3]]) {
        if self.moduli.t == 0.0 {
            let springs = |(s, y): (usize, &mut [f64; 3])| *y = self.spring_force(x, s);
            y.par_iter_mut()
                .with_min_len(CHUNK / 4)
                .enumerate()
                .for_each(springs);
            return;
        }
        let mut scratch = self
            .volumetric
            .lock()
            .expect("no application panics while it holds the scratch");
        let t = self.moduli.t;
        scratch
            .par_iter_mut()
            .with_min_len(CHUNK / 4)
            .enumerate()
            .for_each(|(s, out)| {
                *out = self
                    .volumetric_sums(x, s)
                    .map(|theta| self.weight(s) * t * theta);
            });
        let scratch = &*scratch;
        y.par_iter_mut()
            .with_min_len(CHUNK / 4)
            .enumerate()
            .for_each(|(s, y)| {
                *y = self.spring_force(x, s);
                self.volumetric_force(scratch, s, y);
            });
    }

    fn diagonal(&self, d: &mut [[f64; 3]]) {
        d.par_iter_mut()
            .enumerate()
            .for_each(|(s, d)| *d = self.site_diagonal(s));
    }
}

impl Lattice<'_> {
    fn site_diagonal(&self, site: usize) -> [f64; 3] {
        let (t, w) = (self.moduli.t, self.weight(site));
        let (mut d, mut gradient) = ([0.0; 3], [[0.0; 3]; 2]);
        for (p, pair) in self.pairs.iter().enumerate() {
            let (plus, minus) = self.ends(site, p);
            for (end, sign) in [(plus, 1.0), (minus, -1.0)] {
                if end == site {
                    continue;
                }
                let spring = 0.5 * (w + self.weight(end)) * pair.spring;
                let volumetric = self.weight(end) * t * pair.half * pair.half;
                for c in 0..3 {
                    d[c] += (spring + volumetric) * pair.d[c] * pair.d[c];
                    gradient[pair.shell][c] += sign * pair.half * pair.d[c];
                }
            }
        }
        for c in 0..3 {
            d[c] += w * t * (gradient[0][c].powi(2) + gradient[1][c].powi(2));
        }
        d
    }
}
