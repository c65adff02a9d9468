//! Hard cases: what each came to, how far its stated error was off, and how many mechanisms it has.
//! `cargo test --release stability_cases -- --nocapture` prints the table.

use crate::hard::direct::e_app_mpa;
use crate::specimens::specimen;
use crate::stopping::textbook;
use bonepd_ct::discretisation::voxels::{Planes, VoxelMesh};
use bonepd_ct::grid::Axis;
use bonepd_ct::operator::sparse::Sparse;
use bonepd_ct::physics::hex8::element::Integration;
use bonepd_ct::physics::hex8::heterogeneous::Heterogeneous;
use bonepd_ct::pipeline::apparent::ends::motion::EndMotion;
use bonepd_ct::pipeline::apparent::ends::supports;
use bonepd_ct::pipeline::apparent::solve_lattice;
use bonepd_ct::pipeline::apparent::solve_voxels;
use bonepd_ct::pipeline::apparent::solved::Solved;
use bonepd_ct::pipeline::apparent::voxel_fe::nodes::Gripped;
use bonepd_ct::pipeline::apparent::{Ends, SolveParams};
use bonepd_ct::pipeline::lattice::{Boundary, Case as LatticeCase, Structure};
use bonepd_ct::pipeline::phantom::{PhantomParams, structure};
use bonepd_ct::solver::amg::{Amg, AmgParams};
use bonepd_ct::solver::cg::fallback::minimise_or_fall_back;
use bonepd_ct::solver::cg::{CgParams, ENERGY_ALONE};
use bonepd_ct::volume::Specimen;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// Struts of `thick` voxels on a grid of cells, a share of them broken: hinges, dead ends, few paths.
fn struts(n: usize, cell: usize, thick: usize, broken: f64, seed: u64) -> Specimen {
    let mut random = Pcg64::seed_from_u64(seed);
    let cells = n / cell + 1;
    let missing: Vec<bool> = (0..3 * cells * cells * cells)
        .map(|_| random.random::<f64>() < broken)
        .collect();
    specimen([n; 3], [0.02; 3], |p| {
        let thin = p.map(|v| v % cell < thick);
        (0..3).any(|a| {
            let (b, c) = ((a + 1) % 3, (a + 2) % 3);
            let cell = (p[a] / cell * cells + p[b] / cell) * cells + p[c] / cell;
            thin[b] && thin[c] && (thin[a] || !missing[3 * cell + a])
        })
    })
}

const COARSER: &str = "phantom, lattice parameter near the strut thickness";

/// A block of thin trabeculae: at 0.12 mm its floppy lattice has eight of eighteen bonds a site, and pieces that turn freely.
fn phantom() -> Specimen {
    let params = PhantomParams {
        size_mm: [4.8; 3],
        spacing_mm: 0.06,
        bvtv: 0.12,
        thickness_mm: 0.16,
        ..PhantomParams::default()
    };
    let mask = structure(&params).unwrap().mask;
    let [nx, ny, nz] = mask.grid.n;
    let bone = mask.as_slice();
    specimen([nx, ny, nz], [0.06; 3], |[x, y, z]| {
        bone[(z * ny + y) * nx + x] == 1
    })
}

/// Multigrid took 1541 iterations on a core of such bone; a factor of the springs takes a few. The modulus is that of a solve to 1e-10.
#[test]
fn thin_floppy_lattices_take_few_iterations() {
    let case = cases().into_iter().find(|c| c.what == COARSER).unwrap();
    let tight = SolveParams {
        tolerance: 1e-10,
        ..case.params.clone()
    };
    let loose = solve(&case, &case.params).unwrap();
    let exact = solve(&case, &tight).unwrap();
    let [loose_mpa, exact_mpa] = [&loose, &exact].map(|s| s.moduli.e_app_mpa);
    println!(
        "{} sites, {} iterations, {loose_mpa} MPa, exact {exact_mpa}",
        loose.sites, loose.iterations
    );
    assert!(loose.sites >= 4096, "{}", loose.sites);
    assert!(loose.iterations <= 30, "{}", loose.iterations);
    assert!(
        (loose_mpa / exact_mpa - 1.0).abs() < 1e-3,
        "{loose_mpa} {exact_mpa}"
    );
}

