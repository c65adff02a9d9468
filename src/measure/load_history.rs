//! Owns the estimate of daily loads from a bone's structure: the unit loads whose energy densities, added up, load the tissue most evenly.
//!
//! Source: Christen et al. 2012, Bone 51:620 (load estimation by bone remodelling); the numbers (target 0.02 MPa, fields capped at their
//! 95th percentile) are those of ParOSol's package. Loads act one after the other: energies add up, displacements do not.

/// Percentile of each field that larger values are lowered to: peaks at supports and single voxels are no tissue loading.
const CAP: f64 = 0.95;

/// More loads than this are not tried: every set of them is.
pub const MOST_LOADS: usize = 10;

/// What unit loads were found to act with.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// Of each energy field over the square of its unit load, N² or (N mm)².
    pub factors: Vec<f64>,
    /// Of each load, N or N mm: the root of its factor.
    pub amplitudes: Vec<f64>,
    /// Share of each load in the sum of the combined energy.
    pub shares: Vec<f64>,
    /// Energy density of all loads by voxel, capped, MPa.
    pub combined_mpa: Vec<f32>,
    /// Mean of `combined_mpa`.
    pub mean_mpa: f64,
    /// Standard deviation of `combined_mpa`.
    pub sd_mpa: f64,
}

/// Non-negative least squares of `Σ x_i s_i(v) = target_mpa` over the voxels `v`. `s_i` is `energies_mpa[i]` over the square of
/// `loads[i]` (N, N mm), capped. None where no load strains anything, lengths differ, or there are more than [`MOST_LOADS`].
pub fn estimate(energies_mpa: &[Vec<f32>], loads: &[f64], target_mpa: f64) -> Option<Estimate> {
    let count = energies_mpa.first()?.len();
    let alike = energies_mpa.iter().all(|e| e.len() == count) && loads.len() == energies_mpa.len();
    let usable = loads.iter().all(|l| *l > 0.0 && l.is_finite()) && target_mpa > 0.0;
    if !alike || !usable || count == 0 || loads.len() > MOST_LOADS {
        return None;
    }
    let mut caps = Vec::new();
    for (energy, load) in energies_mpa.iter().zip(loads) {
        caps.push((1.0 / (load * load), percentile(energy, CAP)));
    }
    let unit = |i: usize, v: usize| {
        let (scale, cap) = caps[i];
        f64::from(energies_mpa[i][v]).min(cap) * scale
    };
    let n = loads.len();
    let sum = |of: &dyn Fn(usize) -> f64| (0..count).map(of).sum::<f64>();
    let sums: Vec<f64> = (0..n).map(|i| sum(&|v| unit(i, v))).collect();
    let gram: Vec<Vec<f64>> = (0..n)
        .map(|i| (0..n).map(|j| sum(&|v| unit(i, v) * unit(j, v))).collect())
        .collect();
    let factors = least(&gram, &sums, target_mpa)?;
    let total = |v: usize| (0..n).map(|i| factors[i] * unit(i, v)).sum::<f64>();
    let mut combined_mpa: Vec<f32> = (0..count).map(|v| total(v) as f32).collect();
    let cap = percentile(&combined_mpa, CAP) as f32;
    combined_mpa.iter_mut().for_each(|v| *v = v.min(cap));
    let mean_mpa = combined_mpa.iter().map(|v| f64::from(*v)).sum::<f64>() / count as f64;
    let squared = combined_mpa
        .iter()
        .map(|v| (f64::from(*v) - mean_mpa).powi(2));
    let sd_mpa = (squared.sum::<f64>() / count as f64).sqrt();
    let whole: f64 = (0..n).map(|i| factors[i] * sums[i]).sum();
    Some(Estimate {
        amplitudes: factors.iter().map(|f| f.sqrt()).collect(),
        shares: (0..n).map(|i| factors[i] * sums[i] / whole).collect(),
        factors,
        combined_mpa,
        mean_mpa,
        sd_mpa,
    })
}

/// The non-negative factors of least squared distance, by trying every set of loads that are not zero.
fn least(gram: &[Vec<f64>], sums: &[f64], target: f64) -> Option<Vec<f64>> {
    let n = sums.len();
    let mut best: Option<(f64, Vec<f64>)> = None;
    for set in 1u32..1 << n {
        let chosen: Vec<usize> = (0..n).filter(|i| set >> i & 1 == 1).collect();
        let Some(x) = solved(gram, sums, &chosen) else {
            continue;
        };
        if x.iter().any(|v| *v < 0.0) {
            continue;
        }
        // The squared distance falls by target² Σ b x from that of no loads.
        let gain: f64 = chosen.iter().zip(&x).map(|(i, x)| sums[*i] * x).sum();
        if best.as_ref().is_none_or(|(most, _)| gain > *most) {
            let mut factors = vec![0.0; n];
            chosen
                .iter()
                .zip(&x)
                .for_each(|(i, x)| factors[*i] = target * x);
            best = Some((gain, factors));
        }
    }
    best.map(|(_, factors)| factors)
}

