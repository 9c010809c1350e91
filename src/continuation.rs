//! Continuation of periodic orbits in one parameter: follows a branch of orbits, also through folds, and locates its
//! bifurcations.
//!
//! The unknowns are those of a periodic orbit ([`crate::periodic`]; `docs/theory.md`, (T-81)–(T-83), (T-91)) and the
//! parameter λ. The equations are linearised to
//!
//! ```text
//! δy_{e+1} − A_e δy_e − C_e δ(T, λ) = r_e ,     y_E = y_0 ,     ⟨τ, u − u_0⟩ = s      (and a phase condition if T is unknown)
//! ```
//!
//! where u holds all unknowns, u_0 is the last orbit, τ the unit tangent of the branch there and s the step in arc
//! length (pseudo-arclength continuation). These equations are regular also at a fold, where the branch turns back in
//! λ.
//!
//! The predictor is u_0 + s τ, including the interior of the elements; the corrector is Newton's method on the
//! assembled elements. The next tangent comes from the same matrix with the right-hand side (0, …, 0, 1), which also
//! gives its direction. Arc length is measured in units of the parameter: ds² is dλ² plus w² times the mean square of
//! the change of the orbit, where each coordinate and momentum is divided by its own range and w is the length of the
//! range of the parameter.
//!
//! # Events
//! Bifurcations are located by test functions that change sign between two orbits: dλ/ds at a fold, ∏ (μ + 1) at a
//! period doubling, ∏ (μ_i μ_j − 1) where a complex pair crosses the unit circle, and the determinant of all equations
//! where another branch crosses. Brent's method on the arc length, with the corrector at each trial, finds the place
//! up to rounding. Where another branch crosses, the equations are singular; the orbit there is interpolated from
//! solved orbits on both sides. The multipliers μ are those of [`crate::periodic_schur`].
//!
//! # Resolution
//! Some orbits are compared with the orbits of elements of half the length at the same place of the branch,
//! ⟨τ, u − u_0⟩ = 0: the points with the numbers 8, 16, 32, 48, …, the last one, and those on both sides of every event.
//! Newton's method needs two iterations for that, as a rule. Compared are the values of the test functions. Errors of
//! single elements are no measure: near a homoclinic orbit, with all elements right to 10⁻⁶, dλ/ds may have the
//! wrong sign.
//!
//! # Not guaranteed
//! Two events of one kind between two neighbouring points of the branch are not seen, nor are collisions of
//! multipliers on the unit circle away from ±1 (in conservative models). Branches that fork off are not followed. A
//! closed branch is traced again and again until the largest number of points is reached. Fewer than sixteen
//! points between two that are compared may be unresolved without a warning.
//!
//! # Reference
//! H. B. Keller, *Numerical solution of bifurcation and nonlinear eigenvalue problems*, in: P. Rabinowitz (ed.), *Applications of
//! Bifurcation Theory*, Academic Press 1977; E. Doedel, H. B. Keller, J. P. Kernévez, *Numerical analysis and control of
//! bifurcation problems (II)*, Int. J. Bifurcation and Chaos 1 (1991) 745–772.

mod arc;
mod branch;
mod error;
mod events;
mod follow;
mod halves;
mod problem;
mod progress;
mod solved;
mod warning;

pub use branch::{Branch, End, Event, Point, Tangent};
pub use error::{ContinuationError, ContinuationErrorKind};
pub use events::EventKind;
pub use warning::BranchWarning;

use crate::periodic::{PeriodicOrbit, Phase};
use arc::Row;
use follow::{Follower, ParameterPath, Steps};
use problem::{Continued, Field, PeriodOf};
use progress::Progress;
use std::ops::Range;
use tfe_runtime::{Element, Model, State};

