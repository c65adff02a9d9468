//! Owns one-way analysis of variance with repeated measures: do methods differ on the same specimens?

use super::{deviations, mean};
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

/// One-way analysis of variance with repeated measures.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Default)]
pub struct Anova {
    /// Specimens that all methods have.
    pub specimens: usize,
    /// Number of methods.
    pub methods: usize,
    /// Mean square between methods over that of the error.
    pub f: f64,
    /// Degrees of freedom of methods and of error.
    pub df_methods: usize,
    /// Degrees of freedom of the error.
    pub df_error: usize,
    /// Sphericity assumed: differences between any two methods vary alike.
    pub p: f64,
    /// How far from sphericity: 1 where it holds, 1 / (methods − 1) at worst.
    pub epsilon: f64,
    /// With both degrees of freedom times `epsilon` (Greenhouse and Geisser 1959, <https://doi.org/10.1007/BF02289823>).
    pub p_greenhouse_geisser: f64,
}

/// `values[m][s]` is the value of method `m` on specimen `s`. None for fewer than two of either, or without any error.
pub fn repeated_measures(values: &[Vec<f64>]) -> Option<Anova> {
    let (k, n) = (values.len(), values.first()?.len());
    if k < 2 || n < 2 || values.iter().any(|v| v.len() != n) {
        return None;
    }
    let method: Vec<f64> = values.iter().map(|v| mean(v)).collect();
    let specimen: Vec<f64> = (0..n)
        .map(|s| values.iter().map(|v| v[s]).sum::<f64>() / k as f64)
        .collect();
    let grand = mean(&method);
    let square = |d: f64| d * d;
    let between: f64 = n as f64 * method.iter().map(|m| square(m - grand)).sum::<f64>();
    let error: f64 = (0..k)
        .flat_map(|m| (0..n).map(move |s| (m, s)))
        .map(|(m, s)| square(values[m][s] - method[m] - specimen[s] + grand))
        .sum();
    let total: f64 = values.iter().flatten().map(|v| square(v - grand)).sum();
    // Squares of rounding errors are some 1e-32 of the squares of the values.
    if error <= 1e-28 * total {
        return None;
    }
    let (df_methods, df_error) = (k - 1, (k - 1) * (n - 1));
    let f = (between / df_methods as f64) / (error / df_error as f64);
    let epsilon = epsilon(values)?;
    let p = |share: f64| {
        let fisher = FisherSnedecor::new(share * df_methods as f64, share * df_error as f64);
        Some(fisher.ok()?.sf(f))
    };
    f.is_finite().then_some(())?;
    Some(Anova {
        specimens: n,
        methods: k,
        f,
        df_methods,
        df_error,
        p: p(1.0)?,
        epsilon,
        p_greenhouse_geisser: p(epsilon)?,
    })
}

/// `(tr S)² / ((k − 1) Σ S_ij²)` of the covariance S of k methods over specimens, its rows' and columns' means taken off
/// (Box 1954, <https://doi.org/10.1214/aoms/1177728717>). None where methods differ by constants only.
fn epsilon(values: &[Vec<f64>]) -> Option<f64> {
    let k = values.len();
    let covariance: Vec<Vec<f64>> = values
        .iter()
        .map(|a| values.iter().map(|b| deviations(a, b)).collect())
        .collect();
    let of_row: Vec<f64> = covariance.iter().map(|row| mean(row)).collect();
    let of_all = mean(&of_row);
    let centred = |i: usize, j: usize| covariance[i][j] - of_row[i] - of_row[j] + of_all;
    let trace: f64 = (0..k).map(|i| centred(i, i)).sum();
    let squares: f64 = (0..k * k).map(|at| centred(at / k, at % k).powi(2)).sum();
    let epsilon = trace * trace / ((k - 1) as f64 * squares);
    let least = 1.0 / (k - 1) as f64;
    epsilon.is_finite().then(|| epsilon.clamp(least, 1.0))
}

#[cfg(test)]
mod tests {
    use super::super::agreement::agreement;
    use super::super::cases::{A, B, C, close};
    use super::*;

