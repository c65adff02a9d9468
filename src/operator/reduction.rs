//! Owns which values of a field are unknowns, which follow another value, and which are held: `x = T q + g`.

/// What one value (one component at one point) is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Value {
    /// An unknown with an equation of its own.
    Free,
    /// Equal to the value at another place, plus its entry of `g`.
    Follows(usize),
    /// Given by its entry of `g`.
    Held,
}

const HELD: u32 = u32::MAX;

/// The map from unknowns `q` to all values `x`: row `i` of `T` is a unit row or zero.
#[derive(Debug, Clone)]
pub struct Reduction {
    target: Vec<u32>,
    free: Vec<u32>,
}

impl Reduction {
    /// # Panics
    /// If a value follows one that is itself a follower.
    pub fn new(values: &[Value]) -> Self {
        let mut target = vec![HELD; values.len()];
        let mut free = Vec::new();
        for (i, value) in values.iter().enumerate() {
            if *value == Value::Free {
                target[i] = free.len() as u32;
                free.push(i as u32);
            }
        }
        for (i, value) in values.iter().enumerate() {
            if let Value::Follows(leader) = *value {
                assert!(
                    !matches!(values[leader], Value::Follows(_)),
                    "a follower cannot lead"
                );
                target[i] = target[leader];
            }
        }
        Reduction { target, free }
    }

    /// Number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.free.len()
    }

    /// Number of values.
    pub fn values(&self) -> usize {
        self.target.len()
    }

    /// The unknown that value `i` is or follows; None if it is held.
    pub fn unknown(&self, i: usize) -> Option<usize> {
        (self.target[i] != HELD).then_some(self.target[i] as usize)
    }

    /// The value whose equation belongs to unknown `q`.
    pub fn equation(&self, q: usize) -> usize {
        self.free[q] as usize
    }

    /// Number of unknowns whose equation belongs to a value before `value`; these come first.
    pub fn unknowns_before(&self, value: usize) -> usize {
        self.free.partition_point(|&v| (v as usize) < value)
    }

    /// `x = T q + g`.
    pub fn expand(&self, q: &[f64], g: &[f64], x: &mut [f64]) {
        for i in 0..self.target.len() {
            x[i] = g[i] + self.unknown(i).map_or(0.0, |k| q[k]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn followers_share_the_unknown_of_their_leader() {
        let values = [
            Value::Follows(2),
            Value::Held,
            Value::Free,
            Value::Free,
            Value::Follows(1),
        ];
        let r = Reduction::new(&values);
        assert_eq!((r.unknowns(), r.values()), (2, 5));
        let mut x = [0.0; 5];
        r.expand(&[1.0, 2.0], &[0.5, 7.0, 0.0, 0.0, 0.0], &mut x);
        assert_eq!(x, [1.5, 7.0, 1.0, 2.0, 0.0]);
        assert_eq!(r.equation(1), 3);
        assert_eq!(r.unknown(4), None);
    }
}
