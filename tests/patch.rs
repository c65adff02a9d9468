//! Patch tests: a fully bonded lattice is the isotropic solid, and an affine field is in equilibrium.

use bonepd_ct::discretisation::lattice::sites::Sites;
use bonepd_ct::grid::{Axis, Grid};
use bonepd_ct::operator::Operator;
use bonepd_ct::physics::lattice::connected::ConnectedLattice;
use bonepd_ct::physics::lattice::{Lattice, Moduli};
use bonepd_ct::pipeline::lattice::{Boundary, Case, Structure, build, build_connected};
use bonepd_ct::volume::{Specimen, Volume};

const LP_MM: f64 = 0.1;
const YOUNG_MPA: f64 = 1000.0;
/// Every structure must match the solid at each of these Poisson's ratios.
const POISSONS: [f64; 5] = [0.0, 0.1, 0.25, 0.3, 0.45];

/// A block of 8³ lattice parameters, all bone.
fn block() -> Specimen {
    let grid = Grid::new([16; 3], [0.05; 3]);
    let bone = Volume::from_vec(grid, vec![1; grid.len()]);
    Specimen {
        name: "block".into(),
        bone,
        tv_mm3: 0.512,
        tv_definition: "box".into(),
        grey: None,
        threshold: None,
    }
}

fn lattice_sites(structure: Structure) -> Sites {
    let case = Case {
        structure,
        lp_mm: LP_MM,
        boundary: Boundary::Floppy,
        registration_mm: [0.0; 3],
    };
    build(&block(), &case, Axis::Z, 0.0).unwrap()
}

/// Displacements of a homogeneous strain (tensor components).
fn affine(sites: &Sites, strain: [[f64; 3]; 3]) -> Vec<[f64; 3]> {
    let at = |&i: &[i32; 3]| {
        let p = sites.frame.position_mm(i);
        std::array::from_fn(|r| (0..3).map(|c| strain[r][c] * p[c]).sum())
    };
    sites.indices.iter().map(at).collect()
}

/// A site whose neighbours are all fully coordinated.
fn innermost(sites: &Sites) -> usize {
    let deep = |&s: &usize| {
        let all = |t: usize| sites.neighbours_of(t).iter().all(|&n| n as usize != t);
        all(s) && sites.neighbours_of(s).iter().all(|&n| all(n as usize))
    };
    (0..sites.len())
        .filter(deep)
        .nth(5)
        .expect("a block has an inside")
}

#[test]
fn a_fully_bonded_site_has_the_solids_stiffness() {
    for structure in Structure::ALL {
        let sites = lattice_sites(structure);
        let site = innermost(&sites);
        for nu in POISSONS {
            let model = Lattice::new(
                sites.clone(),
                Moduli::new(structure, LP_MM, YOUNG_MPA, nu).unwrap(),
            );
            let twice_density =
                |strain| 2.0 * model.site_energy(&affine(&sites, strain), site) / sites.cell_mm3();
            let lambda = YOUNG_MPA * nu / ((1.0 + nu) * (1.0 - 2.0 * nu));
            let mu = YOUNG_MPA / (2.0 * (1.0 + nu));
            for a in 0..3 {
                let b = (a + 1) % 3;
                let mut one = [[0.0; 3]; 3];
                one[a][a] = 1.0;
                let mut both = one;
                both[b][b] = 1.0;
                let mut shear = [[0.0; 3]; 3];
                (shear[a][b], shear[b][a]) = (0.5, 0.5);
                let c11 = twice_density(one);
                let c12 = 0.5 * twice_density(both) - c11;
                let c44 = twice_density(shear);
                let solid = [lambda + 2.0 * mu, lambda, mu];
                for (found, exact) in [c11, c12, c44].into_iter().zip(solid) {
                    // Relative to C11 (C12 is zero at ν = 0). Measured: 2e-15.
                    let error = (found - exact).abs() / solid[0];
                    assert!(
                        error < 1e-12,
                        "{structure:?} ν={nu} axis {a}: {found} for {exact}"
                    );
                }
            }
        }
    }
}

#[test]
fn an_affine_field_is_in_equilibrium_inside() {
    let strain = [[0.3, 0.1, -0.2], [0.1, -0.4, 0.25], [-0.2, 0.25, 0.7]];
    for structure in Structure::ALL {
        let sites = lattice_sites(structure);
        let site = innermost(&sites);
        for nu in POISSONS {
            let model = Lattice::new(
                sites.clone(),
                Moduli::new(structure, LP_MM, YOUNG_MPA, nu).unwrap(),
            );
            let mut force = vec![[0.0; 3]; sites.len()];
            model.apply(&affine(&sites, strain), &mut force);
            let surface = force.iter().flatten().fold(0.0, |m: f64, f| m.max(f.abs()));
            for c in 0..3 {
                assert!(
                    force[site][c].abs() < 1e-12 * surface,
                    "{structure:?} ν={nu}: {:?}",
                    force[site]
                );
            }
        }
    }
}

/// Shares are 1 in solid bone: a connected lattice is the uniform one there, and its energy the solid's.
#[test]
fn a_connected_lattice_of_solid_bone_has_its_stiffness() {
    let case = Case {
        structure: Structure::Sc,
        lp_mm: LP_MM,
        boundary: Boundary::Connected,
        registration_mm: [0.0; 3],
    };
    let pieces = build_connected(&block(), &case, Axis::Z, 0.0).unwrap();
    let site = (0..pieces.len())
        .find(|&s| (0..3).all(|a| (2..4).contains(&pieces.indices[s][a])))
        .expect("a block has an inside");
    let strain = [[0.3, 0.1, -0.2], [0.1, -0.4, 0.25], [-0.2, 0.25, 0.7]];
    let field: Vec<[f64; 3]> = pieces
        .indices
        .iter()
        .map(|&i| {
            let p = pieces.frame.position_mm(i);
            std::array::from_fn(|r| (0..3).map(|c| strain[r][c] * p[c]).sum())
        })
        .collect();
    for nu in POISSONS {
        let moduli = Moduli::new(Structure::Sc, LP_MM, YOUNG_MPA, nu).unwrap();
        let model = ConnectedLattice::new(pieces.clone(), moduli);
        let lambda = YOUNG_MPA * nu / ((1.0 + nu) * (1.0 - 2.0 * nu));
        let mu = YOUNG_MPA / (2.0 * (1.0 + nu));
        let trace: f64 = (0..3).map(|a| strain[a][a]).sum();
        let squares: f64 = strain.iter().flatten().map(|e| e * e).sum();
        let solid = (0.5 * lambda * trace * trace + mu * squares) * LP_MM.powi(3);
        let found = model.site_energy(&field, site);
        // Shares are single precision.
        assert!(
            (found / solid - 1.0).abs() < 1e-6,
            "ν={nu}: {found} for {solid}"
        );
    }
}
