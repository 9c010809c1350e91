//! Continuation of runs from checkpoints.

use super::kind::Simulated;
use super::mesh::{Grid, Mesh};
use super::setup::Simulation;
use crate::error::{RunError, RunErrorKind};
use crate::length::Length;
use crate::motion::{Checkpoint, Motion, Node, Reached};
use std::ops::Range;

/// Divides a span into elements, through nodes if there are any.
type Meshing<'a, const N: usize> =
    dyn Fn(&Range<f64>, Option<&[f64]>) -> Result<Mesh<N>, RunErrorKind> + 'a;

impl Reached {
    /// The end of a run over a mesh with an origin, of which `done` elements were done at the end of the run before.
    pub(super) fn after<const N: usize>(
        before: Option<&Self>,
        (mesh, done, origin): (&Mesh<N>, usize, f64),
        step: Option<f64>,
        time: f64,
    ) -> Self {
        match before {
            // If there was nothing to do, the grid is that of the checkpoint.
            Some(reached) if mesh.steps() == done => reached.clone(),
            _ => {
                let direction = before.map_or(0.0, |reached| reached.direction);
                Self::new((origin, direction), step, mesh, time)
            }
        }
    }

    /// The end of a run over a mesh with this origin; `before` is the direction of the run before, if the mesh is
    /// empty.
    pub(crate) fn new<const N: usize>(
        (origin, before): (f64, f64),
        step: Option<f64>,
        mesh: &Mesh<N>,
        time: f64,
    ) -> Self {
        let elements = mesh.steps();
        let first = || mesh.first_step().map(f64::abs);
        Self {
            origin,
            step: step.or(mesh.step()).or_else(first),
            elements,
            time,
            direction: match elements {
                0 => before,
                _ => mesh.direction(),
            },
        }
    }

    /// The mesh of the continuation, the number of its elements already done, and its origin. If the checkpoint lies on
    /// the grid of the run, the grid is continued; otherwise a new one begins at the checkpoint. Of given nodes, those
    /// ahead are used.
    pub(crate) fn place<const N: usize>(
        &self,
        end: f64,
        nodes: Option<&[f64]>,
        mesh: &Meshing<'_, N>,
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
            let nodes: Vec<f64> = std::iter::once(time).chain(ahead).collect();
            return Ok((mesh(&(time..end), Some(&nodes))?, 0, time));
        }
        let on_grid = mesh(&(origin..end), None).ok().filter(|mesh| {
            match mesh.elements().nth(elements) {
                Some((start, ..)) => start == time,
                // The run ends at the checkpoint.
                None => end == time && mesh.steps() == elements,
            }
        });
        match on_grid {
            Some(mesh) => Ok((mesh, elements, origin)),
            None => Ok((mesh(&(time..end), None)?, 0, time)),
        }
    }
}

