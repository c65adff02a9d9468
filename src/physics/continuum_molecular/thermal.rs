//! Owns thermal strain: what strains a bond is its deformation less that of free expansion, s − α T̄ with T̄ the mean temperature of its
//! ends (eq. 176).

use super::body::Body;
use super::bond::{Bond, Moduli};

/// What warms a body.
#[derive(Debug, Clone, PartialEq)]
pub struct ThermalStrain {
    /// a11, a22, a12 per degree.
    pub expansion: [f64; 3],
    /// Temperature rise of each point.
    pub rise: Vec<f64>,
}

impl ThermalStrain {
    /// Stretch and shear of bond `b` from `p` to `q` in free expansion.
    pub fn of(&self, p: usize, q: usize, b: &Bond) -> [f64; 2] {
        let [a11, a22, a12] = self.expansion;
        let [x, y] = b.n;
        let mean = 0.5 * (self.rise[p] + self.rise[q]);
        [
            mean * (a11 * x * x + a22 * y * y + 2.0 * a12 * x * y),
            mean * (a12 * (x * x - y * y) + (a22 - a11) * x * y),
        ]
    }

    /// Force on each value: each bond pushes with its stiffness times its stretch and shear in free expansion. `bonds` and `moduli` are
    /// those of the stencil, `cell_mm2` is the volume of a point.
    pub fn forces<const D: usize>(
        &self,
        body: &Body<D>,
        bonds: &[Bond],
        moduli: &[Moduli],
        cell_mm2: f64,
    ) -> Vec<[f64; D]> {
        let row = |p: usize| {
            let mut force = [0.0; D];
            for (q, kind, factor) in body.row(p) {
                let (b, k) = (&bonds[kind], &moduli[kind]);
                let [x, y] = b.n;
                let [stretch, shear] = self.of(p, q, b);
                let weight = factor * b.volume_mm2 * cell_mm2;
                let (axial, lateral) = (weight * k.axial * stretch, weight * k.shear * shear);
                force[0] -= axial * x - lateral * y;
                force[1] -= axial * y + lateral * x;
                if let Some(moment) = force.get_mut(2) {
                    *moment -= 0.5 * lateral * b.length_mm;
                }
            }
            force
        };
        (0..body.family.rows()).map(row).collect()
    }
}
