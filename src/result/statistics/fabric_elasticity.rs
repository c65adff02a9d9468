//! Owns the fit of Zysset and Curnier's law to the tensors of a cohort: five numbers with confidence intervals.
//!
//! Sources: Zysset & Curnier 1995, Mech. Mater. 21:243; Zysset 2003, J. Biomech. 36:1469 (in engineering constants):
//! `E_i = E0 ρ^k m_i^2l`, `E_i / ν_ij = (E0 / ν0) ρ^k (m_i m_j)^l`, `G_ij = G0 ρ^k (m_i m_j)^l`, with `m1 + m2 + m3 = 3`. Least squares of
//! the logarithms, nine for each tensor.

use super::student::quantile;
use serde::Serialize;

/// One tensor: volume fraction, mean intercept lengths and engineering constants in one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tensor {
    /// Bone volume fraction, 0 to 1.
    pub bv_tv: f64,
    /// Along axes 1, 2, 3.
    pub mil_mm: [f64; 3],
    /// E1, E2, E3.
    pub young_mpa: [f64; 3],
    /// G23, G13, G12.
    pub shear_mpa: [f64; 3],
    /// ν23, ν13, ν12.
    pub poisson: [f64; 3],
}

/// One number of the law.
#[derive(Debug, Clone, PartialEq, Serialize, Default)]
pub struct FabricFitLine {
    /// Boundary conditions of the tensors.
    pub conditions: String,
    /// `E0`, `nu0`, `G0`, `k` or `l`.
    pub parameter: String,
    /// `MPa`, or empty.
    pub unit: String,
    /// The estimate.
    pub value: f64,
    /// Lower end of the 95 % interval (Student's t).
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Tensors.
    pub scans: usize,
    /// Of the logarithms, 0 to 1.
    pub r2: f64,
    /// Scatter of the logarithms, as a percentage of the value: one standard deviation.
    pub scatter_percent: f64,
}

/// Fewer tensors say nothing of the law's five numbers in other bones.
pub const LEAST: usize = 5;

const PAIRS: [[usize; 2]; 3] = [[1, 2], [0, 2], [0, 1]];

/// The law's numbers. None for fewer than [`LEAST`] tensors, constants without a logarithm, or volume fractions or fabrics that do not vary.
pub fn fit(tensors: &[Tensor], conditions: &str) -> Option<Vec<FabricFitLine>> {
    if tensors.len() < LEAST {
        return None;
    }
    // Columns: ln E0, ln (E0 / ν0), ln G0, k, l.
    let mut rows: Vec<([f64; 5], f64)> = Vec::new();
    for t in tensors {
        let sum: f64 = t.mil_mm.iter().sum();
        let m = t.mil_mm.map(|v| (3.0 * v / sum).ln());
        let rho = t.bv_tv.ln();
        for i in 0..3 {
            rows.push(([1.0, 0.0, 0.0, rho, 2.0 * m[i]], t.young_mpa[i].ln()));
            let [a, b] = PAIRS[i];
            let ratio = (t.young_mpa[a] / t.poisson[i]).ln();
            rows.push(([0.0, 1.0, 0.0, rho, m[a] + m[b]], ratio));
            rows.push(([0.0, 0.0, 1.0, rho, m[a] + m[b]], t.shear_mpa[i].ln()));
        }
    }
    if rows
        .iter()
        .any(|(x, y)| !(y.is_finite() && x.iter().all(|v| v.is_finite())))
    {
        return None;
    }
    let (beta, inverse) = solved(&rows)?;
    let dot = |x: &[f64; 5]| (0..5).map(|i| x[i] * beta[i]).sum::<f64>();
    let residual: f64 = rows.iter().map(|(x, y)| (y - dot(x)).powi(2)).sum();
    let mean = rows.iter().map(|r| r.1).sum::<f64>() / rows.len() as f64;
    let total: f64 = rows.iter().map(|r| (r.1 - mean).powi(2)).sum();
    let freedom = (rows.len() - 5) as f64;
    let variance = residual / freedom;
    let t = quantile(freedom);
    // Of a combination c of the five: its value and half its interval.
    let of = |c: [f64; 5]| {
        let spread: f64 = (0..25)
            .map(|k| c[k / 5] * inverse[k / 5][k % 5] * c[k % 5])
            .sum();
        (dot(&c), t * (variance * spread).sqrt())
    };
    let line = |parameter: &str, unit: &str, c: [f64; 5], is_log: bool| {
        let (value, half) = of(c);
        let back = |v: f64| if is_log { v.exp() } else { v };
        FabricFitLine {
            conditions: conditions.to_owned(),
            parameter: parameter.to_owned(),
            unit: unit.to_owned(),
            value: back(value),
            low: back(value - half),
            high: back(value + half),
            scans: tensors.len(),
            r2: 1.0 - residual / total,
            scatter_percent: 100.0 * (variance.sqrt().exp() - 1.0),
        }
    };
    Some(vec![
        line("E0", "MPa", [1.0, 0.0, 0.0, 0.0, 0.0], true),
        line("nu0", "", [1.0, -1.0, 0.0, 0.0, 0.0], true),
        line("G0", "MPa", [0.0, 0.0, 1.0, 0.0, 0.0], true),
        line("k", "", [0.0, 0.0, 0.0, 1.0, 0.0], false),
        line("l", "", [0.0, 0.0, 0.0, 0.0, 1.0], false),
    ])
}

