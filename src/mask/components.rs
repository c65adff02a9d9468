//! Owns connected components through voxel faces (6 neighbours).

use crate::mask::runs::{Runs, Touching};
use crate::volume::Volume;
use rayon::prelude::*;

/// The components of a mask.
pub struct Components {
    runs: Runs,
    /// Component of each run, numbered in the order in which components first appear.
    label: Vec<u32>,
    /// Voxels of each component.
    pub voxels: Vec<u64>,
}

impl Components {
    /// Labels all bone of `mask` (non-zero).
    ///
    /// # Panics
    /// At 2³² runs or more (some 10⁴ million voxels).
    pub fn of(mask: &Volume<u8>) -> Self {
        let runs = Runs::of(mask.grid.n, mask.as_slice(), |&v| v != 0);
        let (label, count) = runs.parts(Touching::Faces);
        let mut voxels = vec![0; count];
        for (run, &label) in runs.runs.iter().zip(&label) {
            voxels[label as usize] += u64::from(run.x1 - run.x0);
        }
        Components {
            runs,
            label,
            voxels,
        }
    }

    /// The component with the most voxels; the first of equals. None without bone.
    pub fn largest(&self) -> Option<u32> {
        let most = self.voxels.iter().max()?;
        self.voxels
            .iter()
            .position(|v| v == most)
            .map(|at| at as u32)
    }

    /// Sets all voxels of other components to 0.
    pub fn keep_only(&self, keep: u32, mask: &mut Volume<u8>) {
        let nx = mask.grid.n[0];
        mask.values
            .as_slice_mut()
            .expect("volumes are kept in standard layout")
            .par_chunks_mut(nx)
            .enumerate()
            .for_each(|(row, voxels)| {
                for i in self.runs.rows[row]..self.runs.rows[row + 1] {
                    let run = self.runs.runs[i];
                    if self.label[i] != keep {
                        voxels[run.x0 as usize..run.x1 as usize].fill(0);
                    }
                }
            });
    }

    /// Components that have a voxel in both the first and the last slice along z.
    pub fn spanning_z(&self, mask: &Volume<u8>) -> Vec<u32> {
        let [_, ny, nz] = mask.grid.n;
        let of = |slice: usize| -> std::collections::BTreeSet<u32> {
            (self.runs.rows[slice * ny]..self.runs.rows[(slice + 1) * ny])
                .map(|run| self.label[run])
                .collect()
        };
        of(0).intersection(&of(nz - 1)).copied().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Grid;
    use proptest::prelude::*;

    /// Flood fill, one voxel at a time: sizes of components in order of appearance.
    fn flooded(mask: &Volume<u8>) -> Vec<u64> {
        let g = mask.grid;
        let mut left = mask.as_slice().to_vec();
        let mut sizes = Vec::new();
        for start in 0..left.len() {
            if left[start] == 0 {
                continue;
            }
            let mut stack = vec![start];
            left[start] = 0;
            let mut size = 0;
            while let Some(at) = stack.pop() {
                size += 1;
                let p = [at % g.n[0], at / g.n[0] % g.n[1], at / (g.n[0] * g.n[1])];
                for a in 0..3 {
                    for step in [-1isize, 1] {
                        let q = p[a] as isize + step;
                        if q < 0 || q >= g.n[a] as isize {
                            continue;
                        }
                        let mut next = p;
                        next[a] = q as usize;
                        let next = g.index(next);
                        if left[next] != 0 {
                            left[next] = 0;
                            stack.push(next);
                        }
                    }
                }
            }
            sizes.push(size);
        }
        sizes
    }

    proptest! {
        #[test]
        fn components_are_those_of_a_flood_fill(
            n in (1usize..9, 1usize..9, 1usize..9),
            seed in proptest::collection::vec(0u8..100, 512),
            share in 10u8..90,
        ) {
            let grid = Grid::new([n.0, n.1, n.2], [1.0; 3]);
            let voxels = (0..grid.len()).map(|i| u8::from(seed[i % 512] < share)).collect();
            let mut mask = Volume::from_vec(grid, voxels);
            let components = Components::of(&mask);
            let expected = flooded(&mask);
            prop_assert_eq!(&components.voxels, &expected);
            if let Some(largest) = components.largest() {
                components.keep_only(largest, &mut mask);
                prop_assert_eq!(flooded(&mask), vec![expected.into_iter().max().unwrap()]);
            }
        }
    }

    #[test]
    fn edges_and_corners_do_not_connect() {
        let grid = Grid::new([2, 2, 2], [1.0; 3]);
        let mask = Volume::from_vec(grid, vec![1, 0, 0, 1, 0, 1, 1, 0]);
        assert_eq!(Components::of(&mask).voxels, [1, 1, 1, 1]);
    }
}
