//! From entries and a plan to a program: loops, stores, and the order of statements. May import `expr`, `derive` (its entries),
//! `optimise` (its plans) and `program`.

pub(crate) mod balance;
pub(crate) mod loop_nest;
mod order;
pub(crate) mod statements;
pub(crate) mod store_or_add;