enum Model {
    Voxels,
    Lattice(Structure, Boundary, f64),
}

struct Case {
    what: &'static str,
    specimen: Specimen,
    params: SolveParams,
    model: Model,
    /// Mechanisms by reasoning, where a reason is at hand.
    mechanisms: Option<usize>,
}

fn poisson(poisson: f64) -> SolveParams {
    SolveParams {
        poisson,
        ..SolveParams::default()
    }
}

/// Hard cases. Each is small enough that a run to 1e-12 and a factorisation take moments.
fn cases() -> Vec<Case> {
    use Boundary::{Connected, Firm, Floppy};
    use Model::{Lattice, Voxels};
    use Structure::{Bcc, Sc};
    let mut cases = Vec::new();
    let mut add = |what, specimen: Specimen, params, model, mechanisms| {
        cases.push(Case {
            what,
            specimen,
            params,
            model,
            mechanisms,
        });
    };
    let thin = || struts(32, 10, 2, 0.3, 2);
    for nu in [-0.4, 0.0, 0.25, 0.45, 0.49, 0.499] {
        add("struts 2 voxels thick", thin(), poisson(nu), Voxels, None);
        let thick = struts(32, 16, 6, 0.2, 2);
        add(
            "struts 6 voxels thick",
            thick.clone(),
            poisson(nu),
            Lattice(Sc, Floppy, 0.04),
            None,
        );
        if nu < 0.45 {
            add(
                "struts 6 voxels thick",
                thick,
                poisson(nu),
                Lattice(Bcc, Floppy, 0.04),
                None,
            );
        }
    }
    for boundary in [Firm, Floppy, Connected] {
        add(
            "struts 2 voxels thick",
            thin(),
            poisson(0.3),
            Lattice(Sc, boundary, 0.04),
            None,
        );
    }
    add(
        COARSER,
        phantom(),
        poisson(0.3),
        Lattice(Sc, Floppy, 0.12),
        None,
    );
    add(
        "lattice parameter half a voxel",
        struts(16, 8, 3, 0.2, 3),
        poisson(0.3),
        Lattice(Sc, Floppy, 0.01),
        None,
    );
    let bonded = |params| SolveParams {
        ends: Ends::Bonded,
        ..params
    };
    let cube = |bone: fn([usize; 3]) -> bool| specimen([12, 12, 24], [0.02; 3], bone);
    // An edge lets the halves turn about it, a corner about three axes; the ends bonded, slid ends let more move.
    let edge = || cube(|p| (p[2] < 12) == (p[0] < 6));
    add("halves meet in an edge", edge(), poisson(0.3), Voxels, None);
    add(
        "halves meet in an edge, ends bonded",
        edge(),
        bonded(poisson(0.3)),
        Voxels,
        Some(0),
    );
    let tip = || cube(|p| (p[2] < 12) == (p[0] < 6) && (p[2] < 12) == (p[1] < 6));
    add("halves meet in a corner", tip(), poisson(0.3), Voxels, None);
    // A block that hangs on a column by one edge turns about it; on a bump by one corner, about three axes.
    let inside = |p: [usize; 3], low: [usize; 3], high: [usize; 3]| {
        (0..3).all(|a| (low[a]..high[a]).contains(&p[a]))
    };
    let by_edge = specimen([12; 3], [0.02; 3], |p| {
        inside(p, [0, 0, 0], [4, 4, 12]) || inside(p, [4, 4, 4], [8, 8, 8])
    });
    let by_corner = specimen([12; 3], [0.02; 3], |p| {
        inside(p, [0, 0, 0], [4, 4, 12])
            || inside(p, [4, 0, 4], [6, 4, 6])
            || inside(p, [6, 4, 6], [10, 8, 10])
    });
    add(
        "a block hangs by an edge",
        by_edge,
        bonded(poisson(0.3)),
        Voxels,
        Some(1),
    );
    add(
        "a block hangs by a corner",
        by_corner,
        bonded(poisson(0.3)),
        Voxels,
        Some(3),
    );
    let one_bond = specimen([12, 1, 24], [0.02; 3], |p| (p[2] < 12) == (p[0] < 6));
    add(
        "halves meet in one bond",
        one_bond,
        bonded(poisson(0.25)),
        Lattice(Sc, Floppy, 0.02),
        None,
    );
    let column = || cube(|p| p[0] == 5 && p[1] == 5);
    add("one-voxel column", column(), poisson(0.3), Voxels, Some(0));
    add(
        "one-voxel column",
        column(),
        poisson(0.3),
        Lattice(Sc, Floppy, 0.02),
        None,
    );
    add(
        "one-voxel column",
        column(),
        poisson(0.3),
        Lattice(Sc, Firm, 0.02),
        None,
    );
    let plate = || cube(|p| p[0] == 5);
    add("one-voxel plate", plate(), poisson(0.3), Voxels, Some(0));
    add(
        "one-voxel plate",
        plate(),
        poisson(0.3),
        Lattice(Sc, Floppy, 0.02),
        None,
    );
    add(
        "slender 1:20",
        specimen([2, 2, 40], [0.02; 3], |_| true),
        poisson(0.3),
        Voxels,
        Some(0),
    );
    add(
        "slender 1:20, ends bonded",
        specimen([2, 2, 40], [0.02; 3], |_| true),
        bonded(poisson(0.3)),
        Voxels,
        Some(0),
    );
    add(
        "BV/TV 3 %",
        struts(40, 20, 2, 0.2, 1),
        poisson(0.3),
        Voxels,
        None,
    );
    add(
        "BV/TV 100 %",
        specimen([14; 3], [0.02; 3], |_| true),
        poisson(0.3),
        Voxels,
        Some(0),
    );
    add(
        "BV/TV 100 %",
        specimen([14; 3], [0.02; 3], |_| true),
        poisson(0.3),
        Lattice(Sc, Floppy, 0.02),
        Some(0),
    );
    add(
        "one voxel touches the platen",
        cube(|p| p[2] > 0 || p == [6, 6, 0]),
        poisson(0.3),
        Voxels,
        None,
    );
    add(
        "one platen only",
        cube(|p| p[2] < 20),
        poisson(0.3),
        Voxels,
        None,
    );
    add(
        "one platen only",
        cube(|p| p[2] < 20),
        poisson(0.3),
        Lattice(Sc, Floppy, 0.04),
        None,
    );
    let long = specimen([24, 24, 8], [0.02, 0.02, 0.06], |p| {
        (p[0] / 4 + p[1] / 4 + p[2] / 2) % 3 > 0
    });
    add("voxels 1:1:3", long, poisson(0.3), Voxels, None);
    add(
        "serpentine, one voxel thick",
        serpentine(),
        bonded(poisson(0.3)),
        Voxels,
        // None by its shape, but its softest bending motions are below 1e-8 of the largest eigenvalue, too.
        None,
    );
    cases
}

