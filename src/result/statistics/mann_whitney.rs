//! Owns the Mann–Whitney test of two independent groups (Mann and Whitney 1947,
//! <https://doi.org/10.1214/aoms/1177730491>): whether values of one tend to be larger.

use serde::Serialize;
use statrs::distribution::{ContinuousCDF, Normal};

/// The exact distribution is used where one group has at most this many values and no two values are equal.
const EXACT: usize = 8;

/// The test's statistic and p.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Default)]
pub struct MannWhitney {
    /// Pairs in which the value of the first group is larger; equal ones count half.
    pub u: f64,
    /// Two-sided.
    pub p: f64,
}

/// None where a group is empty.
pub fn mann_whitney(a: &[f64], b: &[f64]) -> Option<MannWhitney> {
    let (na, nb) = (a.len(), b.len());
    if na == 0 || nb == 0 {
        return None;
    }
    let pair = |x: &f64, y: &f64| match x.total_cmp(y) {
        std::cmp::Ordering::Greater => 1.0,
        std::cmp::Ordering::Equal => 0.5,
        std::cmp::Ordering::Less => 0.0,
    };
    let u: f64 = a
        .iter()
        .flat_map(|x| b.iter().map(move |y| pair(x, y)))
        .sum();
    let pairs = (na * nb) as f64;
    let larger = u.max(pairs - u);
    let ties = ties(a, b);
    let exact = na.min(nb) <= EXACT && ties == 0.0;
    let p = match exact {
        true => 2.0 * exact_tail(larger.round() as usize, na, nb),
        false => 2.0 * normal_tail(larger, (na as f64, nb as f64), ties),
    };
    Some(MannWhitney { u, p: p.min(1.0) })
}

/// `Σ (t³ − t)` over the values that occur `t` times in both groups together.
fn ties(a: &[f64], b: &[f64]) -> f64 {
    let mut all: Vec<f64> = a.iter().chain(b).copied().collect();
    all.sort_by(f64::total_cmp);
    all.chunk_by(|x, y| x == y)
        .map(|same| (same.len() as f64).powi(3) - same.len() as f64)
        .sum()
}

/// P(U >= u) where all orders of the values are alike: coefficients of `Π (1 − q^(nb+i)) / (1 − q^i)`.
fn exact_tail(u: usize, na: usize, nb: usize) -> f64 {
    let (few, many) = (na.min(nb), na.max(nb));
    let mut ways = vec![0.0; na * nb + 1];
    ways[0] = 1.0;
    for i in 1..=few {
        for at in (many + i..ways.len()).rev() {
            ways[at] -= ways[at - many - i];
        }
        for at in i..ways.len() {
            ways[at] += ways[at - i];
        }
    }
    let all: f64 = ways.iter().sum();
    ways.iter().skip(u).sum::<f64>() / all
}

/// The same by the normal distribution, with the correction for ties and for continuity.
fn normal_tail(u: f64, (na, nb): (f64, f64), ties: f64) -> f64 {
    let n = na + nb;
    let variance = na * nb / 12.0 * (n + 1.0 - ties / (n * (n - 1.0)));
    let z = (u - 0.5 * na * nb - 0.5) / variance.sqrt();
    match z.is_finite() {
        true => Normal::standard().sf(z),
        false => 0.5,
    }
}

#[cfg(test)]
mod tests {
    use super::super::cases::{A, B, close};
    use super::*;

    // tests/peers/statistics.py
    const MW_U: f64 = 1.0;
    const MW_P: f64 = 0.015873015873015872;
    const MW_TIED_U: f64 = 2.5;
    const MW_TIED_P: f64 = 0.04387800789041375;

    #[test]
    fn exact_and_tied_values_are_those_of_scipy() {
        let exact = mann_whitney(&A[..5], &B[3..]).unwrap();
        close(exact.u, MW_U);
        close(exact.p, MW_P);
        let rounded = |v: &[f64]| -> Vec<f64> { v.iter().map(|x| (x / 20.0).round()).collect() };
        let tied = mann_whitney(&rounded(&A[..5]), &rounded(&B[3..])).unwrap();
        close(tied.u, MW_TIED_U);
        close(tied.p, MW_TIED_P);
    }

    #[test]
    fn values_that_are_all_alike_do_not_differ() {
        assert_eq!(mann_whitney(&[1.0; 4], &[1.0; 5]).unwrap().p, 1.0);
        assert_eq!(mann_whitney(&[], &[1.0]), None);
        // Three against three, all above: 2 of 20 orders.
        close(mann_whitney(&A[5..], &A[..3]).unwrap().p, 0.1);
    }
}
