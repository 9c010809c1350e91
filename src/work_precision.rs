//! Work–precision diagrams: which element, with which step size, reaches an error in the least time.

mod error;
mod fit;
mod given;
pub(crate) mod grid;
pub(crate) mod measure;
pub(crate) mod measurements;
pub(crate) mod output;
mod peer;
mod point;
pub(crate) mod reference;
pub(crate) mod rounds;
pub(crate) mod subject;

use crate::numbers::is_tolerance;
use grid::Grid;
use measure::{Discretisation, Measure};
use peer::Rival;
use reference::Source;
use rounds::Timed;
use std::error::Error;
use std::fmt;
use std::io::Write;
use std::ops::Range;
use std::time::Duration;
use tfe_runtime::step::Control;
use tfe_runtime::{Element, Solve};

pub use error::{SaveError, WorkPrecisionError};
pub use fit::Slope;
pub use measurements::{Curve, Measurements};
pub use peer::{Peer, PeerMeasured, PeerPoint, PeerRun};
pub use point::{Cost, Measured, Point};
pub use reference::Reference;
pub use subject::{PhasePoint, Subject};

/// A work–precision comparison: runs one model with several elements and step sizes, and measures the cost and the
/// error of each run.
///
/// ```
/// use tfe::prelude::*;
///
/// #[dynamics(coordinates(theta), lagrangian = m/2*l^2*dot(theta)^2 + m*g*l*cos(theta))]
/// struct Pendulum { m: f64, l: f64, g: f64 }
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let pendulum = Pendulum { m: 1.0, l: 1.0, g: 9.81 };
/// let start = pendulum.state([1.5], [0.0]);
/// let measured = WorkPrecision::new(&pendulum, start, 0.0..2.0)
///     .element(Primal::<3>).element(Mixed::<3>).element(Mixed::<6>)
///     .steps([0.1, 0.05, 0.02, 0.01])
///     .run()?;
/// for curve in measured.curves() {
///     if let Some(slope) = curve.slope() {
///         println!("{}: error ~ h^{:.2}", curve.element(), slope.exponent);
///     }
/// }
/// # let folder = std::env::temp_dir().join(format!("tfe-work-precision-{}", std::process::id()));
/// # std::fs::create_dir_all(&folder)?;
/// # /*
/// measured.save("work_precision.svg")?; // or .csv, .html
/// # */
/// # measured.save(folder.join("work_precision.csv"))?;
/// # std::fs::remove_dir_all(&folder)?;
/// # assert!((measured.curves()[1].slope().unwrap().exponent - 4.0).abs() < 0.3);
/// # Ok(())
/// # }
/// ```
///
/// Errors are those of the state at the end, for coordinates and momenta separately, relative to the largest state of
/// the reference:
///
/// ```text
/// error_q = |q − q_ref| / max |q_ref| ,   error_p = |p − p_ref| / max |p_ref|      (Euclidean norms; absolute where the maximum is zero)
/// ```
///
/// Times are those of the steps alone, on one processor, the best of several repetitions if a run is short. The
/// reference is the one given by `reference`, or else a run with `Mixed::<8>` whose step size is halved until it no
/// longer changes.
///
/// Models of run-time length are measured by the same calls; `S` is the type of the states, [`State`](crate::State) or
/// [`FamilyState`](crate::family::FamilyState).
///
/// ```
/// use tfe::prelude::*;
///
/// #[dynamics(
///     coordinates(q[n]),
///     lagrangian = sum(i in 0..n, dot(q[i])^2/2) - sum(i in 0..n-1, (q[i+1]-q[i])^2/2 + b/4*(q[i+1]-q[i])^4),
/// )]
/// struct Chain { n: usize, b: f64 }
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let chain = Chain { n: 16, b: 0.3 };
/// let q: Vec<f64> = (0..chain.n).map(|i| (0.2 * i as f64).cos()).collect();
/// let start = chain.state(q, vec![0.0; chain.n]);
/// let measured = WorkPrecision::new(&chain, start, 0.0..5.0)
///     .element(Mixed::<4>)
///     .steps([0.4, 0.2, 0.1])
///     .run()?;
/// let slope = measured.curves()[0].slope().ok_or("no slope")?;
/// assert!((slope.exponent - 6.0).abs() < 0.2);
/// # Ok(())
/// # }
/// ```
///
/// An element or a solver that a model of run-time length cannot use (see [`Simulation`](crate::Simulation)) makes a
/// failed point that says why; the other curves are measured nevertheless.
pub struct WorkPrecision<'m, M, S> {
    model: &'m M,
    start: S,
    span: Range<f64>,
    title: String,
    elements: Vec<Element>,
    solvers: Vec<Solve>,
    steps: Vec<f64>,
    control: Control,
    tolerances: Vec<f64>,
    rivals: Vec<Rival<'m, S>>,
    source: Source<'m, S>,
    uncertainty: Option<f64>,
    repeat_for: Duration,
    cost: Cost,
    progress: bool,
}

