//! Owns where a ray meets the bone.

use super::body::{Body, LEAP, SURFACE};
use super::vec3::{Vec3, along};

/// A place on the bone.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hit {
    /// Along the ray, mm.
    pub(super) depth: f32,
    /// In the grid of the body.
    pub(super) q: Vec3,
    /// Outwards, of length 1.
    pub(super) normal: Vec3,
}

/// A ray in the grid of a body: `from + t towards`, t in mm.
#[derive(Clone, Copy)]
pub(super) struct Ray {
    from: Vec3,
    towards: Vec3,
}

impl Ray {
    /// From a point in mm, along a direction of length 1.
    pub(super) fn new(body: &Body, from_mm: Vec3, towards: Vec3) -> Ray {
        let towards = std::array::from_fn(|a| {
            let step = towards[a] / body.voxel_mm[a];
            if step.abs() < 1e-9 { 1e-9 } else { step }
        });
        Ray {
            from: body.to_grid(from_mm),
            towards,
        }
    }

    fn at(&self, t: f32) -> Vec3 {
        along(self.from, self.towards, t)
    }

    /// The first place where the ray meets bone.
    pub(super) fn hit(&self, body: &Body) -> Option<Hit> {
        let (enter, leave, face) = self.through(body)?;
        let start = enter.max(0.0);
        let before = body.density(self.at(start));
        if before >= SURFACE && enter > 0.0 {
            let mut normal = [0.0; 3];
            normal[face] = -self.towards[face].signum();
            let q = self.at(start);
            return Some(Hit {
                depth: start,
                q,
                normal,
            });
        }
        let depth = self.walk(body, start, leave, before)?;
        let q = self.at(depth);
        let normal = body.normal(q);
        Some(Hit { depth, q, normal })
    }

    /// Where the ray enters and leaves the specimen's box, and across which axis it enters.
    fn through(&self, body: &Body) -> Option<(f32, f32, usize)> {
        let (mut enter, mut leave, mut face) = (f32::NEG_INFINITY, f32::INFINITY, 0);
        for a in 0..3 {
            let ends =
                [0.5, body.n[a] as f32 - 1.5].map(|end| (end - self.from[a]) / self.towards[a]);
            let (near, far) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
            if near > enter {
                (enter, face) = (near, a);
            }
            leave = leave.min(far);
        }
        (enter < leave && leave > 0.0).then_some((enter, leave, face))
    }

    /// Cell by cell, to where the density rises above the surface's.
    fn walk(&self, body: &Body, start: f32, leave: f32, mut before: f32) -> Option<f32> {
        let q = self.at(start);
        let last = body.n.map(|n| n as i32 - 2);
        let cell_at =
            |q: Vec3| -> [i32; 3] { std::array::from_fn(|a| (q[a] as i32).clamp(0, last[a])) };
        let mut cell = cell_at(q);
        let mut next = self.leaves(cell, 1);
        let step: Vec3 = self.towards.map(|d| (1.0 / d).abs());
        let turn = self.towards.map(|d| if d > 0.0 { 1 } else { -1 });
        let mut t = start;
        let mut is_known = true;
        while t < leave {
            if !body.is_near_block(cell.map(|c| c as usize)) {
                let end = self.leaves(cell, LEAP as i32);
                let end = end[0].min(end[1]).min(end[2]);
                // A little further, so that rounding does not leave it where it was.
                let ahead = cell_at(self.at(end + 1e-3 * step[0].min(step[1]).min(step[2])));
                if end > t && ahead != cell {
                    (t, cell, is_known) = (end, ahead, false);
                    next = self.leaves(cell, 1);
                    continue;
                }
            }
            let a = if next[0] <= next[1] && next[0] <= next[2] {
                0
            } else if next[1] <= next[2] {
                1
            } else {
                2
            };
            let end = next[a].min(leave);
            if body.is_near(cell.map(|c| c as usize)) {
                if !is_known {
                    before = body.density(self.at(t));
                }
                for part in [0.5, 1.0] {
                    let to = t + part * (end - t);
                    let after = body.density(self.at(to));
                    if before < SURFACE && after >= SURFACE {
                        return Some(self.crossing(
                            body,
                            [to - 0.5 * (end - t), to],
                            [before, after],
                        ));
                    }
                    before = after;
                }
                is_known = true;
            } else {
                is_known = false;
            }
            t = end;
            cell[a] += turn[a];
            if cell[a] < 0 || cell[a] > last[a] {
                return None;
            }
            next[a] += step[a];
        }
        None
    }

