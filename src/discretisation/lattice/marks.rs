//! Owns a set of a grid's places in an eighth of a byte each, and the numbers of its members in a sixteenth.

/// Some of the numbers `0..n`.
#[derive(Debug, Clone)]
pub struct Marks {
    words: Vec<u64>,
}

impl Marks {
    pub fn none(n: usize) -> Self {
        Marks {
            words: vec![0; n.div_ceil(64)],
        }
    }

    pub fn has(&self, i: usize) -> bool {
        self.words[i / 64] >> (i % 64) & 1 == 1
    }

    /// Marks `i`; whether it was not yet.
    pub fn add(&mut self, i: usize) -> bool {
        let (word, bit) = (&mut self.words[i / 64], 1 << (i % 64));
        let new = *word & bit == 0;
        *word |= bit;
        new
    }

    /// Keeps what `other`, a set of the same numbers, has too.
    pub fn keep(&mut self, other: &Marks) {
        for (word, other) in self.words.iter_mut().zip(&other.words) {
            *word &= other;
        }
    }

    /// Of `0..n`, from where steps to `neighbours` lead to a number with `low` and to one with `high`.
    pub fn between<I: Iterator<Item = usize>>(
        n: usize,
        low: impl Fn(usize) -> bool + Sync,
        high: impl Fn(usize) -> bool + Sync,
        neighbours: impl Fn(usize) -> I + Sync,
    ) -> Marks {
        let (mut both, high) = rayon::join(
            || Marks::reached(n, &low, &neighbours),
            || Marks::reached(n, &high, &neighbours),
        );
        both.keep(&high);
        both
    }

    fn reached<I: Iterator<Item = usize>>(
        n: usize,
        seed: impl Fn(usize) -> bool,
        neighbours: impl Fn(usize) -> I,
    ) -> Marks {
        let mut seen = Marks::none(n);
        let mut queue: Vec<usize> = (0..n).filter(|&i| seed(i) && seen.add(i)).collect();
        while let Some(i) = queue.pop() {
            queue.extend(neighbours(i).filter(|&next| seen.add(next)));
        }
        seen
    }

    /// The members in order.
    pub fn iter(&self) -> impl Iterator<Item = usize> {
        self.words.iter().enumerate().flat_map(|(w, &word)| {
            std::iter::successors(Some(word), |left| Some(left & left.wrapping_sub(1)))
                .take_while(|&left| left != 0)
                .map(move |left| 64 * w + left.trailing_zeros() as usize)
        })
    }
}

/// Marks whose members are numbered in order.
#[derive(Debug, Clone)]
pub struct Numbered {
    marks: Marks,
    /// Members before each word.
    before: Vec<u32>,
    count: usize,
}

impl From<Marks> for Numbered {
    fn from(marks: Marks) -> Self {
        let mut count = 0;
        let words = marks.words.iter();
        let before = words.map(|word| {
            let before = count as u32;
            count += word.count_ones() as usize;
            before
        });
        Numbered {
            before: before.collect(),
            marks,
            count,
        }
    }
}

impl Numbered {
    pub fn len(&self) -> usize {
        self.count
    }

    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// The number of `i`, if it is a member.
    pub fn number(&self, i: usize) -> Option<u32> {
        let word = self.marks.words[i / 64];
        let below = word & ((1 << (i % 64)) - 1);
        self.marks
            .has(i)
            .then(|| self.before[i / 64] + below.count_ones())
    }

    /// The members in order.
    pub fn iter(&self) -> impl Iterator<Item = usize> {
        self.marks.iter()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn members_are_numbered_in_order() {
        for n in [1, 63, 64, 65, 1000] {
            let mut marks = Marks::none(n);
            let wanted = |i: usize| i * i % 7 < 3;
            for i in (0..n).rev().filter(|&i| wanted(i)) {
                assert!(marks.add(i) && !marks.add(i));
            }
            let mut even = Marks::none(n);
            (0..n).step_by(2).for_each(|i| assert!(even.add(i)));
            let mut both = marks.clone();
            both.keep(&even);
            assert!(both.iter().eq((0..n).filter(|&i| i % 2 == 0 && wanted(i))));
            let numbered = Numbered::from(marks);
            let members: Vec<usize> = (0..n).filter(|&i| wanted(i)).collect();
            assert_eq!(numbered.len(), members.len());
            assert!(numbered.iter().eq(members.iter().copied()));
            for i in 0..n {
                let number = members.iter().position(|&m| m == i).map(|k| k as u32);
                assert_eq!(numbered.number(i), number);
            }
        }
    }
}