/// 21 rows of 41 voxels, joined at alternate ends: one path of 881 voxels.
fn serpentine() -> Specimen {
    specimen([41, 1, 41], [0.02; 3], |p| match p[2] % 4 {
        0 | 2 => true,
        1 => p[0] == 40,
        _ => p[0] == 0,
    })
}

struct Outcome {
    solved: Solved,
    /// Of the modulus, relative; None where there is none.
    stated: f64,
    true_error: f64,
}

fn solve(case: &Case, params: &SolveParams) -> Result<Solved, bonepd_ct::error::Error> {
    match case.model {
        Model::Voxels => solve_voxels(&case.specimen, params, |_| ()),
        Model::Lattice(structure, boundary, lp_mm) => {
            let registration_mm = [0.0; 3];
            let lattice = LatticeCase {
                structure,
                lp_mm,
                boundary,
                registration_mm,
            };
            solve_lattice(&case.specimen, &lattice, params, |_| ())
        }
    }
}

fn outcome(case: &Case) -> Outcome {
    // Sites of connected lattices share places on the grid, which the count cannot tell apart.
    let counted = SolveParams {
        mechanisms: !matches!(case.model, Model::Lattice(_, Boundary::Connected, _)),
        ..case.params.clone()
    };
    let solved = solve(case, &counted).unwrap();
    let tight = SolveParams {
        tolerance: 1e-12,
        ..case.params.clone()
    };
    let exact = solve(case, &tight).unwrap().moduli.e_app_mpa;
    let m = solved.moduli;
    let relative = |v: f64| if exact == 0.0 { 0.0 } else { v / exact };
    Outcome {
        stated: relative(m.algebraic_error_mpa),
        true_error: relative((m.e_app_mpa - exact).abs()),
        solved,
    }
}