    /// Where the ray leaves the block of `side` cells that holds a cell, by axis.
    fn leaves(&self, cell: [i32; 3], side: i32) -> Vec3 {
        std::array::from_fn(|a| {
            let block = cell[a] / side + i32::from(self.towards[a] > 0.0);
            ((block * side) as f32 - self.from[a]) / self.towards[a]
        })
    }

    fn crossing(
        &self,
        body: &Body,
        [mut low, mut high]: [f32; 2],
        [mut below, mut above]: [f32; 2],
    ) -> f32 {
        for _ in 0..2 {
            let t = low + (high - low) * (SURFACE - below) / (above - below).max(1e-6);
            let value = body.density(self.at(t));
            if value < SURFACE {
                (low, below) = (t, value);
            } else {
                (high, above) = (t, value);
            }
        }
        low + (high - low) * (SURFACE - below) / (above - below).max(1e-6)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Grid;
    use crate::volume::Volume;

    /// A slab between x = 0.5 and 1 mm in a box of 2 mm.
    fn slab() -> Body {
        let grid = Grid::new([20, 10, 10], [0.1, 0.2, 0.2]);
        let mask = (0..grid.len())
            .map(|i| u8::from((5..10).contains(&(i % 20))))
            .collect();
        Body::new(&Volume::from_vec(grid, mask))
    }

    #[test]
    fn a_ray_meets_the_surface_between_bone_and_pore() {
        let body = slab();
        let hit = Ray::new(&body, [-1.0, 1.03, 0.97], [1.0, 0.0, 0.0])
            .hit(&body)
            .unwrap();
        // A plane between voxels is where it was: smoothing is the same on both sides.
        assert!((hit.depth - 1.5).abs() < 2e-3, "{hit:?}");
        assert!(hit.normal[0] < -0.999, "{hit:?}");
        assert!(
            Ray::new(&body, [-1.0, 3.0, 1.0], [1.0, 0.0, 0.0])
                .hit(&body)
                .is_none()
        );
    }

    #[test]
    fn leaps_over_empty_blocks_change_no_hit() {
        let (n, spacing_mm) = ([50, 41, 34], [0.1, 0.11, 0.13]);
        let sphere = |i: usize, [x, y, z]: [f64; 3], r: f64| {
            let at = [i % n[0], i / n[0] % n[1], i / (n[0] * n[1])].map(|c| c as f64);
            (at[0] - x).powi(2) + (at[1] - y).powi(2) + (at[2] - z).powi(2) < r * r
        };
        let is_bone = |i| sphere(i, [9.0, 30.0, 5.0], 4.3) || sphere(i, [38.0, 11.0, 25.0], 6.1);
        let grid = Grid::new(n, spacing_mm);
        let made = || {
            let mask = (0..grid.len()).map(|i| u8::from(is_bone(i))).collect();
            Body::new(&Volume::from_vec(grid, mask))
        };
        let (leaping, stepping) = (made(), made().without_leaps());
        let mut met = 0;
        for i in 0..4000 {
            let [a, b] = [f64::from(i % 63) * 0.1, f64::from(i / 63) * 0.1].map(|v| v as f32);
            let towards = crate::draw::still::vec3::unit([0.6, -0.5, 0.62]);
            let from = [a - 3.0, 6.0 - 0.3 * a, b - 2.5];
            let hit = |body| Ray::new(body, from, towards).hit(body).map(|hit| hit.depth);
            let (fast, slow) = (hit(&leaping), hit(&stepping));
            met += usize::from(slow.is_some());
            match (fast, slow) {
                (Some(fast), Some(slow)) => assert!((fast - slow).abs() < 1e-3, "{fast} {slow}"),
                (fast, slow) => assert_eq!(fast.is_some(), slow.is_some(), "{from:?}"),
            }
        }
        assert!(met > 200, "{met}");
    }

    #[test]
    fn bone_that_the_box_cuts_ends_in_its_plane() {
        let body = slab();
        let hit = Ray::new(&body, [0.75, 1.0, 3.0], [0.0, 0.0, -1.0])
            .hit(&body)
            .unwrap();
        assert!((hit.depth - 1.0).abs() < 1e-5, "{hit:?}");
        assert_eq!(hit.normal, [0.0, 0.0, 1.0]);
    }
}
