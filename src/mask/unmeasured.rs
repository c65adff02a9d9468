//! Owns the hiding of voxels that a file says are no measurements: they become NaN, which is pore everywhere and no part of a
//! histogram.

use rayon::prelude::*;

/// What was hidden among the values of a scan, and what was unusable before.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Hidden {
    /// Padding values from the first to the second, in the unit of the scan.
    pub range: [f32; 2],
    /// Voxels that held them.
    pub voxels: u64,
    /// NaN and infinite voxels before.
    pub non_finite: u64,
    /// All voxels.
    pub of: u64,
}

impl Hidden {
    pub fn share(&self) -> f64 {
        self.voxels as f64 / self.of.max(1) as f64
    }

    /// The values, in words.
    pub fn values(&self) -> String {
        let [low, high] = self.range;
        match low == high {
            true => low.to_string(),
            false => format!("{low} to {high}"),
        }
    }
}

/// Replaces the values in `padding` by NaN. None where there are none.
pub fn hide(values: &mut [f32], padding: Option<[f32; 2]>) -> Option<Hidden> {
    let [low, high] = padding?;
    let parts = values.par_chunks_mut(1 << 16).map(|part| {
        let (mut hidden, mut non_finite) = (0u64, 0u64);
        for v in part {
            non_finite += u64::from(!v.is_finite());
            let is_padding = *v >= low && *v <= high;
            hidden += u64::from(is_padding);
            *v = if is_padding { f32::NAN } else { *v };
        }
        [hidden, non_finite]
    });
    let [voxels, non_finite] = parts.reduce(|| [0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
    (voxels > 0).then_some(Hidden {
        range: [low, high],
        voxels,
        non_finite,
        of: values.len() as u64,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_in_the_range_are_hidden_and_counted() {
        let mut values = [-3.0, -2.0, -1.0, f32::NAN, 5.0, f32::INFINITY, -2.5];
        let found = hide(&mut values, Some([-3.0, -2.0])).unwrap();
        assert_eq!((found.voxels, found.non_finite, found.of), (3, 2, 7));
        assert_eq!(found.values(), "-3 to -2");
        let kept: Vec<f32> = values.into_iter().filter(|v| v.is_finite()).collect();
        assert_eq!(kept, [-1.0, 5.0]);
        assert_eq!(hide(&mut values, Some([7.0; 2])), None);
        assert_eq!(hide(&mut values, None), None);
    }
}