/// A branch of periodic orbits to be followed in one parameter of its model.
///
/// The branch begins at the orbit of the model as given, and goes towards the end of the range; at a fold it turns
/// back. It ends where it leaves the range, with a point exactly there, or where its orbits shrink to an equilibrium,
/// [`End::Rest`].
///
/// - *Forced*: the [`period`](Self::period) is a function of the model.
/// - *Autonomous with damping or forces*: the period is unknown ([`unknown_period`](Self::unknown_period)).
/// - *Conservative*: orbits of a [`period`](Self::period) that is a function of the model, or with an unknown one those of the energy
///   of the first orbit. The equations are unfolded as for [`PeriodicOrbit`].
///
/// The parameter must be named in the `sensitivity(…)` of the model.
///
/// Defaults: as [`PeriodicOrbit`]; a first step of a hundredth of the range, steps up to a twentieth, at most 1000
/// points.
///
/// # Resolution
/// The elements have the same parts of the period along the whole branch. Where the period grows without bounds, as
/// towards a homoclinic orbit, they no longer resolve how the parameter changes, and the branch of the elements may have
/// folds, or go on, where that of the model does not. Every event is compared with elements of half the length
/// ([`Event::resolved`]), and so are the points with the numbers 8, 16, 32, 48, … and the last one: where these differ, there
/// is a warning ([`Branch::warnings`]) with the index of the event or the point. The branch is followed nevertheless.
///
/// ```
/// use std::f64::consts::TAU;
/// use tfe::continuation::EventKind;
/// use tfe::prelude::*;
///
/// #[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - alpha/2*x^2 - beta/4*x^4,
///            force(x) = f*cos(omega*t) - delta*dot(x), sensitivity(omega, f))]
/// #[derive(Clone)]
/// struct Duffing { alpha: f64, beta: f64, delta: f64, f: f64, omega: f64 }
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let duffing = Duffing { alpha: 1.0, beta: 1.0, delta: 0.2, f: 0.5, omega: 0.6 };
/// let branch = Continuation::of(&duffing)
///     .parameter(|duffing| &mut duffing.omega)
///     .range(0.6..3.0)
///     .period(|duffing| TAU / duffing.omega)
///     .guess(|t| ([0.6 * (0.6 * t).cos()], [-0.36 * (0.6 * t).sin()]))
///     .run()?;
///
/// // Over the resonance the response is threefold: up to one fold, back to the other, and on.
/// let folds: Vec<f64> = branch.events_of(EventKind::Fold).map(|fold| fold.point.parameter).collect();
/// assert_eq!(folds.len(), 2);
/// assert!(folds[0] > folds[1]);
/// let unstable = branch.points().iter().filter(|point| !point.is_stable());
/// assert!(unstable.into_iter().all(|point| point.parameter > folds[1] && point.parameter < folds[0]));
/// assert_eq!(branch.points()[branch.points().len() - 1].parameter, 3.0);
/// # Ok(())
/// # }
/// ```
pub struct Continuation<'m, M, const N: usize> {
    model: &'m M,
    orbit: PeriodicOrbit<'m, M, N>,
    field: Option<Box<Field<'m, M>>>,
    period: Option<Box<PeriodOf<'m, M>>>,
    range: Option<Range<f64>>,
    step: Option<f64>,
    smallest: Option<f64>,
    largest: Option<f64>,
    max_points: usize,
    progress: bool,
}

impl<'m, M: Model<N> + Clone, const N: usize> Continuation<'m, M, N> {
    /// A continuation that begins at the orbit of `model`, with the defaults.
    pub fn of(model: &'m M) -> Self {
        Self {
            model,
            orbit: PeriodicOrbit::of(model),
            field: None,
            period: None,
            range: None,
            step: None,
            smallest: None,
            largest: None,
            max_points: 1000,
            progress: false,
        }
    }

    /// Sets which field of the model is the parameter λ: one of those named in `sensitivity(…)`.
    #[must_use]
    pub fn parameter(mut self, field: impl Fn(&mut M) -> &mut f64 + 'm) -> Self {
        self.field = Some(Box::new(field));
        self
    }

    /// Sets the range of the parameter, ascending or descending. The branch begins at the value that the model has,
    /// and goes towards the end of the range.
    #[must_use]
    pub fn range(mut self, range: Range<f64>) -> Self {
        self.range = Some(range);
        self
    }

