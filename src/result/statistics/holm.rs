//! Owns Holm's correction of several p values (Holm 1979, <https://www.jstor.org/stable/4615733>).

/// Corrected p values in the order of `p`.
pub fn holm(p: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p.len()).collect();
    order.sort_by(|a, b| p[*a].total_cmp(&p[*b]));
    let mut corrected = vec![0.0; p.len()];
    let mut least: f64 = 0.0;
    for (rank, at) in order.into_iter().enumerate() {
        least = least.max(p[at] * (p.len() - rank) as f64).min(1.0);
        corrected[at] = least;
    }
    corrected
}

#[cfg(test)]
mod tests {
    use super::super::cases::close;
    use super::*;

    // tests/peers/statistics.py, of 0.02, 0.011, 0.5, 0.012
    const HOLM_1: f64 = 0.044;
    const HOLM_2: f64 = 0.044;
    const HOLM_3: f64 = 0.5;
    const HOLM_4: f64 = 0.044;

    #[test]
    fn corrected_values_are_those_of_statsmodels() {
        let found = holm(&[0.02, 0.011, 0.5, 0.012]);
        let expected = [HOLM_1, HOLM_2, HOLM_3, HOLM_4];
        found.iter().zip(expected).for_each(|(f, e)| close(*f, e));
        assert_eq!(holm(&[0.7]), [0.7]);
        assert!(holm(&[]).is_empty());
    }
}
