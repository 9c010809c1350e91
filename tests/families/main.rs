//! Models of run-time length.

#[path = "../common/mod.rs"]
mod common;
#[cfg(feature = "sparse")]
#[path = "../common/composed.rs"]
mod composed;
#[cfg(feature = "sparse")]
#[path = "../common/duals.rs"]
mod duals;
#[path = "../common/lengths.rs"]
mod lengths;

mod calls;
mod chain;
mod checkpoints;
#[cfg(feature = "sparse")]
mod constrained;
mod constraints;
#[cfg(feature = "sparse")]
mod dual_runs;
mod errors;
mod events;
#[cfg(feature = "sparse")]
mod gradient;
mod impulses;
mod inputs;
#[cfg(feature = "sparse")]
mod inside;
mod kernels;
mod kinks;
mod lists;
mod motions;
mod outputs;
#[cfg(feature = "sparse")]
mod rates;
mod rods;
#[cfg(feature = "sparse")]
mod sensitive;
#[cfg(feature = "sparse")]
mod stiff;
mod strides;
#[cfg(feature = "sparse")]
mod table;
mod units;
mod work_precision;
