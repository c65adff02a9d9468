//! Owns the forces of eight bricks at a time, each a lane.

use super::super::modes::Modal;
use crate::simd::Lanes;

/// Values of the modes 1 to 7, for each component.
pub type Modes<L> = [[L; 7]; 3];

/// Coefficients of [`Modal`], eight of each.
pub type Wide<S> = Modal<[S; 8]>;

/// The modes of one component's displacements in four rows of nodes (y, then z).
///
/// All are taken from that of the first corner. A translation costs nothing, so in exact arithmetic that is the same; but sums of
/// what single precision rounds would drown the bending of a long soft structure in its translations.
///
/// # Safety
/// Nine values may be read from each row on; the instruction set of `L` is there.
#[inline(always)]
pub unsafe fn modes<L: Lanes>(rows: [*const L::S; 4]) -> [L; 7] {
    // SAFETY: the caller's.
    unsafe {
        let first = L::load(rows[0]);
        let here = L::load(rows[0].add(1)).sub(first);
        // Along x: sums and differences of each row.
        let (mut s, mut d) = ([here; 4], [here; 4]);
        for r in 1..4 {
            let (l, h) = (
                L::load(rows[r]).sub(first),
                L::load(rows[r].add(1)).sub(first),
            );
            (s[r], d[r]) = (l.add(h), h.sub(l));
        }
        // Along y, at both z.
        let (ss, sd) = (
            [s[0].add(s[1]), s[2].add(s[3])],
            [s[1].sub(s[0]), s[3].sub(s[2])],
        );
        let (ds, dd) = (
            [d[0].add(d[1]), d[2].add(d[3])],
            [d[1].sub(d[0]), d[3].sub(d[2])],
        );
        // Along z.
        [
            ds[0].add(ds[1]),
            sd[0].add(sd[1]),
            dd[0].add(dd[1]),
            ss[1].sub(ss[0]),
            ds[1].sub(ds[0]),
            sd[1].sub(sd[0]),
            dd[1].sub(dd[0]),
        ]
    }
}

/// One component's forces at the corners of smaller and of larger x of each row, from those of its modes.
///
/// # Safety
/// The instruction set of `L` is there.
#[inline(always)]
pub unsafe fn corners<L: Lanes>(g: &[L; 7]) -> ([L; 4], [L; 4]) {
    // SAFETY: the caller's.
    unsafe {
        // Along z: at smaller and larger z. A translation has no force.
        let zero = L::zero();
        let ss = [zero.sub(g[3]), g[3]];
        let ds = [g[0].sub(g[4]), g[0].add(g[4])];
        let sd = [g[1].sub(g[5]), g[1].add(g[5])];
        let dd = [g[2].sub(g[6]), g[2].add(g[6])];
        let (mut low, mut high) = ([zero; 4], [zero; 4]);
        for z in 0..2 {
            let (s, d) = (ss[z].sub(sd[z]), ds[z].sub(dd[z]));
            (low[2 * z], high[2 * z]) = (s.sub(d), s.add(d));
            let (s, d) = (ss[z].add(sd[z]), ds[z].add(dd[z]));
            (low[2 * z + 1], high[2 * z + 1]) = (s.sub(d), s.add(d));
        }
        (low, high)
    }
}

#[inline(always)]
unsafe fn splat<L: Lanes>(v: &[L::S; 8]) -> L {
    // SAFETY: the caller's.
    unsafe { L::load(v.as_ptr()) }
}

/// A symmetric 3 × 3 times a vector.
#[inline(always)]
unsafe fn three<L: Lanes>(c: &[[L::S; 8]; 6], [x, y, z]: [L; 3]) -> [L; 3] {
    // SAFETY: the caller's.
    unsafe {
        let [xx, yy, zz] = [splat(&c[0]), splat(&c[1]), splat(&c[2])];
        let [yz, xz, xy] = [splat(&c[3]), splat(&c[4]), splat(&c[5])];
        [
            x.mul(xx).fma(xy, y).fma(xz, z),
            x.mul(xy).fma(yy, y).fma(yz, z),
            x.mul(xz).fma(yz, y).fma(zz, z),
        ]
    }
}

/// A symmetric 2 × 2 times a vector.
#[inline(always)]
unsafe fn two<L: Lanes>(c: &[[L::S; 8]; 3], [p, q]: [L; 2]) -> [L; 2] {
    // SAFETY: the caller's.
    unsafe {
        let [pp, qq, pq] = [splat(&c[0]), splat(&c[1]), splat(&c[2])];
        [p.mul(pp).fma(pq, q), p.mul(pq).fma(qq, q)]
    }
}

/// Forces of the modes, times a factor each: 45 products.
///
/// # Safety
/// The instruction set of `L` is there.
#[inline(always)]
pub unsafe fn forces<L: Lanes>(k: &Wide<L::S>, factor: L, [x, y, z]: &Modes<L>) -> Modes<L> {
    // SAFETY: the caller's.
    unsafe {
        let zero = L::zero();
        let [mut f, mut g, mut h] = [[zero; 7]; 3];
        [f[0], g[1], h[3]] = three(&k.normal, [x[0], y[1], z[3]]);
        [h[1], g[3]] = two(&k.shear[0], [z[1], y[3]]);
        [h[0], f[3]] = two(&k.shear[1], [z[0], x[3]]);
        [g[0], f[1]] = two(&k.shear[2], [y[0], x[1]]);
        [f[2], h[5]] = two(&k.bending[0], [x[2], z[5]]);
        [g[2], h[4]] = two(&k.bending[1], [y[2], z[4]]);
        [f[4], g[5]] = two(&k.bending[2], [x[4], y[5]]);
        [f[5], g[4], h[2]] = three(&k.twist, [x[5], y[4], z[2]]);
        f[6] = x[6].mul(splat(&k.hourglass[0]));
        g[6] = y[6].mul(splat(&k.hourglass[1]));
        h[6] = z[6].mul(splat(&k.hourglass[2]));
        for m in 0..7 {
            (f[m], g[m], h[m]) = (f[m].mul(factor), g[m].mul(factor), h[m].mul(factor));
        }
        [f, g, h]
    }
}
