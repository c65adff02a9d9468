//! Owns the nodes of voxel elements as supports see them.

use crate::discretisation::voxels::{Planes, VoxelMesh};
use crate::operator::held::Held;
use crate::pipeline::apparent::ends::reactions::End;
use crate::pipeline::apparent::ends::supports::{Node, Nodes};
use crate::pipeline::apparent::ends::uneven::Uneven;

/// The nodes of a mesh between its grips.
#[derive(Clone, Copy)]
pub struct Gripped<'a> {
    /// Elements with their nodes.
    pub mesh: &'a VoxelMesh,
    /// Planes that are held.
    pub grips: Planes,
    /// What is held in place of them.
    pub uneven: Option<&'a Uneven>,
}

impl Nodes for Gripped<'_> {
    fn count(&self) -> usize {
        self.mesh.len()
    }

    fn each(&self, mut visit: impl FnMut(usize, Node)) {
        let Gripped {
            mesh,
            grips,
            uneven,
        } = *self;
        let (n, h) = (mesh.grid.n, mesh.grid.spacing_mm);
        self.each_number(|number, at| {
            if mesh.around[number] != 0 {
                let plane = at[grips.axis.index()];
                let end = match uneven {
                    None => End::at(plane, grips.low, grips.high),
                    Some(uneven) => uneven.end(at),
                };
                let node = Node {
                    place_mm: std::array::from_fn(|a| at[a] as f64 * h[a]),
                    on_side: std::array::from_fn(|a| at[a] == 0 || at[a] == n[a]),
                    end,
                    along: match end {
                        Some(End::Lower) => 0.0,
                        Some(End::Upper) => 1.0,
                        None => along(grips, plane),
                    },
                };
                visit(number, node);
            }
        });
    }

    fn padding(&self) -> Held {
        let mut held = Held::none(self.count());
        self.each_number(|number, _| {
            if self.mesh.around[number] == 0 {
                (0..3).for_each(|c| held.hold(number, c));
            }
        });
        held
    }
}

impl Gripped<'_> {
    /// Calls `f` with every number in a segment, be it padding, and its indices.
    fn each_number(&self, mut f: impl FnMut(usize, [usize; 3])) {
        for segment in &self.mesh.segments {
            let [x, y, z] = segment.at.map(|v| v as usize);
            for (i, number) in segment.nodes().enumerate() {
                f(number, [x + i, y, z]);
            }
        }
    }
}

/// How far a plane lies from the lower grip to the upper: 0 to 1.
pub fn along(grips: Planes, plane: usize) -> f64 {
    (plane.clamp(grips.low, grips.high) - grips.low) as f64 / (grips.high - grips.low) as f64
}

/// Node indices of every node.
pub fn grid_places(mesh: &VoxelMesh) -> Vec<[i32; 3]> {
    (0..mesh.len())
        .map(|node| mesh.indices(node).map(|v| v as i32))
        .collect()
}
