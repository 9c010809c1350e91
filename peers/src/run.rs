//! One run of each peer. It is timed without the preparation before its first step, and has no output in between.

pub mod de;
pub mod diffsol;
pub mod fixed;
pub mod ode_solvers;

use crate::scenes::Start;
use crate::system::System;
use std::error::Error;
use std::time::Duration;

/// The end state y of a run, its time and its number of evaluations of the equations.
pub struct Run<const D: usize> {
    pub y: [f64; D],
    pub time: Duration,
    pub evaluations: u64,
}

pub type Outcome<const D: usize> = Result<Run<D>, Box<dyn Error>>;

/// A system with its initial state, in its unit of time. `D` is twice `N`.
pub struct Problem<'s, S, const N: usize, const D: usize> {
    pub system: &'s S,
    pub y: [f64; D],
    pub end: f64,
    /// The size that each component reaches, to which the tolerance is relative.
    pub sizes: [f64; D],
}

impl<'s, S: System<N>, const N: usize, const D: usize> Problem<'s, S, N, D> {
    pub fn new(system: &'s S, start: &Start<N>) -> Self {
        const { assert!(D == 2 * N) };
        let (sizes_q, sizes_v) = system.sizes();
        let (mut y, mut sizes) = ([0.0; D], [0.0; D]);
        for i in 0..N {
            (y[i], y[N + i]) = (start.q[i], start.v[i] * S::UNIT);
            (sizes[i], sizes[N + i]) = (sizes_q[i], sizes_v[i]);
        }
        Self {
            system,
            y,
            end: start.end / S::UNIT,
            sizes,
        }
    }

    /// Coordinates and velocities in the units of the scene.
    pub fn motion(&self, y: &[f64; D]) -> ([f64; N], [f64; N]) {
        let (mut q, mut v) = ([0.0; N], [0.0; N]);
        for i in 0..N {
            (q[i], v[i]) = (y[i], y[N + i] / S::UNIT);
        }
        (q, v)
    }

    /// Absolute tolerances, one for each component.
    pub fn absolute(&self, tolerance: f64) -> [f64; D] {
        self.sizes.map(|size| tolerance * size)
    }
}
