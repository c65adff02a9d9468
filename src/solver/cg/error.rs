//! Owns the estimate of what conjugate gradients has still to gain: the squared energy norm of its error, from the
//! coefficients of its iterations alone.

/// What the iterations so far tell of the error.
///
/// Iteration `j` lowers `‖x − x_j‖²_A` by exactly `α_j r_jᵀz_j` (Hestenes & Stiefel 1952). After `k` iterations,
///
/// `‖x − x_k‖²_A <= φ_k r_kᵀz_k / μ`, with `φ_0 = 1`, `φ_k = φ_{k−1} / (φ_{k−1} + β_k)`, `β_k = r_kᵀz_k / r_{k−1}ᵀz_{k−1}`,
///
/// wherever `μ` is no larger than the smallest eigenvalue of the preconditioned operator (Meurant & Tichý 2019). That
/// eigenvalue is approached from above by `θ_k`, the smallest one of the tridiagonal matrix that the coefficients make up
/// (Lanczos), so `θ_k` alone would promise too much where it still falls. It is taken to fall once more as it has since
/// two thirds of the iterations, and a motion as soft as `k` iterations can miss is always expected to be there:
/// `μ = min(θ_k² / θ_{2k/3}, (π / 2k)² θ_1) / 2.25`. The divisor was set on 195 hard bodies (`reports/stability.md`).
///
/// What an earlier solve with the same preconditioner came to expect is never exceeded, and with it one iteration is enough for an estimate:
/// the bound holds after any number of them.
#[derive(Debug, Clone)]
pub struct EnergyTail {
    /// Expected by an earlier solve, before the divisor.
    known: Option<f64>,
    /// Expected now, before the divisor.
    expected: Option<f64>,
    /// The Lanczos matrix: diagonal, and squares of its off-diagonal.
    diagonal: Vec<f64>,
    off_diagonal: Vec<f64>,
    /// `θ` after each iteration.
    smallest: Vec<f64>,
    total: f64,
    phi: f64,
    /// `α` and `r·z` of the last iteration.
    last: (f64, f64),
    estimate: Option<f64>,
    /// `J(α p)² / (α rᵀz)` of the last iterations: squared change of a functional per decrease.
    sensitivity: [f64; RECENT],
}

impl Default for EnergyTail {
    fn default() -> Self {
        EnergyTail {
            known: None,
            expected: None,
            diagonal: Vec::new(),
            off_diagonal: Vec::new(),
            smallest: Vec::new(),
            total: 0.0,
            phi: 1.0,
            last: (0.0, 0.0),
            estimate: None,
            sensitivity: [0.0; RECENT],
        }
    }
}

/// Iterations before the first estimate: a few eigenvalues tell nothing of the next.
const LEAST_ITERATIONS: usize = 5;

/// Part of the first direction's eigenvalue that a motion may have which `k` iterations have not seen: a polynomial of degree `k` that is
/// 1 at 0 and small from a part `x` of its interval on needs `k` of about `π / 2√x`. A neck across a diagonal had one of 0.004 that
/// twelve iterations showed no sign of.
fn unseen(k: usize) -> f64 {
    (std::f64::consts::FRAC_PI_2 / k as f64).powi(2)
}

/// What the estimate is multiplied by: with it the true error passes the stated one on 2 of 195 hard bodies at some tolerance
/// from 1e-2 to 1e-5, by half at most.
const SAFETY: f64 = 2.25;

/// Iterations up to which the smallest eigenvalue is found again in each; beyond, a hundred times per doubling or so.
const EACH: usize = 200;

/// Past iterations whose largest effect on a functional is expected of later ones.
const RECENT: usize = 3;

impl EnergyTail {
    /// `known`: what [`EnergyTail::eigenvalue`] was after an earlier solve of about this operator with this preconditioner.
    pub fn knowing(known: Option<f64>) -> Self {
        EnergyTail {
            known: known.filter(|v| *v > 0.0),
            ..EnergyTail::default()
        }
    }

    /// The smallest eigenvalue of the preconditioned operator that is to be expected, by all iterations so far, before the divisor.
    pub fn eigenvalue(&self) -> Option<f64> {
        self.expected
    }

