//! Owns lattices with one site per connected component of bone in a cell as discretisations.

use crate::error::{Error, Result};
use crate::measure::apparent::EndWork;
use crate::operator::{Functional, MixedPrecision};
use crate::physics::lattice::connected::{ConnectedLattice, ConnectedSprings};
use crate::pipeline::apparent::discretisation::precondition::Precondition;
use crate::pipeline::apparent::discretisation::{
    Cost, Discretisation, Known, LoadSet, Prepared, System,
};
use crate::pipeline::apparent::ends::motion::EndMotion;
use crate::pipeline::apparent::fields::{Equilibrated, Recorded, SiteFields};
use crate::pipeline::apparent::lattice::mixed_tissue::Blend;
use crate::pipeline::apparent::lattice::stress::Stress;
use crate::pipeline::apparent::lattice::{Placed, cost, label, refuse_unit_strains};
use crate::pipeline::apparent::params::SolveParams;
use crate::pipeline::apparent::solved::Moduli;
use crate::pipeline::lattice::{Case, build_connected};
use crate::result::settings::Settings;
use crate::volume::Specimen;

/// A lattice of connected components between its grips.
pub struct ConnectedModel {
    lattice: ConnectedLattice,
    motion: EndMotion,
    params: SolveParams,
}

impl ConnectedModel {
    fn placed(&self) -> Placed<'_> {
        placed(&self.lattice)
    }

    fn stress(&self) -> Stress<'_, ConnectedLattice> {
        Stress {
            model: &self.lattice,
            counts: None,
        }
    }
}

fn placed(lattice: &ConnectedLattice) -> Placed<'_> {
    let sites = &lattice.sites;
    Placed {
        frame: &sites.frame,
        indices: &sites.indices,
        grips: sites.grips,
        dropped: sites.dropped,
    }
}

impl Discretisation for ConnectedModel {
    type Case = Case;

    fn label(case: &Case, _: &Specimen, _: &SolveParams, key: Settings) -> Settings {
        label(key, case)
    }

    fn cost(case: &Case, _: &SolveParams, known: Known) -> Result<Cost> {
        Ok(cost::of(case, known))
    }

    fn count(case: &Case, prepared: Prepared, params: &SolveParams) -> Result<(f64, Option<Self>)> {
        let model = Self::build(case, prepared, params)?;
        let bytes = cost::of_components(&model.lattice.sites);
        Ok((bytes, Some(model)))
    }

    fn build(case: &Case, prepared: Prepared, params: &SolveParams) -> Result<Self> {
        refuse_unit_strains(params)?;
        let Prepared { specimen, tissue } = prepared;
        let blend = Blend::of(tissue, case)?;
        if blend.springs.is_some() {
            return Err(Error::setting(
                "solve.material",
                "connected (graded SC) lattices are of one tissue",
                "use firm and floppy lattices, or add --method voxel-fe",
            ));
        }
        if params.mechanisms {
            return Err(Error::setting(
                "mechanisms",
                "components of bone in one cell of a connected (graded SC) lattice share its place on the grid",
                "count mechanisms on firm and floppy lattices or with --method voxel-fe",
            ));
        }
        let sites = build_connected(specimen, case, params.axis, params.grip_mm)?;
        let lattice = ConnectedLattice::new(sites, blend.moduli);
        Ok(ConnectedModel {
            motion: placed(&lattice).motion(specimen, params),
            lattice,
            params: params.clone(),
        })
    }

    fn system(
        &self,
        _: LoadSet,
    ) -> System<'_, impl MixedPrecision, impl Precondition, impl Functional<3>> {
        self.placed().system(
            &self.lattice,
            ConnectedSprings(&self.lattice),
            None::<Stress<ConnectedLattice>>,
            (&self.params, self.motion),
            self.lattice.sites.bone_mm3(),
            None,
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
        let fraction = |s: usize| f64::from(sites.fractions[s]);
        let at = (&sites.frame, &sites.indices[..]);
        Ok(Recorded {
            sites: SiteFields::of(&params.fields, at, solved, energy, fraction),
            ..Recorded::default()
        })
    }
}
