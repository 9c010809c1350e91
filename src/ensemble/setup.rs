//! The definition of an ensemble, and its runs.

use super::ends::{Ends, Finished};
use super::error::EnsembleError;
use super::members::{ManyModels, Members, OneModel, some_starts};
use super::plan::{Plan, WIDTH, bad_starts, start_of};
use super::results::{Results, lock, summed, unlock};
use crate::error::RunErrorKind;
use crate::length::{Declared, FixedLength, Length, breaks_of};
use crate::motion::{Node, default_step};
use crate::progress::Progress;
use crate::simulation::mesh::Mesh;
use crate::simulation::times::AtEnds;
use crate::simulation::{Watching, check_breaks, check_tolerance};
use std::marker::PhantomData;
use std::ops::Range;
use std::sync::Mutex;
use tfe_runtime::bundle::Bundle;
use tfe_runtime::step::Control;
use tfe_runtime::{Element, Mixed, Model, Solve, State, Statistics};

/// Many runs that differ in their starts, or in the parameters of their models, and of which only the ends are wanted.
///
/// ```
/// use tfe::prelude::*;
///
/// #[dynamics(coordinates(theta), lagrangian = dot(theta)^2/2 + cos(theta))]
/// struct Pendulum {}
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let pendulum = Pendulum {};
/// let starts: Vec<_> = (0..100).map(|k| pendulum.state([0.03 * f64::from(k)], [0.0])).collect();
/// let ends = Ensemble::new(&pendulum).element(Mixed::<6>).step(0.1).run(&starts, 0.0..10.0)?;
/// assert_eq!((ends.nodes().count(), ends.failures().count()), (100, 0));
/// // The last one, from the highest start, is the slowest.
/// if let Ok(end) = &ends[99] {
///     println!("{:.6} after {}", end.q[0], ends.statistics());
/// }
/// # Ok(())
/// # }
/// ```
///
/// # How it runs
/// With the feature `parallel` the trajectories are shared among all processors. On each processor, eight trajectories
/// of a model of fixed size run side by side in vector registers ([`Bundle`]), if the model has no constraints and the
/// element at most sixteen points; for a Hamiltonian whose equations are not M q̈ = f, the element must be a two-field
/// one. All others run one after the other.
///
/// Parameter sets ([`of_models`](Self::of_models)) run side by side, too: each lane computes with the parameters of
/// its own model. They run one after the other if they are hand-written models that do not number their
/// [parameters](Model::parameters), or if they differ in a `usize` or in the numbers of a `Vec`, which have no number
/// in models of fixed size.
///
/// Runs of models of run-time length are made one by one, on all processors.
///
/// No bit of a result depends on the number of processors, or on the order or number of the other starts. Compared
/// with a [`Simulation`](crate::Simulation) of the same start, results may differ by rounding.
///
/// Defaults are those of `Simulation`: element `Mixed::<4>` (order 6), one thousandth of the span as step size,
/// iteration up to rounding.
#[derive(Debug)]
pub struct Ensemble<'m, M: 'm, const N: usize, K = OneModel<'m, M>, L: Length<N> = FixedLength> {
    pub(super) models: K,
    pub(super) element: Element,
    pub(super) step: Option<f64>,
    pub(super) control: Control,
    pub(super) breaks: Vec<f64>,
    pub(super) at_kinks: bool,
    pub(super) progress: bool,
    pub(super) events: Watching<'m, M, N, L>,
    pub(super) of: PhantomData<(&'m M, L)>,
}

impl<M, const N: usize, K: Copy, L: Length<N>> Clone for Ensemble<'_, M, N, K, L> {
    fn clone(&self) -> Self {
        Self {
            breaks: self.breaks.clone(),
            events: self.events.clone(),
            ..*self
        }
    }
}

impl<'m, M, const N: usize, L: Length<N>> Ensemble<'m, M, N, OneModel<'m, M>, L>
where
    M: Declared<N, Length = L> + Sync,
{
    /// An ensemble of runs of one model from many starts.
    pub fn new(model: &'m M) -> Self {
        Self::with(OneModel(model), breaks_of([model]))
    }
}

impl<'m, M, const N: usize, L: Length<N>> Ensemble<'m, M, N, ManyModels<'m, M>, L>
where
    M: Declared<N, Length = L> + Sync,
{
    /// An ensemble of runs of many models of one type (parameter sets), with one start for each or one for all.
    ///
    /// ```
    /// use tfe::prelude::*;
    ///
    /// #[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - k/2*x^2)]
    /// struct Oscillator { k: f64 }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let oscillators: Vec<_> = (1..=10).map(|k| Oscillator { k: f64::from(k) }).collect();
    /// let start = oscillators[0].state([1.0], [0.0]); // all have the same momentum, zero
    /// let ends = Ensemble::of_models(&oscillators).step(0.01).run(&[start], 0.0..1.0)?;
    /// for (oscillator, end) in oscillators.iter().zip(ends.iter()) {
    ///     let expected = oscillator.k.sqrt().cos();
    ///     assert!((end.as_ref().unwrap().q[0] - expected).abs() < 1e-12);
    /// }
    /// # Ok(())
    /// # }
    /// ```
    pub fn of_models(models: &'m [M]) -> Self {
        Self::with(ManyModels(models), breaks_of(models))
    }
}

