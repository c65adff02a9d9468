//! Owns the points of a two-dimensional scene: cells of a regular grid, numbered row by row.

pub mod family;
pub mod geometry;
pub mod layers;

use crate::error::{Error, Result};
use crate::parts;

const NONE: u32 = u32::MAX;

/// Material points on a square grid. Point `i` sits at the centre of its cell, `origin + (cell + 1/2)·spacing`.
/// Fictitious points (see [`crate::discretisation::plane::layers`]) come after the material ones.
#[derive(Debug, Clone)]
pub struct Points {
    /// Edge of a cell, in the scene's length unit.
    pub spacing: f64,
    /// Lower left corner of cell `[0, 0]`.
    pub origin: [f64; 2],
    /// Whether the outermost points lie on the edges of the body instead of half a spacing inside.
    pub on_edges: bool,
    cells: Vec<[i32; 2]>,
    low: [i32; 2],
    n: [usize; 2],
    index: Vec<u32>,
}

impl Points {
    /// The cells of an `n[0] × n[1]` box whose centre satisfies `inside`.
    pub fn from_box(
        origin: [f64; 2],
        spacing: f64,
        n: [usize; 2],
        inside: impl Fn([f64; 2]) -> bool,
    ) -> Self {
        let mut cells = Vec::new();
        for j in 0..n[1] as i32 {
            for i in 0..n[0] as i32 {
                if inside(centre(origin, spacing, [i, j])) {
                    cells.push([i, j]);
                }
            }
        }
        Points::from_cells(origin, spacing, cells)
    }

    /// Points at the given distinct cells, in the given order.
    pub fn from_cells(origin: [f64; 2], spacing: f64, cells: Vec<[i32; 2]>) -> Self {
        let bound = |a: usize, pick: fn(i32, i32) -> i32| {
            cells.iter().map(|c| c[a]).reduce(pick).unwrap_or(0)
        };
        let low = [bound(0, i32::min), bound(1, i32::min)];
        let high = [bound(0, i32::max), bound(1, i32::max)];
        let n = [0, 1].map(|a| (high[a] - low[a] + 1) as usize);
        let mut points = Points {
            spacing,
            origin,
            on_edges: false,
            cells,
            low,
            n,
            index: vec![NONE; n[0] * n[1]],
        };
        for i in 0..points.len() {
            let slot = points
                .slot(points.cells[i])
                .expect("the box holds all cells");
            points.index[slot] = i as u32;
        }
        points
    }

    pub fn len(&self) -> usize {
        self.cells.len()
    }

    pub fn is_empty(&self) -> bool {
        self.cells.is_empty()
    }

    pub fn cell(&self, point: usize) -> [i32; 2] {
        self.cells[point]
    }

    /// Lowest cell of the bounding box, and its number of cells along x and y.
    pub fn bounds(&self) -> ([i32; 2], [usize; 2]) {
        (self.low, self.n)
    }

    pub fn position(&self, point: usize) -> [f64; 2] {
        centre(self.origin, self.spacing, self.cells[point])
    }

    pub fn positions(&self) -> Vec<[f64; 2]> {
        (0..self.len()).map(|i| self.position(i)).collect()
    }

    /// The point in a cell, if there is one.
    pub fn at(&self, cell: [i32; 2]) -> Option<usize> {
        let found = self.index[self.slot(cell)?];
        (found != NONE).then_some(found as usize)
    }

    /// The point nearest to a position (the first of equals).
    pub fn nearest(&self, position: [f64; 2]) -> Option<usize> {
        let squared = |i: usize| {
            let p = self.position(i);
            (p[0] - position[0]).powi(2) + (p[1] - position[1]).powi(2)
        };
        (0..self.len()).min_by(|&a, &b| squared(a).total_cmp(&squared(b)))
    }

    /// The piece (by edge neighbours) each point belongs to, and the number of pieces.
    pub fn pieces(&self) -> (Vec<u32>, usize) {
        let mut up = parts::apart(self.len());
        for (point, &[i, j]) in self.cells.iter().enumerate() {
            for next in [[i + 1, j], [i, j + 1]] {
                if let Some(next) = self.at(next) {
                    parts::join(&mut up, point as u32, next as u32);
                }
            }
        }
        parts::numbered(up)
    }

