//! Owns what all conduction shares: its components, the potential between probes, and whether currents find a path through a body whose
//! bonds break.

use super::setup::Setup;
use crate::discretisation::plane::family::Family;
use crate::parts;

pub const CONDUCTED: [&[&str]; 1] = [&["temperature", "potential"]];

/// Time at which schedules of a steady scene are read.
pub const STEADY: f64 = 1.0;

/// Difference of potential between two probes.
pub fn drop(setup: &Setup, probes: [[f64; 2]; 2], values: &[f64]) -> f64 {
    let at = |x| setup.points.nearest(x).map_or(0.0, |p| values[p]);
    at(probes[0]) - at(probes[1])
}

/// Points of pieces, as intact bonds join them, that take up a current and nowhere hold a potential: theirs has no bound.
/// `held` and `force` are by point, `broken` by listed bond.
pub fn isolated(
    family: &Family,
    broken: &[bool],
    held: &[Option<f64>],
    force: &[[f64; 1]],
) -> Vec<bool> {
    let mut up = parts::apart(held.len());
    for p in 0..held.len() {
        for slot in family.range(p).filter(|&slot| !broken[slot]) {
            parts::join(&mut up, p as u32, family.kind(slot).0 as u32);
        }
    }
    let (piece, count) = parts::numbered(up);
    let (mut current, mut is_held) = (vec![0.0; count], vec![false; count]);
    for (p, &piece) in piece.iter().enumerate() {
        current[piece as usize] += force[p][0];
        is_held[piece as usize] |= held[p].is_some();
    }
    let largest = force.iter().fold(0.0_f64, |m, f| m.max(f[0].abs()));
    let is_isolated = |p: usize| !is_held[p] && current[p].abs() > 1e-12 * largest;
    piece.iter().map(|&p| is_isolated(p as usize)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::discretisation::plane::Points;
    use crate::discretisation::plane::family::Stencil;

    /// Four points in a row, the bond in the middle broken: current into the right half goes nowhere, unless something
    /// is held there or as much is taken out.
    #[test]
    fn a_piece_that_holds_no_potential_strands_its_current() {
        let points = Points::from_box([0.0; 2], 1.0, [4, 1], |_| true);
        let family = Family::new(&points, 4, Stencil::new(1.0, 1.01, false).unwrap());
        let cut = |slot: usize, p: usize| (p < 2) != (family.kind(slot).0 < 2);
        let broken: Vec<bool> = (0..4)
            .flat_map(|p| family.range(p).map(move |slot| (slot, p)))
            .map(|(slot, p)| cut(slot, p))
            .collect();
        let intact = vec![false; broken.len()];
        let held = [Some(0.0), None, None, None];
        let force = [[0.0], [0.0], [0.0], [1.0]];
        assert_eq!(isolated(&family, &intact, &held, &force), [false; 4]);
        let half = [false, false, true, true];
        assert_eq!(isolated(&family, &broken, &held, &force), half);
        let both = [Some(0.0), None, Some(1.0), None];
        assert_eq!(isolated(&family, &broken, &both, &force), [false; 4]);
        let round = [[0.0], [0.0], [-1.0], [1.0]];
        assert_eq!(isolated(&family, &broken, &held, &round), [false; 4]);
    }
}
