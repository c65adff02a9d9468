//! Owns lattices with one site per cell as discretisations: firm, floppy, weighted by bone fraction.

use crate::error::Result;
use crate::measure::apparent::EndWork;
use crate::operator::{Functional, MixedPrecision};
use crate::physics::lattice::Lattice;
use crate::pipeline::apparent::discretisation::precondition::Precondition;
use crate::pipeline::apparent::discretisation::{
    Cost, Discretisation, Known, LoadSet, Places, Prepared, System,
};
use crate::pipeline::apparent::ends::motion::EndMotion;
use crate::pipeline::apparent::fields::{Equilibrated, Recorded, SiteFields};
use crate::pipeline::apparent::lattice::mixed_tissue::Blend;
use crate::pipeline::apparent::lattice::stress::Stress;
use crate::pipeline::apparent::lattice::thin::ThinOrPlump;
use crate::pipeline::apparent::lattice::{Placed, cost, label, refuse_unit_strains};
use crate::pipeline::apparent::params::SolveParams;
use crate::pipeline::apparent::solved::Moduli;
use crate::pipeline::lattice::{Boundary, Case, build_of, site_values};
use crate::result::settings::Settings;
use crate::volume::Specimen;
use rayon::prelude::*;

/// A lattice between its grips.
pub struct SiteModel {
    lattice: Lattice,
    /// Firm: the fully coordinated sites, whose stress is the headline.
    whole: Option<Vec<bool>>,
    /// How many bonds away a displacement is felt.
    bonds: i32,
    motion: EndMotion,
    params: SolveParams,
}

impl SiteModel {
    fn placed(&self) -> Placed<'_> {
        placed(&self.lattice)
    }

    fn stress(&self) -> Stress<'_, Lattice> {
        Stress {
            model: &self.lattice,
            counts: self.whole.as_deref(),
        }
    }
}

fn placed(lattice: &Lattice) -> Placed<'_> {
    let sites = &lattice.sites;
    Placed {
        frame: &sites.frame,
        indices: &sites.indices,
        grips: sites.grips,
        dropped: sites.dropped,
    }
}

impl Discretisation for SiteModel {
    type Case = Case;

    fn label(case: &Case, _: &Specimen, _: &SolveParams, key: Settings) -> Settings {
        label(key, case)
    }

    fn cost(case: &Case, _: &SolveParams, known: Known) -> Result<Cost> {
        Ok(cost::of(case, known))
    }

    fn count(case: &Case, prepared: Prepared, params: &SolveParams) -> Result<(f64, Option<Self>)> {
        let model = Self::build(case, prepared, params)?;
        let bytes = cost::of_sites(&model.lattice.sites, prepared.tissue);
        Ok((bytes, Some(model)))
    }

    fn build(case: &Case, prepared: Prepared, params: &SolveParams) -> Result<Self> {
        refuse_unit_strains(params)?;
        let Prepared { specimen, tissue } = prepared;
        let Blend {
            moduli,
            springs,
            volumetric,
        } = Blend::of(tissue, case)?;
        let sites = build_of(
            specimen,
            springs.as_deref(),
            case,
            params.axis,
            params.grip_mm,
        )?;
        let whole = (case.boundary == Boundary::Firm).then(|| {
            let all = (0..sites.len()).into_par_iter();
            all.map(|s| sites.fully_coordinated(s)).collect()
        });
        let lattice = match volumetric {
            None => Lattice::new(sites, moduli),
            Some(tissue) => {
                let by_site = site_values(specimen, &tissue, case, &sites);
                let volumetric = by_site.into_iter().map(|v| v * moduli.t).collect();
                Lattice::with_volumetric(sites, moduli, volumetric)
            }
        };
        let motion = placed(&lattice).motion(specimen, params);
        Ok(SiteModel {
            lattice,
            whole,
            // Volumetric sums couple the ends of two bonds.
            bonds: if moduli.t == 0.0 { 1 } else { 2 },
            motion,
            params: params.clone(),
        })
    }

    fn system(
        &self,
        _: LoadSet,
    ) -> System<'_, impl MixedPrecision, impl Precondition, impl Functional<3>> {
        let (placed, params) = (self.placed(), &self.params);
        let places = params.mechanisms.then(|| Places {
            at: placed.indices.to_vec(),
            // A bond spans up to two grid steps along an axis (SC: one).
            reach: self.bonds * placed.frame.structure.steps_per_lp() as i32,
        });
        // The stress is off to first order where the energy is off to second.
        let goal = self.whole.is_some().then(|| self.stress());
        placed.system(
            &self.lattice,
            ThinOrPlump::new(&self.lattice),
            goal,
            (params, self.motion),
            self.lattice.sites.volume_mm3(),
            places,
        )
    }

    fn assess(&self, solved: &Equilibrated) -> Moduli {
        self.placed()
            .assess(&self.stress(), &self.motion.loaded, solved)
    }

    fn fields(
        &self,
        _: Prepared,
        params: &SolveParams,
        solved: &Equilibrated,
        _: &EndWork,
    ) -> Result<Recorded> {
        let sites = &self.lattice.sites;
        let energy = |s| self.lattice.site_energy(solved.u, s);
        let fraction = |s: usize| sites.weights.as_ref().map_or(1.0, |weights| weights[s]);
        let at = (&sites.frame, &sites.indices[..]);
        Ok(Recorded {
            sites: SiteFields::of(&params.fields, at, solved, energy, fraction),
            ..Recorded::default()
        })
    }
}
