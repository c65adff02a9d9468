//! Owns how much memory and time voxel elements take, from the bone before anything is built.
//!
//! Memory goes with what is kept a node (vectors, diagonal) and with the boxes of multigrid's aggregates (the assembled
//! levels). The factors are fits to the program's own peaks, within 11 % on ten meshes of 0.1 to 28 million nodes (`cargo
//! bench --bench memory` prints peaks and estimates, `cargo test --release -- --ignored memory_is` holds eight whole commands
//! to them).

use crate::grid::Grid;
use crate::mask::resample;
use crate::pipeline::apparent::discretisation::{ASSUMED_BONE, Cost, Known, Prepared, Resolution};
use crate::pipeline::apparent::params::{CoarsenBy, Conditions, Load, SolveParams};
use crate::pipeline::apparent::voxel_fe::bricks::LEAST_FRACTION;
use crate::volume::{Specimen, Volume};
use rayon::prelude::*;

/// Bytes a node and a box of [`BOX`] nodes; of elements that differ, more a node (a factor and a whole diagonal block).
const NODE: f64 = 101.0;
const NODE_BOX: f64 = 1850.0;
const DIFFERING: f64 = 28.0;

/// Bytes more a node of the five fields that a stiffness tensor keeps.
const KEPT_FIELDS: f64 = 60.0;

/// Bytes more a node of what multigrid has in common under several supports (7.3 MB of 319 000 nodes measured).
const IN_COMMON: f64 = 23.0;

/// Bytes more a node of load steps: eight vectors in double precision, four in single, a number; what elements that flow keep (3.4 kB
/// each) is not known before.
const LOAD_STEPS: f64 = 8.0 * 24.0 + 4.0 * 12.0 + 4.0;

/// Edge of multigrid's boxes in nodes.
const BOX: usize = 5;

/// Bytes and seconds (two cores) per hexahedron before nodes are counted: 6.4 s for 1 869 627 elements.
const BYTES_PER_ELEMENT: f64 = 220.0;
const S_PER_ELEMENT: f64 = 3.5e-6;

/// What a solve takes.
pub fn of(params: &SolveParams, known: Known) -> Cost {
    let per_voxel = (params.refine as f64 / params.coarsen as f64).powi(3);
    let voxels = match known {
        Known::Header { voxels, .. } => ASSUMED_BONE * voxels,
        Known::Bone(Prepared { specimen, .. }) => {
            specimen.bv_mm3() / specimen.bone.grid.voxel_mm3()
        }
    };
    // Those without load are not dropped yet.
    let elements = voxels * per_voxel;
    let bytes = match known {
        Known::Header { .. } => [elements * BYTES_PER_ELEMENT; 2],
        Known::Bone(_) => [0.0, elements * BYTES_PER_ELEMENT],
    };
    Cost {
        bytes,
        time_s: Some(elements * S_PER_ELEMENT),
        resolution: match params.refine {
            1 => Resolution::Coarsen(params.coarsen),
            refine => Resolution::Refine(refine),
        },
    }
}

/// Bytes of a solve beyond the specimen, at their highest; 0 where there is nothing to solve.
pub fn counted(specimen: &Specimen, params: &SolveParams) -> f64 {
    let grid = &specimen.bone.grid;
    let by_fraction = params.coarsen > 1 && params.coarsen_by == CoarsenBy::Fraction;
    let differing = by_fraction || params.material.is_some();
    let counts = match params.coarsen {
        1 => Counts::of(&specimen.bone),
        factor => {
            let fractions = resample::coarsen(&specimen.bone, factor);
            let bone = fractions.as_slice().iter();
            let bone = bone.map(|f| u8::from(*f >= LEAST_FRACTION)).collect();
            Counts::of(&Volume::from_vec(fractions.grid, bone))
        }
    };
    if counts.elements == 0.0 {
        return 0.0;
    }
    let refine = params.refine as f64;
    let nodes = counts.nodes_refined(refine);
    // Finer boxes fill in the same proportion to nodes as those of the finest count that was made.
    let boxes = counts.boxes * nodes / counts.nodes;
    let masks = if params.refine > 1 {
        refine.powi(3) * grid.len() as f64
    } else {
        0.0
    };
    let mut node = if differing { NODE + DIFFERING } else { NODE };
    if params.load == Load::Stiffness {
        node += match params.conditions {
            Conditions::Kinematic => KEPT_FIELDS,
            Conditions::Mixed | Conditions::Symshear => IN_COMMON,
        };
    }
    if params.plasticity.is_some() {
        node += LOAD_STEPS;
    }
    masks + nodes * node + boxes * NODE_BOX
}

/// What a mask's elements are made of.
struct Counts {
    elements: f64,
    faces: f64,
    nodes: f64,
    boxes: f64,
}