    /// Refuses an empty set, and one in several pieces: a piece without support of its own could move freely.
    pub fn require_one_piece(&self) -> Result<()> {
        if self.is_empty() {
            return Err(Error::specimen(
                "the geometry holds no point of the grid",
                "check its size against grid.spacing",
            ));
        }
        let (piece, count) = self.pieces();
        if count == 1 {
            return Ok(());
        }
        let mut sizes = vec![0usize; count];
        piece.iter().for_each(|&p| sizes[p as usize] += 1);
        let smallest = (0..count).min_by_key(|&p| sizes[p]).unwrap_or(0);
        let stray = piece.iter().position(|&p| p as usize == smallest);
        let [x, y] = self.position(stray.unwrap_or(0));
        Err(Error::specimen(
            format!(
                "the geometry falls into {count} unconnected pieces of {} to {} points; the smallest is near \
                 ({x:.4}, {y:.4})",
                sizes[smallest],
                sizes.iter().max().unwrap_or(&0),
            ),
            "keep the largest alone (grid.keep_largest = true), join them, or refine grid.spacing",
        ))
    }

    /// The largest piece alone; of equals, the first.
    pub fn largest_piece(&self) -> Points {
        let (piece, count) = self.pieces();
        let mut sizes = vec![0usize; count];
        piece.iter().for_each(|&p| sizes[p as usize] += 1);
        let keep = (0..count).rev().max_by_key(|&p| sizes[p]).unwrap_or(0) as u32;
        let kept = self.cells.iter().zip(&piece).filter(|(_, p)| **p == keep);
        self.of(kept.map(|(c, _)| *c).collect())
    }

    /// Only the points that belong to a square of four neighbouring points.
    pub fn pruned(&self) -> Points {
        let there = |[i, j]: [i32; 2], [a, b]: [i32; 2]| self.at([i + a, j + b]).is_some();
        let square = |c: [i32; 2], [a, b]: [i32; 2]| {
            there(c, [a, 0]) && there(c, [0, b]) && there(c, [a, b])
        };
        let corners = [[1, 1], [-1, 1], [-1, -1], [1, -1]];
        let kept = self
            .cells
            .iter()
            .filter(|c| corners.iter().any(|&d| square(**c, d)));
        self.of(kept.copied().collect())
    }

    /// Some of these points, as they lie.
    fn of(&self, cells: Vec<[i32; 2]>) -> Points {
        Points {
            on_edges: self.on_edges,
            ..Points::from_cells(self.origin, self.spacing, cells)
        }
    }

    fn slot(&self, cell: [i32; 2]) -> Option<usize> {
        let [i, j] = [cell[0] - self.low[0], cell[1] - self.low[1]];
        let inside = i >= 0 && j >= 0 && (i as usize) < self.n[0] && (j as usize) < self.n[1];
        inside.then(|| j as usize * self.n[0] + i as usize)
    }
}

fn centre(origin: [f64; 2], spacing: f64, cell: [i32; 2]) -> [f64; 2] {
    [0, 1].map(|a| origin[a] + (cell[a] as f64 + 0.5) * spacing)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_are_found_and_named() {
        let two = Points::from_cells([0.0; 2], 1.0, vec![[0, 0], [1, 0], [4, 4]]);
        assert_eq!(two.pieces().1, 2);
        let message = two.require_one_piece().unwrap_err().to_string();
        assert!(message.contains("2 unconnected pieces"), "{message}");
        assert_eq!(two.largest_piece().len(), 2);
        assert!(two.largest_piece().require_one_piece().is_ok());
    }

    #[test]
    fn what_drops_nothing_changes_nothing() {
        let mut points = Points::from_box([0.0; 2], 1.0, [3, 3], |_| true);
        points.on_edges = true;
        for same in [points.largest_piece(), points.pruned()] {
            assert_eq!(same.cells, points.cells);
            assert!(same.on_edges);
        }
    }

    #[test]
    fn cells_find_their_points() {
        let p = Points::from_cells([-1.0, 2.0], 0.5, vec![[3, -2], [4, 5]]);
        assert_eq!(p.at([3, -2]), Some(0));
        assert_eq!(p.at([3, 5]), None);
        assert_eq!(p.at([-30, 5]), None);
        assert_eq!(p.position(0), [0.75, 1.25]);
        assert_eq!(p.nearest([0.8, 1.0]), Some(0));
    }
}
