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
//! |·| is the largest error of any coordinate over the largest coordinate, the same of momenta and of each declared output, whichever is larger.

mod estimated;
mod search;
mod trace;

pub use estimated::{Attempt, Estimated, Picked};
pub(crate) use search::{Asked, Found, Ran, Way, search};
pub(crate) use trace::{Trace, difference};