/// Least squares, and the inverse of the normal matrix, by Gauss and Jordan with pivots. None where the columns are not independent.
fn solved(rows: &[([f64; 5], f64)]) -> Option<([f64; 5], [[f64; 5]; 5])> {
    let mut a = [[0.0; 11]; 5];
    for (x, y) in rows {
        for i in 0..5 {
            (0..5).for_each(|j| a[i][j] += x[i] * x[j]);
            a[i][10] += x[i] * y;
        }
    }
    let size: [f64; 5] = std::array::from_fn(|i| a[i][i]);
    (0..5).for_each(|i| a[i][5 + i] = 1.0);
    for column in 0..5 {
        let pivot =
            (column..5).max_by(|&p, &q| a[p][column].abs().total_cmp(&a[q][column].abs()))?;
        a.swap(column, pivot);
        if a[column][column].abs() <= 1e-9 * size[column] {
            return None;
        }
        let scale = a[column][column];
        a[column].iter_mut().for_each(|v| *v /= scale);
        let own = a[column];
        for (_, row) in a.iter_mut().enumerate().filter(|(i, _)| *i != column) {
            let part = row[column];
            row.iter_mut().zip(&own).for_each(|(v, o)| *v -= part * o);
        }
    }
    let inverse = std::array::from_fn(|i| std::array::from_fn(|j| a[i][5 + j]));
    Some((std::array::from_fn(|i| a[i][10]), inverse))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tensors of the law itself, each of whose constants is off by a factor.
    fn of_law(off: impl Fn(usize) -> f64) -> Vec<Tensor> {
        let mut count = 0;
        let mut next = || {
            count += 1;
            off(count)
        };
        (0..8)
            .map(|s| {
                let bv_tv = 0.08 + 0.04 * s as f64;
                let mil_mm = [
                    0.3 + 0.02 * (s % 3) as f64,
                    0.25,
                    0.2 - 0.01 * (s % 4) as f64,
                ];
                let sum: f64 = mil_mm.iter().sum();
                let m = mil_mm.map(|v| 3.0 * v / sum);
                let (rho, l) = (f64::powf(bv_tv, 1.9), 0.9);
                let young_mpa: [f64; 3] =
                    std::array::from_fn(|i| 9000.0 * rho * f64::powf(m[i], 2.0 * l) * next());
                let pair = |i: usize| f64::powf(m[PAIRS[i][0]] * m[PAIRS[i][1]], l);
                Tensor {
                    bv_tv,
                    mil_mm,
                    shear_mpa: std::array::from_fn(|i| 3500.0 * rho * pair(i) * next()),
                    poisson: std::array::from_fn(|i| {
                        young_mpa[PAIRS[i][0]] / (9000.0 / 0.25 * rho * pair(i) * next())
                    }),
                    young_mpa,
                }
            })
            .collect()
    }

    #[test]
    fn the_laws_own_tensors_give_its_numbers() {
        let found = fit(&of_law(|_| 1.0), "mixed").unwrap();
        for (line, exact) in found.iter().zip([9000.0, 0.25, 3500.0, 1.9, 0.9]) {
            assert!((line.value / exact - 1.0).abs() < 1e-9, "{line:?}");
            assert!(line.r2 > 1.0 - 1e-12 && line.scatter_percent < 1e-5 && line.scans == 8);
        }
    }

    #[test]
    fn scatter_widens_the_intervals_about_the_law() {
        let found = fit(
            &of_law(|i| if i % 2 == 0 { 1.1 } else { 1.0 / 1.1 }),
            "mixed",
        )
        .unwrap();
        for (line, exact) in found.iter().zip([9000.0, 0.25, 3500.0, 1.9, 0.9]) {
            assert!(line.low < exact && exact < line.high, "{line:?}");
        }
        assert!((found[0].scatter_percent - 10.0).abs() < 1.5, "{found:?}");
    }

    #[test]
    fn too_few_or_alike_tensors_have_no_fit() {
        let all = of_law(|_| 1.0);
        assert!(fit(&all[..4], "mixed").is_none());
        assert!(fit(&[all[0]; 6], "mixed").is_none());
        let mut broken = all.clone();
        broken[2].poisson[1] = -0.1;
        assert!(fit(&broken, "mixed").is_none());
    }
}
