//! Owns one lattice cell: the connected components of its bone, how much there is of each, and what shows on its faces.

use crate::discretisation::lattice::placement::overlaps;
use crate::grid::Axis;
use crate::parts;
use crate::volume::Volume;

/// Label of what is no bone.
pub const NO_PIECE: u16 = u16::MAX;

const LARGEST: u16 = u16::MAX - 2;

/// A cell with bone in it.
pub struct Cell {
    pub components: Vec<Part>,
    /// Labels (places in `components`) of the outermost voxels below and above along each axis.
    pub first: [Vec<u16>; 3],
    pub last: [Vec<u16>; 3],
}

/// What a voxel behind which bone ends bears, toward that end, of what it bears inside bone. Load flows around the corners
/// of voxel steps: were it 1, struts of five voxels would be 10 % too stiff; 0 would leave out a whole voxel of each run.
const END_SHARE: f64 = 0.5;

/// A connected component of a cell's bone.
pub struct Part {
    /// Of the part of the cell that lies between the loaded faces.
    pub fraction: f32,
    /// Share of a whole cross-section along each axis, of the half cell below and above: the harmonic mean over the half
    /// slices in which the component is, each of the area that bears toward the slice next to it.
    pub ends: [[f32; 2]; 3],
}

/// Voxels along one axis and the lengths of theirs in the cell, in all and in the half below and above its centre.
struct Span {
    first: usize,
    length: Vec<f64>,
    halves: Vec<[f64; 2]>,
}

impl Span {
    fn new(x: f64, edge: f64, h: f64, n: usize) -> Option<Self> {
        let all = overlaps(x, edge, h, n);
        let first = all.first()?.0;
        let cut = |v: usize, low: f64, high: f64| {
            (high.min((v + 1) as f64 * h) - low.max(v as f64 * h)).max(0.0)
        };
        let halves = |v: usize| [cut(v, x - 0.5 * edge, x), cut(v, x, x + 0.5 * edge)];
        Some(Span {
            first,
            halves: all.iter().map(|&(v, _)| halves(v)).collect(),
            length: all.into_iter().map(|(_, l)| l).collect(),
        })
    }

    fn len(&self) -> usize {
        self.length.len()
    }
}

impl Cell {
    /// The cell of edge `edge` around a position; None where it has no bone. Along the load axis what lies outside the
    /// volume is no part of the cell, sideways it is pore.
    pub fn of(bone: &Volume<u8>, position_mm: [f64; 3], edge: f64, load: Axis) -> Option<Cell> {
        let grid = &bone.grid;
        let mut spans = Vec::with_capacity(3);
        for (a, &position) in position_mm.iter().enumerate() {
            spans.push(Span::new(position, edge, grid.spacing_mm[a], grid.n[a])?);
        }
        let m = [spans[0].len(), spans[1].len(), spans[2].len()];
        let mut labels = vec![NO_PIECE; m.iter().product()];
        let mut any = false;
        for k in 0..m[2] {
            for j in 0..m[1] {
                let row = grid.index([spans[0].first, spans[1].first + j, spans[2].first + k]);
                let to = (k * m[1] + j) * m[0];
                for i in 0..m[0] {
                    if bone.as_slice()[row + i] != 0 {
                        labels[to + i] = 0;
                        any = true;
                    }
                }
            }
        }
        if !any {
            return None;
        }
        let count = label(&mut labels, m);
        let mut extent = [edge; 3];
        extent[load.index()] = spans[load.index()].length.iter().sum();
        let origin = [spans[0].first, spans[1].first, spans[2].first];
        let goes_on = |at: [usize; 3], a: usize, up: bool| goes_on(bone, origin, at, a, up, load);
        let components = measure(&labels, m, count, &spans, extent, goes_on);
        let face = |a: usize, at: usize| {
            let place = |i: usize| [i % m[0], i / m[0] % m[1], i / (m[0] * m[1])];
            let on = labels
                .iter()
                .enumerate()
                .filter(|(i, _)| place(*i)[a] == at);
            on.map(|(_, l)| *l).collect()
        };
        Some(Cell {
            first: std::array::from_fn(|a| face(a, 0)),
            last: std::array::from_fn(|a| face(a, m[a] - 1)),
            components,
        })
    }
}

