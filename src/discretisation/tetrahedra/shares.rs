//! Owns how much of each element is bone. Cells fill what is thinner than they are: creases where struts meet at a sharp angle, narrow gaps.
//!
//! Values of the surface at an element's corners and at the middles of its edges split it into eight parts, and are linear in each.

use super::mesh::Mesh;
use super::nodes::EDGES;
use super::surface::Surface;
use rayon::prelude::*;

/// Depth outside bone, in parts of a cell's edge, that does not count: flat faces between points of a curved surface are that far off
/// it, and their gaps on both sides of it balance (see `fit`).
const BALANCED: f64 = 0.06;

/// Shares are multiples of one over this: decks of other programs hold one material for each.
pub const STEPS: f64 = 32.0;

/// Elements with a smaller share of bone are left out.
pub const LEAST: f32 = 0.1;

/// Middles of edges in the order around the one between the middles of edges 2 and 4.
const RING: [usize; 4] = [0, 1, 5, 3];

/// The share of bone in each element: multiples of `1 / STEPS` up to 1.
pub fn shares(mesh: &Mesh, surface: &Surface) -> Vec<f32> {
    let values: Vec<f64> = mesh
        .vertices_mm
        .par_iter()
        .map(|p| surface.value(*p))
        .collect();
    let balanced = BALANCED * mesh.cell_mm * mean_slope(mesh, surface);
    let of = |e: &[u32; 4]| {
        let (at, corners) = (mesh.corners(e), e.map(|v| values[v as usize] + balanced));
        let middles = EDGES.map(|[a, b]| {
            let middle = [0, 1, 2].map(|c| 0.5 * (at[a][c] + at[b][c]));
            surface.value(middle) + balanced
        });
        ((share(corners, middles) * STEPS).round() / STEPS) as f32
    };
    mesh.elements.par_iter().map(of).collect()
}

/// Mean slope of the values at the surface, per mm.
fn mean_slope(mesh: &Mesh, surface: &Surface) -> f64 {
    let on = || (0..mesh.vertices_mm.len()).filter(|v| mesh.on_surface[*v]);
    let slope = |v: usize| {
        let (_, slope) = surface.value_and_slope(mesh.vertices_mm[v]);
        slope.iter().map(|s| s * s).sum::<f64>().sqrt()
    };
    let sum: f64 = on().map(slope).sum();
    sum / on().count().max(1) as f64
}

/// The share of an element with positive values, from those at its corners and at the middles of its edges.
fn share(corners: [f64; 4], middles: [f64; 6]) -> f64 {
    let all = || corners.iter().chain(&middles);
    if all().all(|v| *v >= 0.0) {
        return 1.0;
    }
    if all().all(|v| *v <= 0.0) {
        return 0.0;
    }
    let mut sum = 0.0;
    for (c, corner) in corners.iter().enumerate() {
        let mut part = [*corner; 4];
        let own = (0..6).filter(|e| EDGES[*e].contains(&c));
        part[1..]
            .iter_mut()
            .zip(own)
            .for_each(|(p, e)| *p = middles[e]);
        sum += positive(part);
    }
    for i in 0..4 {
        let [a, b] = [RING[i], RING[(i + 1) % 4]];
        sum += positive([middles[2], middles[4], middles[a], middles[b]]);
    }
    sum / 8.0
}

/// The share of a tetrahedron where the linear function with these values at its corners is positive: `Σ v³ / Π (v − w)` over the
/// positive ones.
fn positive(mut values: [f64; 4]) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    let [low, .., high] = values;
    if low >= 0.0 {
        return 1.0;
    }
    if high <= 0.0 {
        return 0.0;
    }
    // Equal values would divide by nothing.
    let apart = 1e-3 * (high - low);
    let v: [f64; 4] = std::array::from_fn(|i| values[i] + i as f64 * apart);
    let term = |i: usize| {
        let others = (0..4).filter(|j| *j != i);
        v[i].powi(3) / others.map(|j| v[i] - v[j]).product::<f64>()
    };
    let sum: f64 = (0..4).filter(|i| v[*i] > 0.0).map(term).sum();
    sum.clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `x > s` in the tetrahedron of the axes: `(1 − s)³` of it.
    #[test]
    fn the_share_beyond_a_plane_is_exact() {
        let places = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        for s in [0.1, 0.3, 0.5, 0.8] {
            let value = |p: [f64; 3]| p[0] - s;
            let middles =
                EDGES.map(|[a, b]| value([0, 1, 2].map(|c| 0.5 * (places[a][c] + places[b][c]))));
            let found = share(places.map(value), middles);
            let exact = (1.0f64 - s).powi(3);
            assert!((found - exact).abs() < 5e-3, "{s}: {found} {exact}");
        }
        // Beyond x + y = s: two corners on either side.
        for s in [0.2, 0.6] {
            let value = |p: [f64; 3]| p[0] + p[1] - s;
            let middles =
                EDGES.map(|[a, b]| value([0, 1, 2].map(|c| 0.5 * (places[a][c] + places[b][c]))));
            // Sections at x + y = t have the area t (1 − t) of the whole's, times 6.
            let exact = 1.0 - (3.0 * s * s - 2.0 * s * s * s);
            let found = share(places.map(value), middles);
            assert!((found - exact).abs() < 5e-3, "{s}: {found} {exact}");
        }
    }

    #[test]
    fn whole_and_empty_elements_have_shares_of_one_and_nothing() {
        assert_eq!(share([1.0; 4], [0.0; 6]), 1.0);
        assert_eq!(share([-1.0; 4], [0.0; 6]), 0.0);
        assert_eq!(positive([0.0, 0.0, 0.0, -1.0]), 0.0);
    }
}
