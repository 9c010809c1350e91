//! Impulses: those that act in part of an element, and those on models of run-time length, which act between elements.

use super::setup::Simulation;
use crate::length::RunTimeLength;
use tfe_runtime::family;
use tfe_runtime::step::Impulse;

/// How many of the impulses in an element act before a time in it; h is negative where it goes back in time.
pub(super) fn behind<const N: usize>(impulses: &[Impulse<N>], time: f64, h: f64) -> usize {
    let is_ahead = |impulse: &Impulse<N>| h.signum() * impulse.time >= h.signum() * time;
    impulses.iter().take_while(|one| !is_ahead(one)).count()
}

/// How many of them act in less than a length from its start.
pub(super) fn within<const N: usize>(impulses: &[Impulse<N>], start: f64, length: f64) -> usize {
    let is_before = |impulse: &&Impulse<N>| (impulse.time - start).abs() < length.abs();
    impulses.iter().take_while(is_before).count()
}

impl<M: family::Model> Simulation<'_, M, 0, RunTimeLength> {
    /// Adds an impulse: a generalized force of the given time integral, one number for each coordinate, that acts at one instant. An element ends there, and the node shows the momentum
    /// before it. One at the start of the span acts at once, one at its end on what [`resume`](Self::resume) goes on with. What is against the constraints
    /// of a model these take up at once, as of [`Act::Impulse`](crate::Act::Impulse).
    ///
    /// ```
    /// use tfe::prelude::*;
    ///
    /// #[dynamics(
    ///     coordinates(q[n]),
    ///     lagrangian = sum(i in 0..n, dot(q[i])^2/2) - sum(i in 0..n-1, (q[i+1]-q[i])^2/2),
    /// )]
    /// struct Chain { n: usize }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let chain = Chain { n: 50 };
    /// let mut blow = vec![0.0; 50];
    /// blow[0] = 1.5;
    /// let motion = Simulation::new(&chain)
    ///     .step(0.1)
    ///     .impulse(1.0, blow)
    ///     .run(chain.state([0.0; 50], [0.0; 50]), 0.0..5.0)?;
    /// assert!(motion.states()[10].p.iter().all(|p| *p == 0.0)); // at t = 1, before it
    /// let total: f64 = motion.last().p.iter().sum();
    /// assert!((total - 1.5).abs() < 1e-14);
    /// # Ok(())
    /// # }
    /// ```
    #[must_use]
    pub fn impulse(mut self, time: f64, impulse: impl Into<Vec<f64>>) -> Self {
        self.breaks.push(time);
        self.impulses.push((time, impulse.into()));
        self
    }
}
