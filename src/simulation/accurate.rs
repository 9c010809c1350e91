//! Runs with an estimate of their error.

use super::mesh::Mesh;
use super::{Simulation, check_constraints, check_start};
use crate::accuracy::{Asked, Estimated, Found, Ran, Trace, Way, difference, search};
use crate::error::{RunError, RunErrorKind};
use crate::motion::Motion;
use std::ops::Range;
use tfe_runtime::step::{Control, Stepper};
use tfe_runtime::{Element, Form, Model, Solve, State, constrained};

/// An iteration that takes more is no bargain.
const MOST_ITERATIONS: u32 = 25;

/// What there is of the motion: the last one over the whole span; as long as there is none, the state that went farthest.
enum Kept<const N: usize> {
    Nothing,
    Part(f64, State<N>),
    Motion(Box<Motion<N>>),
}

impl<const N: usize> Kept<N> {
    fn keep_part(&mut self, start: f64, t: f64, state: State<N>) {
        let farthest = match self {
            Self::Nothing => start,
            Self::Part(farthest, _) => *farthest,
            Self::Motion(_) => return,
        };
        if (t - start).abs() >= (farthest - start).abs() {
            *self = Self::Part(t, state);
        }
    }
}

/// Why and where a run that was not recorded has stopped.
struct Stop<const N: usize> {
    kind: RunErrorKind,
    t: f64,
    state: State<N>,
}

/// What is seen of a run.
struct Watcher<const N: usize> {
    trace: Trace,
    /// Room for one time.
    row: Vec<f64>,
    /// The last one, where outputs need it.
    velocity: [f64; N],
}

/// A run to be that picks its element and its step; made by [`Simulation::accuracy`].
#[derive(Clone, Debug)]
pub struct Accurate<'m, M, const N: usize> {
    simulation: Simulation<'m, M, N>,
    accuracy: f64,
}

