//! Owns an operator as an assembled matrix, found by applying it to combs of unit displacements whose answers do not
//! overlap. For small models: direct solution, inertia.

use crate::operator::Operator;
use crate::operator::held::Held;
use crate::operator::sparse::Sparse;
use std::collections::HashMap;

/// The matrix of the free unknowns that have stiffness.
pub struct Probed {
    pub matrix: Sparse,
    /// Site and component of each unknown.
    pub unknowns: Vec<(usize, usize)>,
}

/// `at` are the sites' places on an integer grid (two free sites never share one), `reach` how far, along an axis, one
/// site's displacement can be felt. Takes `3 (2 reach + 1)³` applications.
pub fn probe(operator: &impl Operator<3>, held: &Held, at: &[[i32; 3]], reach: i32) -> Probed {
    let n = operator.sites();
    let mut diagonal = vec![[0.0; 3]; n];
    operator.diagonal(&mut diagonal);
    let is_free = |site: usize, c: usize| !held.is_held(site, c) && diagonal[site][c] > 0.0;
    let unknowns: Vec<(usize, usize)> = (0..3 * n)
        .map(|k| (k / 3, k % 3))
        .filter(|&(site, c)| is_free(site, c))
        .collect();
    let mut number = vec![[u32::MAX; 3]; n];
    for (k, &(site, c)) in unknowns.iter().enumerate() {
        number[site][c] = k as u32;
    }
    let site_at: HashMap<[i32; 3], usize> = (0..n)
        .filter(|&site| (0..3).any(|c| is_free(site, c)))
        .map(|site| (at[site], site))
        .collect();
    let mut rows: Vec<Vec<(u32, f64)>> = vec![Vec::new(); unknowns.len()];
    let (mut x, mut y) = (vec![[0.0; 3]; n], vec![[0.0; 3]; n]);
    let period = 2 * reach + 1;
    for comb in 0..period.pow(3) {
        let tooth = [comb % period, comb / period % period, comb / period.pow(2)];
        for c in 0..3 {
            for site in 0..n {
                let on = (0..3).all(|a| (at[site][a] - tooth[a]).rem_euclid(period) == 0);
                x[site] = [0.0; 3];
                if on && is_free(site, c) {
                    x[site][c] = 1.0;
                }
            }
            operator.apply(&x, &mut y);
            for (k, &(site, d)) in unknowns.iter().enumerate() {
                if y[site][d] == 0.0 {
                    continue;
                }
                let source = std::array::from_fn(|a| {
                    let ahead = (tooth[a] - at[site][a]).rem_euclid(period);
                    at[site][a] + ahead - if ahead > reach { period } else { 0 }
                });
                if let Some(&from) = site_at.get(&source)
                    && number[from][c] != u32::MAX
                {
                    rows[k].push((number[from][c], y[site][d]));
                }
            }
        }
    }
    let (mut start, mut column, mut value) = (vec![0], Vec::new(), Vec::new());
    for mut row in rows {
        row.sort_unstable_by_key(|entry| entry.0);
        column.extend(row.iter().map(|entry| entry.0));
        value.extend(row.iter().map(|entry| entry.1));
        start.push(column.len() as u32);
    }
    Probed {
        matrix: Sparse {
            start,
            column,
            value,
        },
        unknowns,
    }
}

impl Probed {
    /// `D^−½ A D^−½ − shift`, with `D` the diagonal.
    pub fn scaled(&self, shift: f64) -> Sparse {
        let a = &self.matrix;
        let entry = |i: usize| a.row(i).find(|e| e.0 == i).map_or(1.0, |e| e.1);
        let scale: Vec<f64> = (0..a.n()).map(|i| entry(i).sqrt().recip()).collect();
        let mut out = a.clone();
        for i in 0..a.n() {
            for k in a.start[i] as usize..a.start[i + 1] as usize {
                let j = a.column[k] as usize;
                let own = if i == j { shift } else { 0.0 };
                out.value[k] = a.value[k] * scale[i] * scale[j] - own;
            }
        }
        out
    }
}
