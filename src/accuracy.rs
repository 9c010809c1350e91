//! Runs that know their error: an estimate beside every motion, and the element and step that meet an accuracy.
//!
//! [`Simulation::run_estimated`](crate::Simulation::run_estimated) runs with the element and the step it is told and estimates the error of what comes out;
//! [`Simulation::accuracy`](crate::Simulation::accuracy) picks both itself, the cheapest of those it knows that meets what is asked. Both compare two
//! discrete motions over the whole span, so that growth and decay of errors are those of the model, not of a linearisation (`docs/theory.md` §14):
//!
//! ```text
//! run_estimated:   E(t) = |y_{h, n}(t) − y_{h, n+1}(t)|                              an element of the next order      (T-98)
//! accuracy:        E(t) = |y_h(t) − y_H(t)| / ((H/h)^p − 1) ,   h < H                the same element of order p       (T-99)
//! ```
//!
//! Where a model is forced, damped or depends on time, steps may vary: the search then looks for the factor c of a mesh with s(t_{k+1}) − s(t_k) = c, s the
//! number of steps up to a time in a pilot run with controlled steps (T-102), (T-103); (T-99) holds with C/c in the place of H/h.
//!
//! |·| is the largest error of any coordinate over the largest coordinate, the same of momenta and of each declared output, whichever is larger.

mod estimated;
mod grading;
mod pilot;
mod search;
mod trace;

pub use estimated::{Attempt, Estimated, Picked};
pub(crate) use grading::Grading;
pub(crate) use pilot::{Course, Pair, explore};
pub(crate) use search::{
    Asked, Beside, Failed, Found, Graded, Judge, Pilot, Ran, RanBeside, Runner, Way,
    damping_element_for, element_for, factor_for, next, search,
};
pub(crate) use trace::{Trace, difference};
