//! Owns lattices with one site per connected component of bone in a cell as discretisations.

use crate::error::{Error, Result};
use crate::measure::apparent::Loaded;
use crate::operator::{Functional, MixedPrecision};
use crate::physics::lattice::connected::{ConnectedLattice, ConnectedSprings};
use crate::pipeline::apparent::discretisation::{
    Cost, Discretisation, Known, LoadSet, Prepared, System,
};
use crate::pipeline::apparent::fields::{Recorded, SiteFields};
use crate::pipeline::apparent::lattice::mixed_tissue::Blend;
use crate::pipeline::apparent::lattice::stress::Stress;
use crate::pipeline::apparent::lattice::{Placed, cost, label, refuse_unit_strains};
use crate::pipeline::apparent::params::SolveParams;
use crate::pipeline::apparent::precondition::Precondition;
use crate::pipeline::apparent::solved::Moduli;
use crate::pipeline::lattice::{Case, build_connected};
use crate::result::settings::Settings;
use crate::solver::cg::CgInfo;
use crate::volume::Specimen;

/// A lattice of connected components between its grips.
pub struct ConnectedModel {
    lattice: ConnectedLattice,
    loaded: Loaded,
    params: SolveParams,
}

impl ConnectedModel {
    fn placed(&self) -> Placed<'_> {
        let sites = &self.lattice.sites;
        Placed {
            frame: &sites.frame,
            indices: &sites.indices,
            grips: sites.grips,
            dropped: sites.dropped,
        }
    }

    fn stress(&self) -> Stress<'_, ConnectedLattice> {
        Stress {
            model: &self.lattice,
            counts: None,
        }
    }
}

impl Discretisation for ConnectedModel {
    type Case = Case;

    fn label(case: &Case, _: &Specimen, _: &SolveParams, key: Settings) -> Settings {
        label(key, case)
    }

    fn cost(case: &Case, params: &SolveParams, known: Known) -> Result<Cost> {
        cost::of(case, known, |prepared| {
            cost::of_components(case, prepared, params)
        })
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
        let mut model = ConnectedModel {
            lattice: ConnectedLattice::new(sites, blend.moduli),
            loaded: Loaded::default(),
            params: params.clone(),
        };
        model.loaded = model.placed().loaded(specimen, params);
        Ok(model)
    }

    fn system(
        &self,
        _: LoadSet,
    ) -> System<'_, impl MixedPrecision, impl Precondition, impl Functional<3>> {
        self.placed().system(
            &self.lattice,
            ConnectedSprings(&self.lattice),
            None::<Stress<ConnectedLattice>>,
            (&self.params, self.loaded.displacement_mm),
            None,
        )
    }

    fn assess(&self, u: &[[f64; 3]], info: &CgInfo) -> Moduli {
        self.placed().assess(&self.stress(), &self.loaded, u, info)
    }

    fn fields(
        &self,
        _: Prepared,
        params: &SolveParams,
        u: &[[f64; 3]],
        _: &Moduli,
    ) -> Result<Recorded> {
        let sites = &self.lattice.sites;
        let energy = |s| self.lattice.site_energy(u, s);
        let fraction = |s: usize| f64::from(sites.fractions[s]);
        let at = (&sites.frame, &sites.indices[..]);
        Ok(Recorded {
            sites: SiteFields::of(&params.fields, at, u, energy, fraction),
            ..Recorded::default()
        })
    }
}
