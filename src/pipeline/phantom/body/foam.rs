//! Owns random open foams: struts along the edges of a Voronoi tessellation.

use super::super::waves::Numbers;
use super::frame::{Vec3, dot, minus, norm, plus, times};
use super::lattices::{cube, name};
use super::struts::Strut;
use std::collections::BTreeMap;

/// Seeds lie in the cells of a cubic grid, anywhere within this share of a cell about its middle.
const JITTER: f64 = 0.8;

/// Seeds farther apart than this, in cells, share no vertex that counts.
const NEIGHBOURS: f64 = 2.4;

struct Seed {
    name: u64,
    at: Vec3,
}

/// All edges that reach within `half_mm` of the origin along each axis.
pub fn struts(
    cell_mm: f64,
    numbers: Numbers,
    half_mm: Vec3,
    mut finish: impl FnMut(u64, Vec3, Vec3) -> Strut,
) -> Vec<Strut> {
    let seeds = seeds(cell_mm, numbers, half_mm);
    let inside = |p: Vec3| (0..3).all(|a| p[a].abs() <= half_mm[a] + 0.5 * cell_mm);
    let mut edges: BTreeMap<[u64; 3], Vec<Vec3>> = BTreeMap::new();
    for (four, vertex) in vertices(&seeds, NEIGHBOURS * cell_mm) {
        for left_out in 0..4 {
            let mut three = [0; 3];
            let kept = (0..4).filter(|n| *n != left_out);
            kept.zip(&mut three)
                .for_each(|(n, name)| *name = seeds[four[n]].name);
            edges.entry(three).or_default().push(vertex);
        }
    }
    let whole = edges.into_iter().filter(|(_, ends)| ends.len() == 2);
    whole
        .filter(|(_, ends)| inside(ends[0]) || inside(ends[1]))
        .filter(|(_, ends)| norm(minus(ends[0], ends[1])) > 1e-6 * cell_mm)
        .map(|([a, b, c], ends)| {
            let own = a ^ b.rotate_left(21) ^ c.rotate_left(42);
            finish(own, ends[0], ends[1])
        })
        .collect()
}

/// In the order of their names.
fn seeds(cell_mm: f64, numbers: Numbers, half_mm: Vec3) -> Vec<Seed> {
    let cells = |a: usize| (half_mm[a] / cell_mm).ceil() as i64 + 3;
    let most = (0..3).map(cells).fold(0, i64::max);
    let mut seeds: Vec<Seed> = cube(most)
        .filter(|cell| (0..3).all(|a| cell[a].abs() <= cells(a)))
        .map(|cell| {
            let name = name(cell, 0);
            let within = |a: usize| JITTER * (numbers.uniform(name + ((a as u64) << 48)) - 0.5);
            let at = std::array::from_fn(|a| cell_mm * (cell[a] as f64 + 0.5 + within(a)));
            Seed { name, at }
        })
        .collect();
    seeds.sort_by_key(|seed| seed.name);
    seeds
}

/// Points as far from four seeds as from no other seed nearer: the four, in order, and the point.
fn vertices(seeds: &[Seed], reach_mm: f64) -> Vec<([usize; 4], Vec3)> {
    let mut found = Vec::new();
    for (a, seed) in seeds.iter().enumerate() {
        let near: Vec<usize> = (0..seeds.len())
            .filter(|&b| b != a && norm(minus(seeds[b].at, seed.at)) < reach_mm)
            .collect();
        let later: Vec<usize> = near.iter().copied().filter(|&b| b > a).collect();
        for (m, &b) in later.iter().enumerate() {
            for (n, &c) in later.iter().enumerate().skip(m + 1) {
                for &d in &later[n + 1..] {
                    let Some(from) = centre([b, c, d].map(|s| minus(seeds[s].at, seed.at))) else {
                        continue;
                    };
                    let radius = norm(from);
                    let point = plus(seed.at, from);
                    let empty = 2.0 * radius < reach_mm
                        && near
                            .iter()
                            .filter(|s| ![b, c, d].contains(s))
                            .all(|&s| norm(minus(seeds[s].at, point)) >= radius);
                    if empty {
                        found.push(([a, b, c, d], point));
                    }
                }
            }
        }
    }
    found
}

/// Centre of the sphere through the origin and three points; None where they lie in a plane with it.
fn centre([a, b, c]: [Vec3; 3]) -> Option<Vec3> {
    let cross = |u: Vec3, v: Vec3| {
        [
            u[1] * v[2] - u[2] * v[1],
            u[2] * v[0] - u[0] * v[2],
            u[0] * v[1] - u[1] * v[0],
        ]
    };
    let volume = 2.0 * dot(a, cross(b, c));
    let size = norm(a) * norm(b) * norm(c);
    if volume.abs() < 1e-9 * size {
        return None;
    }
    let sum = plus(
        plus(times(cross(b, c), dot(a, a)), times(cross(c, a), dot(b, b))),
        times(cross(a, b), dot(c, c)),
    );
    Some(times(sum, 1.0 / volume))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_edges_meet_at_each_vertex_inside() {
        let finish = |_, from, to| Strut {
            from,
            to,
            radius: 1.0,
            broken: None,
        };
        let struts = struts(1.0, Numbers::new(3, 5), [2.0; 3], finish);
        let ends = struts.iter().flat_map(|s| [s.from, s.to]);
        let mut meeting: Vec<(Vec3, usize)> = Vec::new();
        for end in ends.filter(|p| p.iter().all(|x| x.abs() < 1.5)) {
            match meeting
                .iter_mut()
                .find(|(p, _)| norm(minus(*p, end)) < 1e-9)
            {
                Some((_, n)) => *n += 1,
                None => meeting.push((end, 1)),
            }
        }
        // A Voronoi tessellation of random points has 6.77 vertices a cell, of jittered ones about as many.
        assert!(
            meeting.len() > 27 * 5 && meeting.len() < 27 * 8,
            "{}",
            meeting.len()
        );
        assert!(meeting.iter().all(|(_, n)| *n == 4));
    }
}
