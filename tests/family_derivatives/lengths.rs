//! The same model with both kinds of length, known at run time and fixed: its fields, acts of its events, and
//! comparisons of what is found.

use crate::largest::larger;
use tfe::family::FamilyState;
use tfe::length::{Length, RunTimeLength};
use tfe::prelude::*;
use tfe::{Linearised, Occurrence};

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
pub(crate) fn of_heap<const N: usize>(state: &State<N>) -> FamilyState {
    FamilyState {
        q: state.q.to_vec(),
        p: state.p.to_vec(),
    }
}

/// An impact that leaves 0.8 of the speed.
pub(crate) fn bounce<const N: usize, L: Length<N>>(event: &Occurrence<'_, N, L>) -> Act<N, L> {
    Act::Restart(event.after_impact(0.8))
}

/// The largest difference of two lists of numbers, relative to the largest of these numbers, but at least to 1.
pub(crate) fn apart<'a>(
    a: impl IntoIterator<Item = &'a f64>,
    b: impl IntoIterator<Item = &'a f64>,
) -> f64 {
    let (a, b): (Vec<f64>, Vec<f64>) = (
        a.into_iter().copied().collect(),
        b.into_iter().copied().collect(),
    );
    assert_eq!(a.len(), b.len());
    let size = a
        .iter()
        .chain(&b)
        .fold(1.0, |size, one| larger(size, one.abs()));
    let pairs = a.iter().zip(&b);
    pairs.fold(0.0, |most, (a, b)| larger(most, (a - b).abs() / size))
}

/// Both are derivatives of the same computed motion. Actions are differentiated by differences over 2e-3, with a
/// rounding error of some 1e-13 / 2e-3, which each bounce multiplies several times.
pub(crate) const SAME: f64 = 1e-9;

/// Compares the matrices of all elements.
#[track_caller]
pub(crate) fn check_matrices<const N: usize>(
    long: &Linearised<0, RunTimeLength>,
    fixed: &Linearised<N>,
) {
    assert_eq!(long.transitions().len(), fixed.transitions().len());
    for (a, b) in long.transitions().iter().zip(fixed.transitions()) {
        let off = apart(a, b);
        assert!(off < SAME, "{off:e}");
    }
}
