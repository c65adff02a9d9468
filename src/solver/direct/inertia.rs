//! Owns how many eigenvalues of a symmetric matrix are negative, without finding any: as many as its LDLᵀ has negative
//! pivots (Sylvester's law of inertia). Eigenvalues that coincide, as those of mechanisms do, all count.

use crate::operator::sparse::Sparse;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::cholesky::supernodal::SupernodalLltRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Par, Side};

/// Values in the factor beyond which it is not made: 4 GiB.
const MOST_VALUES: usize = 1 << 29;

/// # Errors
/// In words: a matrix too large to factorise, or one with a pivot that is zero.
pub fn negative_eigenvalues(a: &Sparse) -> Result<usize, String> {
    if a.n() == 0 {
        return Ok(0);
    }
    let pattern = SymbolicSparseColMatRef::new_checked(a.n(), a.n(), &a.start, None, &a.column);
    let symbolic = factorize_symbolic_cholesky(
        pattern,
        Side::Upper,
        SymmetricOrdering::Amd,
        CholeskySymbolicParams::default(),
    )
    .map_err(|e| format!("{e:?}"))?;
    if symbolic.len_val() > MOST_VALUES {
        let gib = symbolic.len_val() as f64 * 8.0 / f64::from(1 << 30);
        return Err(format!("{} unknowns need {gib:.0} GiB", a.n()));
    }
    let mut values = vec![0.0; symbolic.len_val()];
    let scratch = symbolic.factorize_numeric_ldlt_scratch::<f64>(Par::Seq, Default::default());
    symbolic
        .factorize_numeric_ldlt(
            &mut values,
            SparseColMatRef::new(pattern, &a.value[..]),
            Side::Upper,
            Default::default(),
            Par::Seq,
            MemStack::new(&mut MemBuffer::new(scratch)),
            Default::default(),
        )
        .map_err(|e| format!("{e:?}"))?;
    Ok(pivots(&symbolic, &values).filter(|d| *d < 0.0).count())
}

/// The diagonal of D, which stands in the place of L's.
fn pivots<'a>(
    symbolic: &'a SymbolicCholesky<u32>,
    values: &'a [f64],
) -> Box<dyn Iterator<Item = f64> + 'a> {
    match symbolic.raw() {
        SymbolicCholeskyRaw::Simplicial(s) => Box::new(
            s.col_ptr()[..symbolic.nrows()]
                .iter()
                .map(|&k| values[k as usize]),
        ),
        SymbolicCholeskyRaw::Supernodal(s) => {
            let factor = SupernodalLltRef::new(s, values);
            Box::new((0..s.n_supernodes()).flat_map(move |k| {
                let node = factor.supernode(k);
                let columns = s.supernode_end()[k] as usize - node.start();
                (0..columns).map(move |j| node.val()[(j, j)])
            }))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A five-point Laplacian on m × m points, minus a shift: eigenvalues 4 − 2 cos − 2 cos, many of them in pairs.
    #[test]
    fn as_many_as_lie_below_the_shift() {
        for m in [7, 40] {
            let near = |i: usize| {
                let (x, y) = ((i % m) as i64, (i / m) as i64);
                let all = [(x, y), (x + 1, y), (x - 1, y), (x, y + 1), (x, y - 1)];
                let inside = |v: i64| (0..m as i64).contains(&v);
                all.into_iter()
                    .filter(|(x, y)| inside(*x) && inside(*y))
                    .map(|(x, y)| y as usize * m + x as usize)
                    .collect::<Vec<_>>()
            };
            let mut a = Sparse::from_pattern(m * m, |i, list| {
                list.extend(near(i).iter().map(|&j| j as u32))
            });
            for shift in [-0.1, 0.3, 1.234, 3.9, 8.1] {
                a.fill(|rows| {
                    for i in rows.range() {
                        near(i)
                            .iter()
                            .for_each(|&j| rows.add(i, j, if i == j { 4.0 - shift } else { -1.0 }));
                    }
                });
                let wave =
                    |k: usize| 2.0 * (std::f64::consts::PI * k as f64 / (m + 1) as f64).cos();
                let below = (0..m * m)
                    .filter(|k| 4.0 - wave(k % m + 1) - wave(k / m + 1) < shift)
                    .count();
                assert_eq!(negative_eigenvalues(&a).unwrap(), below, "{m} {shift}");
            }
        }
    }
}
