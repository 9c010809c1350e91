//! Runs one batch of an ensemble.

use crate::error::RunErrorKind;
use crate::motion::Node;
use crate::simulation::mesh::Mesh;
use crate::simulation::{check_constraints, check_start};
use tfe_runtime::bundle::{Bundle, Trajectories};
use tfe_runtime::step::{Control, Stepper};
use tfe_runtime::{Element, Model, State, Statistics};

/// The number of trajectories that are advanced side by side.
pub(super) const WIDTH: usize = 8;

/// The start of one run; a single start is used for all.
pub(super) fn start_of<S>(starts: &[S], index: usize) -> &S {
    &starts[if starts.len() == 1 { 0 } else { index }]
}

/// The data common to all runs.
pub(super) struct Plan<const N: usize> {
    pub(super) element: Element,
    pub(super) control: Control,
    pub(super) end: f64,
    pub(super) step: f64,
    pub(super) mesh: Mesh<N>,
    /// The number of elements that are done.
    pub(super) done: usize,
    /// The number of runs that are advanced side by side: [`WIDTH`] or one.
    pub(super) width: usize,
}

/// The errors of the trajectories in the lanes.
pub(super) type Failures = [Option<RunErrorKind>; WIDTH];

impl<const N: usize> Plan<N> {
    fn node<M: Model<N>>(&self, model: &M, state: &State<N>) -> Node<N> {
        Node::new(model, self.end, state, &[0.0; N])
    }

    /// The result of a run without elements.
    pub(super) fn at_rest<M: Model<N>>(
        &self,
        model: &M,
        start: &State<N>,
    ) -> Result<Node<N>, RunErrorKind> {
        model.check().map_err(RunErrorKind::Family)?;
        check_start(start)?;
        Ok(self.node(model, start))
    }

    /// Advances up to [`WIDTH`] runs in lanes, from their current states.
    pub(super) fn drive_together<'m, M, T>(
        &self,
        bundle: &mut Bundle<'m, M, N, WIDTH, T>,
        count: usize,
        failures: &mut Failures,
        finished: &dyn Fn(usize, Result<Node<N>, RunErrorKind>),
    ) -> Statistics
    where
        M: Model<N>,
        T: Trajectories<'m, M, N>,
    {
        for (element, (time, _, step)) in self.mesh.elements().enumerate().skip(self.done) {
            if !bundle.advance(self.mesh.begin(time, step), step) {
                continue;
            }
            for (lane, failure) in failures.iter_mut().enumerate().take(count) {
                if let (Err(source), None) = (bundle.state(lane), &failure) {
                    *failure = Some(RunErrorKind::Solve {
                        element,
                        time,
                        step,
                        source,
                    });
                }
            }
            if failures[..count].iter().all(Option::is_some) {
                break;
            }
        }
        for (lane, failure) in failures.iter().enumerate().take(count) {
            let result = match (failure, bundle.state(lane)) {
                (None, Ok(state)) => Ok(self.node(bundle.model_of(lane), &state)),
                (Some(failure), _) => Err(failure.clone()),
                // Outside of steps only an invalid start causes an error, and starts were checked.
                (None, Err(source)) => Err(RunErrorKind::Solve {
                    element: 0,
                    time: self.end,
                    step: 0.0,
                    source,
                }),
            };
            finished(lane, result);
        }
        bundle.take_statistics()
    }

    /// Makes one run alone.
    pub(super) fn run_alone<M>(
        &self,
        model: &M,
        start: &State<N>,
    ) -> (Result<Node<N>, RunErrorKind>, Statistics)
    where
        M: Model<N>,
    {
        let mut stepper = match self.stepper(model, start) {
            Ok(stepper) => stepper,
            Err(kind) => return (Err(kind), Statistics::default()),
        };
        let mut state = *start;
        let outcome = self.drive_alone(&mut stepper, &mut state);
        (outcome, *stepper.statistics())
    }

    /// Creates a stepper, if the start is valid.
    pub(super) fn stepper<'m, M>(
        &self,
        model: &'m M,
        start: &State<N>,
    ) -> Result<Stepper<'m, M, N>, RunErrorKind>
    where
        M: Model<N>,
    {
        model.check().map_err(RunErrorKind::Family)?;
        check_start(start)?;
        if let Some((t, _, h)) = self.mesh.elements().next() {
            check_constraints(model, t, h, start)?;
        }
        Stepper::new(model, self.element, self.control).map_err(RunErrorKind::of_stepper)
    }

    /// Advances one run from its current state.
    pub(super) fn drive_alone<M>(
        &self,
        stepper: &mut Stepper<'_, M, N>,
        state: &mut State<N>,
    ) -> Result<Node<N>, RunErrorKind>
    where
        M: Model<N>,
    {
        for (element, (time, _, step)) in self.mesh.elements().enumerate().skip(self.done) {
            let outcome = stepper.advance(self.mesh.begin(time, step), step, state, &[]);
            outcome.map_err(|source| RunErrorKind::Solve {
                element,
                time,
                step,
                source,
            })?;
        }
        Ok(self.node(stepper.model(), state))
    }
}

/// The errors of the lanes with invalid starts.
pub(super) fn bad_starts<const N: usize>(starts: &[State<N>]) -> Failures {
    let mut failures = [const { None }; WIDTH];
    for (start, failure) in starts.iter().zip(&mut failures) {
        *failure = check_start(start).err();
    }
    failures
}
