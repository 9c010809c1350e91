//! Runs that go on where others ended.

mod family;

use super::follow::Nobody;
use super::mesh::Mesh;
use super::setup::Simulation;
use crate::error::{RunError, RunErrorKind};
use crate::motion::{Checkpoint, Motion, Reached};
use std::ops::Range;
use tfe_runtime::Model;
use tfe_runtime::step::Stepper;

impl Reached {
    pub(crate) fn new<const N: usize>(
        origin: f64,
        step: Option<f64>,
        mesh: &Mesh<N>,
        time: f64,
    ) -> Self {
        Self {
            origin,
            step: step.or_else(|| mesh.elements().next().map(|(.., h)| h.abs())),
            elements: mesh.steps(),
            time,
        }
    }

    /// The mesh to go on over, how many elements of it are done, and where it begins: the grid of the run if the checkpoint lies on it, else one that begins there. Given nodes
    /// are those that lie ahead.
    pub(crate) fn place<const N: usize>(
        &self,
        end: f64,
        nodes: Option<&[f64]>,
        mut mesh: impl FnMut(&Range<f64>, Option<Vec<f64>>) -> Result<Mesh<N>, RunErrorKind>,
    ) -> Result<(Mesh<N>, usize, f64), RunErrorKind> {
        let Self {
            origin,
            elements,
            time,
            ..
        } = *self;
        if let Some(nodes) = nodes {
            let is_ahead = |node: &&f64| (end - time) * (**node - time) > 0.0;
            let ahead = nodes.iter().filter(is_ahead).copied();
            let nodes = std::iter::once(time).chain(ahead).collect();
            return Ok((mesh(&(time..end), Some(nodes))?, 0, time));
        }
        let on_grid = mesh(&(origin..end), None).ok().filter(|mesh| {
            let next = mesh.elements().nth(elements);
            next.is_some_and(|(start, ..)| start == time)
        });
        match on_grid {
            Some(mesh) => Ok((mesh, elements, origin)),
            None => Ok((mesh(&(time..end), None)?, 0, time)),
        }
    }
}

impl<M: Model<N>, const N: usize> Simulation<'_, M, N> {
    /// Goes on where a run ended, up to the time `end`.
    ///
    /// Where that run ended on the grid of this one (its start, and the same steps and breaks), the motion is to the last bit what one run would have been from there on; else the grid
    /// begins at the checkpoint. Impulses at the very time of the checkpoint have acted already. Another element begins anew.
    ///
    /// ```
    /// use tfe::prelude::*;
    ///
    /// #[dynamics(coordinates(x), lagrangian = dot(x)^2/2 + cos(x))]
    /// struct Pendulum;
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let simulation = Simulation::new(&Pendulum).element(Mixed::<4>).step(0.1);
    /// let start = Pendulum.state([2.0], [0.0]);
    /// let whole = simulation.run(start, 0.0..20.0)?;
    /// let first = simulation.run(start, 0.0..8.0)?;
    /// let checkpoint = first.checkpoint().ok_or("the run is complete")?;
    /// let second = simulation.resume(checkpoint, 20.0)?;
    /// assert_eq!(second.states(), &whole.states()[80..]);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// [`RunError`], as from [`run`](Self::run).
    pub fn resume(&self, checkpoint: &Checkpoint<N>, end: f64) -> Result<Motion<N>, RunError<N>> {
        let motion = Motion::from_checkpoint(&*self.model, checkpoint);
        let prepared = self.check_start(&checkpoint.state).and_then(|()| {
            let mut run = self.clone();
            run.step = run.step.or(checkpoint.reached.step);
            // The last element of a run takes those at its end.
            run.impulses
                .retain(|impulse| impulse.time != checkpoint.time());
            let element = self.chosen_element();
            let suspended = checkpoint.stepper.clone();
            let stepper = if suspended.element() == element {
                Stepper::resume(self.model.clone(), self.control, suspended)
            } else {
                Stepper::sharing(self.model.clone(), element, self.control)
            };
            let stepper = self.cutting(stepper.map_err(RunErrorKind::Element)?);
            let place = checkpoint
                .reached
                .place(end, self.nodes.as_deref(), |span, nodes| {
                    run.nodes = nodes;
                    run.mesh(span)
                })?;
            Ok((place, stepper))
        });
        match prepared {
            Ok(((mesh, done, origin), stepper)) => self.drive_on(
                motion,
                &checkpoint.state,
                (&mesh, done, origin),
                stepper,
                Nobody,
            ),
            Err(kind) => Err(RunError::new(kind, motion)),
        }
    }
}
