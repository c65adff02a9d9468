//! Specimens that every bench makes for itself.

use bonepd_ct::grid::Grid;
use bonepd_ct::volume::{Specimen, Volume};

/// A cube of `n` voxels of 0.02 mm with bone where a sum of waves is small: `solid` of 1 is full. Struts of waves of 40
/// voxels and a quarter of bone are plump, of 20 voxels and 0.12 thin.
pub fn waves(n: usize, wave: f64, solid: f64) -> Specimen {
    let grid = Grid::new([n; 3], [0.02; 3]);
    let k = std::f64::consts::TAU / wave;
    let level = |i: usize| {
        let [x, y, z] = [i % n, i / n % n, i / (n * n)].map(|v| k * v as f64);
        (x.sin() * y.cos() + y.sin() * z.cos() + z.sin() * x.cos()).abs()
    };
    let mut sorted: Vec<f64> = (0..grid.len()).step_by(7).map(level).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let cut = sorted[((sorted.len() - 1) as f64 * solid) as usize];
    let voxels = (0..grid.len()).map(|i| u8::from(level(i) <= cut)).collect();
    Specimen {
        name: "waves".into(),
        tv_mm3: grid.size_mm().iter().product(),
        bone: Volume::from_vec(grid, voxels),
        tv_definition: "box".into(),
        grey: None,
        threshold: None,
    }
}

/// Edge in voxels, from the environment.
pub fn edge(default: usize) -> usize {
    std::env::var("BONEPD_BENCH_VOXELS").map_or(default, |v| v.parse().unwrap_or(default))
}
