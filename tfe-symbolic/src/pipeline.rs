//! From the entries of a kernel to its program: the list of all passes, in the order in which they run.
//!
//! ```text
//! entries ──QuadraticForm──▶ entries, written in several ways                              `derive`
//!         ──Balance, OpenSums, loops, AngleSums──▶ drafts: expressions in loops           `schedule`, `optimise`
//!         ──CommonFactors, binarize, guard──▶ plans that lose no digits                   `optimise`
//!         ──Identities──▶ the cheapest ──CanonicalOrder, Signs──▶ plan                    `optimise`
//!         ──statements, StatementOrder──▶ program                                         `schedule`
//! ```
//!
//! A pass makes results cheaper and changes none of their values but by rounding. What rounding may do is checked for every plan by one guard
//! (`optimise/guard`), against the formula as declared. What is cheaper is said by one measure (`program/cost`). Limits, which keep the time of
//! expansion near-linear in the size of a model, are constants beside each pass. The passes with
//! their contracts and limits are listed in `optimise/passes.rs`. This folder may import `derive`, `optimise`, `schedule`, and what these may import.

mod programs;
mod select_plan;

pub use crate::optimise::passes::Pass;