impl Counts {
    fn of(bone: &Volume<u8>) -> Self {
        let (grid, voxels) = (bone.grid, bone.as_slice());
        let is_bone = |at: [usize; 3]| voxels[grid.index(at)] != 0;
        let of_plane = |z: usize| {
            let (mut elements, mut shared) = (0usize, 0usize);
            for at in plane(grid.n, z).filter(|at| is_bone(*at)) {
                elements += 1;
                for a in 0..3 {
                    let mut next = at;
                    next[a] += 1;
                    shared += usize::from(next[a] < grid.n[a] && is_bone(next));
                }
            }
            [elements, 6 * elements - shared]
        };
        let [elements, faces] = sum((0..grid.n[2]).into_par_iter().map(of_plane));
        let [nodes, boxes] = nodes_and_boxes(&grid, is_bone);
        Counts {
            elements: elements as f64,
            faces: faces as f64,
            nodes: nodes as f64,
            boxes: boxes as f64,
        }
    }

    /// Nodes with `r` elements along a voxel's edge: those inside voxels, faces and edges, and the nodes there are. How
    /// many edges there are follows from the rest (Euler); tunnels and cavities are too few to count.
    fn nodes_refined(&self, r: f64) -> f64 {
        let edges = self.nodes + self.faces - self.elements;
        let inner = r - 1.0;
        inner.powi(3) * self.elements + inner.powi(2) * self.faces + inner * edges + self.nodes
    }
}

fn plane([nx, ny, _]: [usize; 3], z: usize) -> impl Iterator<Item = [usize; 3]> {
    (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z]))
}

fn sum(pairs: impl ParallelIterator<Item = [usize; 2]>) -> [usize; 2] {
    pairs.reduce(|| [0; 2], |a, b| [a[0] + b[0], a[1] + b[1]])
}

/// Corners of bone voxels, and boxes of [`BOX`] nodes that hold some.
fn nodes_and_boxes(grid: &Grid, is_bone: impl Fn([usize; 3]) -> bool + Sync) -> [usize; 2] {
    let n = grid.n.map(|n| n + 1);
    let is_node = |at: &[usize; 3]| {
        (0..8).any(|corner| {
            let back = |a: usize| {
                at[a]
                    .checked_sub(corner >> a & 1)
                    .filter(|v| *v < grid.n[a])
            };
            match (back(0), back(1), back(2)) {
                (Some(x), Some(y), Some(z)) => is_bone([x, y, z]),
                _ => false,
            }
        })
    };
    let across = [n[0].div_ceil(BOX), n[1].div_ceil(BOX)];
    let layer = |layer: usize| {
        let mut held = vec![false; across[0] * across[1]];
        let mut nodes = 0;
        for z in layer * BOX..((layer + 1) * BOX).min(n[2]) {
            for [x, y, _] in plane(n, z).filter(is_node) {
                nodes += 1;
                held[y / BOX * across[0] + x / BOX] = true;
            }
        }
        [nodes, held.iter().filter(|h| **h).count()]
    };
    sum((0..n[2].div_ceil(BOX)).into_par_iter().map(layer))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_to_solve_needs_nothing() {
        // One voxel in 8³: a coarse element of it is mostly pore, and left out.
        let grid = Grid::new([8; 3], [0.02; 3]);
        let mut voxels = vec![0u8; grid.len()];
        voxels[77] = 1;
        let specimen = Specimen {
            name: "speck".into(),
            grey: None,
            threshold: None,
            bone: Volume::from_vec(grid, voxels),
            tv_mm3: 1.0,
            tv_definition: "box".into(),
        };
        let coarse = SolveParams {
            coarsen: 4,
            ..SolveParams::default()
        };
        assert_eq!(counted(&specimen, &coarse), 0.0);
        assert!(counted(&specimen, &SolveParams::default()) > 0.0);
    }

    #[test]
    fn nodes_of_refined_voxels_are_counted_without_refining() {
        // An angle of 6 × 2 × 2 and 2 × 2 × 6 voxels.
        let grid = Grid::new([6, 5, 7], [0.02; 3]);
        let is_bone = |[x, y, z]: [usize; 3]| y < 2 && z < 6 && (z < 2 || x < 2);
        let at = |i: usize| [i % 6, i / 6 % 5, i / 30];
        let voxels = (0..grid.len()).map(|i| u8::from(is_bone(at(i)))).collect();
        let bone = Volume::from_vec(grid, voxels);
        let counts = Counts::of(&bone);
        for factor in [2, 3] {
            let fine = Counts::of(&resample::refine(&bone, factor));
            // One piece without tunnels: Euler's number is 1, which the estimate leaves out.
            let left_out = factor as f64 - 1.0;
            assert_eq!(counts.nodes_refined(factor as f64) - left_out, fine.nodes);
        }
    }
}
