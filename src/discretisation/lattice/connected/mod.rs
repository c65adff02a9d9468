//! Owns the sites of a connected lattice: the bone in each cell, split into its connected components.
//!
//! A cell coarser than the pores holds bone of several struts. One site for all of it would tie struts together that do
//! not touch (on phantoms whose struts are one lattice parameter thick, that alone made E_app 30 to 50 % too high). So
//! every component of bone, connected through voxel faces within its cell, is a site of its own, and a bond joins
//! two components only where they touch across the cells' common face, or, along a diagonal, where a third component touches
//! both.
//!
//! A bond carries what the bone along it can: of each end the cross-section of the half cell toward the other end, as
//! the harmonic mean over slices (slices are in series), and of both ends the geometric mean. Where bone ends at a voxel,
//! half of that voxel bears. Where all is bone, every share is 1 and the lattice is the uniform one.

mod bonding;
mod cell;
mod touching;

use crate::discretisation::lattice::marks::Marks;
use crate::discretisation::lattice::placement::Frame;
use crate::discretisation::lattice::sites::Grips;
use crate::volume::Volume;
use bonding::Bonding;

/// Bonds by site: those of site `s` are `start[s]..start[s + 1]`. Each stands at both of its ends.
#[derive(Debug, Clone, Default)]
pub struct Bonds {
    pub start: Vec<u32>,
    pub neighbour: Vec<u32>,
    /// Bond of the structure's stencil, as seen from the site.
    pub direction: Vec<u8>,
    /// Share of a whole bond's stiffness.
    pub share: Vec<f32>,
}

impl Bonds {
    /// The bonds of one site: neighbour, direction, share.
    #[inline]
    pub fn of(&self, site: usize) -> impl Iterator<Item = (usize, usize, f32)> + '_ {
        let range = self.start[site] as usize..self.start[site + 1] as usize;
        range.map(|b| {
            (
                self.neighbour[b] as usize,
                usize::from(self.direction[b]),
                self.share[b],
            )
        })
    }

    /// Keeps the given sites, in ascending order, in place. A bond keeps both ends or neither: what it reaches, it
    /// reaches both ways.
    fn keep(&mut self, sites: &[usize]) {
        let mut numbers = vec![u32::MAX; self.start.len() - 1];
        for (n, &s) in sites.iter().enumerate() {
            numbers[s] = n as u32;
        }
        let mut at = 0;
        for (n, &s) in sites.iter().enumerate() {
            let own = self.start[s] as usize..self.start[s + 1] as usize;
            self.start[n] = at as u32;
            for b in own {
                self.neighbour[at] = numbers[self.neighbour[b] as usize];
                self.direction[at] = self.direction[b];
                self.share[at] = self.share[b];
                at += 1;
            }
        }
        self.start[sites.len()] = at as u32;
        self.start.truncate(sites.len() + 1);
        self.neighbour.truncate(at);
        self.direction.truncate(at);
        self.share.truncate(at);
    }
}

/// The components that carry load, in the order of their cells.
#[derive(Debug, Clone)]
pub struct ConnectedSites {
    pub frame: Frame,
    /// Grid indices of each component's cell.
    pub indices: Vec<[i32; 3]>,
    /// Bone fraction of each component in its cell.
    pub fractions: Vec<f32>,
    pub bonds: Bonds,
    pub grips: Grips,
    /// Components without a path of bonds to both grips.
    pub dropped: usize,
}

/// A component while the lattice is put together.
struct Component {
    /// Candidate of the frame.
    cell: u32,
    fraction: f32,
    /// Cross-section of the half cell below and above along each axis, as a share of a whole one.
    ends: [[f32; 2]; 3],
}

impl ConnectedSites {
    /// Volume of the components' bone in mm³.
    pub fn bone_mm3(&self) -> f64 {
        let bone: f64 = self.fractions.iter().map(|&f| f64::from(f)).sum();
        bone * self.frame.lp_mm.powi(3)
    }

    /// Builds the lattice of simple cubic `frame`, keeping what has a path of bonds to both grips.
    pub fn connect(frame: Frame, bone: &Volume<u8>, grips: Grips) -> Self {
        let (components, touching) = touching::find(&frame, bone);
        let mut bonds = Bonding {
            frame: &frame,
            components: &components,
            touching: &touching,
        }
        .all();
        drop(touching);
        let axis = frame.axis.index();
        let plane = |p: usize| frame.indices(components[p].cell as usize)[axis];
        let kept: Vec<usize> = Marks::between(
            components.len(),
            |p| plane(p) <= grips.low,
            |p| plane(p) >= grips.high,
            |p| bonds.of(p).map(|(end, ..)| end),
        )
        .iter()
        .collect();
        if kept.len() < components.len() {
            bonds.keep(&kept);
        }
        ConnectedSites {
            indices: kept
                .iter()
                .map(|&p| frame.indices(components[p].cell as usize))
                .collect(),
            fractions: kept.iter().map(|&p| components[p].fraction).collect(),
            bonds,
            grips,
            dropped: components.len() - kept.len(),
            frame,
        }
    }

