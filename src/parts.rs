//! Owns which numbers belong together: disjoint sets, joined pair by pair. `up[i]` is a member of the set of `i`, never a larger one
//! than `i`; a set's smallest member is its root.

/// The numbers `0..n`, each a set of its own.
///
/// # Panics
/// At 2³² numbers or more.
pub fn apart(n: usize) -> Vec<u32> {
    (0..u32::try_from(n).expect("fewer than 2³² numbers")).collect()
}

/// The root of the set of `i`.
#[inline]
pub fn root(up: &mut [u32], mut i: u32) -> u32 {
    while up[i as usize] != i {
        up[i as usize] = up[up[i as usize] as usize];
        i = up[i as usize];
    }
    i
}

/// Makes one set of those of `a` and `b`.
#[inline]
pub fn join(up: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root(up, a), root(up, b));
    up[a.max(b) as usize] = a.min(b);
}

/// The number of each member's set, counted in the order of their roots, and how many sets there are.
pub fn numbered(mut up: Vec<u32>) -> (Vec<u32>, usize) {
    let mut count = 0;
    for i in 0..up.len() {
        let above = up[i] as usize;
        up[i] = if above == i {
            count += 1;
            count - 1
        } else {
            // Smaller than `i`, so numbered already.
            up[above]
        };
    }
    (up, count as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_are_numbered_in_the_order_of_their_smallest_members() {
        let mut up = apart(7);
        for (a, b) in [(5, 3), (6, 5), (1, 4), (3, 6)] {
            join(&mut up, a, b);
        }
        assert_eq!(root(&mut up, 6), 3);
        assert_eq!(numbered(up), (vec![0, 1, 2, 3, 1, 3, 3], 4));
    }
}