impl<M, const N: usize, L> Simulation<'_, M, N, L>
where
    M: Simulated<N, L>,
    L: Length<N>,
{
    /// Continues a run from its end, given as a checkpoint, up to the time `end`.
    ///
    /// If the earlier run ended on the grid of this one (same start of the span, same steps and breaks), the
    /// continuation has the same bits as one single run; otherwise the grid of steps begins at the checkpoint. With
    /// another element, or a model with other parameters, lengths or lists, the run starts afresh from the coordinates
    /// and momenta of the checkpoint.
    ///
    /// Impulses exactly at the time of the checkpoint have acted already, unless the earlier run began there; a run
    /// backwards in time subtracts them. Impulses on models of run-time length act now.
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
    pub fn resume(
        &self,
        checkpoint: &Checkpoint<N, L>,
        end: f64,
    ) -> Result<Motion<N, L>, RunError<N, L>> {
        let (time, state) = (checkpoint.time(), &checkpoint.state);
        let direction = checkpoint.reached.direction;
        let prepare = || -> Result<_, RunErrorKind> {
            self.check_start(state)?;
            let step = self.step.or(checkpoint.reached.step);
            // At the checkpoint itself, impulses have acted if the run continues in the same direction. In a first run
            // none has, and in backward integration all of them are still to be subtracted.
            let mut impulses = self.impulses.clone();
            if (end - time) * direction > 0.0 {
                M::leave_behind(&mut impulses, time);
            }
            let suspended = checkpoint.stepper.clone();
            let is_same = self.model.is_that_of(&suspended);
            let mut stepper = M::resumed(self.model.clone(), self.chosen(), suspended)?;
            M::check_velocity(&mut stepper, (time, state))?;
            let mesh = |span: &Range<f64>, nodes: Option<&[f64]>| {
                // A new grid begins behind the impulses that lie before it.
                let impulses = ahead(&impulses, M::time_of, span);
                let grid = Grid {
                    step,
                    nodes,
                    breaks: &self.breaks,
                    impulses: &impulses,
                };
                Ok(M::mesh(span, &grid)?.with(self.at_ends()))
            };
            let nodes = self.nodes.as_deref();
            let place = checkpoint.reached.place(end, nodes, &mesh)?;
            // A checkpoint without elements was never checked.
            if !is_same || direction == 0.0 {
                self.check_constraints_at((&place.0, place.1), (time, state))?;
            }
            let node = match is_same {
                true => self.node_of(checkpoint, &mut stepper),
                false => {
                    let at = (time, state);
                    M::node(&mut stepper, &*self.model, at, &checkpoint.velocity)
                }
            };
            // The signs of the event functions are not those of another model.
            let seen = is_same.then(|| checkpoint.seen.clone());
            let seen = seen.unwrap_or_default();
            Ok((place, seen, stepper, Motion::starting(&*self.model, node)))
        };
        let prepared = self.model.guarded(prepare);
        match prepared.unwrap_or_else(|| Err(RunErrorKind::panicked(time))) {
            Ok(((mesh, done, origin), seen, stepper, motion)) => {
                let place = (&mesh, done, origin, Some((&checkpoint.reached, seen)));
                self.drive_on(motion, state, place, stepper, None)
            }
            Err(kind) => Err(self.refused(kind, (time, state))),
        }
    }

    /// The node at a checkpoint. Its velocity is computed anew if the functions of the inputs may have changed.
    fn node_of(
        &self,
        checkpoint: &Checkpoint<N, L>,
        stepper: &mut L::Stepper<'_, M>,
    ) -> Node<N, L> {
        let (time, state) = (checkpoint.time(), &checkpoint.state);
        let known = &checkpoint.velocity;
        if const { M::FACTS.time_dependent } {
            let found = M::node(stepper, &*self.model, (time, state), known);
            if !is_same_velocity(found.v.as_ref(), known.as_ref()) {
                return found;
            }
        }
        Node::of(time, state, known.clone())
    }

    /// Checks the constraints at the first element of the continuation.
    fn check_constraints_at(
        &self,
        (mesh, done): (&Mesh<N>, usize),
        (time, state): (f64, &L::State),
    ) -> Result<(), RunErrorKind> {
        match mesh.elements().nth(done) {
            Some((.., h)) => self.model.check_first((time, h), state),
            None => Ok(()),
        }
    }
}

/// Whether two velocities differ by no more than iterations leave.
fn is_same_velocity(found: &[f64], known: &[f64]) -> bool {
    /// The largest relative difference that is attributed to the iteration.
    const SAME: f64 = 1e-9;

    let both = || found.iter().zip(known);
    let largest = both().fold(0.0_f64, |most, (a, b)| most.max(a.abs()).max(b.abs()));
    let is_same =
        |(a, b): (&f64, &f64)| (a - b).abs() <= SAME * largest || a.is_nan() && b.is_nan();
    both().all(is_same)
}

/// The impulses that do not lie before a span.
fn ahead<I: Clone>(impulses: &[I], time: fn(&I) -> f64, span: &Range<f64>) -> Vec<I> {
    let direction = (span.end - span.start).signum();
    let is_behind = |impulse: &&I| direction * time(impulse) < direction * span.start;
    let ahead = impulses.iter().filter(|impulse| !is_behind(impulse));
    ahead.cloned().collect()
}
