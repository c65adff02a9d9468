//! The stated algebraic error on bodies whose soft motions are found late: stiff wires cut by soft voxels, random phases at
//! contrasts to 1e6, frames, hinges, necks, serpentines, sparse media. `cargo test --release two_hundred -- --ignored
//! --nocapture` prints the distribution of true over stated errors.

pub mod bodies;
pub mod direct;

use bodies::Body;
use bonepd_ct::pipeline::apparent::job::JobResult;
use bonepd_ct::pipeline::apparent::solved::Solved;
use bonepd_ct::pipeline::apparent::{Conditions, Ends, Load, SolveParams, of_voxels, solve_voxels};

/// True error over the stated one that a hard body may have: the estimate is no bound.
const MOST: f64 = 1.5;

fn solved(body: &Body, tolerance: f64) -> Solved {
    let params = SolveParams {
        tolerance,
        ..body.params.clone()
    };
    solve_voxels(&body.specimen, &params, |_| ()).unwrap()
}

/// True and stated relative error at a tolerance, and whether the solve converged.
fn errors(body: &Body, exact_mpa: f64, tolerance: f64) -> (f64, f64, Solved) {
    let solved = solved(body, tolerance);
    let m = solved.moduli;
    let off = (m.e_app_mpa / exact_mpa - 1.0).abs();
    (off, m.algebraic_error_mpa / m.e_app_mpa, solved)
}

fn assert_stated(body: &Body, exact_mpa: f64, tolerance: f64) {
    let (off, stated, solved) = errors(body, exact_mpa, tolerance);
    let words = format!(
        "{} at {tolerance:.0e}: off by {off:.2e}, stated {stated:.2e}, {solved:?}",
        body.name
    );
    assert!(solved.ended.converged() && stated <= tolerance, "{words}");
    // What the reference itself may be off by.
    assert!(off <= MOST * stated + 1e-8, "{words}");
}

#[test]
fn cut_wires_state_their_error_at_four_tolerances() {
    for (seed, contrast) in [(37, 1e2), (23, 3e3), (66, 1e3), (11, 1e4), (44, 1e6)] {
        let body = bodies::cut_wires(seed, contrast);
        let exact = solved(&body, 1e-10).moduli.e_app_mpa;
        for tolerance in [1e-2, 1e-3, 1e-4, 1e-5] {
            assert_stated(&body, exact, tolerance);
        }
    }
}

#[test]
fn hard_bodies_state_their_error() {
    let made = [
        bodies::random_labels(2, 1e6, 0.0, 1),
        bodies::random_labels(37, 1e5, 0.4, 2),
        bodies::random_labels(25, 1e4, 0.5, 1),
        bodies::c_frame(27),
        bodies::c_frame(159),
        bodies::necks(6, true),
        bodies::necks(17, false),
        bodies::diagonal_neck(29),
        bodies::diagonal_neck(139),
        bodies::serpentine(8),
        bodies::serpentine(63),
        bodies::sparse(42),
        bodies::broken_foam(65),
        bodies::broken_foam(186),
    ];
    for body in made {
        let exact = solved(&body, 1e-10).moduli.e_app_mpa;
        for tolerance in [1e-2, 1e-3, 1e-4] {
            assert_stated(&body, exact, tolerance);
        }
    }
}