impl<M, const N: usize, K, L: Length<N>> Ensemble<'_, M, N, K, L> {
    fn with(models: K, breaks: Vec<f64>) -> Self {
        Self {
            events: Watching::NOTHING,
            of: PhantomData,
            models,
            element: Element::from(Mixed::<4>),
            step: None,
            control: Control::default(),
            breaks,
            at_kinks: false,
            progress: false,
        }
    }

    /// Refuses an element that does not exist, a tolerance that is none, and breaks at no time.
    pub(super) fn check_method(&self) -> Result<(), RunErrorKind> {
        self.element.validate().map_err(RunErrorKind::Element)?;
        check_breaks(&self.breaks)?;
        check_tolerance(self.control.tolerance)
    }

    /// The step size of runs over a span.
    pub(super) fn step_over(&self, span: &Range<f64>) -> f64 {
        self.step.unwrap_or_else(|| default_step(span))
    }

    /// Sets the element: `Mixed::<6>`, `Radau::<3>`, `Element::mixed(n)`, …
    #[must_use]
    pub fn element(mut self, element: impl Into<Element>) -> Self {
        self.element = element.into();
        self
    }

    /// Sets the step size h, in units of time. Where the span is not a whole number of steps, the last step is
    /// shorter.
    #[must_use]
    pub fn step(mut self, step: f64) -> Self {
        self.step = Some(step);
        self
    }

    /// Sets the tolerance of the iteration inside an element, relative to the state, as
    /// [`Simulation::tolerance`](crate::Simulation::tolerance) does. The default iterates until only rounding errors
    /// are left.
    #[must_use]
    pub fn tolerance(mut self, tolerance: f64) -> Self {
        self.control.tolerance = tolerance;
        self
    }

    /// Sets the largest number of iterations in one element; if an element needs more, its run stops with an error.
    #[must_use]
    pub fn max_iterations(mut self, iterations: u32) -> Self {
        self.control.max_iterations = iterations;
        self
    }

    /// Sets how the equations of an element are solved; `Solve::Auto` by default. With `Solve::Newton`, trajectories
    /// run one after the other.
    #[must_use]
    pub fn solver(mut self, solve: Solve) -> Self {
        self.control.solve = solve;
        self
    }

    /// Makes an element end at `time`. Use it where a force jumps at a known time: an element across the jump would
    /// lose its order of accuracy.
    #[must_use]
    pub fn break_at(mut self, time: f64) -> Self {
        self.breaks.push(time);
        self
    }

    /// Sets whether steps end where a force has a kink or a jump, as
    /// [`Simulation::at_kinks`](crate::Simulation::at_kinks) does. Runs of models with kinks are then made one by one,
    /// on all processors; a motion that would slide along a jump fails its own run.
    ///
    /// ```
    /// use tfe::prelude::*;
    ///
    /// /// A mass that falls onto a spring.
    /// #[dynamics(coordinates(y), lagrangian = dot(y)^2/2 - g*y - k/2*min(y, 0)^2)]
    /// struct Landing { g: f64, k: f64 }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let landing = Landing { g: 10.0, k: 1e4 };
    /// let starts: Vec<_> = (1..=20).map(|k| landing.state([0.01 * f64::from(k)], [0.0])).collect();
    /// let ends = Ensemble::new(&landing).element(Mixed::<6>).step(0.02).at_kinks(true).run(&starts, 0.0..1.0)?;
    /// assert!(ends.statistics().kinks > 20);
    /// for (start, end) in starts.iter().zip(ends.nodes()) {
    ///     let energy = end.p[0] * end.p[0] / 2.0 + 10.0 * end.q[0] + 5e3 * end.q[0].min(0.0).powi(2);
    ///     assert!((energy - 10.0 * start.q[0]).abs() < 1e-11);
    /// }
    /// # Ok(())
    /// # }
    /// ```
    #[must_use]
    pub fn at_kinks(mut self, are_cut: bool) -> Self {
        self.at_kinks = are_cut;
        self
    }

    /// Shows the progress on standard error, once a second.
    #[must_use]
    pub fn progress(mut self) -> Self {
        self.progress = true;
        self
    }
}

