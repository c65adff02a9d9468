//! Owns the estimate of what conjugate gradients has still to gain: the squared energy norm of its error.

/// Squared energy-norm decreases of the iterations so far.
///
/// Iteration `j` lowers `‖x − x_j‖²_A` by exactly `α_j r_jᵀz_j` (Hestenes & Stiefel 1952), so the error left after `k`
/// iterations is the sum over all later ones. It is estimated from two neighbouring windows of past iterations, as the
/// rest of the geometric series that their sums begin; the worse of a short and a long window counts, and the worse of
/// this iteration's estimate and the last one's: a single step can gain next to nothing just before one that gains much
/// (seen on struts with hinges, where that one step's estimate was 35 times too small).
#[derive(Debug, Clone, Default)]
pub struct EnergyTail {
    decreases: Vec<f64>,
    total: f64,
}

/// Ratio of neighbouring windows beyond which the series is not extrapolated further: at 0.95 the rest is 19 windows.
const SLOWEST_RATIO: f64 = 0.95;

/// Iterations before the first window; the first estimate comes one later.
const LEAST_ITERATIONS: usize = 4;

impl EnergyTail {
    /// Records one iteration's `α_j r_jᵀz_j`.
    pub fn push(&mut self, decrease: f64) {
        self.decreases.push(decrease);
        self.total += decrease;
    }

    /// Decrease since the start.
    pub fn total(&self) -> f64 {
        self.total
    }

    /// Estimated squared energy norm of the current error; None while too few iterations have been made.
    pub fn estimate(&self) -> Option<f64> {
        let k = self.decreases.len();
        if k <= LEAST_ITERATIONS {
            return None;
        }
        let now = self.after(k);
        // What this iteration gained is no longer left.
        let before = self.after(k - 1) - self.decreases[k - 1];
        Some(now.max(before))
    }

    /// The estimate after the first `k` iterations, by themselves.
    fn after(&self, k: usize) -> f64 {
        self.rest(k, (k / 8).max(1))
            .max(self.rest(k, (k / 4).max(2)))
    }

    /// Rest of the geometric series whose two last terms are the sums over the last two windows of length `w`.
    fn rest(&self, k: usize, w: usize) -> f64 {
        // Summed from the decreases themselves: differences of running totals would end at the totals' rounding.
        let last: f64 = self.decreases[k - w..k].iter().sum();
        let before: f64 = self.decreases[k - 2 * w..k - w].iter().sum();
        if last <= 0.0 {
            return 0.0;
        }
        let ratio = (last / before.max(f64::MIN_POSITIVE)).min(SLOWEST_RATIO);
        last * ratio / (1.0 - ratio)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_geometric_series_is_summed_exactly() {
        let mut tail = EnergyTail::default();
        for j in 0..40 {
            tail.push(0.8f64.powi(j));
        }
        let rest = 0.8f64.powi(40) / 0.2;
        assert!((tail.estimate().unwrap() / rest - 1.0).abs() < 1e-10);
    }

    #[test]
    fn a_single_idle_step_is_not_taken_for_the_end() {
        let mut tail = EnergyTail::default();
        for j in 0..20 {
            tail.push(if j == 19 { 1e-9 } else { 0.7f64.powi(j) });
        }
        let rest = 0.7f64.powi(19) / 0.3;
        assert!(tail.estimate().unwrap() > 0.5 * rest);
    }

    #[test]
    fn a_plateau_is_not_taken_for_the_end() {
        // Fast at first, then slow: the estimate must follow the slow part.
        let mut tail = EnergyTail::default();
        for j in 0..400 {
            tail.push(0.7f64.powi(j) + 1e-4 * 0.995f64.powi(j));
        }
        let rest = 1e-4 * 0.995f64.powi(400) / 0.005;
        let ratio = tail.estimate().unwrap() / rest;
        assert!((0.5..3.0).contains(&ratio), "{ratio}");
    }
}
