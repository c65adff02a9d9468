//! Owns voxel elements that yield: linear bricks, and a state at the points of those alone that have ever flowed. Internal forces are
//! those of the linear kernel and, of yielded elements, what their plastic strains take off.

mod onset;
pub mod points;
mod tangent;

pub use onset::Onset;
pub use tangent::Tangent;

use crate::discretisation::voxels::VoxelMesh;
use crate::operator::coarsen::Coarsen;
use crate::operator::nonlinear::Incremental;
use crate::par::CHUNK;
use crate::physics::hex8::heterogeneous::low_corner;
use crate::physics::plasticity::{Elastic, Point, Softening, Tensor, YieldLaw};
use points::{Corners, Points, Scalar};
use rayon::prelude::*;
use std::ops::Range;

/// What an element is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tissue {
    pub elastic: Elastic,
    pub law: YieldLaw,
}

/// State of one element, named by the node that is its corner of smallest x, y, z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    pub node: u32,
    pub points: [Point; 8],
}

/// An element that flows in a step, or has before.
pub(super) struct Yielded {
    pub(super) state: State,
    softening: [Softening; 8],
    flows: bool,
    /// What plastic strains add to its elastic nodal forces.
    forces: Corners,
}

/// No element.
const NONE: u32 = u32::MAX;

/// Elements of a mesh with the linear operator of all of them, and what they remember.
pub struct PlasticBricks<'a, E, T> {
    elastic: &'a E,
    mesh: &'a VoxelMesh,
    points: Points,
    /// Of the element whose corner of smallest x, y, z is a node.
    tissue: T,
    /// At the start of the step, by node.
    before: Vec<State>,
    /// Of the last displacements that were looked at, by node.
    yielded: Vec<Yielded>,
    /// Place of an element in `yielded`, by node.
    slots: Vec<u32>,
}

/// Energies and volumes at the end of a step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Balance {
    /// Stored elastically, N mm.
    pub elastic_nmm: f64,
    /// Stress at the middle of the step times the step's plastic strain, N mm.
    pub dissipated_nmm: f64,
}

impl<'a, E: Coarsen, T: Fn(usize) -> Tissue + Sync> PlasticBricks<'a, E, T> {
    /// `elastic` has the stiffness of elements that are integrated as `points` are.
    pub fn new(elastic: &'a E, mesh: &'a VoxelMesh, points: Points, tissue: T) -> Self {
        PlasticBricks {
            slots: vec![NONE; mesh.len()],
            elastic,
            mesh,
            points,
            tissue,
            before: Vec::new(),
            yielded: Vec::new(),
        }
    }

    /// The same with a state that was kept.
    pub fn with_states(mut self, states: Vec<State>) -> Self {
        self.before = states;
        self
    }

    pub fn states(&self) -> &[State] {
        &self.before
    }