/// Whether the case ended well: the true error is at most one and a half times the stated one (below 1e-9 both are
/// rounding), and the count of mechanisms is what the shape says.
fn is_well(case: &Case, o: &Outcome) -> bool {
    let e_app = o.solved.moduli.e_app_mpa;
    let counted = case.mechanisms.is_none() || case.mechanisms == o.solved.mechanisms;
    let held = o.solved.ended.converged() && o.true_error <= 1.5 * o.stated + 1e-9;
    e_app.is_finite() && e_app >= 0.0 && counted && held
}

fn model_words(case: &Case) -> String {
    match case.model {
        Model::Voxels => "voxel FE".into(),
        Model::Lattice(s, b, lp) => format!("{} {} LP {lp}", s.name(), b.name()),
    }
}

fn report_row(case: &Case, o: &Outcome) -> String {
    let s = &o.solved;
    format!(
        "| {} | {} | {} | {} | {} | {} | {:.4} | {:.1e} | {:.1e} | {} | {} |\n",
        case.what,
        model_words(case),
        case.params.poisson,
        s.unknowns,
        if s.connected() {
            format!("{:?}", s.ended)
        } else {
            "faces not joined, E_app 0 in words".into()
        },
        s.iterations,
        s.moduli.e_app_mpa,
        o.stated,
        o.true_error,
        s.mechanisms.map_or("–".into(), |n| n.to_string()),
        if is_well(case, o) { "yes" } else { "**no**" }
    )
}

#[test]
fn a_poissons_ratio_beyond_the_lattice_is_refused() {
    let case = Case {
        what: "fcc at -0.4",
        specimen: struts(32, 16, 6, 0.2, 2),
        params: poisson(-0.4),
        model: Model::Lattice(Structure::Fcc, Boundary::Floppy, 0.04),
        mechanisms: None,
    };
    let words = solve(&case, &case.params).unwrap_err().to_string();
    assert!(words.contains("fcc") || words.contains("FCC"), "{words}");
}

/// Conjugate gradients to 1e-12 against a factorisation of the matrix found by probing.
#[test]
fn a_direct_solution_is_the_iterated_one() {
    for (specimen, nu) in [
        (struts(12, 6, 2, 0.2, 5), 0.3),
        (struts(12, 6, 2, 0.2, 6), 0.499),
        (
            specimen([24, 1, 13], [0.02; 3], |p| {
                p[2] % 4 != 3 && (p[2] % 2 == 0 || p[0] == 23) || p[2] % 4 == 3 && p[0] == 0
            }),
            0.3,
        ),
    ] {
        let params = SolveParams {
            ends: Ends::Bonded,
            tolerance: 1e-12,
            ..poisson(nu)
        };
        let (direct, probed) = e_app_mpa(&specimen, &params);
        let solved = solve_voxels(&specimen, &params, |_| ()).unwrap();
        let off = solved.moduli.e_app_mpa / direct - 1.0;
        assert!(
            off.abs() < 1e-9,
            "ν {nu}: {} {direct} {off:.1e}",
            solved.moduli.e_app_mpa
        );
        assert_eq!(probed.matrix.n(), solved.unknowns);
        symmetric(&probed.matrix);
    }
}

fn symmetric(a: &Sparse) {
    let largest = a.max();
    for i in 0..a.n() {
        for (j, v) in a.row(i) {
            let other = a.row(j).find(|e| e.0 == i).map_or(0.0, |e| e.1);
            assert!((v - other).abs() < 1e-12 * largest);
        }
    }
}

