//! Owns the nodes and struts of regular lattices.

use super::super::waves::Numbers;
use super::frame::{Axes, Vec3, minus, norm, times};
use super::struts::Strut;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lattice {
    Cubic,
    Bcc,
    Octet,
    Kelvin,
}

impl Lattice {
    /// Nodes of one cell and the length of the struts, both in cells.
    fn cell(self) -> (Vec<Vec3>, f64) {
        match self {
            Lattice::Cubic => (vec![[0.0; 3]], 1.0),
            Lattice::Bcc => (vec![[0.0; 3], [0.5; 3]], 0.75f64.sqrt()),
            Lattice::Octet => (
                vec![[0.0; 3], [0.5, 0.5, 0.0], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5]],
                0.5f64.sqrt(),
            ),
            Lattice::Kelvin => (kelvin(), 0.125f64.sqrt()),
        }
    }

    /// All struts that reach within `half_mm` of the origin along each axis.
    pub fn struts(
        self,
        cell_mm: f64,
        axes: &Axes,
        numbers: Numbers,
        half_mm: Vec3,
        mut finish: impl FnMut(u64, Vec3, Vec3) -> Strut,
    ) -> Vec<Strut> {
        let (nodes, length) = self.cell();
        let shift: Vec3 = std::array::from_fn(|a| numbers.uniform(10 + a as u64));
        let outer = norm(half_mm) + 2.0 * cell_mm;
        let cells = (outer / cell_mm).ceil() as i64;
        let at = |cell: [i64; 3], node: Vec3| {
            let inner = std::array::from_fn(|a| cell[a] as f64 + node[a] + shift[a]);
            axes.outward(times(inner, cell_mm))
        };
        let inside = |p: Vec3| (0..3).all(|a| p[a].abs() <= half_mm[a] + cell_mm);
        let links = links(&nodes, length);
        let mut struts = Vec::new();
        for cell in cube(cells) {
            for (link, &(i, to, j)) in links.iter().enumerate() {
                let from = at(cell, nodes[i]);
                let to = at(std::array::from_fn(|a| cell[a] + to[a]), nodes[j]);
                if inside(from) || inside(to) {
                    struts.push(finish(name(cell, link as u64), from, to));
                }
            }
        }
        struts
    }
}

/// Whole numbers from `-n` to `n` along each axis.
pub fn cube(n: i64) -> impl Iterator<Item = [i64; 3]> {
    (-n..=n).flat_map(move |k| (-n..=n).flat_map(move |j| (-n..=n).map(move |i| [i, j, k])))
}

/// A number for the `n`th thing of a cell, the same however large the body is cut.
pub fn name(cell: [i64; 3], n: u64) -> u64 {
    let [i, j, k] = cell.map(|c| (c + (1 << 15)) as u64 & 0xFFFF);
    i | j << 16 | k << 32 | n << 48
}

/// Vertices of the truncated octahedra that fill space.
fn kelvin() -> Vec<Vec3> {
    let mut nodes = Vec::new();
    for zero in 0..3 {
        for half in (0..3).filter(|h| *h != zero) {
            for quarter in [0.25, 0.75] {
                let mut node = [quarter; 3];
                node[zero] = 0.0;
                node[half] = 0.5;
                nodes.push(node);
            }
        }
    }
    nodes
}

/// Struts that start in one cell: node, cell and node they end at. Each strut once.
fn links(nodes: &[Vec3], length: f64) -> Vec<(usize, [i64; 3], usize)> {
    let mut links = Vec::new();
    for cell in cube(1) {
        for (i, from) in nodes.iter().enumerate() {
            for (j, to) in nodes.iter().enumerate() {
                let end: Vec3 = std::array::from_fn(|a| to[a] + cell[a] as f64);
                let first = (cell, j) > ([0; 3], i);
                if first && (norm(minus(end, *from)) - length).abs() < 1e-6 {
                    links.push((i, cell, j));
                }
            }
        }
    }
    links
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lattices_have_the_struts_of_their_cell() {
        let count = |lattice: Lattice| {
            let (nodes, length) = lattice.cell();
            (nodes.len(), links(&nodes, length).len())
        };
        assert_eq!(count(Lattice::Cubic), (1, 3));
        assert_eq!(count(Lattice::Bcc), (2, 8));
        assert_eq!(count(Lattice::Octet), (4, 24));
        assert_eq!(count(Lattice::Kelvin), (12, 24));
    }
}
