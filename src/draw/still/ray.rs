//! Owns where a ray meets the bone.

use super::body::{Body, SURFACE};
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
        let mut cell: [i32; 3] = std::array::from_fn(|a| (q[a] as i32).clamp(0, last[a]));
        let mut next: Vec3 = std::array::from_fn(|a| {
            let plane = cell[a] as f32 + if self.towards[a] > 0.0 { 1.0 } else { 0.0 };
            (plane - self.from[a]) / self.towards[a]
        });
        let step: Vec3 = self.towards.map(|d| (1.0 / d).abs());
        let turn = self.towards.map(|d| if d > 0.0 { 1 } else { -1 });
        let mut t = start;
        let mut is_known = true;
        while t < leave {
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
    fn bone_that_the_box_cuts_ends_in_its_plane() {
        let body = slab();
        let hit = Ray::new(&body, [0.75, 1.0, 3.0], [0.0, 0.0, -1.0])
            .hit(&body)
            .unwrap();
        assert!((hit.depth - 1.0).abs() < 1e-5, "{hit:?}");
        assert_eq!(hit.normal, [0.0, 0.0, 1.0]);
    }
}
