//! Owns which vertices of the lattice are in bone, where the surface crosses its edges, and which vertices move onto it.
//!
//! A vertex moves onto the surface where that crosses one of its edges near it. Vertices in bone decide first, all by
//! themselves, then those outside, from the crossings that are left: the order of the paper without its dependence on one.

use super::lattice::{EdgeKind, Lattice, Place};
use super::surface::Surface;
use rayon::prelude::*;

/// Share of an edge within which a crossing moves its end: of long and of short edges, those of the paper for the best
/// angles (10.7° to 164.8°).
const NEAR_LONG: f64 = 0.21509;
const NEAR_SHORT: f64 = 0.35900;

/// Of diagonals of the box's faces: the length is between the others.
const NEAR_DIAGONAL: f64 = 0.2;

/// Parts of a cell's edge that a vertex on the box may move in the face, and that the surface may move there at most.
const SLIDE: f64 = 0.25;
const MOVED_SURFACE: f64 = 0.1;

/// Where the surface crosses an edge.
#[derive(Debug, Clone, Copy)]
pub struct Cut {
    pub plus: u32,
    pub minus: u32,
    pub at_mm: [f64; 3],
    /// From the vertex in bone, as a share of the edge.
    share: f64,
}

/// A vertex of the lattice against the surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    Bone,
    On,
    Outside,
}

/// The lattice with its crossings.
pub struct Snapped<'a> {
    pub lattice: &'a Lattice,
    pub sides: Vec<Side>,
    /// Sorted by the vertex in bone, then by the other.
    pub cuts: Vec<Cut>,
    /// First cut of every vertex, and their number.
    first: Vec<u32>,
    /// Vertices that moved, ascending, and where they are.
    moved: Vec<(u32, [f64; 3])>,
}

fn near(kind: EdgeKind) -> f64 {
    match kind {
        EdgeKind::Short => NEAR_SHORT,
        EdgeKind::Long => NEAR_LONG,
        EdgeKind::Diagonal => NEAR_DIAGONAL,
    }
}

/// Where `surface` crosses the edge from `a` in bone to `b` outside, as a share of it.
fn crossing(surface: &Surface, a: [f64; 3], b: [f64; 3], ends: [f64; 2]) -> f64 {
    let at = |t: f64| surface.value(along(a, b, t));
    let (mut low, mut high) = ((0.0, ends[0]), (1.0, ends[1]));
    let mut last = 0;
    for _ in 0..12 {
        let share = low.1 / (low.1 - high.1);
        let t = low.0 + share * (high.0 - low.0);
        if high.0 - low.0 < 1e-4 {
            return t;
        }
        let value = at(t);
        // Illinois: the end that stays counts half, so that both come nearer.
        if value >= 0.0 {
            low = (t, value);
            if last == 1 {
                high.1 *= 0.5;
            }
            last = 1;
        } else {
            high = (t, value);
            if last == -1 {
                low.1 *= 0.5;
            }
            last = -1;
        }
        if value.abs() <= 1e-6 * (ends[0] - ends[1]) {
            return t;
        }
    }
    0.5 * (low.0 + high.0)
}

fn along(a: [f64; 3], b: [f64; 3], t: f64) -> [f64; 3] {
    std::array::from_fn(|c| a[c] + t * (b[c] - a[c]))
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt()
}