    /// Records an iteration: its step `α` and `rᵀz` before it.
    pub fn push(&mut self, alpha: f64, rz: f64) {
        let (alpha_before, rz_before) = self.last;
        let k = self.diagonal.len();
        if k == 0 {
            self.diagonal.push(1.0 / alpha);
        } else {
            let beta = rz / rz_before;
            self.diagonal.push(1.0 / alpha + beta / alpha_before);
            self.off_diagonal.push(beta / (alpha_before * alpha_before));
        }
        self.total += alpha * rz;
        self.last = (alpha, rz);
        let known = self.smallest.last().copied();
        self.smallest.push(match known {
            Some(known) if k > EACH && !k.is_multiple_of(k / EACH + 1) => known,
            known => self.smallest_eigenvalue(known.unwrap_or(self.diagonal[0])),
        });
    }

    /// Records what that iteration changed a functional by.
    pub fn push_change(&mut self, change: f64) {
        let (alpha, rz) = self.last;
        self.sensitivity.rotate_left(1);
        self.sensitivity[RECENT - 1] = change * change / (alpha * rz);
    }

    /// Decrease since the start.
    pub fn total(&self) -> f64 {
        self.total
    }

    /// Estimated squared energy norm of the error after the iterations so far, which left `rz = rᵀz`. To be called once
    /// after each iteration. None while too few have been made.
    pub fn update(&mut self, rz: f64) -> Option<f64> {
        let k = self.diagonal.len();
        if k == 0 {
            return None;
        }
        self.phi /= self.phi + rz / self.last.1;
        self.expected = self.smallest_expected(k);
        if let Some(smallest) = self.expected {
            self.estimate = Some(SAFETY * rz * self.phi / smallest);
        }
        self.estimate
    }

    /// The smallest eigenvalue to be expected after `k` iterations; None where too little is known.
    fn smallest_expected(&self, k: usize) -> Option<f64> {
        let now = self.smallest[k - 1];
        let before = self.smallest[(2 * k / 3).max(1) - 1];
        let seen = now * now / before;
        let own = (k >= LEAST_ITERATIONS).then(|| seen.min(unseen(k) * self.diagonal[0]));
        match (own, self.known) {
            (own, None) => own,
            (own, Some(known)) => Some(known.min(own.unwrap_or(seen))),
        }
    }

    /// The last estimate made.
    pub fn estimate(&self) -> Option<f64> {
        self.estimate
    }

    /// Estimated error of the functional: the energy norm of the error times the most that a unit of it has lately
    /// changed the functional by. None while too few changes are known.
    pub fn goal_estimate(&self) -> Option<f64> {
        if self.diagonal.len() < RECENT {
            return None;
        }
        let most = self.sensitivity.into_iter().fold(0.0, f64::max);
        Some((most * self.estimate?).sqrt())
    }

    /// The larger of the relative errors of the energy and of the functional, should there be one of that value.
    pub fn with_goal(&self, of_energy: Option<f64>, goal_value: Option<f64>) -> Option<f64> {
        match goal_value {
            None => of_energy,
            Some(value) => Some(of_energy?.max(self.goal_estimate()? / value.abs())),
        }
    }

    /// By bisection, a thousandth exact, from a bound above it.
    fn smallest_eigenvalue(&self, above: f64) -> f64 {
        let (mut low, mut high) = (0.5 * above, above);
        while self.has_below(low) && low > f64::MIN_POSITIVE {
            (low, high) = (0.5 * low, low);
        }
        while high - low > 1e-3 * high {
            let middle = 0.5 * (low + high);
            match self.has_below(middle) {
                true => high = middle,
                false => low = middle,
            }
        }
        high
    }

