//! Bodies of voxel elements that yield, with their supports and loads.

use bonepd_ct::discretisation::voxels::VoxelMesh;
use bonepd_ct::grid::Grid;
use bonepd_ct::operator::held::Held;
use bonepd_ct::physics::hex8::Hex8;
use bonepd_ct::physics::hex8::element::Integration;
use bonepd_ct::physics::hex8::plastic::points::Points;
use bonepd_ct::physics::hex8::plastic::{PlasticBricks, Tissue};
use bonepd_ct::physics::plasticity::{DruckerPrager, Elastic, VonMises, YieldLaw};
use bonepd_ct::pipeline::apparent::discretisation::steps::length::Lengths;
use bonepd_ct::pipeline::apparent::discretisation::steps::{
    History, Loading, Outcome, Step, Stepping, load,
};
use bonepd_ct::solver::amg::{Amg, AmgParams};
use bonepd_ct::solver::load_step::StepParams;

pub type Field = Vec<[f64; 3]>;

/// A meshed body with its supports and its load.
pub struct Body {
    pub mesh: VoxelMesh,
    pub held: Held,
    /// Displacements of the supports, and a first guess, under the whole load.
    pub ends: Field,
    pub forces: Option<Field>,
    pub young: f64,
    pub poisson: f64,
}

pub fn mesh(n: [usize; 3], h: f64, inside: impl Fn([usize; 3]) -> bool) -> VoxelMesh {
    let grid = Grid::new(n, [h; 3]);
    let at = |i: usize| [i % n[0], i / n[0] % n[1], i / (n[0] * n[1])];
    let bone: Vec<u8> = (0..grid.len()).map(|i| u8::from(inside(at(i)))).collect();
    VoxelMesh::at_faces(grid, &bone, |b| *b != 0).unwrap()
}

impl Body {
    /// Supports are `hold`, by node indices and component.
    pub fn new(mesh: VoxelMesh, hold: impl Fn([usize; 3], usize) -> bool) -> Body {
        let mut held = Held::none(mesh.len());
        for node in 0..mesh.len() {
            let at = mesh.indices(node).map(|v| v as usize);
            for c in 0..3 {
                if mesh.around[node] == 0 || hold(at, c) {
                    held.hold(node, c);
                }
            }
        }
        Body {
            ends: vec![[0.0; 3]; mesh.len()],
            mesh,
            held,
            forces: None,
            young: 10_000.0,
            poisson: 0.3,
        }
    }

    /// A block compressed along z by `strain`; its ends slide, or are bonded.
    pub fn block(mesh: VoxelMesh, strain: f64, bonded: bool) -> Body {
        let n = mesh.grid.n;
        let mut body = Body::new(mesh, |at, c| {
            let end = at[2] == 0 || at[2] == n[2];
            match bonded {
                true => end,
                // Sliding ends, and planes of symmetry at x = 0 and y = 0.
                false => (c == 2 && end) || (c < 2 && at[c] == 0),
            }
        });
        for node in 0..body.mesh.len() {
            body.ends[node][2] = strain * body.mesh.position(node)[2];
        }
        body
    }

    pub fn stepping(steps: u32) -> Stepping {
        Stepping {
            lengths: Lengths::Even(steps),
            halvings: 6,
            params: StepParams {
                tolerance: 1e-10,
                max_iterations: 25,
                max_cg_iterations: 2000,
            },
        }
    }

    pub fn load(&self, law: YieldLaw, how: &Stepping) -> (Outcome, History) {
        self.load_with(law, how, true)
    }

    /// `is_mean` chooses mean dilatation; full integration otherwise.
    pub fn load_with(&self, law: YieldLaw, how: &Stepping, is_mean: bool) -> (Outcome, History) {
        let rule = match is_mean {
            true => Integration::MeanDilatation,
            false => Integration::Full,
        };
        let bricks = Hex8::new(self.mesh.clone(), self.young, self.poisson, rule);
        let tissue = Tissue {
            elastic: Elastic::of(self.young, self.poisson),
            law,
        };
        let h = self.mesh.grid.spacing_mm;
        let body = PlasticBricks::new(&bricks, &self.mesh, Points::new(h, is_mean), |_| tissue);
        let multigrid = Amg::new(&bricks, &self.held, &AmgParams::new(h));
        let mut history = History::new(self.mesh.len());
        let loading = Loading {
            held: &self.held,
            elastic: &self.ends,
            external: self.forces.as_deref(),
        };
        let outcome = load(body, &loading, &multigrid, how, &mut history, |_| true);
        (outcome, history)
    }

    /// Apparent stress of a block under `strain` at the end of a step.
    pub fn stress(&self, step: &Step, strain: f64) -> f64 {
        let [x, y, z] = self.mesh.grid.size_mm();
        step.conjugate_nmm / (strain * x * y * z)
    }
}

pub fn von_mises(yield_mpa: f64, hardening_mpa: f64) -> YieldLaw {
    YieldLaw::VonMises(VonMises {
        yield_mpa,
        hardening_mpa,
    })
}

pub fn asymmetric(tension_mpa: f64, compression_mpa: f64) -> YieldLaw {
    YieldLaw::Asymmetric(DruckerPrager {
        tension_mpa,
        compression_mpa,
        hardening_mpa: 0.0,
    })
}

/// Struts of two voxels on a grid of cells of six.
pub fn frame(n: usize) -> VoxelMesh {
    mesh([n; 3], 0.02, |p| {
        let thin = p.map(|v| v % 6 < 2);
        (0..3).filter(|a| thin[*a]).count() >= 2
    })
}

pub fn assert_balanced(steps: &[Step]) {
    for s in steps {
        let off = (s.elastic_nmm + s.dissipated_nmm) / s.work_nmm - 1.0;
        assert!(off.abs() < 1e-6, "{s:?}: off by {off:e}");
    }
    let growing = steps
        .windows(2)
        .all(|w| w[1].dissipated_nmm >= w[0].dissipated_nmm);
    assert!(growing, "{steps:?}");
}