    pub fn len(&self) -> usize {
        self.indices.len()
    }

    pub fn is_empty(&self) -> bool {
        self.indices.is_empty()
    }

    /// Both ends of every bond, once.
    pub fn pairs(&self) -> impl Iterator<Item = (u32, u32)> + '_ {
        (0..self.len()).flat_map(|s| {
            let ends = self
                .bonds
                .of(s)
                .map(move |(end, ..)| (s as u32, end as u32));
            ends.filter(|(a, b)| a < b)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::discretisation::lattice::placement::Boundary;
    use crate::discretisation::lattice::stencil::Structure;
    use crate::grid::{Axis, Grid};

    fn connect(
        n: [usize; 3],
        h: f64,
        lp: f64,
        bone: impl Fn([usize; 3]) -> bool,
    ) -> ConnectedSites {
        let grid = Grid::new(n, [h; 3]);
        let at = |i: usize| [i % n[0], i / n[0] % n[1], i / (n[0] * n[1])];
        let voxels = (0..grid.len()).map(|i| u8::from(bone(at(i)))).collect();
        let bone = Volume::from_vec(grid, voxels);
        let frame = Frame::new(
            &grid,
            Structure::Sc,
            lp,
            Boundary::Connected,
            Axis::Z,
            [0.0; 3],
        )
        .unwrap();
        let grips = Grips::new(&frame, grid.size_mm()[2], 0.0).unwrap();
        ConnectedSites::connect(frame, &bone, grips)
    }

    #[test]
    fn struts_that_share_a_cell_but_do_not_touch_stay_apart() {
        // Two struts, one pore voxel between them, in one column of cells.
        let apart = connect([8, 8, 32], 0.01, 0.08, |p| p[0] != 4);
        assert_eq!(apart.len(), 2 * 5);
        assert_eq!(apart.pairs().count(), 2 * 4);
        let joined = connect([8, 8, 32], 0.01, 0.08, |p| p[0] != 4 || p[2] == 16);
        assert_eq!(joined.len(), 2 * 5 - 1);
    }

    #[test]
    fn every_share_of_solid_bone_is_whole() {
        // 3.5 voxels to a cell: cells cut voxels.
        let solid = connect([14, 14, 14], 0.02, 0.07, |_| true);
        assert_eq!(solid.len(), 4 * 4 * 5);
        for s in 0..solid.len() {
            assert!((solid.fractions[s] - 1.0).abs() < 1e-5);
            for (end, b, share) in solid.bonds.of(s) {
                let flat = Structure::Sc.stencil().direction(b)[2] == 0;
                let half = flat && [0, 4].contains(&solid.indices[s][2]);
                assert!(
                    (share - if half { 0.5 } else { 1.0 }).abs() < 1e-5,
                    "{share}"
                );
                assert!(solid.bonds.of(end).any(|x| x.0 == s && x.2 == share));
            }
        }
        let middle = solid.indices.iter().position(|i| *i == [1, 1, 2]).unwrap();
        assert_eq!(solid.bonds.of(middle).count(), 18);
    }

    #[test]
    fn a_neck_sets_the_share_of_its_bond() {
        // Between two planes one half cell has a quarter of the area, the other all of it but for its first and last half
        // slices, which bear on a quarter in full and on the rest by half. The bond is the geometric mean.
        let necked = connect([8, 8, 32], 0.01, 0.08, |p| {
            p[2] % 8 >= 4 || (p[0] < 4 && p[1] < 4)
        });
        let share = necked.bonds.of(0).next().unwrap().2;
        let wide: f32 = 4.0 / (2.0 * 0.5 / 0.625 + 3.0);
        assert!((share - (0.25 * wide).sqrt()).abs() < 1e-5, "{share}");
    }

    #[test]
    fn what_leads_nowhere_is_dropped() {
        let branch = connect([24, 8, 32], 0.01, 0.08, |p| {
            p[0] < 8 || (p[0] > 16 && p[2] < 8)
        });
        assert_eq!((branch.len(), branch.dropped), (5, 2));
    }
}
