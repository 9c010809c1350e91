//! Error estimates of runs, and the choice of an element and a step size that meet a given accuracy.
//!
//! [`Simulation::run_estimated`](crate::Simulation::run_estimated) runs with the element and the step size given, and
//! estimates the error of the result. [`Simulation::accuracy`](crate::Simulation::accuracy) chooses both, the cheapest
//! of the candidates that meet the accuracy. Both compare two computed motions over the whole span, so that errors
//! grow and decay as the nonlinear model makes them, not as a linearisation would (`docs/theory.md` §14):
//!
//! ```text
//! run_estimated:   E(t) = |y_{h, n}(t) − y_{h, n+1}(t)|                              an element of the next order      (T-98)
//! accuracy:        E(t) = |y_h(t) − y_H(t)| / ((H/h)^p − 1) ,   h < H                the same element of order p       (T-99)
//! ```
//!
//! |·| is relative: the largest error of any coordinate divided by the largest coordinate, and likewise for momenta and for
//! each declared output; the largest of these ratios counts.
//!
//! If a model is forced, damped or depends on time, step sizes may vary. A pilot run with controlled steps yields
//! s(t), the number of steps up to the time t, and the search looks for the factor c of a mesh with s(t_{k+1}) −
//! s(t_k) = c (T-102), (T-103); in (T-99), C/c replaces H/h.

mod estimated;
mod grading;
mod pilot;
mod search;
mod trace;

pub use estimated::{Attempt, Estimated, Picked};
pub(crate) use grading::Grading;
pub(crate) use pilot::{Pair, PilotSettings, explore};
pub(crate) use search::{
    Asked, Failed, Found, Graded, PairComparison, PairObserver, PairRun, Pilot, Ran, RunSettings,
    Runner, damping_element_for, element_for, factor_for, next, search,
};
pub(crate) use trace::{Trace, difference};
