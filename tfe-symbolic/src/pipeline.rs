//! From the entries of a kernel to its program: the passes of `optimise` and `schedule` one after another. May import `derive`,
//! `model` and `program` besides.

mod programs;
mod select_plan;