impl<'m, M: Subject<S>, S: PhasePoint> WorkPrecision<'m, M, S> {
    /// A comparison of runs of `model` from `start` over the span, backwards in time if it ends before it starts; as
    /// yet without elements and step sizes.
    pub fn new(model: &'m M, start: S, span: Range<f64>) -> Self {
        Self {
            model,
            start,
            span,
            title: "Work and precision".to_owned(),
            elements: Vec::new(),
            solvers: Vec::new(),
            steps: Vec::new(),
            control: Control::default(),
            tolerances: Vec::new(),
            rivals: Vec::new(),
            source: Source::Computed,
            uncertainty: None,
            repeat_for: Duration::from_millis(20),
            cost: Cost::Time,
            progress: false,
        }
    }

    /// Adds an element, which makes one curve for each solver.
    #[must_use]
    pub fn element(mut self, element: impl Into<Element>) -> Self {
        self.elements.push(element.into());
        self
    }

    /// Adds several elements.
    #[must_use]
    pub fn elements(mut self, elements: impl IntoIterator<Item = Element>) -> Self {
        self.elements.extend(elements);
        self
    }

    /// Adds step sizes, in units of time, in any order. Where the span is not a whole number of steps, the last step
    /// is shorter.
    #[must_use]
    pub fn steps(mut self, steps: impl IntoIterator<Item = f64>) -> Self {
        self.steps.extend(steps);
        self
    }

    /// Adds a way of solving the equations of an element; if none is added, `Solve::Auto` is used.
    #[must_use]
    pub fn solver(mut self, solve: Solve) -> Self {
        self.solvers.push(solve);
        self
    }

    /// Sets the tolerance of the iteration inside an element, as
    /// [`Simulation::tolerance`](crate::Simulation::tolerance) does. It limits the accuracy as well as the cost.
    #[must_use]
    pub fn tolerance(mut self, tolerance: f64) -> Self {
        self.control.tolerance = tolerance;
        self
    }

    /// Sets several tolerances instead of one. Each point uses the loosest of them that changes its error by no more
    /// than a quarter, compared with the tightest that the iteration reaches, and [names it](Point::tolerance):
    /// iterating to rounding for an error of 1e-4 would waste time.
    #[must_use]
    pub fn tolerances(mut self, tolerances: impl IntoIterator<Item = f64>) -> Self {
        self.tolerances.extend(tolerances);
        self
    }

