//! Owns runs: consecutive voxels of one row along x, a few of them where there are hundreds of voxels. Which ones are connected is found
//! from them alone, so memory and time go with the number of runs.

use crate::parts;
use rayon::prelude::*;

/// Voxels `x0..x1` of one row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Run {
    pub x0: u32,
    pub x1: u32,
}

/// Which voxels are connected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Touching {
    /// Those with a common face: 6 neighbours.
    Faces,
    /// Those with a common face, edge or corner: 26 neighbours.
    Corners,
}

impl Touching {
    /// Steps along y and z to the rows before one whose voxels may touch its own.
    fn rows(self) -> &'static [[isize; 2]] {
        match self {
            Touching::Faces => &[[-1, 0], [0, -1]],
            Touching::Corners => &[[-1, 0], [-1, -1], [0, -1], [1, -1]],
        }
    }

    /// Whether runs of two such rows are connected.
    fn joins(self, p: Run, q: Run) -> bool {
        let reach = u32::from(self == Touching::Corners);
        p.x0 < q.x1 + reach && q.x0 < p.x1 + reach
    }
}

/// Runs of a volume, row by row (y faster than z).
#[derive(Debug, Clone)]
pub struct Runs {
    pub n: [usize; 3],
    pub runs: Vec<Run>,
    /// Where each row's runs begin; one more at the end.
    pub rows: Vec<usize>,
}

impl Runs {
    /// The runs of the voxels (x fastest) for which `inside` holds.
    pub fn of<T: Sync>(n: [usize; 3], voxels: &[T], inside: impl Fn(&T) -> bool + Sync) -> Self {
        let by_row: Vec<Vec<Run>> = voxels
            .par_chunks(n[0].max(1))
            .map(|row| row_runs(row, &inside))
            .collect();
        Runs::from_rows(n, by_row)
    }

    fn from_rows(n: [usize; 3], by_row: Vec<Vec<Run>>) -> Self {
        let mut rows = Vec::with_capacity(by_row.len() + 1);
        rows.push(0);
        for row in &by_row {
            rows.push(rows.last().unwrap_or(&0) + row.len());
        }
        Runs {
            n,
            runs: by_row.into_iter().flatten().collect(),
            rows,
        }
    }

    /// The runs of one row; none outside the volume.
    pub fn row(&self, y: isize, z: isize) -> &[Run] {
        let inside = y >= 0 && z >= 0 && (y as usize) < self.n[1] && (z as usize) < self.n[2];
        if !inside {
            return &[];
        }
        let row = z as usize * self.n[1] + y as usize;
        &self.runs[self.rows[row]..self.rows[row + 1]]
    }

    /// Number of voxels.
    pub fn voxels(&self) -> usize {
        self.runs.iter().map(|r| (r.x1 - r.x0) as usize).sum()
    }

    /// The part that each run belongs to, numbered in the order in which parts first appear, and how many there are.
    ///
    /// # Panics
    /// At 2³² runs or more (some 10⁴ million voxels).
    pub fn parts(&self, touching: Touching) -> (Vec<u32>, usize) {
        let mut up = parts::apart(self.runs.len());
        for row in 0..self.n[1] * self.n[2] {
            let (y, z) = ((row % self.n[1]) as isize, (row / self.n[1]) as isize);
            for [dy, dz] in touching.rows() {
                let (y, z) = (y + dy, z + dz);
                if y >= 0 && z >= 0 && y < self.n[1] as isize {
                    let before = z as usize * self.n[1] + y as usize;
                    self.join(&mut up, touching, before, row);
                }
            }
        }
        parts::numbered(up)
    }

    /// Joins what touches in two rows; both are sorted, one walk does.
    fn join(&self, up: &mut [u32], touching: Touching, a: usize, b: usize) {
        let (mut i, mut j) = (self.rows[a], self.rows[b]);
        while i < self.rows[a + 1] && j < self.rows[b + 1] {
            let (p, q) = (self.runs[i], self.runs[j]);
            if touching.joins(p, q) {
                parts::join(up, i as u32, j as u32);
            }
            if p.x1 < q.x1 { i += 1 } else { j += 1 }
        }
    }