    // tests/peers/statistics.py
    const RM_F: f64 = 8.66360983166662;
    const RM_P: f64 = 0.0035599449605832065;
    const GG_EPSILON: f64 = 0.5731214279270012;
    const GG_P: f64 = 0.016524799104382513;

    #[test]
    fn f_and_p_are_those_of_statsmodels() {
        let found = repeated_measures(&[A.to_vec(), B.to_vec(), C.to_vec()]).unwrap();
        close(found.f, RM_F);
        close(found.p, RM_P);
        assert_eq!((found.df_methods, found.df_error), (2, 14));
    }

    #[test]
    fn the_correction_is_that_of_pingouin() {
        let found = repeated_measures(&[A.to_vec(), B.to_vec(), C.to_vec()]).unwrap();
        close(found.epsilon, GG_EPSILON);
        close(found.p_greenhouse_geisser, GG_P);
    }

    /// Closed form: F = t², whose p is the paired t test's; there is no sphericity to violate.
    #[test]
    fn of_two_methods_it_is_the_paired_t_test() {
        let found = repeated_measures(&[A.to_vec(), B.to_vec()]).unwrap();
        let t = agreement(&A, &B).unwrap();
        close(found.f, (t.bias / t.sd).powi(2) * 8.0);
        close(found.p, t.bias_p.unwrap());
        assert_eq!(found.epsilon, 1.0);
        close(found.p_greenhouse_geisser, t.bias_p.unwrap());
    }

    /// Closed form: the mean of two methods as a third leaves F = t² on one contrast, ε = 1/2, and the t test's p.
    #[test]
    fn a_third_method_that_follows_from_two_corrects_to_the_paired_t_test() {
        let between: Vec<f64> = A.iter().zip(B).map(|(a, b)| 0.5 * (a + b)).collect();
        let found = repeated_measures(&[A.to_vec(), between, B.to_vec()]).unwrap();
        let t = agreement(&A, &B).unwrap();
        close(found.f, (t.bias / t.sd).powi(2) * 8.0);
        close(found.epsilon, 0.5);
        close(found.p_greenhouse_geisser, t.bias_p.unwrap());
        assert!(found.p < 0.9 * t.bias_p.unwrap(), "{found:?}");
    }

    /// Closed form: contrasts of equal size that do not correlate are spherical.
    #[test]
    fn spherical_methods_need_no_correction() {
        // Over four specimens both contrasts of three methods, orthogonal to each other.
        let (u, v) = ([1.0, 1.0, -1.0, -1.0], [1.0, -1.0, 1.0, -1.0]);
        let weights = [[0.5, 0.75f64.sqrt()], [0.5, -(0.75f64.sqrt())], [-1.0, 0.0]];
        let values: Vec<Vec<f64>> = (0..3)
            .map(|m| {
                let of = |s: usize| weights[m][0] * u[s] + weights[m][1] * v[s] + m as f64;
                (0..4).map(of).collect()
            })
            .collect();
        close(repeated_measures(&values).unwrap().epsilon, 1.0);
    }

    #[test]
    fn a_shift_common_to_all_methods_changes_nothing() {
        let shifted =
            |v: &[f64]| -> Vec<f64> { v.iter().zip(A).map(|(v, a)| v + 7.0 * a).collect() };
        let plain = repeated_measures(&[A.to_vec(), B.to_vec(), C.to_vec()]).unwrap();
        let moved = repeated_measures(&[shifted(&A), shifted(&B), shifted(&C)]).unwrap();
        assert!(
            (plain.f / moved.f - 1.0).abs() < 1e-9,
            "{} {}",
            plain.f,
            moved.f
        );
    }

    #[test]
    fn too_little_data_has_no_anova() {
        assert_eq!(repeated_measures(&[]), None);
        assert_eq!(repeated_measures(&[A.to_vec()]), None);
        assert_eq!(repeated_measures(&[A.to_vec(), A.to_vec()]), None);
    }
}
