//! Owns the rotation of a scan: a box with axes of its own inside or around another, and what is read there.

use crate::grid::Grid;
use crate::mask::regrid::{Between, laid, line, voxel};
use crate::volume::Volume;
use rayon::prelude::*;

/// A box with axes of its own, about the middle of another grid's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rotated {
    pub grid: Grid,
    /// Rows: the box's axes x, y, z as unit vectors along the other grid's.
    pub axes: [[f64; 3]; 3],
}

impl Rotated {
    /// `z` along `direction` (any length but 0) by the shortest way; cubic voxels of `edge_mm`. The box is one that lies
    /// wholly within the old one, or (`whole`) the one around it.
    pub fn to_z(old: &Grid, direction: [f64; 3], edge_mm: f64, whole: bool) -> Rotated {
        let axes = shortest_turn(direction);
        let size = old.size_mm();
        let reach = |r: usize| (0..3).map(|a| axes[r][a].abs() * size[a]).sum::<f64>();
        let fitted = match whole {
            true => [reach(0), reach(1), reach(2)],
            false => within(size, &axes),
        };
        // Rounding must not take a slice off a box turned by a right angle.
        let count = |length: f64| match whole {
            true => (length / edge_mm - 1e-6).ceil().max(1.0) as usize,
            false => (length / edge_mm + 1e-6).max(1.0) as usize,
        };
        Rotated {
            grid: Grid::new(fitted.map(count), [edge_mm; 3]),
            axes,
        }
    }

    /// `volume` on this grid; `fill` where there is none.
    pub fn read(&self, volume: &Volume<f32>, between: Between, fill: f32) -> Volume<f32> {
        let (old, [nx, ny, _]) = (volume.grid, self.grid.n);
        let values = volume.as_slice();
        let mut out = vec![0f32; self.grid.len()];
        out.par_chunks_mut(nx).enumerate().for_each(|(row, out)| {
            for (i, value) in out.iter_mut().enumerate() {
                let at = self.position_mm([i, row % ny, row / ny], &old);
                *value = sample(values, &old, at, between).unwrap_or(fill);
            }
        });
        let mut read = Volume::from_vec(self.grid, out);
        read.affine = laid(
            volume,
            self.position_mm([0; 3], &old),
            self.grid.spacing_mm,
            &self.axes,
        );
        read
    }

    /// The centre of a voxel, in mm from the other grid's corner.
    fn position_mm(&self, voxel: [usize; 3], old: &Grid) -> [f64; 3] {
        let from_middle: [f64; 3] = std::array::from_fn(|r| {
            (voxel[r] as f64 + 0.5 - 0.5 * self.grid.n[r] as f64) * self.grid.spacing_mm[r]
        });
        let size = old.size_mm();
        std::array::from_fn(|a| {
            0.5 * size[a]
                + (0..3)
                    .map(|r| self.axes[r][a] * from_middle[r])
                    .sum::<f64>()
        })
    }
}

/// None outside the grid.
fn sample(values: &[f32], grid: &Grid, at_mm: [f64; 3], between: Between) -> Option<f32> {
    let at: [f64; 3] = std::array::from_fn(|a| at_mm[a] / grid.spacing_mm[a]);
    if (0..3).any(|a| !(-1e-6..=grid.n[a] as f64 + 1e-6).contains(&at[a])) {
        return None;
    }
    if between == Between::Nearest {
        let p = std::array::from_fn(|a| voxel(at[a], grid.n[a]));
        return Some(values[grid.index(p)]);
    }
    let [x, y, z]: [[(usize, f64); 2]; 3] = std::array::from_fn(|a| line(at[a], grid.n[a]));
    let mut sum = 0.0;
    for (k, wz) in z {
        for (j, wy) in y {
            for (i, wx) in x {
                let w = wx * wy * wz;
                if w != 0.0 {
                    sum += w * f64::from(values[grid.index([i, j, k])]);
                }
            }
        }
    }
    Some(sum as f32)
}

/// Rows: the axes that the shortest turn of `direction` to z leaves as x, y and z.
fn shortest_turn(direction: [f64; 3]) -> [[f64; 3]; 3] {
    let length = direction.iter().map(|v| v * v).sum::<f64>().sqrt();
    // A fabric has no sense: the half turn is never needed.
    let sign = if direction[2] < 0.0 { -1.0 } else { 1.0 };
    let [x, y, z] = direction.map(|v| sign * v / length);
    let k = 1.0 / (1.0 + z);
    [
        [1.0 - k * x * x, -k * x * y, -x],
        [-k * x * y, 1.0 - k * y * y, -y],
        [x, y, z],
    ]
}

