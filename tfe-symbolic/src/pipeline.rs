//! From the entries of a kernel to its program: the passes of `optimise` and `schedule` one after another. May import every other folder.

pub(crate) mod select_plan;
