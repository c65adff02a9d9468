//! Owns what of a lattice tetrahedron is bone, as tetrahedra: the stencils of the paper.
//!
//! Neighbours must split a shared quadrilateral alike: its diagonal starts at the end whose cut edge is the longer one, among
//! short ones by the paper's parity rule. That orders the vertices, so that what is left of a corner can always be filled.

use super::lattice::{EdgeKind, Lattice, Place};
use super::snap::{Side, Snapped};

/// A vertex of the mesh: one of the lattice, or a crossing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Vertex {
    Lattice(u32),
    Cut(u32),
}

/// Calls `emit` with the tetrahedra that fill the bone of one of the lattice. Their orientation is any.
pub fn fill(snapped: &Snapped, tetrahedron: [Place; 4], emit: &mut impl FnMut([Vertex; 4])) {
    let number = |p: Place| snapped.lattice.number(p);
    let side = |p: &Place| snapped.sides[number(*p)];
    let (mut plus, mut on, mut minus) = ([[0; 3]; 4], [[0; 3]; 4], [[0; 3]; 4]);
    let mut counts = [0; 3];
    for p in tetrahedron {
        let (list, k) = match side(&p) {
            Side::Bone => (&mut plus, 0),
            Side::On => (&mut on, 1),
            Side::Outside => (&mut minus, 2),
        };
        list[counts[k]] = p;
        counts[k] += 1;
    }
    let (plus, on, minus) = (
        &mut plus[..counts[0]],
        &on[..counts[1]],
        &minus[..counts[2]],
    );
    let whole = |p: Place| Vertex::Lattice(number(p) as u32);
    let cut = |p: Place, m: Place| Vertex::Cut(snapped.cut(number(p), number(m)) as u32);
    match (&mut *plus, on, minus) {
        ([], ..) => (),
        (_, _, []) => emit(tetrahedron.map(whole)),
        ([a], on, minus) => {
            let mut all = [whole(*a); 4];
            let rest = on
                .iter()
                .map(|p| whole(*p))
                .chain(minus.iter().map(|m| cut(*a, *m)));
            all[1..].iter_mut().zip(rest).for_each(|(v, p)| *v = p);
            emit(all);
        }
        ([a, b], [on], [m]) => {
            let [a, b] = if starts(*a, *b, *m) {
                [*a, *b]
            } else {
                [*b, *a]
            };
            // The quadrilateral a, b, b's cut, a's cut is split from a.
            emit([whole(*on), whole(a), whole(b), cut(b, *m)]);
            emit([whole(*on), whole(a), cut(b, *m), cut(a, *m)]);
        }
        ([a, b], [], [m, n]) => wedge([*a, *b], [*m, *n], &whole, &cut, emit),
        ([_, _, _], [], [m]) => {
            plus.sort_by(|a, b| match starts(*a, *b, *m) {
                true => std::cmp::Ordering::Less,
                false => std::cmp::Ordering::Greater,
            });
            let [a, b, c] = [plus[0], plus[1], plus[2]];
            emit([whole(a), whole(b), whole(c), cut(c, *m)]);
            emit([whole(a), whole(b), cut(b, *m), cut(c, *m)]);
            emit([whole(a), cut(a, *m), cut(b, *m), cut(c, *m)]);
        }
        _ => unreachable!("a tetrahedron has four vertices"),
    }
}

/// The edge from a to b with the bone on either side of it, towards m and n.
fn wedge(
    [a, b]: [Place; 2],
    [m, n]: [Place; 2],
    whole: &impl Fn(Place) -> Vertex,
    cut: &impl Fn(Place, Place) -> Vertex,
    emit: &mut impl FnMut([Vertex; 4]),
) {
    let (from_a_at_m, from_a_at_n) = (starts(a, b, m), starts(a, b, n));
    if from_a_at_m == from_a_at_n {
        // Both diagonals start at one end.
        let [a, b] = if from_a_at_m { [a, b] } else { [b, a] };
        emit([whole(a), whole(b), cut(b, m), cut(b, n)]);
        emit([whole(a), cut(a, m), cut(b, m), cut(b, n)]);
        emit([whole(a), cut(a, m), cut(a, n), cut(b, n)]);
        return;
    }
    let [m, n] = if from_a_at_m { [m, n] } else { [n, m] };
    // From a towards m's side, from b towards n's.
    emit([whole(a), whole(b), cut(b, m), cut(a, n)]);
    emit([whole(a), cut(a, m), cut(a, n), cut(b, m)]);
    emit([whole(b), cut(b, n), cut(a, n), cut(b, m)]);
}

/// Whether the diagonal of the quadrilateral between a, b and their cuts towards m starts at a.
fn starts(a: Place, b: Place, m: Place) -> bool {
    let kinds = [a, b].map(|p| Lattice::edge_kind(p, m));
    if kinds[0] != kinds[1] {
        return kinds[0] > kinds[1];
    }
    let even = |p: Place| (0..3).filter(|&c| p[c] > m[c]).count() % 2 == 0;
    match (kinds[0], even(a), even(b)) {
        (EdgeKind::Short, true, false) => true,
        (EdgeKind::Short, false, true) => false,
        _ => a < b,
    }
}
