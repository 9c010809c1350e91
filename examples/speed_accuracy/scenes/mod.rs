//! The scenes: a module for each kind. Each scene is a model, a start and what is measured.

pub mod lattice;
pub mod oscillators;
pub mod planets;
pub mod stiff;

/// Where a motion starts, and when it ends.
#[derive(Clone, Copy, Debug)]
pub struct Start<const N: usize> {
    pub q: [f64; N],
    pub v: [f64; N],
    /// From zero.
    pub end: f64,
}