/// Later loads take over what the first one found of the preconditioner: a unit strain that begins near its solution may end after one
/// iteration.
#[test]
fn six_unit_strains_of_hard_bodies_state_their_error() {
    let made = [
        bodies::cut_wires(37, 1e2),
        bodies::cut_wires(66, 1e3),
        bodies::random_labels(2, 1e6, 0.0, 1),
        bodies::random_labels(37, 1e5, 0.4, 2),
        bodies::c_frame(27),
        bodies::necks(6, true),
        bodies::diagonal_neck(29),
        bodies::serpentine(8),
        bodies::sparse(42),
        bodies::broken_foam(65),
    ];
    for body in made {
        let of = |tolerance| {
            let params = SolveParams {
                load: Load::Stiffness,
                conditions: Conditions::Kinematic,
                tolerance,
                ..body.params.clone()
            };
            match of_voxels().solve_specimen(&body.specimen, &params, &mut |_, _| ()) {
                Ok(JobResult::Stiffness(stiffness)) => stiffness,
                _ => panic!("{}", body.name),
            }
        };
        let exact = of(1e-10).matrix_mpa;
        for tolerance in [1e-2, 1e-3, 1e-4] {
            let found = of(tolerance);
            assert!(found.ended.converged(), "{}: {found:?}", body.name);
            for (i, exact) in exact.iter().enumerate() {
                let off = (found.matrix_mpa[i][i] - exact[i]).abs();
                let stated = found.error_mpa[i][i];
                assert!(
                    off <= MOST * stated + 1e-8 * exact[i],
                    "{} at {tolerance:.0e}, strain {i}: off by {off:.2e}, stated {stated:.2e}, {:?}",
                    body.name,
                    found.iterations
                );
            }
        }
    }
}

/// Against a factorisation, so that a solver that stands still is not its own reference.
#[test]
fn contrasts_to_a_million_come_to_the_direct_solution() {
    for (body, tolerance) in [
        (bodies::random_labels(14, 1e3, 0.0, 1), 1e-6),
        (bodies::random_labels(26, 1e5, 0.0, 2), 1e-5),
        (bodies::cut_wires(23, 1e6), 1e-5),
    ] {
        // Bonded: a factorisation needs every rigid motion held.
        let body = Body {
            params: SolveParams {
                ends: Ends::Bonded,
                ..body.params
            },
            ..body
        };
        let (exact, _) = direct::e_app_mpa(&body.specimen, &body.params);
        assert_stated(&body, exact, tolerance);
        assert_stated(&body, exact, 1e-3);
    }
}

#[test]
#[ignore = "some minutes"]
fn two_hundred_random_bodies_state_their_error() {
    const LOOSE_TO_TIGHT: [f64; 3] = [1e-2, 1e-3, 1e-4];
    let mut ratios = [Vec::new(), Vec::new(), Vec::new()];
    for body in (0..200).map(bodies::random_case) {
        let reference = solved(&body, 1e-9);
        // Blocks that only turn about each other bear nothing: there is no error to compare.
        let bears = reference.connected() && reference.moduli.e_app_mpa > 1e-6;
        if !bears {
            continue;
        }
        for (ratios, tolerance) in ratios.iter_mut().zip(LOOSE_TO_TIGHT) {
            let (off, stated, solved) = errors(&body, reference.moduli.e_app_mpa, tolerance);
            assert!(solved.ended.converged(), "{}: {solved:?}", body.name);
            ratios.push((off / stated, body.name.clone()));
        }
    }
    for (ratios, tolerance) in ratios.iter_mut().zip(LOOSE_TO_TIGHT) {
        ratios.sort_by(|a, b| a.0.total_cmp(&b.0));
        let at = |share: f64| ratios[(share * (ratios.len() - 1) as f64) as usize].0;
        let above = ratios.iter().filter(|r| r.0 > 1.0).count();
        println!(
            "{tolerance:.0e}: {} bodies, true over stated 10 / 50 / 90 %: {:.2} {:.2} {:.2}, above 1: {above}, most {:?}",
            ratios.len(),
            at(0.1),
            at(0.5),
            at(0.9),
            ratios.last()
        );
    }
    for ratios in &ratios {
        assert!(ratios.last().unwrap().0 <= MOST);
        // A tenth is the goal in the median; 0.08, 0.07 and 0.04 were found. It is the price of expecting a motion as soft as so many
        // iterations can miss: the worst body is at 0.89 with it and was at 5.8 without.
        assert!(ratios[ratios.len() / 2].0 >= 0.03);
    }
}