    /// Sets the period as a function of the model, for forced models: `|model| TAU / model.omega`.
    #[must_use]
    pub fn period(mut self, period: impl Fn(&M) -> f64 + 'm) -> Self {
        self.orbit = self.orbit.period(period(self.model));
        self.period = Some(Box::new(period));
        self
    }

    /// Makes the period an unknown, for autonomous models; `guess` is its approximate value for the first orbit.
    #[must_use]
    pub fn unknown_period(mut self, guess: f64) -> Self {
        self.orbit = self.orbit.unknown_period(guess);
        self.period = None;
        self
    }

    /// Sets the element: `Mixed::<6>`, `Element::primal(n)`, …
    #[must_use]
    pub fn element(mut self, element: impl Into<Element>) -> Self {
        self.orbit = self.orbit.element(element);
        self
    }

    /// Sets the number of elements in a period, all of the same length. Of this call and [`graded`](Self::graded) the
    /// last one counts.
    #[must_use]
    pub fn elements(mut self, elements: usize) -> Self {
        self.orbit = self.orbit.elements(elements);
        self
    }

    /// Sets one element for each weight, with lengths proportional to the weights, for every orbit of the branch.
    #[must_use]
    pub fn graded(mut self, weights: impl IntoIterator<Item = f64>) -> Self {
        self.orbit = self.orbit.graded(weights);
        self
    }

    /// Sets the time at which the period begins; 0 by default.
    #[must_use]
    pub fn start_time(mut self, time: f64) -> Self {
        self.orbit = self.orbit.start_time(time);
        self
    }

    /// Sets the first guess of the first orbit: a curve t ↦ (q, dq/dt).
    #[must_use]
    pub fn guess(mut self, curve: impl Fn(f64) -> ([f64; N], [f64; N]) + 'm) -> Self {
        self.orbit = self.orbit.guess(curve);
        self
    }

    /// Sets the first guess of the first orbit: the motion that starts at this state.
    #[must_use]
    pub fn guess_from(mut self, state: State<N>) -> Self {
        self.orbit = self.orbit.guess_from(state);
        self
    }

    /// Sets the phase condition, for autonomous models: it selects one of the orbits that differ only in their phase.
    #[must_use]
    pub fn phase(mut self, phase: Phase) -> Self {
        self.orbit = self.orbit.phase(phase);
        self
    }

    /// Sets by how much the coordinates grow over a period: a full turn, for an angle that rotates.
    #[must_use]
    pub fn advance(mut self, advance: [f64; N]) -> Self {
        self.orbit = self.orbit.advance(advance);
        self
    }

    /// Sets when Newton's method has converged: when the last correction, relative to the orbit, is at most this;
    /// 10⁻¹³ by default.
    #[must_use]
    pub fn tolerance(mut self, tolerance: f64) -> Self {
        self.orbit = self.orbit.tolerance(tolerance);
        self
    }

    /// Sets the first step, in units of the parameter; a hundredth of the range by default. Later steps are adapted.
    #[must_use]
    pub fn step(mut self, step: f64) -> Self {
        self.step = Some(step);
        self
    }

    /// Sets the smallest step in arc length; a millionth of the range by default. If the corrector fails even with it,
    /// the run ends with an error.
    #[must_use]
    pub fn smallest_step(mut self, step: f64) -> Self {
        self.smallest = Some(step);
        self
    }

    /// Sets the largest step in arc length, the largest distance of neighbouring points. By default a twentieth of the
    /// range, or the first step if that is longer.
    #[must_use]
    pub fn largest_step(mut self, step: f64) -> Self {
        self.largest = Some(step);
        self
    }

    /// Sets the largest number of points, 1000 by default.
    #[must_use]
    pub fn max_points(mut self, points: usize) -> Self {
        self.max_points = points;
        self
    }

    /// Shows the progress of long runs on standard error, once a second.
    #[must_use]
    pub fn progress(mut self) -> Self {
        self.progress = true;
        self
    }

