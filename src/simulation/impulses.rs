//! Impulses on models of run-time length; they act between elements.

use super::setup::Simulation;
use crate::length::RunTimeLength;
use tfe_runtime::family;

impl<M: family::Model> Simulation<'_, M, 0, RunTimeLength> {
    /// Adds an impulse: a generalized force that acts at the instant `time` and has the time integral `impulse`, one
    /// number for each coordinate, in units of that coordinate's momentum.
    ///
    /// An element ends at that time, and the recorded node shows the momentum before the impulse. An impulse at the
    /// start of the span acts at once; one at its end acts when the run is [resumed](Self::resume). A run backwards in
    /// time subtracts it. Constraints react at once to the part of an impulse that violates them, as for
    /// [`Act::Impulse`](crate::Act::Impulse).
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
        // No element ends at a time that is no number; the impulse is refused when the run begins.
        self.breaks.extend(Some(time).filter(|time| !time.is_nan()));
        self.impulses.push((time, impulse.into()));
        self
    }
}