    /// Whether the Lanczos matrix has an eigenvalue below `x`: a negative pivot of `T − x`.
    fn has_below(&self, x: f64) -> bool {
        let mut pivot = self.diagonal[0] - x;
        for (d, squared) in self.diagonal[1..].iter().zip(&self.off_diagonal) {
            if pivot <= 0.0 {
                return true;
            }
            pivot = d - x - squared / pivot;
        }
        pivot <= 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Conjugate gradients on a diagonal matrix from the residual `r`: the estimate over the true error, squared energy
    /// norms, after each of `n` iterations.
    fn ratios(eigenvalues: &[f64], mut r: Vec<f64>, n: usize) -> Vec<f64> {
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let mut tail = EnergyTail::default();
        let mut p = vec![0.0; eigenvalues.len()];
        let mut rz = dot(&r, &r);
        let mut beta = 0.0;
        let mut ratios = Vec::new();
        for _ in 0..n {
            p.iter_mut().zip(&r).for_each(|(p, r)| *p = r + beta * *p);
            let q: Vec<f64> = p.iter().zip(eigenvalues).map(|(p, a)| a * p).collect();
            let alpha = rz / dot(&p, &q);
            r.iter_mut().zip(&q).for_each(|(r, q)| *r -= alpha * q);
            tail.push(alpha, rz);
            let next = dot(&r, &r);
            (beta, rz) = (next / rz, next);
            let error: f64 = r.iter().zip(eigenvalues).map(|(r, a)| r * r / a).sum();
            ratios.extend(tail.update(rz).map(|e| e / error));
        }
        ratios
    }

    #[test]
    fn a_well_conditioned_operator() {
        let eigenvalues: Vec<f64> = (0..200).map(|k| 0.3 + 0.7 * f64::from(k) / 199.0).collect();
        let found = ratios(&eigenvalues, vec![1.0; 200], 12);
        // The safety, and eigenvalues from 0.3 on where (π / 2k)² is expected: 0.1 after five iterations, 0.017 after twelve.
        assert!(found.iter().all(|r| (10.0..110.0).contains(r)), "{found:?}");
    }

    /// A spectrum down to zero, as with a weak preconditioner: the smallest eigenvalue is never found, only approached.
    #[test]
    fn an_eigenvalue_that_is_still_falling() {
        let eigenvalues: Vec<f64> = (1..4000).map(|k| (f64::from(k) / 4000.0).powi(2)).collect();
        // Errors alike in all motions, and larger in soft ones.
        for power in [1.0, 0.5] {
            let start = eigenvalues.iter().map(|v: &f64| v.powf(power)).collect();
            let found = ratios(&eigenvalues, start, 60);
            assert!(found.iter().all(|r| (1.0..5.0).contains(r)), "{found:?}");
        }
    }

    #[test]
    fn the_smallest_eigenvalue_is_found() {
        let n = 40;
        let tail = EnergyTail {
            diagonal: vec![2.0; n],
            off_diagonal: vec![1.0; n - 1],
            ..EnergyTail::default()
        };
        let exact = 2.0 - 2.0 * (std::f64::consts::PI / (n + 1) as f64).cos();
        assert!((tail.smallest_eigenvalue(2.0) / exact - 1.0).abs() < 2e-3);
    }

    /// What another solve found lets the first iterations be judged, and is never exceeded.
    #[test]
    fn a_known_eigenvalue_bounds_the_error_from_the_first_iteration() {
        let eigenvalues: Vec<f64> = (0..200).map(|k| 0.1 + 0.9 * f64::from(k) / 199.0).collect();
        let r = vec![1.0; 200];
        let rz = 200.0;
        let error: f64 = eigenvalues.iter().map(|a| 1.0 / a).sum();
        // One iteration along the residual.
        let alpha = rz / eigenvalues.iter().sum::<f64>();
        let left: Vec<f64> = eigenvalues
            .iter()
            .zip(&r)
            .map(|(a, r)| r - alpha * a)
            .collect();
        let next: f64 = left.iter().map(|v| v * v).sum();
        let mut tail = EnergyTail::knowing(Some(0.1));
        tail.push(alpha, rz);
        let stated = tail.update(next).unwrap();
        assert!(stated >= error - alpha * rz, "{stated}");
        assert_eq!(tail.eigenvalue(), Some(0.1));
        let mut tail = EnergyTail::default();
        tail.push(alpha, rz);
        assert_eq!((tail.update(next), tail.eigenvalue()), (None, None));
    }

    /// A functional along the error itself: its error is `√(J-part)` of the energy's.
    #[test]
    fn a_functional_is_off_by_the_root() {
        let mut tail = EnergyTail::default();
        for k in 0..8 {
            let rz = 0.1f64.powi(k);
            tail.push(1.0, rz);
            tail.push_change(2.0 * rz.sqrt());
            tail.update(0.1 * rz);
        }
        let ratio = tail.goal_estimate().unwrap() / (2.0 * tail.estimate().unwrap().sqrt());
        assert!((ratio - 1.0).abs() < 1e-12, "{ratio}");
    }
}
