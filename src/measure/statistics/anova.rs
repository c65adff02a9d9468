//! Owns one-way analysis of variance with repeated measures: do methods differ on the same specimens?

use super::mean;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Default)]
pub struct Anova {
    pub specimens: usize,
    pub methods: usize,
    pub f: f64,
    /// Degrees of freedom of methods and of error.
    pub df_methods: usize,
    pub df_error: usize,
    /// Sphericity assumed.
    pub p: f64,
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
    let fisher = FisherSnedecor::new(df_methods as f64, df_error as f64).ok()?;
    f.is_finite().then(|| Anova {
        specimens: n,
        methods: k,
        f,
        df_methods,
        df_error,
        p: fisher.sf(f),
    })
}

#[cfg(test)]
mod tests {
    use super::super::cases::{A, B, C, close};
    use super::*;

    // tests/peers/statistics.py
    const RM_F: f64 = 8.66360983166662;
    const RM_P: f64 = 0.0035599449605832065;

    #[test]
    fn f_and_p_are_those_of_statsmodels() {
        let found = repeated_measures(&[A.to_vec(), B.to_vec(), C.to_vec()]).unwrap();
        close(found.f, RM_F);
        close(found.p, RM_P);
        assert_eq!((found.df_methods, found.df_error), (2, 14));
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
