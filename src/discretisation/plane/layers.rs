//! Owns fictitious layers: points added beyond an edge so that a displacement can be prescribed over a full horizon.

use crate::discretisation::plane::Points;
use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Edge {
    Bottom,
    Top,
    Left,
    Right,
}

impl Edge {
    /// Axis of the edge's normal, and its sign.
    pub fn normal(self) -> (usize, i32) {
        match self {
            Edge::Bottom => (1, -1),
            Edge::Top => (1, 1),
            Edge::Left => (0, -1),
            Edge::Right => (0, 1),
        }
    }
}

/// A fictitious point: the material point it mirrors across `edge`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fictitious {
    pub mirrored: usize,
    pub edge: Edge,
}

/// `material` followed by `depth` rows of fictitious points beyond each of `edges`. The edge is that of the bounding
/// box, or its outermost row where the points lie on it; the fictitious points mirror the material points nearest to it.
pub fn add_layers(
    material: &Points,
    edges: &[Edge],
    depth: usize,
) -> Result<(Points, Vec<Fictitious>)> {
    let (low, n) = material.bounds();
    let mut cells: Vec<[i32; 2]> = (0..material.len()).map(|i| material.cell(i)).collect();
    let mut fictitious = Vec::new();
    for &edge in edges {
        let (axis, sign) = edge.normal();
        if depth + usize::from(material.on_edges) > n[axis] {
            return Err(Error::specimen(
                format!(
                    "a fictitious layer of {depth} rows cannot mirror {} rows of points",
                    n[axis]
                ),
                "refine grid.spacing, shorten grid.horizon or enlarge the geometry",
            ));
        }
        let face = low[axis] + if sign > 0 { n[axis] as i32 - 1 } else { 0 };
        // Rows count from 0 at the edge inwards; a row on the edge itself mirrors nothing.
        let on_edge = i32::from(material.on_edges);
        for i in 0..material.len() {
            let mut cell = material.cell(i);
            let row = sign * (face - cell[axis]);
            if (on_edge..on_edge + depth as i32).contains(&row) {
                cell[axis] = face + sign * (row + 1 - on_edge);
                cells.push(cell);
                fictitious.push(Fictitious { mirrored: i, edge });
            }
        }
    }
    let mut points = Points::from_cells(material.origin, material.spacing, cells);
    points.on_edges = material.on_edges;
    Ok((points, fictitious))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_mirror_the_nearest_rows() {
        let square = Points::from_box([0.0; 2], 1.0, [4, 5], |_| true);
        let (all, extra) = add_layers(&square, &[Edge::Top, Edge::Left], 2).unwrap();
        assert_eq!(all.len(), 20 + 2 * 4 + 2 * 5);
        for (k, f) in extra.iter().enumerate() {
            let (here, there) = (all.position(20 + k), all.position(f.mirrored));
            match f.edge {
                Edge::Top => assert_eq!((here[0], here[1] - 5.0), (there[0], 5.0 - there[1])),
                _ => assert_eq!((-here[0], here[1]), (there[0], there[1])),
            }
        }
        assert!(add_layers(&square, &[Edge::Top], 6).is_err());
    }
}
