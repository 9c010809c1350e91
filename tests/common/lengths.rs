//! The same model with both kinds of length, known at run time and fixed: its fields, its states, and comparisons of
//! what is found.

#![allow(dead_code)] // each test target uses its part

use crate::common::larger;
use tfe::family::FamilyState;
use tfe::length::Length;
use tfe::sensitivity::{LossGradient, Sensitive};
use tfe::{Node, State};

/// A model of run-time length and the same of fixed size, from the values of their fields; arrays of the second are
/// `Vec`s of the first.
macro_rules! of_both_lengths {
    ($long:ident($n:expr), $fixed:ident: $($field:ident),+) => {{
        let fixed = $fixed { $($field),+ };
        let long = $long { n: $n, $($field: fixed.$field.into()),+ };
        (long, fixed)
    }};
}
pub(crate) use of_both_lengths;

/// A state of fixed size as one of run-time length.
pub fn of_heap<const N: usize>(state: &State<N>) -> FamilyState {
    FamilyState {
        q: state.q.to_vec(),
        p: state.p.to_vec(),
    }
}

/// The largest difference of the numbers of two states.
#[track_caller]
pub fn states_apart<const N: usize>(long: &FamilyState, fixed: &State<N>) -> f64 {
    assert_eq!((long.q.len(), long.p.len()), (N, N));
    let places = long.q.iter().zip(&fixed.q);
    let pairs = places.chain(long.p.iter().zip(&fixed.p));
    pairs.fold(0.0, |most, (a, b)| larger(most, (a - b).abs()))
}

/// The largest difference of numbers from those expected, and the largest of the latter.
pub struct Seen {
    pub off: f64,
    pub size: f64,
}

impl Seen {
    pub const NOTHING: Self = Self {
        off: 0.0,
        size: 0.0,
    };

    #[track_caller]
    pub fn see(&mut self, found: &[f64], expected: &[f64]) {
        assert_eq!(found.len(), expected.len());
        for (a, b) in found.iter().zip(expected) {
            self.off = larger(self.off, (a - b).abs());
            self.size = larger(self.size, b.abs());
        }
    }

    /// Coordinates, momenta and velocities.
    #[track_caller]
    pub fn see_nodes<const N: usize, L: Length<N>, const K: usize, O: Length<K>>(
        &mut self,
        found: &Node<N, L>,
        expected: &Node<K, O>,
    ) {
        self.see(found.q.as_ref(), expected.q.as_ref());
        self.see(found.p.as_ref(), expected.p.as_ref());
        self.see(found.v.as_ref(), expected.v.as_ref());
    }

    /// The derivatives of two runs at given times, by all parameters and by the start.
    #[track_caller]
    pub fn see_inside<const N: usize, L: Length<N>, const K: usize, O: Length<K>>(
        &mut self,
        found: &Sensitive<N, L>,
        expected: &Sensitive<K, O>,
        times: &[f64],
    ) {
        assert_eq!(found.parameters(), expected.parameters());
        for t in times {
            for name in expected.parameters() {
                let a = found.by(name).at(*t).expect("in the span");
                let b = expected.by(name).at(*t).expect("in the span");
                self.see_nodes(&a, &b);
            }
            let a = found.by_start().at(*t).expect("in the span");
            let b = expected.by_start().at(*t).expect("in the span");
            self.see(a.as_slice(), b.as_slice());
        }
    }

    /// Losses with their gradients.
    #[track_caller]
    pub fn see_gradients<const N: usize, L: Length<N>, const K: usize, O: Length<K>>(
        &mut self,
        (found, gradient): &(f64, LossGradient<N, L>),
        (expected, other): &(f64, LossGradient<K, O>),
    ) {
        self.see(&[*found], &[*expected]);
        self.see(gradient.by_parameters(), other.by_parameters());
        let (found, expected) = (gradient.by_start(), other.by_start());
        let (a, b) = (L::parts(&found), O::parts(&expected));
        self.see(a.0.as_ref(), b.0.as_ref());
        self.see(a.1.as_ref(), b.1.as_ref());
    }

    /// The largest difference relative to the largest number.
    pub fn part(&self) -> f64 {
        self.off / self.size
    }
}