impl<'m, M, const N: usize, K> Ensemble<'m, M, N, K>
where
    M: Model<N> + Sync,
    K: Members<'m, M, N>,
{
    /// Whether runs are made one by one because of events or cuts at kinks.
    pub(super) fn is_watched(&self) -> bool {
        !self.events.is_empty() || (self.at_kinks && const { !M::FACTS.smooth })
    }

    /// Runs all trajectories over the span, backwards in time if it ends before it starts. Each result is the node at
    /// the end, or the error of that run; a failure does not stop other runs.
    ///
    /// # Errors
    /// If nothing can run: [`EnsembleError::Run`] if the element does not exist or the step size or the span is invalid,
    /// [`EnsembleError::Starts`] if the number of starts does not fit the number of models. An invalid start, or a model
    /// that does not pass its [check](Model::check), fails its own run only.
    pub fn run(&self, starts: &[State<N>], span: Range<f64>) -> Result<Ends<N>, EnsembleError> {
        let count = self.models.count(starts.len())?;
        let results = Mutex::new(Results::new(count));
        let from = span.start;
        let statistics = self.each(starts, span, &|index, result| {
            let model = self.models.model(index);
            let warnings = self.doubts(model, (from, start_of(starts, index)), &result);
            lock(&results).put(index, result, warnings);
        })?;
        Ok(unlock(results).into_ends(statistics))
    }

    /// Runs all trajectories, and hands over each result with the index of its run as soon as it is known: in no
    /// particular order, and with the feature `parallel` from several threads. Use it for results that are too many to
    /// keep, or that are wanted while other runs continue.
    ///
    /// Returns the cost of all runs together.
    ///
    /// # Errors
    /// As from [`run`](Self::run).
    ///
    /// # Example
    /// ```
    /// # use tfe::prelude::*;
    /// use std::sync::atomic::{AtomicUsize, Ordering};
    ///
    /// # #[dynamics(coordinates(theta), lagrangian = dot(theta)^2/2 + cos(theta))]
    /// # struct Pendulum {}
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// # let pendulum = Pendulum {};
    /// let starts: Vec<_> = (0..40).map(|k| pendulum.state([0.0], [0.1 * f64::from(k)])).collect();
    /// let turned_over = AtomicUsize::new(0);
    /// Ensemble::new(&pendulum).step(0.1).for_each(&starts, 0.0..20.0, |_, end| {
    ///     if end.is_ok_and(|end| end.q[0].abs() > std::f64::consts::PI) {
    ///         turned_over.fetch_add(1, Ordering::Relaxed);
    ///     }
    /// })?;
    /// // Those with more than the energy of the upper rest: velocities above 2.
    /// assert_eq!(turned_over.into_inner(), 19);
    /// # Ok(())
    /// # }
    /// ```
    pub fn for_each<F>(
        &self,
        starts: &[State<N>],
        span: Range<f64>,
        finished: F,
    ) -> Result<Statistics, EnsembleError>
    where
        F: Fn(usize, Result<Node<N>, RunErrorKind>) + Send + Sync,
    {
        self.each(starts, span, &finished)
    }

    /// [`for_each`](Self::for_each), compiled once for a model.
    fn each(
        &self,
        starts: &[State<N>],
        span: Range<f64>,
        finished: &Finished<'_, N, FixedLength>,
    ) -> Result<Statistics, EnsembleError> {
        let count = self.models.count(starts.len())?;
        let step = self.step_over(&span);
        let at_ends = AtEnds::of(self.element, !M::CONSTRAINTS.is_empty());
        let mesh = Mesh::new(&span, step, &self.breaks, &[])?.with(at_ends);
        self.check_method()?;
        let plan = Plan {
            element: self.element,
            control: self.control,
            end: span.end,
            step,
            mesh,
            done: 0,
            width: self.width(),
        };
        let progress = Progress::new(self.progress, count, "runs");
        if count == 0 {
            return Ok(Statistics::default());
        }
        let statistics = if self.is_watched() {
            self.run_one_by_one(starts, &span, (count, &progress), finished)
        } else if plan.width == WIDTH {
            // Created once; one batch after the other runs in a copy.
            let empty = self.models.bundle(self.element, self.control);
            let empty = empty.map_err(RunErrorKind::of_stepper)?;
            let batch = |bundle: &mut Bundle<'m, M, N, WIDTH, K::Lanes>, number: usize| {
                let from = number * WIDTH;
                let starts = some_starts(starts, from, count);
                self.models.place(bundle, from, &starts);
                let mut failures = bad_starts(&starts);
                let finished = |lane: usize, result| finished(from + lane, result);
                let count = starts.len();
                let statistics = plan.drive_together(bundle, count, &mut failures, &finished);
                progress.advance(count);
                statistics
            };
            summed(count.div_ceil(WIDTH), || empty.clone(), batch)
        } else {
            summed(
                count,
                || (),
                |_: &mut (), index| {
                    let start = start_of(starts, index);
                    let (result, statistics) = plan.run_alone(self.models.model(index), start);
                    finished(index, result);
                    progress.advance(1);
                    statistics
                },
            )
        };
        Ok(statistics)
    }

    /// The number of trajectories that are advanced side by side: [`WIDTH`] or one.
    pub(super) fn width(&self) -> usize {
        let uses_lanes = Bundle::<M, N, WIDTH, K::Lanes>::uses_lanes(&self.element, &self.control);
        if uses_lanes && self.models.share_kernels() {
            WIDTH
        } else {
            1
        }
    }
}
