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
//! A pass makes results cheaper and changes their values only by rounding. For every plan one guard (`optimise/guard`)
//! compares the rounding errors with those of the formula as declared. All costs are measured in one way
//! (`program/cost`). Limits that keep the time of expansion nearly linear in the size of a model are constants beside
//! each pass. The passes with their contracts and limits are listed in `optimise/passes.rs`. This folder may import
//! `derive`, `optimise`, `schedule`, and what these may import.

mod programs;
mod select_plan;

pub use crate::optimise::passes::Pass;