/// Edges of a box along `axes` that fits into one of `size`, both about one middle: of the nearest axes' proportions,
/// then as long along each axis as there is room.
fn within(size: [f64; 3], axes: &[[f64; 3]; 3]) -> [f64; 3] {
    let nearest = |r: usize| {
        let longer = |a: &usize, b: &usize| axes[r][*a].abs().total_cmp(&axes[r][*b].abs());
        size[(0..3).max_by(longer).unwrap_or(r)]
    };
    let shape = [nearest(0), nearest(1), nearest(2)];
    let reach =
        |edges: &[f64; 3], a: usize| -> f64 { (0..3).map(|r| axes[r][a].abs() * edges[r]).sum() };
    let scale = (0..3)
        .map(|a| size[a] / reach(&shape, a))
        .fold(f64::INFINITY, f64::min);
    let mut edges = shape.map(|v| v * scale);
    for r in 0..3 {
        let room = (0..3)
            .filter(|&a| axes[r][a].abs() > 1e-9)
            .map(|a| (size[a] - reach(&edges, a)) / axes[r][a].abs())
            .fold(f64::INFINITY, f64::min);
        edges[r] += room.max(0.0);
    }
    edges
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mask::regrid::resampled;

    fn world(v: &Volume<f32>, p: [usize; 3]) -> [f64; 3] {
        let rows = v.affine.unwrap();
        rows.map(|r| (0..3).map(|c| r[c] * p[c] as f64).sum::<f64>() + r[3])
    }

    /// A field that is linear in the world stays that, wherever its voxels go.
    #[test]
    fn values_stay_where_they_are_in_the_world() {
        let grid = Grid::new([20, 24, 28], [0.03, 0.025, 0.02]);
        let mut v = Volume::from_vec(grid, vec![0.0; grid.len()]);
        v.affine = Some([
            [0.0, -0.025, 0.0, 5.0],
            [0.03, 0.0, 0.0, -1.0],
            [0.0, 0.0, 0.02, 2.0],
        ]);
        let field = |[x, y, z]: [f64; 3]| (10.0 + 2.0 * x - 3.0 * y + 5.0 * z) as f32;
        let n = v.grid.n;
        let at = |i: usize| [i % n[0], i / n[0] % n[1], i / (n[0] * n[1])];
        let values = (0..v.grid.len()).map(|i| field(world(&v, at(i)))).collect();
        v = Volume {
            affine: v.affine,
            ..Volume::from_vec(v.grid, values)
        };
        let rotated = Rotated::to_z(&v.grid, [0.4, -0.3, 0.8], 0.02, false);
        let finer = resampled(&v, [0.01; 3], Between::Means);
        for r in [rotated.read(&v, Between::Means, 0.0), finer] {
            let n = r.grid.n;
            for k in 1..n[2] - 1 {
                for j in 1..n[1] - 1 {
                    for i in 1..n[0] - 1 {
                        let (found, there) = (r.values[[k, j, i]], field(world(&r, [i, j, k])));
                        assert!((found - there).abs() < 1e-4, "{found} {there}");
                    }
                }
            }
        }
    }

    #[test]
    fn the_box_within_touches_the_old_faces_and_a_right_angle_loses_nothing() {
        for direction in [[0.3, -0.5, 0.4], [-1.0, 2.0, -1e-9], [0.0, 0.0, -5.0]] {
            let axes = shortest_turn(direction);
            for (r, row) in axes.iter().enumerate() {
                let dot = |other: &[f64; 3]| (0..3).map(|a| row[a] * other[a]).sum::<f64>();
                let squares = axes.map(|other| dot(&other));
                let unit = (0..3).all(|s| (squares[s] - f64::from(u8::from(r == s))).abs() < 1e-12);
                assert!(unit, "{direction:?} {axes:?}");
            }
            let [x, y, z] = axes[2];
            let [dx, dy, dz] = direction;
            assert!((x * dy - y * dx).abs() + (y * dz - z * dy).abs() < 1e-12);
        }
        let grid = Grid::new([40, 50, 60], [0.02; 3]);
        let quarter = Rotated::to_z(&grid, [1.0, 0.0, 0.0], 0.02, false);
        assert_eq!(quarter.grid.n, [60, 50, 40]);
        let tilted = Rotated::to_z(&grid, [0.5, 0.0, 0.75f64.sqrt()], 0.02, false);
        // About y: nothing is lost along it.
        assert_eq!(tilted.grid.n[1], 50);
        let size = tilted.grid.size_mm();
        let (s, c) = (0.5, 0.75f64.sqrt());
        let reach = [c * size[0] + s * size[2], s * size[0] + c * size[2]];
        assert!(
            reach[0] <= 0.8 + 1e-9 && reach[1] <= 1.2 + 1e-9,
            "{reach:?}"
        );
        assert!(reach[0] > 0.76, "{reach:?}");
        let whole = Rotated::to_z(&grid, [0.5, 0.0, 0.75f64.sqrt()], 0.02, true);
        assert!(whole.grid.size_mm()[2] >= s * 0.8 + c * 1.2);
    }
}