    /// The tangent at the last displacements whose forces were asked for.
    pub fn tangent_in<K: Scalar>(&self) -> Tangent<'a, E, K> {
        Tangent::new(self.elastic, self.mesh, &self.points, &self.yielded)
    }

    /// Makes the last displacements, `u`, the end of the step that began at `from`. `f` are the forces of `u`.
    pub fn accept(&mut self, from: &[[f64; 3]], u: &[[f64; 3]], f: &[[f64; 3]]) -> Balance {
        let parts: Vec<[f64; 2]> = self
            .yielded
            .par_chunks(256)
            .map(|some| {
                let each = some.iter().map(|y| self.energies(y, from, u));
                each.fold([0.0; 2], |sum, e| [sum[0] + e[0], sum[1] + e[1]])
            })
            .collect();
        let plastic: f64 = parts.iter().map(|p| p[0]).sum();
        let dissipated_nmm = parts.iter().map(|p| p[1]).sum();
        let twice = crate::par::dot(f, u);
        self.before = self.yielded.iter().map(|y| y.state).collect();
        Balance {
            elastic_nmm: 0.5 * (twice - plastic),
            dissipated_nmm,
        }
    }

    /// `∫ σ:ε_p` at the end of the step, and what the step dissipated.
    fn energies(&self, y: &Yielded, from: &[[f64; 3]], u: &[[f64; 3]]) -> [f64; 2] {
        let node = y.state.node as usize;
        let Tissue { elastic, .. } = (self.tissue)(node);
        let earlier = self
            .state_of(node)
            .map_or([Point::default(); 8], |s| s.points);
        let stress = |u: &[[f64; 3]], points: &[Point; 8]| {
            let strains = self.points.strains(&self.corners(node, u));
            let stored =
                |p: usize| std::array::from_fn(|i| strains[p][i] - points[p].plastic_strain[i]);
            std::array::from_fn::<Tensor, 8, _>(|p| elastic.stress(&stored(p)))
        };
        let (first, last) = (stress(from, &earlier), stress(u, &y.state.points));
        let mut sums = [0.0; 2];
        for p in 0..8 {
            let (now, then) = (y.state.points[p].plastic_strain, earlier[p].plastic_strain);
            for i in 0..6 {
                sums[0] += last[p][i] * now[i];
                sums[1] += 0.5 * (first[p][i] + last[p][i]) * (now[i] - then[i]);
            }
        }
        sums.map(|v| v * self.points.weight())
    }

    fn state_of(&self, node: usize) -> Option<&State> {
        let at = self.before.binary_search_by_key(&(node as u32), |s| s.node);
        at.ok().map(|at| &self.before[at])
    }

    /// Looks at every element: which flow, and how.
    fn look(&mut self, u: &[[f64; 3]]) {
        let chunks = self.mesh.len().div_ceil(CHUNK);
        let this = &*self;
        let parts: Vec<Vec<Yielded>> = (0..chunks)
            .into_par_iter()
            .map(|c| this.look_at(c * CHUNK..((c + 1) * CHUNK).min(this.mesh.len()), u))
            .collect();
        self.yielded = parts.into_iter().flatten().collect();
        self.slots.fill(NONE);
        for (slot, y) in (0u32..).zip(&self.yielded) {
            self.slots[y.state.node as usize] = slot;
        }
    }

    fn look_at(&self, nodes: Range<usize>, u: &[[f64; 3]]) -> Vec<Yielded> {
        let first = self
            .before
            .partition_point(|s| (s.node as usize) < nodes.start);
        let mut known = self.before[first..].iter().peekable();
        let mut found = Vec::new();
        for segment in self.mesh.segments_in(nodes) {
            for (i, node) in segment.nodes().enumerate() {
                if !self.mesh.has_element(node) {
                    continue;
                }
                let earlier = known.next_if(|s| s.node as usize == node);
                let strains = self.points.strains(&corners(&segment.rows, i, u));
                found.extend(self.element(node, &strains, earlier));
            }
        }
        found
    }

    /// An element under these strains; None where it has never flowed.
    fn element(
        &self,
        node: usize,
        strains: &[Tensor; 8],
        earlier: Option<&State>,
    ) -> Option<Yielded> {
        let Tissue { elastic, law } = (self.tissue)(node);
        if earlier.is_none() && !strains.iter().any(|strain| law.yields(&elastic, strain)) {
            return None;
        }
        let before = earlier.map_or([Point::default(); 8], |s| s.points);
        let responses: [_; 8] =
            std::array::from_fn(|p| law.respond(&elastic, &strains[p], &before[p]));
        let plastic = responses.map(|r| elastic.stress(&r.after.plastic_strain).map(|s| -s));
        Some(Yielded {
            state: State {
                node: node as u32,
                points: responses.map(|r| r.after),
            },
            flows: responses.iter().any(|r| r.softening.is_some()),
            softening: responses.map(|r| r.softening.unwrap_or_default()),
            forces: self.points.forces(&plastic),
        })
    }

    fn corners(&self, node: usize, u: &[[f64; 3]]) -> Corners {
        let segment = self.mesh.segments_in(node..node + 1).next();
        segment.map_or([[0.0; 3]; 8], |s| corners(&s.rows, 0, u))
    }

    /// Share of the elements whose middle has turned by more than `radians`.
    pub fn share_turned(&self, u: &[[f64; 3]], radians: f64) -> f64 {
        let turned = |node: usize| {
            let gradients = self.points.displacement_gradients(&self.corners(node, u));
            let mean = |i: usize, j: usize| gradients.iter().map(|g| g[i][j]).sum::<f64>() / 8.0;
            let axial = [(2, 1), (0, 2), (1, 0)].map(|(i, j)| 0.5 * (mean(i, j) - mean(j, i)));
            axial.iter().map(|v| v * v).sum::<f64>().sqrt() > radians
        };
        let count = (0..self.mesh.len()).into_par_iter();
        let count = count
            .filter(|node| self.mesh.has_element(*node) && turned(*node))
            .count();
        count as f64 / self.mesh.elements as f64
    }
}

impl<'a, E: Coarsen, T: Fn(usize) -> Tissue + Sync> Incremental for PlasticBricks<'a, E, T> {
    type Tangent = Tangent<'a, E, f32>;

    fn forces(&mut self, u: &[[f64; 3]], f: &mut [[f64; 3]]) {
        self.look(u);
        let this = &*self;
        f.par_chunks_mut(CHUNK).enumerate().for_each(|(c, f)| {
            let nodes = c * CHUNK..c * CHUNK + f.len();
            this.elastic.rows_f64(nodes.clone(), u, f);
            if this.yielded.is_empty() {
                return;
            }
            each_yielded(
                this.mesh,
                &this.slots,
                nodes.clone(),
                |node, corner, slot, _, _| {
                    let plastic = this.yielded[slot].forces[corner];
                    let f = &mut f[node - nodes.start];
                    (0..3).for_each(|a| f[a] += plastic[a]);
                },
            );
        });
    }

    fn tangent(&self) -> Tangent<'a, E, f32> {
        self.tangent_in()
    }
}

/// Displacements of the corners of the element whose corner of smallest x, y, z is node `i` of a segment.
fn corners(rows: &[u32; 9], i: usize, u: &[[f64; 3]]) -> Corners {
    std::array::from_fn(|c| u[rows[4 + (c >> 1 & 1) + 3 * (c >> 2)] as usize + i + (c & 1)])
}

/// Calls `visit` with every node of a range and every yielded element around it: the node, which corner of the element it is, the
/// element's slot, and the rows of neighbours with the node's place in them.
fn each_yielded(
    mesh: &VoxelMesh,
    slots: &[u32],
    nodes: Range<usize>,
    mut visit: impl FnMut(usize, usize, usize, &[u32; 9], usize),
) {
    for segment in mesh.segments_in(nodes) {
        for (i, node) in segment.nodes().enumerate() {
            let around = mesh.around[node];
            for e in (0..8).filter(|e| around >> e & 1 == 1) {
                let slot = slots[low_corner(&segment.rows, i, e)];
                if slot != NONE {
                    visit(node, 7 - e, slot as usize, &segment.rows, i);
                }
            }
        }
    }
}