    /// Adds a curve of another integrator (a peer), measured by the same clock and against the same reference. The
    /// function `run` is called with each setting (a tolerance or a step size), in turn with the runs of the elements
    /// and as often, and returns the state at the end and the time of its steps.
    ///
    /// ```
    /// use std::time::Instant;
    /// use tfe::prelude::*;
    /// use tfe::work_precision::PeerRun;
    ///
    /// #[dynamics(coordinates(x), momenta(p), hamiltonian = p^2/2 + x^2/2)]
    /// struct Oscillator;
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let start = State { q: [1.0], p: [0.0] };
    /// let measured = WorkPrecision::new(&Oscillator, start, 0.0..10.0)
    ///     .element(Mixed::<3>)
    ///     .steps([0.1, 0.05])
    ///     .peer("leapfrog", [0.1, 0.01, 0.001], |step| {
    ///         let (clock, mut end, steps) = (Instant::now(), start, (10.0 / step).round() as u64);
    ///         for _ in 0..steps {
    ///             end.p[0] -= step / 2.0 * end.q[0];
    ///             end.q[0] += step * end.p[0];
    ///             end.p[0] -= step / 2.0 * end.q[0];
    ///         }
    ///         Ok(PeerRun { end, time: clock.elapsed(), evaluations: steps })
    ///     })
    ///     .run()?;
    /// let (peer, point) = measured.fastest_peer(1e-4).ok_or("leapfrog reaches 1e-4")?;
    /// assert_eq!((peer.name(), point.setting), ("leapfrog", 0.01));
    /// # Ok(())
    /// # }
    /// ```
    #[must_use]
    pub fn peer<F>(
        mut self,
        name: impl Into<String>,
        settings: impl IntoIterator<Item = f64>,
        run: F,
    ) -> Self
    where
        F: Fn(f64) -> Result<PeerRun<S>, Box<dyn Error>> + 'm,
    {
        self.rivals.push(Rival {
            name: name.into(),
            settings: settings.into_iter().collect(),
            run: Box::new(run),
        });
        self
    }

    /// Sets the largest number of iterations in one element; if an element needs more, the run counts as failed.
    #[must_use]
    pub fn max_iterations(mut self, iterations: u32) -> Self {
        self.control.max_iterations = iterations;
        self
    }

    /// Sets the relative error of the reference that was given; of a computed reference, the least error that is
    /// assumed.
    #[must_use]
    pub fn reference_uncertainty(mut self, uncertainty: f64) -> Self {
        self.uncertainty = Some(uncertainty);
        self
    }

    /// Sets for how long a run is repeated to find its best time: 20 ms by default. A run that takes longer is made
    /// once.
    #[must_use]
    pub fn repeat_for(mut self, duration: Duration) -> Self {
        self.repeat_for = duration;
        self
    }

    /// Sets the measure of cost for charts and for the Pareto front: the computing time, by default.
    #[must_use]
    pub fn against(mut self, cost: Cost) -> Self {
        self.cost = cost;
        self
    }

    /// Sets the title of charts.
    #[must_use]
    pub fn title(mut self, title: impl Into<String>) -> Self {
        self.title = title.into();
        self
    }

    /// Reports the progress on standard error, with the number of runs of each curve.
    #[must_use]
    pub fn progress(mut self) -> Self {
        self.progress = true;
        self
    }

