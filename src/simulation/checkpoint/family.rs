//! The same for families.

use crate::error::RunError;
use crate::length::RunTimeLength;
use crate::motion::{Checkpoint, Motion};
use crate::simulation::Simulation;
use tfe_runtime::family::FamilyModel;

impl<M: FamilyModel> Simulation<'_, M, 0, RunTimeLength> {
    /// Goes on where a run ended, up to the time `end`: to the last bit as one run would have from there on, as [`Simulation::resume`](crate::Simulation::resume) does.
    ///
    /// ```
    /// use tfe::prelude::*;
    ///
    /// #[dynamics(
    ///     coordinates(q[n]),
    ///     lagrangian = sum(i in 0..n, dot(q[i])^2/2) - sum(i in 0..n-1, (q[i+1]-q[i])^2/2 + (q[i+1]-q[i])^4/4),
    /// )]
    /// struct Chain { n: usize }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let chain = Chain { n: 20 };
    /// let q: Vec<f64> = (0..20).map(|i| f64::from(i).cos()).collect();
    /// let start = chain.state(q, vec![0.0; 20]);
    /// let simulation = Simulation::new(&chain).step(0.1);
    /// let whole = simulation.run(start.clone(), 0.0..10.0)?;
    /// let first = simulation.run(start, 0.0..3.0)?;
    /// let checkpoint = first.checkpoint().ok_or("the run is complete")?;
    /// let second = simulation.resume(checkpoint, 10.0)?;
    /// assert_eq!(second.states(), &whole.states()[30..]);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// [`RunError`], as from [`run`](Self::run).
    pub fn resume(
        &self,
        checkpoint: &Checkpoint<0, RunTimeLength>,
        end: f64,
    ) -> Result<Motion<0, RunTimeLength>, RunError<0, RunTimeLength>> {
        let (time, state) = (checkpoint.time(), &checkpoint.state);
        let refused = |kind| self.refused(kind, time, state);
        let mut run = self.clone();
        run.step = run.step.or(checkpoint.reached.step);
        let place = checkpoint
            .reached
            .place(end, self.nodes.as_deref(), |span, nodes| {
                run.nodes = nodes;
                run.mesh(span)
            });
        let (mesh, done, origin) = place.map_err(refused)?;
        let stepper = self.resumed_stepper(time, state, checkpoint.stepper.clone());
        self.drive_on(
            (time, state),
            (&mesh, done, origin),
            stepper.map_err(refused)?,
        )
    }
}
