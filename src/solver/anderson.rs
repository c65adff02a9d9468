//! Owns Anderson acceleration: of the last updates of a fixed-point iteration, the combination that leaves the least.
//! Walker and Ni (2011), doi 10.1137/10078356X, with the window below.

/// Updates kept.
const WINDOW: usize = 5;

/// The last iterates' differences, those of their updates, and the last of both.
#[derive(Default)]
pub struct Anderson {
    steps: Vec<Vec<f64>>,
    changes: Vec<Vec<f64>>,
    last: Option<(Vec<f64>, Vec<f64>)>,
    weight: [f64; 2],
}

impl Anderson {
    /// Forgets all iterates: the map has changed.
    pub fn restart(&mut self) {
        *self = Anderson::default();
    }

    /// The next iterate from `q` and the map's update `f` there. The first `local` unknowns and the others are of
    /// different kinds: each is measured by the size of its first update.
    pub fn next(&mut self, q: &[f64], f: &[f64], local: usize) -> Vec<f64> {
        match self.last.take() {
            None => {
                let size = |f: &[f64]| dot(f, f).max(f64::MIN_POSITIVE).recip();
                self.weight = [size(&f[..local]), size(&f[local..])];
            }
            Some((q0, f0)) => {
                if self.steps.len() == WINDOW {
                    self.steps.remove(0);
                    self.changes.remove(0);
                }
                self.steps.push(minus(q, &q0));
                self.changes.push(minus(f, &f0));
            }
        }
        self.last = Some((q.to_vec(), f.to_vec()));
        let mut next: Vec<f64> = q.iter().zip(f).map(|(q, f)| q + f).collect();
        for ((step, change), g) in self.steps.iter().zip(&self.changes).zip(self.mix(f, local)) {
            let both = step.iter().zip(change);
            next.iter_mut()
                .zip(both)
                .for_each(|(n, (s, c))| *n -= g * (s + c));
        }
        next
    }

    /// `γ` that minimises `|f − Σ γ_k change_k|`, by the normal equations, slightly regularised.
    fn mix(&self, f: &[f64], local: usize) -> Vec<f64> {
        let m = self.changes.len();
        let inner = |a: &[f64], b: &[f64]| {
            self.weight[0] * dot(&a[..local], &b[..local])
                + self.weight[1] * dot(&a[local..], &b[local..])
        };
        let row = |i: usize| {
            let mut row: Vec<f64> = (0..m)
                .map(|j| inner(&self.changes[i], &self.changes[j]))
                .collect();
            row[i] *= 1.0 + 1e-10;
            row.push(inner(&self.changes[i], f));
            row
        };
        solve((0..m).map(row).collect())
    }
}

/// Gauss elimination of a small positive definite system, its right-hand side in the last column.
fn solve(mut a: Vec<Vec<f64>>) -> Vec<f64> {
    let m = a.len();
    for k in 0..m {
        if a[k][k] <= 0.0 {
            return vec![0.0; m];
        }
        let pivot = a[k].clone();
        for row in &mut a[k + 1..] {
            let factor = row[k] / pivot[k];
            row.iter_mut()
                .zip(&pivot)
                .for_each(|(v, p)| *v -= factor * p);
        }
    }
    let mut x = vec![0.0; m];
    for k in (0..m).rev() {
        let known: f64 = (k + 1..m).map(|j| a[k][j] * x[j]).sum();
        x[k] = (a[k][m] - known) / a[k][k];
    }
    x
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn minus(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A linear map of six unknowns with contraction 0.9: eight plain iterations would leave 4 of 10. A window of six
    /// would be exact after seven; five leaves 1.1e-4 after eight.
    #[test]
    fn a_linear_map_is_solved_in_about_as_many_iterations_as_unknowns() {
        let update = |q: &[f64]| -> Vec<f64> {
            let rate = |k: usize| 0.9 - 0.17 * k as f64;
            (0..6)
                .map(|k| (rate(k) - 1.0) * (q[k] - k as f64))
                .collect()
        };
        let mut anderson = Anderson::default();
        let mut q = vec![10.0; 6];
        for _ in 0..8 {
            q = anderson.next(&q, &update(&q), 2);
        }
        let error = (0..6).map(|k| (q[k] - k as f64).abs()).fold(0.0, f64::max);
        assert!(error < 1e-3, "{error:e}");
    }
}