    /// Makes all runs, one after the other so that none disturbs the time of another, and repeats them in turn.
    ///
    /// A run that fails is kept as a point without numbers, with its error ([`Point::outcome`]); the other runs are
    /// made nevertheless.
    ///
    /// # Errors
    /// If no run is possible [`WorkPrecisionError::NoElements`], [`NoSteps`](WorkPrecisionError::NoSteps),
    /// [`Element`](WorkPrecisionError::Element), [`Span`](WorkPrecisionError::Span), [`Step`](WorkPrecisionError::Step),
    /// [`TooManySteps`](WorkPrecisionError::TooManySteps), [`Tolerance`](WorkPrecisionError::Tolerance),
    /// [`Uncertainty`](WorkPrecisionError::Uncertainty) or [`Start`](WorkPrecisionError::Start); without a usable reference
    /// [`ReferenceRun`](WorkPrecisionError::ReferenceRun),
    /// [`ReferenceValue`](WorkPrecisionError::ReferenceValue) or
    /// [`ReferenceLength`](WorkPrecisionError::ReferenceLength).
    pub fn run(&self) -> Result<Measurements, WorkPrecisionError> {
        let grids = self.grids()?;
        self.check_numbers()?;
        self.check_start(&grids)?;
        self.report(format_args!("reference …"));
        let reference = self.source.find(
            self.model,
            (self.span.start, &self.start),
            &grids,
            self.uncertainty,
        )?;
        self.report(format_args!("reference: {}", reference.summary()));
        let measure = Measure {
            model: self.model,
            start: &self.start,
            reference: &reference,
        };
        let solvers = match self.solvers.as_slice() {
            [] => &[Solve::Auto],
            some => some,
        };
        let mut curves = Vec::new();
        for &element in &self.elements {
            for &solve in solvers {
                let control = Control {
                    solve,
                    ..self.control
                };
                let look = |grid| {
                    let way = Discretisation {
                        element,
                        control,
                        grid,
                    };
                    Timed::look(&measure, way, &self.tolerances)
                };
                curves.push(grids.iter().map(look).collect::<Vec<_>>());
            }
        }
        self.report(format_args!("{} curves …", curves.len()));
        let mut peers = rounds::look_at_peers(&self.rivals, &reference, self.span.end);
        rounds::repeat(
            &measure,
            &mut curves,
            (&self.rivals, &mut peers),
            self.repeat_for,
        );
        let curve = |timed: Vec<Timed<'_>>| {
            let points = timed.into_iter().map(|one| one.point).collect();
            Curve::new(points, reference.uncertainty())
        };
        let curves: Vec<Curve> = curves.into_iter().map(curve).collect();
        for curve in &curves {
            self.report(format_args!(
                "{} ({:?}): {} of {} runs done",
                curve.element(),
                curve.solve(),
                curve.measured().count(),
                curve.points().len()
            ));
        }
        Ok(Measurements {
            title: self.title.clone(),
            constrained: M::CONSTRAINED,
            curves,
            peers,
            reference: reference.into_summary(),
            cost: self.cost,
        })
    }

    /// The meshes of all runs, from the longest step on.
    fn grids(&self) -> Result<Vec<Grid>, WorkPrecisionError> {
        if self.elements.is_empty() {
            return Err(WorkPrecisionError::NoElements);
        }
        for element in &self.elements {
            element.validate().map_err(WorkPrecisionError::Element)?;
        }
        if self.steps.is_empty() {
            return Err(WorkPrecisionError::NoSteps);
        }
        let grids = self.steps.iter().map(|step| Grid::new(&self.span, *step));
        let mut grids = grids.collect::<Result<Vec<_>, _>>()?;
        grids.sort_by(|a, b| b.step().total_cmp(&a.step()));
        Ok(grids)
    }

    /// Refuses tolerances with which iterations would accept anything, or nothing, and an uncertainty that is none.
    fn check_numbers(&self) -> Result<(), WorkPrecisionError> {
        let mut tolerances = std::iter::once(&self.control.tolerance).chain(&self.tolerances);
        if let Some(&tolerance) = tolerances.find(|one| !is_tolerance(**one)) {
            return Err(WorkPrecisionError::Tolerance { tolerance });
        }
        match self.uncertainty {
            Some(uncertainty) if !(0.0..f64::INFINITY).contains(&uncertainty) => {
                Err(WorkPrecisionError::Uncertainty { uncertainty })
            }
            _ => Ok(()),
        }
    }

    /// Refuses a start at which no run can begin.
    fn check_start(&self, grids: &[Grid]) -> Result<(), WorkPrecisionError> {
        let Some(grid) = grids.last() else {
            return Err(WorkPrecisionError::NoSteps);
        };
        let (_, next, h) = grid.element(0);
        let step = self.span.start..next;
        let checked = self.model.check_start(&self.start, step, h);
        checked.map_err(WorkPrecisionError::Start)
    }

    fn report(&self, line: fmt::Arguments<'_>) {
        report(self.progress, line);
    }
}

/// Writes a line of progress to standard error, if wanted.
pub(crate) fn report(is_wanted: bool, line: fmt::Arguments<'_>) {
    if is_wanted {
        // Errors of the display are ignored.
        let _ = writeln!(std::io::stderr(), "{line}");
    }
}

impl<M, S> fmt::Debug for WorkPrecision<'_, M, S> {
    /// Shows the settings; models and functions need not be `Debug`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("WorkPrecision")
            .field("title", &self.title)
            .field("span", &self.span)
            .field("elements", &self.elements)
            .field("solvers", &self.solvers)
            .field("steps", &self.steps)
            .finish_non_exhaustive()
    }
}