impl<'m, M: Model<N>, const N: usize> Simulation<'m, M, N> {
    /// Picks element and step so that the estimated error is at or below `accuracy` wherever it is estimated: of coordinates over the largest coordinate, of
    /// momenta over the largest momentum, of each declared output over its largest value.
    ///
    /// An element chosen before stays, a step given before is the longest one allowed. The motion comes with its error and says what was picked and why. Three or
    /// four runs over the span are made, all but the last with longer steps (`docs/theory.md` §14.3); the last two of them tell the error.
    ///
    /// ```
    /// use tfe::prelude::*;
    ///
    /// #[dynamics(coordinates(theta), lagrangian = dot(theta)^2/2 + k*cos(theta), output(height) = -cos(theta))]
    /// struct Pendulum { k: f64 }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let pendulum = Pendulum { k: 1.0 };
    /// let motion = Simulation::new(&pendulum)
    ///     .accuracy(1e-8)
    ///     .run(pendulum.state([2.0], [0.0]), 0.0..10.0)?;
    /// assert!(motion.error_estimate() <= 1e-8);
    /// assert!((motion.last().q[0] - 0.713_148_180_601_379).abs() < 2e-8); // of a motion between −2 and 2
    /// assert!(motion.error_estimate_of("height").is_some());
    /// println!("{}", motion.picked().ok_or("picks always")?);
    /// # Ok(())
    /// # }
    /// ```
    #[must_use]
    pub fn accuracy(self, accuracy: f64) -> Accurate<'m, M, N> {
        Accurate {
            simulation: self,
            accuracy,
        }
    }

    /// Runs over the span as [`run`](Self::run) does, and estimates the error at every node by a second run with an element of higher order:
    ///
    /// ```text
    /// E(t) = |y_{h, n}(t) − y_{h, n+1}(t)|                                                    (T-98)
    /// ```
    ///
    /// with the same steps and one node more; beside an element of twelve nodes, two steps for each of one of twelve. It costs a little more than another run. Where
    /// steps are far too long for the motion both runs are wrong and so is the estimate: it is large then, never small by chance at all nodes.
    ///
    /// ```
    /// use tfe::prelude::*;
    ///
    /// #[dynamics(coordinates(theta), lagrangian = dot(theta)^2/2 + k*cos(theta))]
    /// struct Pendulum { k: f64 }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let pendulum = Pendulum { k: 1.0 };
    /// let motion = Simulation::new(&pendulum)
    ///     .element(Primal::<3>)
    ///     .step(0.1)
    ///     .run_estimated(pendulum.state([2.0], [0.0]), 0.0..10.0)?;
    /// let error = (motion.last().q[0] - 0.713_148_180_601_379).abs() / 2.0;
    /// let (_, estimate) = motion.error_estimates().last().ok_or("one a node")?;
    /// assert!(error / 2.0 < estimate && estimate < 2.0 * error.max(1e-6));
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// [`RunError`], as from [`run`](Self::run), of either run.
    pub fn run_estimated(
        &self,
        start: State<N>,
        span: Range<f64>,
    ) -> Result<Estimated<Motion<N>>, RunError<N>> {
        let mut watcher = self.watcher(span.start, &start);
        let mut times = Vec::new();
        let ends_only = self.record_every != 1;
        let motion = self.drive(start, &span, ends_only, |_, passed| {
            times.push(passed.end);
            self.pass(&mut watcher, passed.end, passed.after, true);
            Ok(())
        })?;
        let other = match self.finer(start, &span, &times) {
            Ok(other) => other,
            Err(kind) => return Err(RunError::new(kind, motion)),
        };
        let errors = difference(&watcher.trace, &other);
        Ok(Estimated::new(motion, times, errors, M::OBSERVABLES, None))
    }

    /// The same steps with one node more, or two steps for each of the same element where there are no more nodes.
    fn finer(
        &self,
        start: State<N>,
        span: &Range<f64>,
        times: &[f64],
    ) -> Result<Trace, RunErrorKind> {
        let element = self.chosen_element();
        let more = Element::mixed(element.nodes() + 1);
        let companion = |element| self.companion(element, self.control);
        let (companion, mesh) = if more.validate().is_ok() {
            (companion(more), self.mesh(span)?)
        } else {
            let nodes: Vec<f64> = [span.start].iter().chain(times).copied().collect();
            let lengths = nodes.windows(2).map(|pair| (pair[1] - pair[0]).abs());
            let half = lengths.fold(0.0, f64::max) * (0.5 + 1e-9);
            let mesh = Mesh::even(&nodes, half, &self.impulses)?;
            (companion(Element::mixed(element.nodes())), mesh)
        };
        let mut stepper = companion.stepper()?.ends_only();
        self.follow(&mut stepper, start, &mesh, times)
            .map_err(|stop| stop.kind)
    }

    /// A run of which nothing is kept but what it is compared by, at `times`.
    fn follow(
        &self,
        stepper: &mut Stepper<'m, M, N>,
        start: State<N>,
        mesh: &Mesh<N>,
        times: &[f64],
    ) -> Result<Trace, Stop<N>> {
        let mut elements = mesh.elements().enumerate().peekable();
        let t0 = elements.peek().map_or(0.0, |(_, (t, ..))| *t);
        let mut watcher = self.watcher(t0, &start);
        let mut times = times.iter().peekable();
        let mut state = start;
        while let Some((element, (t, next, h))) = elements.next() {
            let impulses = mesh.impulses_in(t, next, elements.peek().is_none());
            if let Err(source) = stepper.advance(t, h, &mut state, impulses) {
                let kind = RunErrorKind::Solve {
                    element,
                    time: t,
                    step: h,
                    source,
                };
                return Err(Stop { kind, t, state });
            }
            let keeps = times.next_if_eq(&&next).is_some();
            self.pass(&mut watcher, next, &state, keeps);
        }
        Ok(watcher.trace)
    }

    /// A trace that has seen the start.
    fn watcher(&self, t: f64, start: &State<N>) -> Watcher<N> {
        let trace = Trace::new(N, M::OBSERVABLES.len());
        let mut watcher = Watcher {
            row: vec![0.0; trace.width()],
            velocity: [0.0; N],
            trace,
        };
        self.pass(&mut watcher, t, start, false);
        watcher
    }

    /// Shows a state with its outputs to the trace.
    fn pass(&self, watcher: &mut Watcher<N>, t: f64, state: &State<N>, keeps: bool) {
        let Watcher {
            row,
            velocity,
            trace,
        } = watcher;
        row[..N].copy_from_slice(&state.q);
        row[N..2 * N].copy_from_slice(&state.p);
        if const { !M::OBSERVABLES.is_empty() } {
            let z = match M::FORM {
                Form::Hamiltonian => state.p,
                Form::Lagrangian => {
                    *velocity =
                        constrained::velocity_of(self.model, t, &state.q, &state.p, velocity)
                            .unwrap_or([f64::NAN; N]);
                    *velocity
                }
            };
            self.model.observables(t, &state.q, &z, &mut row[2 * N..]);
        }
        trace.pass(row, keeps);
    }

    /// The same run with another element, of which nothing is recorded.
    fn companion(&self, element: Element, control: Control) -> Self {
        Self {
            element: Some(element),
            control,
            record_every: usize::MAX,
            progress: false,
            ..self.clone()
        }
    }

    fn stepper(&self) -> Result<Stepper<'m, M, N>, RunErrorKind> {
        Stepper::new(self.model, self.chosen_element(), self.control).map_err(RunErrorKind::Element)
    }
}

