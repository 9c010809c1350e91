//! The two kinds of length of models: fixed at compile time, or known at run time. They determine the vectors,
//! polynomials and checkpoints of motions.

pub use tfe_runtime::length::{Declared, FixedLength, RunTimeLength};

use std::fmt::{Debug, Display};
use tfe_runtime::family::{self, FamilyState};
use tfe_runtime::step::{DenseElement, Impulse, Stepper, Suspended};
use tfe_runtime::{CoordinateName, State};

/// The times at which elements of runs of several models should end, in order.
pub(crate) fn breaks_of<'m, M, const N: usize>(models: impl IntoIterator<Item = &'m M>) -> Vec<f64>
where
    M: Declared<N> + 'm,
{
    let mut breaks = Vec::new();
    for model in models {
        model.breaks(&mut |time| breaks.push(time));
    }
    breaks.sort_by(f64::total_cmp);
    breaks.dedup();
    breaks
}

/// The kind of length of a model, which determines the vectors of its states: arrays for [`FixedLength`], `Vec`s for
/// [`RunTimeLength`]. There is no other kind.
///
/// A [`Motion<N>`](crate::Motion) belongs to `FixedLength`; the motion of a model of run-time length is a `Motion<0,
/// RunTimeLength>`, or [`family::Motion`](crate::family::Motion) for short.
pub trait Length<const N: usize>: Copy + Debug + PartialEq + Send + Sync + 'static {
    /// The type of a vector of coordinates, momenta or velocities.
    type Vector: Clone + Debug + PartialEq + AsRef<[f64]> + Send + Sync;
    /// The type of a state (q, p).
    type State: Clone + Debug + PartialEq + Send + Sync;
    /// The type of the polynomial solution inside an element.
    type Polynomial: Polynomial<State = Self::State, Vector = Self::Vector>;
    /// The type that makes the steps; internal.
    type Stepper<'m, M: 'm>;
    /// A stepper without its model; internal.
    type Suspended: Clone + Debug + Send + Sync;
    /// The type of an impulse.
    type Impulse: Clone + Debug;
    /// The type of the name of a constraint.
    type ConstraintName: Clone + Debug + Display + PartialEq;

    /// The state (q, p) with given coordinates and momenta.
    fn state(q: Self::Vector, p: Self::Vector) -> Self::State;

    /// The coordinates and the momenta of a state.
    fn parts(state: &Self::State) -> (&Self::Vector, &Self::Vector);

    /// A vector as long as `like`, with the values of a function at 0, 1, …
    fn from_fn(like: &Self::Vector, number: impl FnMut(usize) -> f64) -> Self::Vector;

    /// The coordinates of a state, then its momenta.
    fn numbers(state: &Self::State) -> Vec<f64> {
        let (q, p) = Self::parts(state);
        [q.as_ref(), p.as_ref()].concat()
    }

    /// The state that has these [`numbers`](Self::numbers); as long as `like`.
    fn state_of(like: &Self::State, numbers: &[f64]) -> Self::State {
        let (q, _) = Self::parts(like);
        let (of_q, of_p) = numbers.split_at(q.as_ref().len());
        Self::state(Self::from_fn(q, |a| of_q[a]), Self::from_fn(q, |a| of_p[a]))
    }

    /// A vector as long as `like`, of NaN.
    fn unknown(like: &Self::Vector) -> Self::Vector {
        Self::from_fn(like, |_| f64::NAN)
    }

    /// A vector as long as `like`, of zeros.
    fn zero(like: &Self::Vector) -> Self::Vector {
        Self::from_fn(like, |_| 0.0)
    }
}

impl<const N: usize> Length<N> for FixedLength {
    type Vector = [f64; N];
    type State = State<N>;
    type Polynomial = DenseElement<N>;
    type Stepper<'m, M: 'm> = Stepper<'m, M, N>;
    type Suspended = Suspended<N>;
    type Impulse = Impulse<N>;
    type ConstraintName = &'static str;

    fn state(q: [f64; N], p: [f64; N]) -> State<N> {
        State { q, p }
    }

    fn parts(state: &State<N>) -> (&[f64; N], &[f64; N]) {
        (&state.q, &state.p)
    }

    #[inline]
    fn from_fn(_: &[f64; N], mut number: impl FnMut(usize) -> f64) -> [f64; N] {
        let mut numbers = [0.0; N];
        for (a, place) in numbers.iter_mut().enumerate() {
            *place = number(a);
        }
        numbers
    }
}

impl Length<0> for RunTimeLength {
    type Vector = Vec<f64>;
    type State = FamilyState;
    type Polynomial = family::DenseElement;
    type Stepper<'m, M: 'm> = family::Stepper<'m, M>;
    type Suspended = family::Suspended;
    type Impulse = (f64, Vec<f64>);
    type ConstraintName = CoordinateName;

    fn state(q: Vec<f64>, p: Vec<f64>) -> FamilyState {
        FamilyState { q, p }
    }

    fn parts(state: &FamilyState) -> (&Vec<f64>, &Vec<f64>) {
        (&state.q, &state.p)
    }

    fn from_fn(like: &Vec<f64>, number: impl FnMut(usize) -> f64) -> Vec<f64> {
        (0..like.len()).map(number).collect()
    }
}

/// The polynomial solution inside an element, or inside the pieces into which it was cut; internal.
pub trait Polynomial: Clone + Debug {
    /// The type of a state (q, p).
    type State;
    /// The type of a vector of velocities.
    type Vector;

    /// The time at the start of the element.
    fn start(&self) -> f64;

    /// The time at the end of the element.
    fn end(&self) -> f64;

    /// The length of the element, with all digits of the step size.
    fn length(&self) -> f64;

    /// The degree of the polynomial of the coordinates.
    fn degree(&self) -> usize;

    /// The pieces, if the element was cut; otherwise the element itself.
    fn pieces(&self) -> &[Self]
    where
        Self: Sized;

    /// The state at a fraction of the length, between 0 and 1; only for an element that was not cut.
    fn at(&self, fraction: f64) -> Self::State;

    /// The state at a time between start and end.
    fn at_time(&self, time: f64) -> Self::State;

    /// The velocities dq/dt at a time: the derivative of the polynomial.
    fn velocity_at_time(&self, time: f64) -> Self::Vector;
}

macro_rules! polynomial {
    ($polynomial:ty, $state:ty, $vector:ty, $($length:tt)*) => {
        impl<$($length)*> Polynomial for $polynomial {
            type State = $state;
            type Vector = $vector;

            fn start(&self) -> f64 {
                self.start()
            }

            fn end(&self) -> f64 {
                self.end()
            }

            fn length(&self) -> f64 {
                self.length()
            }

            fn degree(&self) -> usize {
                self.degree()
            }

            fn pieces(&self) -> &[Self] {
                self.pieces()
            }

            fn at(&self, fraction: f64) -> $state {
                self.at(fraction)
            }

            fn at_time(&self, time: f64) -> $state {
                self.at_time(time)
            }

            fn velocity_at_time(&self, time: f64) -> $vector {
                self.velocity_at_time(time)
            }
        }
    };
}

polynomial!(DenseElement<N>, State<N>, [f64; N], const N: usize);
polynomial!(family::DenseElement, FamilyState, Vec<f64>,);