    /// The runs of those parts that hold a voxel with `low` and a voxel with `high`, tested on `(run, y, z)`. Elements that share a
    /// node, be it one, pass force to each other, so parts are connected through faces, edges and corners.
    pub fn spanning(
        &self,
        low: impl Fn(Run, usize, usize) -> bool,
        high: impl Fn(Run, usize, usize) -> bool,
    ) -> Runs {
        let (part, count) = self.parts(Touching::Corners);
        let mut touches = vec![0u8; count];
        self.each(|i, run, y, z| {
            touches[part[i] as usize] |= u8::from(low(run, y, z)) | u8::from(high(run, y, z)) << 1;
        });
        let mut by_row = vec![Vec::new(); self.n[1] * self.n[2]];
        self.each(|i, run, y, z| {
            if touches[part[i] as usize] == 3 {
                by_row[z * self.n[1] + y].push(run);
            }
        });
        Runs::from_rows(self.n, by_row)
    }

    fn each(&self, mut f: impl FnMut(usize, Run, usize, usize)) {
        for row in 0..self.n[1] * self.n[2] {
            for i in self.rows[row]..self.rows[row + 1] {
                f(i, self.runs[i], row % self.n[1], row / self.n[1]);
            }
        }
    }
}

fn row_runs<T>(row: &[T], inside: &impl Fn(&T) -> bool) -> Vec<Run> {
    let mut runs = Vec::new();
    let mut x = 0;
    while x < row.len() {
        if !inside(&row[x]) {
            x += 1;
            continue;
        }
        let x0 = x;
        while x < row.len() && inside(&row[x]) {
            x += 1;
        }
        runs.push(Run {
            x0: x0 as u32,
            x1: x as u32,
        });
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Random masks against a flood fill over 26 neighbours.
    #[test]
    fn spanning_parts_are_those_a_flood_fill_finds() {
        let n = [7, 5, 6];
        for seed in 0..40u64 {
            let mut state = seed * 7919 + 1;
            let mask: Vec<u8> = (0..n.iter().product())
                .map(|_| {
                    state = state.wrapping_mul(6364136223846793005).wrapping_add(99);
                    u8::from((state >> 33) % 100 < 18)
                })
                .collect();
            let runs =
                Runs::of(n, &mask, |&b| b != 0).spanning(|_, _, z| z == 0, |_, _, z| z + 1 == n[2]);
            assert_eq!(voxels_of(&runs), flood(n, &mask), "seed {seed}");
        }
    }

    fn voxels_of(runs: &Runs) -> Vec<u8> {
        let mut out = vec![0; runs.n.iter().product()];
        runs.each(|_, r, y, z| {
            for x in r.x0..r.x1 {
                out[(z * runs.n[1] + y) * runs.n[0] + x as usize] = 1;
            }
        });
        out
    }

    fn flood(n: [usize; 3], mask: &[u8]) -> Vec<u8> {
        let at = |p: [isize; 3]| (p[2] as usize * n[1] + p[1] as usize) * n[0] + p[0] as usize;
        let from = |z: usize| {
            let mut seen = vec![0u8; mask.len()];
            let mut todo: Vec<[isize; 3]> = (0..n[0] * n[1])
                .map(|i| [(i % n[0]) as isize, (i / n[0]) as isize, z as isize])
                .filter(|&p| mask[at(p)] != 0)
                .collect();
            while let Some(p) = todo.pop() {
                if std::mem::replace(&mut seen[at(p)], 1) == 1 {
                    continue;
                }
                for d in 0..27isize {
                    let q = [p[0] + d % 3 - 1, p[1] + d / 3 % 3 - 1, p[2] + d / 9 - 1];
                    if (0..3).all(|a| q[a] >= 0 && q[a] < n[a] as isize) && mask[at(q)] != 0 {
                        todo.push(q);
                    }
                }
            }
            seen
        };
        let (low, high) = (from(0), from(n[2] - 1));
        low.iter().zip(&high).map(|(a, b)| a & b).collect()
    }
}
