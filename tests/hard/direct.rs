//! The modulus of a voxel model by a sparse factorisation.

use bonepd_ct::discretisation::voxels::Planes;
use bonepd_ct::operator::Operator;
use bonepd_ct::operator::probe::{Probed, probe};
use bonepd_ct::par::dot;
use bonepd_ct::pipeline::apparent::SolveParams;
use bonepd_ct::pipeline::apparent::discretisation::Prepared;
use bonepd_ct::pipeline::apparent::ends::motion::EndMotion;
use bonepd_ct::pipeline::apparent::ends::supports;
use bonepd_ct::pipeline::apparent::tissue::Tissue;
use bonepd_ct::pipeline::apparent::voxel_fe::bricks::{Bricks, Keep};
use bonepd_ct::pipeline::apparent::voxel_fe::nodes::{Gripped, grid_places};
use bonepd_ct::solver::direct::DirectLlt;
use bonepd_ct::volume::Specimen;

/// E_app in MPa from the energy, and the matrix of the free unknowns.
pub fn e_app_mpa(specimen: &Specimen, params: &SolveParams) -> (f64, Probed) {
    let tissue = &Tissue::of(specimen, params).unwrap();
    let prepared = Prepared { specimen, tissue };
    let model = Bricks::new(prepared, params, Keep::BetweenGrips).unwrap();
    let mesh = model.mesh();
    assert!(!mesh.is_empty());
    let grips = Planes::within(&mesh.grid, params.axis, 0.0).unwrap();
    let length = specimen.length_mm(params.axis);
    let motion = EndMotion::of(specimen, params, length);
    let nodes = Gripped {
        mesh,
        grips,
        uneven: None,
    };
    let held = supports::held(&nodes, &motion, params.load);
    let mut u = supports::start(&nodes, &motion);
    for (node, u) in u.iter_mut().enumerate() {
        (0..3)
            .filter(|&c| !held.is_held(node, c))
            .for_each(|c| u[c] = 0.0);
    }
    let mut force = vec![[0.0; 3]; mesh.len()];
    model.apply(&u, &mut force);
    let probed = probe(&model, &held, &grid_places(mesh), 1);
    let mut x: Vec<f64> = probed.unknowns.iter().map(|&(n, c)| -force[n][c]).collect();
    let order: Vec<usize> = (0..x.len()).collect();
    let mut llt = DirectLlt::new(&probed.matrix, &order).unwrap();
    llt.factorize(&probed.matrix).unwrap();
    llt.solve(&mut x);
    let pairs = probed.unknowns.iter().zip(&x);
    pairs.for_each(|(&(n, c), x)| u[n][c] = *x);
    model.apply(&u, &mut force);
    let energy = dot(&u, &force);
    let scale = params.strain.powi(2) * length * specimen.area_mm2(params.axis);
    (energy / scale, probed)
}