/// Labels connected bone through voxel faces, from 0. Returns how many labels there are.
fn label(labels: &mut [u16], m: [usize; 3]) -> usize {
    let strides = [1, m[0], m[0] * m[1]];
    let mut up = parts::apart(labels.len());
    for v in (0..labels.len()).filter(|&v| labels[v] != NO_PIECE) {
        for (stride, m) in strides.into_iter().zip(m) {
            let at = v / stride % m;
            if at > 0 && labels[v - stride] != NO_PIECE {
                parts::join(&mut up, v as u32, (v - stride) as u32);
            }
        }
    }
    let mut count = 0;
    for v in 0..labels.len() {
        let above = up[v] as usize;
        if above != v {
            labels[v] = labels[above];
        } else if labels[v] != NO_PIECE {
            // Beyond the largest label (never met: a cell would need 131 068 voxels) the rest counts as one component.
            labels[v] = (count as u16).min(LARGEST);
            count = usize::from(labels[v]) + 1;
        }
    }
    count
}

/// Whether bone goes on behind a voxel of the cell, up or down an axis. Behind the loaded faces it does.
fn goes_on(
    bone: &Volume<u8>,
    origin: [usize; 3],
    at: [usize; 3],
    a: usize,
    up: bool,
    load: Axis,
) -> bool {
    let mut voxel: [usize; 3] = std::array::from_fn(|c| origin[c] + at[c]);
    let last = if up { bone.grid.n[a] - 1 } else { 0 };
    if voxel[a] == last {
        return a == load.index();
    }
    voxel[a] = if up { voxel[a] + 1 } else { voxel[a] - 1 };
    bone.as_slice()[bone.grid.index(voxel)] != 0
}

fn measure(
    labels: &[u16],
    m: [usize; 3],
    count: usize,
    spans: &[Span],
    extent: [f64; 3],
    goes_on: impl Fn([usize; 3], usize, bool) -> bool,
) -> Vec<Part> {
    // Of each component in every slice along each axis, the area that bears down and up, and the volume.
    let mut areas: [Vec<[f64; 2]>; 3] = std::array::from_fn(|a| vec![[0.0; 2]; count * m[a]]);
    let mut volumes = vec![0.0; count];
    for (v, &l) in labels.iter().enumerate() {
        if l == NO_PIECE {
            continue;
        }
        let at = [v % m[0], v / m[0] % m[1], v / (m[0] * m[1])];
        let w: [f64; 3] = std::array::from_fn(|a| spans[a].length[at[a]]);
        volumes[usize::from(l)] += w.iter().product::<f64>();
        for a in 0..3 {
            let area = w[(a + 1) % 3] * w[(a + 2) % 3];
            for up in [false, true] {
                let share = if goes_on(at, a, up) { 1.0 } else { END_SHARE };
                areas[a][usize::from(l) * m[a] + at[a]][usize::from(up)] += share * area;
            }
        }
    }
    let volume: f64 = extent.iter().product();
    (0..count)
        .map(|l| {
            let ends = |a: usize, side: usize| {
                let whole = extent[(a + 1) % 3] * extent[(a + 2) % 3];
                let (mut length, mut resistance) = (0.0, 0.0);
                let slices = &areas[a][l * m[a]..(l + 1) * m[a]];
                for ([down, up], halves) in slices.iter().zip(&spans[a].halves) {
                    if *down > 0.0 {
                        length += halves[side];
                        resistance += 0.5 * halves[side] * (down.recip() + up.recip());
                    }
                }
                if resistance > 0.0 {
                    (length / resistance / whole) as f32
                } else {
                    0.0
                }
            };
            Part {
                fraction: (volumes[l] / volume) as f32,
                ends: std::array::from_fn(|a| [ends(a, 0), ends(a, 1)]),
            }
        })
        .collect()
}