impl<M: Model<N>, const N: usize> Accurate<'_, M, N> {
    /// Runs over the span with the element and the step that meet the accuracy.
    ///
    /// # Errors
    /// [`RunError`], as from [`Simulation::run`]; [`RunErrorKind::AccuracyMissed`] where no step was found that meets the accuracy, with the best motion in
    /// [`partial`](RunError::partial): a chaotic motion over a span too long, or less than roundings make.
    pub fn run(
        &self,
        start: State<N>,
        span: Range<f64>,
    ) -> Result<Estimated<Motion<N>>, RunError<N>> {
        if span.start == span.end {
            let motion = self.simulation.run(start, span)?;
            return Ok(Estimated::new(
                motion,
                Vec::new(),
                Vec::new(),
                M::OBSERVABLES,
                None,
            ));
        }
        let mut found = Kept::Nothing;
        let outcome = self.find(start, &span, &mut found);
        let motion = match found {
            Kept::Motion(motion) => *motion,
            Kept::Nothing => Motion::from_start(self.simulation.model, span.start, &start),
            Kept::Part(t, state) => {
                let model = self.simulation.model;
                let mut motion = Motion::from_start(model, span.start, &start);
                if t != span.start {
                    motion.record(model, t, &state);
                }
                motion
            }
        };
        let found = match outcome {
            Ok(found) => found,
            Err(kind) => return Err(RunError::new(kind, motion)),
        };
        let estimated = Estimated::new(
            motion,
            found.times,
            found.errors,
            M::OBSERVABLES,
            Some(found.picked),
        );
        if found.is_met {
            return Ok(estimated);
        }
        let kind = RunErrorKind::AccuracyMissed {
            asked: self.accuracy,
            estimate: estimated.error_estimate(),
            until: estimated.horizon(self.accuracy),
        };
        Err(RunError::new(kind, estimated.into_motion()))
    }

    fn find(
        &self,
        start: State<N>,
        span: &Range<f64>,
        kept: &mut Kept<N>,
    ) -> Result<Found, RunErrorKind> {
        let simulation = &self.simulation;
        let accuracy = self.accuracy;
        if !(accuracy > 0.0 && accuracy < 1.0) {
            return Err(RunErrorKind::Accuracy { asked: accuracy });
        }
        check_start(&start)?;
        // Checks span, breaks and impulses.
        let h = (span.end - span.start) / 1000.0;
        Mesh::new(span, h, &simulation.breaks, &simulation.impulses)?;
        check_constraints(simulation.model, span.start, h, &start)?;
        let asked = Asked {
            accuracy,
            span: span.clone(),
            // An impulse inside an element costs it its order.
            breaks: simulation
                .breaks
                .iter()
                .copied()
                .chain(simulation.impulses.iter().map(|one| one.time))
                .collect(),
            element: simulation.element,
            longest: simulation.step,
            may_iterate: simulation.control.solve == Solve::Auto
                && const { !M::FACTS.linear && M::CONSTRAINTS.is_empty() },
        };
        let mut steppers: Option<(bool, Stepper<'_, M, N>)> = None;
        search(&asked, &mut |way: &Way<'_>| {
            let control = Control {
                tolerance: way.tolerance,
                // One that contracts badly is no faster than Newton's method.
                ..if way.by_iteration {
                    Control {
                        solve: Solve::FixedPoint,
                        max_iterations: MOST_ITERATIONS,
                        ..simulation.control
                    }
                } else {
                    simulation.control
                }
            };
            let companion = simulation.companion(way.element, control);
            let mesh = Mesh::even(way.cuts, way.step, &simulation.impulses)?;
            let (_, stepper) = match steppers.take() {
                Some((by_iteration, stepper)) if by_iteration == way.by_iteration => {
                    steppers.insert((by_iteration, stepper))
                }
                _ => {
                    let stepper = match simulation.record_every {
                        1 => companion.stepper()?,
                        _ => companion.stepper()?.ends_only(),
                    };
                    steppers.insert((way.by_iteration, stepper))
                }
            };
            stepper.set_tolerance(way.tolerance);
            let before = *stepper.statistics();
            let times = &way.cuts[1..];
            let trace = if way.keeps {
                let recorded = Simulation {
                    record_every: simulation.record_every,
                    progress: simulation.progress,
                    ..companion
                };
                let mut watcher = simulation.watcher(span.start, &start);
                let mut times = times.iter().peekable();
                let motion = recorded.drive_over(start, span.start, &mesh, stepper, |_, passed| {
                    let keeps = times.next_if_eq(&&passed.end).is_some();
                    simulation.pass(&mut watcher, passed.end, passed.after, keeps);
                    Ok(())
                });
                let motion = motion.map_err(|error| error.kind().clone())?;
                *kept = Kept::Motion(Box::new(motion));
                watcher.trace
            } else {
                simulation
                    .follow(stepper, start, &mesh, times)
                    .map_err(|stop| {
                        kept.keep_part(span.start, stop.t, stop.state);
                        stop.kind
                    })?
            };
            let after = stepper.statistics();
            Ok(Ran {
                trace,
                contracts: after.newton_iterations == before.newton_iterations
                    && after.products == before.products,
            })
        })
    }
}