/// Struts in marrow ten thousand times as soft, as grey values would make them.
#[test]
fn a_contrast_of_ten_thousand_converges() {
    let (iterations, e_app, exact) = contrast(1e-4);
    println!("contrast 1e4: {iterations} iterations, E_app {e_app}, exact {exact}");
    assert!(iterations <= 60 && (e_app / exact - 1.0).abs() < 3e-3);
    let bare = solve_voxels(&struts(32, 10, 2, 0.3, 2), &poisson(0.3), |_| ()).unwrap();
    assert!(exact > bare.moduli.e_app_mpa * 0.999);
}

fn contrast(soft: f32) -> (usize, f64, f64) {
    let specimen = struts(32, 10, 2, 0.3, 2);
    let (grid, bone) = (specimen.bone.grid, specimen.bone.as_slice());
    let grips = Planes::within(&grid, Axis::Z, 0.0).unwrap();
    let mesh = VoxelMesh::new(grid, bone, |_| true, grips).unwrap();
    let length = grid.size_mm()[2];
    let stretched = SolveParams {
        strain: 1.0,
        ..poisson(0.3)
    };
    let motion = EndMotion::of(&specimen, &stretched, length);
    let nodes = Gripped {
        mesh: &mesh,
        grips,
        uneven: None,
    };
    let held = supports::held(&nodes, &motion, stretched.load);
    let start = supports::start(&nodes, &motion);
    let factor = |e: usize| if bone[e] == 1 { 1.0 } else { soft };
    let model = Heterogeneous::new(mesh, 1000.0, 0.3, Integration::Full, factor);
    let amg = Amg::new(&model, &held, &AmgParams::new(grid.spacing_mm));
    let run = |energy_tolerance| {
        let params = CgParams {
            energy_tolerance,
            ..CgParams::default()
        };
        let mut u = start.clone();
        let info =
            minimise_or_fall_back(&model, &held, &amg, &mut u, &params, ENERGY_ALONE, |_| ());
        assert!(info.ended.converged());
        (
            info.iterations,
            info.energy / (length * specimen.area_mm2(Axis::Z)),
        )
    };
    let ((iterations, e_app), (_, exact)) = (run(1e-3), run(1e-12));
    (iterations, e_app, exact)
}

/// Plain conjugate gradients need over 10 000 iterations to 1e-12 on the serpentine, which keeps 4e-6 of a bar's energy.
#[test]
fn the_serpentine_converges() {
    let case = cases()
        .into_iter()
        .find(|c| c.what.starts_with("serpentine"))
        .unwrap();
    let steps = textbook(&case.specimen, Ends::Bonded, 200_000, 1e-12);
    let &(plain, residual, exact, _) = steps.last().unwrap();
    let found = solve(&case, &case.params).unwrap();
    let m = found.moduli;
    println!(
        "plain: {plain} iterations to {residual:.0e}, {exact} MPa; multigrid: {} iterations, {} ± {} MPa",
        found.iterations, m.e_app_mpa, m.algebraic_error_mpa
    );
    assert!(plain > 10_000 && residual < 1e-11);
    assert!(found.ended.converged() && found.iterations < 200);
    assert!((m.e_app_mpa - exact).abs() <= m.algebraic_error_mpa);
    assert!(m.algebraic_error_mpa <= 1e-3 * m.e_app_mpa);
}

/// Prints the table of `reports/stability.md`.
#[test]
fn stability_cases() {
    println!(
        "| case | model | ν | unknowns | ended by | iterations | E_app (MPa) | stated error | true error | mechanisms | well |\n|---|---|---|---|---|---|---|---|---|---|---|"
    );
    let mut ill = Vec::new();
    for case in cases() {
        let outcome = outcome(&case);
        let row = report_row(&case, &outcome);
        print!("{row}");
        if !is_well(&case, &outcome) {
            ill.push(row);
        }
    }
    assert!(ill.is_empty(), "{ill:#?}");
}
