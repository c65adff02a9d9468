//! Owns the stress on sections: the force of the bonds that cross a point's own part of a plane through it (eqs. 83, 84).

use crate::scene::continuum_molecular::setup::Setup;
use crate::scene::continuum_molecular::solid::Solid;

/// Tractions on the planes normal to the first and to the second axis through each point, [σ11, σ21] and [σ12, σ22] (MPa).
pub struct Sections {
    pub normal_x: Vec<[f64; 2]>,
    pub normal_y: Vec<[f64; 2]>,
}

/// Each bond pulls through every plane that lies between its ends or at its lower one, at the point of the plane's row that is
/// nearest to where it crosses, and half at each of two that are equally near. A point's part of the plane is one spacing wide.
pub fn sections<const D: usize>(solid: &Solid<D>, setup: &Setup, x: &[[f64; D]]) -> Sections {
    let n = setup.points.len();
    let mut all = Sections {
        normal_x: vec![[0.0; 2]; n],
        normal_y: vec![[0.0; 2]; n],
    };
    let width = setup.points.spacing;
    for p in 0..n {
        let here = setup.points.cell(p);
        for (q, kind, factor) in solid.body.row(p) {
            let there = setup.points.cell(q);
            let step = [there[0] - here[0], there[1] - here[1]];
            if step[0] <= 0 && step[1] <= 0 {
                continue;
            }
            let (b, k) = (&setup.bonds[kind], &solid.moduli[kind]);
            let d = solid.strained(x, p, q, b);
            let weight = factor * b.volume_mm2 * setup.cell / width;
            let (axial, lateral) = (weight * k.axial * d.stretch, weight * k.shear * d.shear);
            let [nx, ny] = b.n;
            // What the far side pulls the near one by.
            let force = [axial * nx - lateral * ny, axial * ny + lateral * nx];
            for (normal, out) in [&mut all.normal_x, &mut all.normal_y]
                .into_iter()
                .enumerate()
            {
                for crossed in 0..step[normal].max(0) {
                    for (cell, share) in nearest(here, step, normal, crossed) {
                        if let Some(point) = setup.points.at(cell) {
                            out[point][0] += share * force[0];
                            out[point][1] += share * force[1];
                        }
                    }
                }
            }
        }
    }
    all
}

/// Cells nearest to where a bond of `step` from `here` crosses the row `crossed` steps on along `normal`, with its share of each.
fn nearest(here: [i32; 2], step: [i32; 2], normal: usize, crossed: i32) -> [([i32; 2], f64); 2] {
    let along = 1 - normal;
    // Where it crosses, in steps along the row: `crossed * step[along] / step[normal]`, rounded down after half a step.
    let twice = 2 * crossed * step[along] + step[normal];
    let low = twice.div_euclid(2 * step[normal]);
    let is_between = twice.rem_euclid(2 * step[normal]) == 0;
    let cell = |off: i32| {
        let mut cell = here;
        cell[normal] += crossed;
        cell[along] += off;
        cell
    };
    match is_between {
        true => [(cell(low), 0.5), (cell(low - 1), 0.5)],
        false => [(cell(low), 1.0), (cell(low), 0.0)],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bond_crosses_at_the_nearest_point_or_between_two() {
        // Up two rows and one to the side: through its own point, then midway between two columns.
        assert_eq!(nearest([5, 5], [1, 2], 1, 0)[0], ([5, 5], 1.0));
        let between = nearest([5, 5], [1, 2], 1, 1);
        assert_eq!(between, [([6, 6], 0.5), ([5, 6], 0.5)]);
        let left = nearest([5, 5], [-1, 2], 1, 1);
        assert_eq!(left, [([5, 6], 0.5), ([4, 6], 0.5)]);
        // Along x: three columns on, two rows up.
        assert_eq!(nearest([0, 0], [3, 2], 0, 1)[0], ([1, 1], 1.0));
        assert_eq!(nearest([0, 0], [3, 2], 0, 2)[0], ([2, 1], 1.0));
    }
}
