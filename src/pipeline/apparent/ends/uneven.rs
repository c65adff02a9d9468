//! Owns uneven ends: the faces of bone that are seen from an end plane, down to a depth.
//!
//! Source: the node sets of visible surfaces of Faim (n88modelgenerator, "uneven" ends).

use crate::discretisation::voxels::VoxelMesh;
use crate::error::{Error, Result};
use crate::grid::{Axis, Grid};
use crate::mask::runs::Run;
use crate::pipeline::apparent::ends::reactions::End;
use crate::volume::Volume;

/// No face within the depth.
const NONE: u32 = u32::MAX;

/// What is seen from both end planes of a grid along one axis.
pub struct Uneven {
    axis: usize,
    /// Voxels across the axis.
    across: [usize; 2],
    /// Elements along an edge of a voxel.
    refine: usize,
    /// By column of voxels, the plane of the first face that is seen from below and from above.
    faces: [Vec<u32>; 2],
}

impl Uneven {
    /// Faces of `bone` at most `depth_mm` from the end planes across `axis`; each voxel is `refine` elements wide.
    ///
    /// # Errors
    /// Depths that meet in the middle, or meet no bone.
    pub fn of(bone: &Volume<u8>, axis: Axis, depth_mm: f64, refine: usize) -> Result<Uneven> {
        let (grid, a) = (bone.grid, axis.index());
        let (n, h) = (grid.n[a], grid.spacing_mm[a]);
        let length = n as f64 * h;
        if 2.0 * depth_mm >= length {
            return Err(Error::setting(
                "solve.ends_depth_mm",
                format!(
                    "{depth_mm} mm from each end leaves nothing of a specimen {length} mm long"
                ),
                "choose a smaller depth",
            ));
        }
        let [b, c] = across(a);
        let (nb, nc) = (grid.n[b], grid.n[c]);
        let mut faces = [vec![NONE; nb * nc], vec![NONE; nb * nc]];
        let mut first = [f64::INFINITY; 2];
        let columns = 0..nb * nc;
        columns.for_each(|column| {
            let is_bone = |k: usize| {
                let mut at = [0; 3];
                (at[a], at[b], at[c]) = (k, column % nb, column / nb);
                bone.as_slice()[grid.index(at)] != 0
            };
            let seen = [
                (0..n).find(|&k| is_bone(k)),
                (0..n).rev().find(|&k| is_bone(k)).map(|k| k + 1),
            ];
            for (end, plane) in seen.into_iter().enumerate() {
                let Some(plane) = plane else { continue };
                let deep = if end == 0 { plane } else { n - plane };
                let deep_mm = deep as f64 * h;
                first[end] = first[end].min(deep_mm);
                if deep_mm <= depth_mm * (1.0 + 1e-9) {
                    faces[end][column] = plane as u32;
                }
            }
        });
        for (end, faces) in [End::Lower, End::Upper].into_iter().zip(&faces) {
            if faces.iter().all(|f| *f == NONE) {
                let (name, mm) = (end.name(), first[end as usize]);
                let found = match mm.is_finite() {
                    true => format!("the first bone lies {:.4} mm from it", mm),
                    false => "there is no bone at all".to_owned(),
                };
                return Err(Error::setting(
                    "solve.ends_depth_mm",
                    format!("a depth of {depth_mm} mm from the {name} end meets no bone: {found}"),
                    "give a greater depth, or crop the scan to the bone",
                ));
            }
        }
        Ok(Uneven {
            axis: a,
            across: [nb, nc],
            refine,
            faces,
        })
    }

    /// The plane of elements' nodes that is seen in a column of elements; None beyond the depth or the grid.
    fn face(&self, end: End, column: [isize; 2]) -> Option<usize> {
        let refine = self.refine as isize;
        let inside = (0..2).all(|i| column[i] >= 0 && column[i] < self.across[i] as isize * refine);
        if !inside {
            return None;
        }
        let [b, c] = column.map(|v| (v / refine) as usize);
        let plane = self.faces[end as usize][c * self.across[0] + b];
        (plane != NONE).then_some(plane as usize * self.refine)
    }

    /// The end that a node is gripped by.
    pub fn end(&self, node: [usize; 3]) -> Option<End> {
        let [b, c] = across(self.axis).map(|a| node[a] as isize);
        [End::Lower, End::Upper].into_iter().find(|&end| {
            let columns = [[b - 1, c - 1], [b, c - 1], [b - 1, c], [b, c]];
            columns
                .iter()
                .any(|&column| self.face(end, column) == Some(node[self.axis]))
        })
    }

    /// Whether a run of elements has a face that an end grips.
    pub fn touches(&self, end: End, run: Run, y: usize, z: usize) -> bool {
        (run.x0 as usize..run.x1 as usize).any(|x| {
            let at = [x, y, z];
            let column = across(self.axis).map(|a| at[a] as isize);
            let plane = at[self.axis] + usize::from(end == End::Upper);
            self.face(end, column) == Some(plane)
        })
    }

    /// Meshes the elements that join the faces of both ends.
    ///
    /// # Errors
    /// Too many nodes.
    pub fn mesh<T: Sync>(
        &self,
        grid: Grid,
        voxels: &[T],
        is_bone: impl Fn(&T) -> bool + Sync,
    ) -> Result<VoxelMesh> {
        VoxelMesh::joining(
            grid,
            voxels,
            is_bone,
            |run, y, z| self.touches(End::Lower, run, y, z),
            |run, y, z| self.touches(End::Upper, run, y, z),
        )
    }
}

/// The axes across one, in order.
fn across(axis: usize) -> [usize; 2] {
    match axis {
        0 => [1, 2],
        1 => [0, 2],
        _ => [0, 1],
    }
}