impl<'a> Snapped<'a> {
    pub fn new(lattice: &'a Lattice, surface: &Surface) -> Snapped<'a> {
        let values: Vec<f32> = (0..lattice.vertices())
            .into_par_iter()
            .map(|v| surface.value(lattice.position_mm(lattice.place(v))) as f32)
            .collect();
        let cuts_of = |v: usize| {
            let mut cuts = Vec::new();
            if values[v] >= 0.0 {
                let place = lattice.place(v);
                let a = lattice.position_mm(place);
                lattice.each_neighbour(place, |to| {
                    let minus = lattice.number(to);
                    if values[minus] < 0.0 {
                        let b = lattice.position_mm(to);
                        let ends = [v, minus].map(|v| f64::from(values[v]));
                        let share = crossing(surface, a, b, ends);
                        cuts.push(Cut {
                            plus: v as u32,
                            minus: minus as u32,
                            at_mm: along(a, b, share),
                            share,
                        });
                    }
                });
                cuts.sort_unstable_by_key(|c| c.minus);
            }
            cuts
        };
        let cuts: Vec<Cut> = (0..values.len())
            .into_par_iter()
            .flat_map_iter(cuts_of)
            .collect();
        let mut first = vec![0u32; values.len() + 1];
        cuts.iter().for_each(|c| first[c.plus as usize + 1] += 1);
        for v in 0..values.len() {
            first[v + 1] += first[v];
        }
        let side = |v: &f32| match *v >= 0.0 {
            true => Side::Bone,
            false => Side::Outside,
        };
        let mut snapped = Snapped {
            lattice,
            sides: values.par_iter().map(side).collect(),
            cuts,
            first,
            moved: Vec::new(),
        };
        drop(values);
        snapped.snap(surface);
        snapped
    }

    fn snap(&mut self, surface: &Surface) {
        let mut of_plus: Vec<u32> = (0..self.cuts.len() as u32).collect();
        let inside = self.decide(surface, &of_plus, |c| (c.plus, c.minus, c.share));
        self.adopt(inside);
        of_plus.retain(|&c| self.sides[self.cuts[c as usize].plus as usize] == Side::Bone);
        of_plus.par_sort_unstable_by_key(|&c| (self.cuts[c as usize].minus, c));
        let outside = self.decide(surface, &of_plus, |c| (c.minus, c.plus, 1.0 - c.share));
        self.adopt(outside);
        self.moved.par_sort_unstable_by_key(|m| m.0);
    }

    fn adopt(&mut self, moved: Vec<(u32, [f64; 3])>) {
        for (v, _) in &moved {
            self.sides[*v as usize] = Side::On;
        }
        self.moved.extend(moved);
    }

    /// Vertices that move, and where to, from `cuts` grouped by vertex. `ends` are a cut's vertex, the edge's other end and
    /// the share of the edge between.
    fn decide(
        &self,
        surface: &Surface,
        cuts: &[u32],
        ends: impl Fn(&Cut) -> (u32, u32, f64) + Sync,
    ) -> Vec<(u32, [f64; 3])> {
        let of = |c: &u32| ends(&self.cuts[*c as usize]);
        let groups: Vec<&[u32]> = cuts.chunk_by(|a, b| of(a).0 == of(b).0).collect();
        let decided = |group: &&[u32]| {
            let (vertex, ..) = of(&group[0]);
            let place = self.lattice.place(vertex as usize);
            let here = self.lattice.position_mm(place);
            let on = self.lattice.on_faces(place);
            let mut nearest: Option<(f64, [f64; 3])> = None;
            let mut off_face = f64::INFINITY;
            for c in group.iter() {
                let (_, other, share) = of(c);
                let to: Place = self.lattice.place(other as usize);
                if share >= near(Lattice::edge_kind(place, to)) {
                    continue;
                }
                let at = self.cuts[*c as usize].at_mm;
                let far = distance(at, here);
                if (0..3).any(|a| on[a] && to[a] != place[a]) {
                    off_face = off_face.min(far);
                } else if nearest.is_none_or(|(d, _)| far < d) {
                    nearest = Some((far, at));
                }
            }
            let at = nearest.map(|(_, at)| at);
            let at = at.or_else(|| {
                (off_face < f64::INFINITY)
                    .then(|| self.in_face(surface, here, on, off_face))
                    .flatten()
            });
            at.map(|at| (vertex, at))
        };
        groups.par_iter().filter_map(decided).collect()
    }

    /// Where a vertex on the box moves whose surface is `off_face` away along an edge inwards: to the surface in the face,
    /// nowhere where the surface is that near anyway; None where it stays off the surface.
    fn in_face(
        &self,
        surface: &Surface,
        here: [f64; 3],
        on: [bool; 3],
        off_face: f64,
    ) -> Option<[f64; 3]> {
        let size = self.lattice.size_mm();
        let mut at = here;
        for _ in 0..5 {
            let (value, slope) = surface.value_and_slope(at);
            let slope: [f64; 3] = std::array::from_fn(|a| if on[a] { 0.0 } else { slope[a] });
            let squared = slope.iter().map(|s| s * s).sum::<f64>();
            if squared == 0.0 {
                break;
            }
            at = std::array::from_fn(|a| at[a] - value * slope[a] / squared);
            if distance(at, here) > SLIDE * size {
                break;
            }
        }
        let fits = distance(at, here) <= SLIDE * size && surface.depth_mm(at).abs() < 0.01 * size;
        if fits {
            return Some(at);
        }
        (off_face <= MOVED_SURFACE * size).then_some(here)
    }

    /// The number of the crossing of an edge from a vertex in bone to one outside.
    pub fn cut(&self, plus: usize, minus: usize) -> usize {
        let range = self.first[plus] as usize..self.first[plus + 1] as usize;
        let at = self.cuts[range.clone()].binary_search_by_key(&(minus as u32), |c| c.minus);
        range.start + at.expect("an edge between bone and outside is crossed")
    }

    /// Where a vertex of the lattice is after moving.
    pub fn position_mm(&self, vertex: usize) -> [f64; 3] {
        match self.moved.binary_search_by_key(&(vertex as u32), |m| m.0) {
            Ok(at) => self.moved[at].1,
            Err(_) => self.lattice.position_mm(self.lattice.place(vertex)),
        }
    }
}