    /// Follows the branch and locates its bifurcations.
    ///
    /// # Errors
    /// [`ContinuationError`] holds the branch up to the failure and its [kind](ContinuationErrorKind): for invalid settings
    /// [`NoParameter`](ContinuationErrorKind::NoParameter), [`NoSensitivity`](ContinuationErrorKind::NoSensitivity),
    /// [`NoRange`](ContinuationErrorKind::NoRange), [`Range`](ContinuationErrorKind::Range) or
    /// [`Steps`](ContinuationErrorKind::Steps); [`Start`](ContinuationErrorKind::Start) if the first orbit is not found;
    /// [`Step`](ContinuationErrorKind::Step) if the branch cannot be followed even with the smallest step.
    pub fn run(&self) -> Result<Branch<M, N>, ContinuationError<M, N>> {
        let mut branch = Branch::new("");
        match self.follow(&mut branch) {
            Ok(()) => Ok(branch),
            Err(kind) => Err(ContinuationError::new(kind, branch)),
        }
    }

    fn follow(&self, branch: &mut Branch<M, N>) -> Result<(), ContinuationErrorKind> {
        let field = self
            .field
            .as_deref()
            .ok_or(ContinuationErrorKind::NoParameter)?;
        let (sensitivity, name) = self.sensitivity(field)?;
        branch.parameter = name;
        let mut model = self.model.clone();
        let path = self.path(*field(&mut model))?;
        let (orbit, iterate, ..) = self.orbit.solved()?;
        let problem = Continued {
            width: (path.range.end - path.range.start).abs(),
            row: Row::Parameter(*field(&mut model)),
            model,
            orbit,
            field,
            sensitivity,
            period: self.period.as_deref(),
            rate: 0.0,
        };
        let follower = Follower::start(problem, iterate, self.orbit.method(), path)?;
        follower.run(branch, Progress::new(self.progress))
    }

    /// The index and the name of the parameter of `sensitivity(…)` that changes with the field.
    fn sensitivity(
        &self,
        field: &Field<'m, M>,
    ) -> Result<(usize, &'static str), ContinuationErrorKind> {
        let mut moved = self.model.clone();
        let value = field(&mut moved);
        // Any other number.
        *value = if *value == 1.0 { 2.0 } else { 1.0 };
        let changes = |index: &usize| {
            self.model.sensitivity_parameter(*index).to_bits()
                != moved.sensitivity_parameter(*index).to_bits()
        };
        let mut names = M::SENSITIVITIES.iter().copied().enumerate();
        names
            .find(|(index, _)| changes(index))
            .ok_or(ContinuationErrorKind::NoSensitivity {
                known: M::SENSITIVITIES,
            })
    }

    /// The checked range and step sizes.
    fn path(&self, value: f64) -> Result<ParameterPath, ContinuationErrorKind> {
        let range = self.range.clone().ok_or(ContinuationErrorKind::NoRange)?;
        let Range { start, end } = range;
        let width = (end - start).abs();
        let inside = (start.min(end)..=start.max(end)).contains(&value) && value != end;
        if !(width.is_finite() && inside) {
            return Err(ContinuationErrorKind::Range { start, end, value });
        }
        // The sizes that were given determine the defaults of the others.
        let step = self.step.unwrap_or(0.0);
        let largest = self.largest.unwrap_or((0.05 * width).max(step));
        let smallest = (1e-6 * width)
            .min(self.step.unwrap_or(largest))
            .min(largest);
        let smallest = self.smallest.unwrap_or(smallest);
        let default = (0.01 * width).max(smallest).min(largest);
        let first = self.step.unwrap_or(default);
        let positive = [first, smallest, largest]
            .iter()
            .all(|step| step.is_finite() && *step > 0.0);
        if !(positive && smallest <= first && first <= largest) {
            return Err(ContinuationErrorKind::Steps {
                step: first,
                smallest,
                largest,
            });
        }
        Ok(ParameterPath {
            range: start..end,
            steps: Steps {
                first,
                smallest,
                largest,
            },
            max_points: self.max_points,
        })
    }
}
