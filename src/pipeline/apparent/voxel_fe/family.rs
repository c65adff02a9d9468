//! Owns what loads of one body share: the settings that shape its elements, and multigrid while the same unknowns are held.

use crate::operator::SinglePreconditioner;
use crate::operator::held::Held;
use crate::pipeline::apparent::discretisation::precondition::Precondition;
use crate::pipeline::apparent::params::SolveParams;
use crate::pipeline::apparent::voxel_fe::bricks::Bricks;
use crate::solver::amg::supports::Common;
use crate::solver::amg::{Amg, AmgParams};
use std::sync::{Arc, Mutex, OnceLock};

/// Multigrid of elements.
pub type Multigrid = Arc<Amg<Arc<Bricks>>>;

/// Makes multigrid on elements, and keeps it for the next load where there is one.
pub struct Family {
    bricks: Arc<Bricks>,
    /// The last one made, and what was held; None where no more loads come.
    kept: Option<Mutex<Option<(Held, AmgParams, Multigrid)>>>,
    several: Option<Several>,
}

/// Supports that follow one another, and what multigrid has in common under them.
struct Several {
    supports: Vec<Held>,
    common: OnceLock<Common<Arc<Bricks>>>,
}

impl Family {
    /// Of a single load.
    pub fn alone(bricks: Arc<Bricks>) -> Self {
        Family {
            bricks,
            kept: None,
            several: None,
        }
    }

    /// Keeps multigrid from now on.
    pub fn keep(&mut self) {
        self.kept.get_or_insert_default();
    }

    /// Makes once, from now on, what multigrid has in common under these supports.
    pub fn expect(&mut self, supports: Vec<Held>) {
        self.several = Some(Several {
            supports,
            common: OnceLock::new(),
        });
    }

    /// The elements.
    pub fn bricks(&self) -> &Arc<Bricks> {
        &self.bricks
    }

    /// Multigrid for what is held: the last one, where that was made for the same.
    pub fn multigrid(&self, held: &Held, params: &AmgParams) -> Multigrid {
        let own = || Arc::clone(&self.bricks);
        if let Some(several) = &self.several
            && several.supports.contains(held)
        {
            let common = || Common::new(own(), &several.supports, params);
            return Arc::new(several.common.get_or_init(common).under(held));
        }
        let fresh = || Arc::new(Amg::new(own(), held, params));
        let Some(kept) = &self.kept else {
            return fresh();
        };
        let mut kept = kept.lock().unwrap_or_else(|e| e.into_inner());
        match &*kept {
            Some((of, by, multigrid)) if (of, by) == (held, params) => Arc::clone(multigrid),
            _ => {
                // The one before goes first: there is never room for two.
                *kept = None;
                let made = fresh();
                *kept = Some((held.clone(), *params, Arc::clone(&made)));
                made
            }
        }
    }
}

impl Precondition for &Family {
    fn precondition<'a>(
        &'a self,
        held: &Held,
        params: &AmgParams,
    ) -> impl SinglePreconditioner<3> + 'a {
        self.multigrid(held, params)
    }
}

/// The settings without those that change from load to load on the same elements.
pub fn shaping(params: &SolveParams) -> SolveParams {
    let any = SolveParams::default();
    SolveParams {
        load: any.load,
        strain: any.strain,
        angle_deg: any.angle_deg,
        ends: any.ends,
        fields: any.fields,
        tolerance: any.tolerance,
        max_iterations: any.max_iterations,
        ..params.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::discretisation::voxels::VoxelMesh;
    use crate::grid::Grid;
    use crate::physics::hex8::Hex8;
    use crate::physics::hex8::element::Integration;

    #[test]
    fn multigrid_is_kept_while_the_same_is_held() {
        let grid = Grid::new([6; 3], [0.02; 3]);
        let mesh = VoxelMesh::at_faces(grid, &[true; 216], |b| *b).unwrap();
        let mut held = Held::none(mesh.len());
        held.hold(0, 2);
        let mut other = held.clone();
        other.hold(3, 1);
        let bricks = Hex8::new(mesh, 1000.0, 0.3, Integration::Full);
        let mut family = Family::alone(Arc::new(Bricks::Homogeneous(bricks)));
        let params = AmgParams::new([0.02; 3]);
        let alone = [0, 1].map(|_| family.multigrid(&held, &params));
        assert!(!Arc::ptr_eq(&alone[0], &alone[1]));
        family.keep();
        let kept = [&held, &held, &other].map(|held| family.multigrid(held, &params));
        assert!(Arc::ptr_eq(&kept[0], &kept[1]));
        assert!(!Arc::ptr_eq(&kept[1], &kept[2]));
    }
}
