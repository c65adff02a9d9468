//! Owns connected components through voxel faces (6 neighbours), over runs of bone along x: a run is one node, so memory
//! and time go with the number of runs, not of voxels.

use crate::volume::Volume;
use rayon::prelude::*;

/// Consecutive bone voxels `start..end` of one row.
#[derive(Debug, Clone, Copy)]
struct Run {
    start: u32,
    end: u32,
}

/// The components of a mask.
pub struct Components {
    runs: Vec<Run>,
    /// First run of each row, and the number of runs at the end.
    rows: Vec<usize>,
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
        let [nx, ny, _] = mask.grid.n;
        let found: Vec<Vec<Run>> = mask.as_slice().par_chunks(nx).map(runs_of).collect();
        let mut rows = Vec::with_capacity(found.len() + 1);
        let mut runs = Vec::with_capacity(found.iter().map(Vec::len).sum());
        for row in found {
            rows.push(runs.len());
            runs.extend(row);
        }
        rows.push(runs.len());
        let mut parent: Vec<u32> =
            (0..u32::try_from(runs.len()).expect("fewer than 2³² runs")).collect();
        for row in 0..rows.len() - 1 {
            if row % ny > 0 {
                join(
                    &mut parent,
                    &runs,
                    rows[row - 1]..rows[row],
                    rows[row]..rows[row + 1],
                );
            }
            if row >= ny {
                join(
                    &mut parent,
                    &runs,
                    rows[row - ny]..rows[row - ny + 1],
                    rows[row]..rows[row + 1],
                );
            }
        }
        let (label, voxels) = number(parent, &runs);
        Components {
            runs,
            rows,
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
                for run in self.rows[row]..self.rows[row + 1] {
                    if self.label[run] != keep {
                        voxels[self.runs[run].start as usize..self.runs[run].end as usize].fill(0);
                    }
                }
            });
    }

    /// Components that have a voxel in both the first and the last slice along z.
    pub fn spanning_z(&self, mask: &Volume<u8>) -> Vec<u32> {
        let [_, ny, nz] = mask.grid.n;
        let of = |slice: usize| -> std::collections::BTreeSet<u32> {
            (self.rows[slice * ny]..self.rows[(slice + 1) * ny])
                .map(|run| self.label[run])
                .collect()
        };
        of(0).intersection(&of(nz - 1)).copied().collect()
    }
}

fn runs_of(row: &[u8]) -> Vec<Run> {
    let mut runs = Vec::new();
    let mut at = 0;
    while let Some(skip) = row[at..].iter().position(|&v| v != 0) {
        let start = at + skip;
        let end = row[start..]
            .iter()
            .position(|&v| v == 0)
            .map_or(row.len(), |len| start + len);
        runs.push(Run {
            start: start as u32,
            end: end as u32,
        });
        at = end;
    }
    runs
}

/// Unites the runs of two neighbouring rows that overlap; both rows are sorted, one walk does.
fn join(parent: &mut [u32], runs: &[Run], a: std::ops::Range<usize>, b: std::ops::Range<usize>) {
    let (mut i, mut j) = (a.start, b.start);
    while i < a.end && j < b.end {
        if runs[i].start < runs[j].end && runs[j].start < runs[i].end {
            unite(parent, i as u32, j as u32);
        }
        if runs[i].end < runs[j].end {
            i += 1;
        } else {
            j += 1;
        }
    }
}

fn root(parent: &mut [u32], mut run: u32) -> u32 {
    while parent[run as usize] != run {
        parent[run as usize] = parent[parent[run as usize] as usize];
        run = parent[run as usize];
    }
    run
}

/// The earlier root stays root, so components are numbered in order of appearance.
fn unite(parent: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root(parent, a), root(parent, b));
    if a < b {
        parent[b as usize] = a;
    } else {
        parent[a as usize] = b;
    }
}

fn number(mut parent: Vec<u32>, runs: &[Run]) -> (Vec<u32>, Vec<u64>) {
    let mut voxels = Vec::new();
    let mut label = vec![0u32; runs.len()];
    for run in 0..runs.len() {
        let root = root(&mut parent, run as u32) as usize;
        if root == run {
            label[run] = voxels.len() as u32;
            voxels.push(0);
        } else {
            label[run] = label[root];
        }
        voxels[label[run] as usize] += u64::from(runs[run].end - runs[run].start);
    }
    (label, voxels)
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