/// `G x = b` of the chosen rows and columns, by Cholesky of the matrix scaled to a diagonal of 1. None where loads are multiples of each other.
fn solved(gram: &[Vec<f64>], b: &[f64], chosen: &[usize]) -> Option<Vec<f64>> {
    let n = chosen.len();
    let scale: Vec<f64> = chosen.iter().map(|&i| gram[i][i].sqrt()).collect();
    if scale.iter().any(|s| !(*s > 0.0 && s.is_finite())) {
        return None;
    }
    let mut l = vec![vec![0.0; n]; n];
    for i in 0..n {
        for j in 0..=i {
            let dot: f64 = (0..j).map(|k| l[i][k] * l[j][k]).sum();
            let entry = gram[chosen[i]][chosen[j]] / (scale[i] * scale[j]) - dot;
            if i == j {
                if entry < 1e-10 {
                    return None;
                }
                l[i][i] = entry.sqrt();
            } else {
                l[i][j] = entry / l[j][j];
            }
        }
    }
    let mut y = vec![0.0; n];
    for i in 0..n {
        let dot: f64 = (0..i).map(|k| l[i][k] * y[k]).sum();
        y[i] = (b[chosen[i]] / scale[i] - dot) / l[i][i];
    }
    for i in (0..n).rev() {
        let dot: f64 = (i + 1..n).map(|k| l[k][i] * y[k]).sum();
        y[i] = (y[i] - dot) / l[i][i];
    }
    Some(y.iter().zip(&scale).map(|(y, s)| y / s).collect())
}

/// By straight lines between the values in order, as NumPy's.
fn percentile(values: &[f32], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f32::total_cmp);
    let at = share * (sorted.len() - 1) as f64;
    let (low, part) = (at.floor() as usize, at.fract());
    let high = (low + 1).min(sorted.len() - 1);
    f64::from(sorted[low]) * (1.0 - part) + f64::from(sorted[high]) * part
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two loads that strain one half of the tissue each, evenly: each is scaled to the target.
    #[test]
    fn loads_of_two_halves_are_scaled_to_the_target() {
        let halves = [
            vec![[0.5f32, 0.0]; 50].concat(),
            vec![[0.0, 8.0f32]; 50].concat(),
        ];
        let found = estimate(&halves, &[10.0, 4.0], 0.02).unwrap();
        // 0.02 = amplitude² × 0.5 / 10².
        assert!((found.amplitudes[0] - 2.0).abs() < 1e-9, "{found:?}");
        assert!((found.amplitudes[1] - 0.2).abs() < 1e-9);
        assert!((found.mean_mpa - 0.02).abs() < 1e-9 && found.sd_mpa < 1e-9);
        assert!((found.shares[0] - 0.5).abs() < 1e-9);
    }

    /// Against a search over a grid of factors that knows nothing of normal equations; a load that evens nothing out gets none.
    #[test]
    fn no_other_factors_are_nearer_to_even() {
        let mut state = 7u64;
        let mut random = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 40) as f32 / (1u64 << 24) as f32
        };
        for _ in 0..5 {
            let fields: Vec<Vec<f32>> = (0..3)
                .map(|i| (0..40).map(|_| random().powi(i + 1)).collect())
                .collect();
            let found = estimate(&fields, &[1.0; 3], 1.0).unwrap();
            let capped: Vec<Vec<f64>> = fields
                .iter()
                .map(|f| {
                    f.iter()
                        .map(|v| f64::from(*v).min(percentile(f, CAP)))
                        .collect()
                })
                .collect();
            let distance = |x: &[f64]| -> f64 {
                (0..40)
                    .map(|v| ((0..3).map(|i| x[i] * capped[i][v]).sum::<f64>() - 1.0).powi(2))
                    .sum()
            };
            let least = distance(&found.factors);
            for k in 0..41usize.pow(3) {
                let x = [k % 41, k / 41 % 41, k / 1681].map(|v| v as f64 * 0.1);
                assert!(
                    distance(&x) >= least - 1e-9,
                    "{x:?} is nearer than {:?}",
                    found.factors
                );
            }
        }
    }

    #[test]
    fn what_is_no_set_of_loads_has_no_estimate() {
        assert_eq!(estimate(&[], &[], 0.02), None);
        assert_eq!(estimate(&[vec![1.0]], &[0.0], 0.02), None);
        assert_eq!(estimate(&[vec![0.0; 9]], &[1.0], 0.02), None);
        // Multiples of each other: one of them suffices.
        let twice = [vec![1.0; 9], vec![2.0; 9]];
        let found = estimate(&twice, &[1.0, 1.0], 0.02).unwrap();
        assert!((found.mean_mpa - 0.02).abs() < 1e-9);
        assert_eq!(percentile(&[3.0, 1.0, 2.0], 0.75), 2.5);
    }
}
