//! Models of run-time length.

mod errors;
mod kernels;
mod motions;
#[cfg(feature = "sparse")]
mod stiff;
