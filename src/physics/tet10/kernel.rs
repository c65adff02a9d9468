//! Owns forces of elements, eight at a time.

use crate::discretisation::tetrahedra::nodes::{EDGES, Ten};
use crate::simd::vec3::Precision;
use crate::simd::{Isa, isa};
use std::ops::{Add, Mul, Sub};

const LANES: usize = 8;

/// One number of each of eight elements.
#[derive(Clone, Copy)]
struct Wide<T>([T; LANES]);

macro_rules! lanewise {
    ($name:ident, $method:ident) => {
        impl<T: Precision> $name for Wide<T> {
            type Output = Self;
            #[inline(always)]
            fn $method(mut self, other: Self) -> Self {
                for l in 0..LANES {
                    self.0[l] = self.0[l].$method(other.0[l]);
                }
                self
            }
        }
    };
}

lanewise!(Add, add);
lanewise!(Sub, sub);
lanewise!(Mul, mul);

type Vector<T> = [Wide<T>; 3];

/// Adds to `y` the forces of `elements` on the nodes from `first` on under displacements `x`. `shape` gives slopes and volume.
pub fn add<T: Precision>(
    mesh: &[Ten],
    elements: &[u32],
    moduli: [T; 2],
    shape: impl Fn(usize) -> [T; 10],
    x: &[[T; 3]],
    first: usize,
    y: &mut [[T; 3]],
) {
    match isa() {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the processor has what the function asks for.
        Isa::Avx512 | Isa::Avx2 => unsafe { add_avx2(mesh, elements, moduli, shape, x, first, y) },
        _ => add_lanes(mesh, elements, moduli, shape, x, first, y),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn add_avx2<T: Precision>(
    mesh: &[Ten],
    elements: &[u32],
    moduli: [T; 2],
    shape: impl Fn(usize) -> [T; 10],
    x: &[[T; 3]],
    first: usize,
    y: &mut [[T; 3]],
) {
    add_lanes(mesh, elements, moduli, shape, x, first, y);
}

#[inline(always)]
fn add_lanes<T: Precision>(
    mesh: &[Ten],
    elements: &[u32],
    moduli: [T; 2],
    shape: impl Fn(usize) -> [T; 10],
    x: &[[T; 3]],
    first: usize,
    y: &mut [[T; 3]],
) {
    let moduli = moduli.map(|m| Wide([m; LANES]));
    for group in elements.chunks(LANES) {
        // A last group that is not full repeats an element, whose force is left out.
        let of = |l: usize| group[l.min(group.len() - 1)] as usize;
        let zero = Wide([T::default(); LANES]);
        let mut u = [[zero; 3]; 10];
        let mut shapes = [zero; 10];
        for l in 0..LANES {
            let e = of(l);
            for (n, u) in mesh[e].iter().zip(&mut u) {
                let x = &x[*n as usize];
                (0..3).for_each(|c| u[c].0[l] = x[c]);
            }
            let own = shape(e);
            (0..10).for_each(|i| shapes[i].0[l] = own[i]);
        }
        let forces = forces(&u, &shapes, moduli);
        for (l, e) in group.iter().enumerate() {
            for (n, f) in mesh[*e as usize].iter().zip(&forces) {
                let at = (*n as usize).wrapping_sub(first);
                if let Some(y) = y.get_mut(at) {
                    (0..3).for_each(|c| y[c] = y[c] + f[c].0[l]);
                }
            }
        }
    }
}

#[inline(always)]
fn forces<T: Precision>(
    u: &[Vector<T>; 10],
    shapes: &[Wide<T>; 10],
    [lambda, mu]: [Wide<T>; 2],
) -> [Vector<T>; 10] {
    let zero = Wide([T::default(); LANES]);
    let slopes: [Vector<T>; 3] =
        std::array::from_fn(|i| std::array::from_fn(|d| shapes[3 * i + d]));
    let three = |v: Wide<T>| v + v + v;
    let four = |v: Wide<T>| {
        let two = v + v;
        two + two
    };
    let volume = shapes[9];
    // Stresses at the corners: xx, yy, zz, yz, xz, xy.
    let mut stress = [[zero; 6]; 4];
    for k in 0..4 {
        // What multiplies the slope of corner j in the displacement's slope at corner k.
        let mut w = [[zero; 3]; 4];
        for j in 0..4 {
            for c in 0..3 {
                w[j][c] = if j == k {
                    three(u[k][c])
                } else {
                    four(u[4 + edge(k, j)][c]) - u[j][c]
                };
            }
        }
        let mut g = [[zero; 3]; 3];
        for c in 0..3 {
            for j in 0..3 {
                let by = w[j + 1][c] - w[0][c];
                for d in 0..3 {
                    g[c][d] = g[c][d] + by * slopes[j][d];
                }
            }
        }
        let trace = lambda * (g[0][0] + g[1][1] + g[2][2]);
        for c in 0..3 {
            let (p, q) = ((c + 1) % 3, (c + 2) % 3);
            stress[k][c] = trace + mu * (g[c][c] + g[c][c]);
            stress[k][3 + c] = mu * (g[p][q] + g[q][p]);
        }
    }
    let mut share = volume;
    for l in 0..LANES {
        share.0[l] = share.0[l] * T::of(0.05);
    }
    let sum: [Wide<T>; 6] =
        std::array::from_fn(|s| (stress[0][s] + stress[1][s]) + (stress[2][s] + stress[3][s]));
    // Force of corner k's stress on corner j's slope.
    let mut t = [[[zero; 3]; 4]; 4];
    for k in 0..4 {
        let s: [Wide<T>; 6] = std::array::from_fn(|s| share * (stress[k][s] + sum[s]));
        let rows = [[s[0], s[5], s[4]], [s[5], s[1], s[3]], [s[4], s[3], s[2]]];
        for c in 0..3 {
            for j in 0..3 {
                let r = &rows[c];
                let f = r[0] * slopes[j][0] + r[1] * slopes[j][1] + r[2] * slopes[j][2];
                t[k][j + 1][c] = f;
                t[k][0][c] = t[k][0][c] - f;
            }
        }
    }
    let mut f = [[zero; 3]; 10];
    for k in 0..4 {
        for c in 0..3 {
            let column = (t[0][k][c] + t[1][k][c]) + (t[2][k][c] + t[3][k][c]);
            f[k][c] = four(t[k][k][c]) - column;
        }
    }
    for (e, [i, j]) in EDGES.iter().enumerate() {
        for c in 0..3 {
            f[4 + e][c] = four(t[*i][*j][c] + t[*j][*i][c]);
        }
    }
    f
}

/// The edge between two corners.
#[inline(always)]
const fn edge(a: usize, b: usize) -> usize {
    match (a, b) {
        (0, 1) | (1, 0) => 0,
        (1, 2) | (2, 1) => 1,
        (2, 0) | (0, 2) => 2,
        (0, 3) | (3, 0) => 3,
        (1, 3) | (3, 1) => 4,
        _ => 5,
    }
}
