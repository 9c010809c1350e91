//! A run to be: a model, an element, a step, and what else is asked for; of models of either kind of length.

use super::events::remodel::remodel;
use super::events::watching::Watching;
use super::kind::{Chosen, Simulated};
use super::mesh::Grid;
use super::resolution::Again;
use crate::error::RunErrorKind;
use crate::length::{Declared, FixedLength, Length};
use crate::sensitivity::Loss;
use std::ops::Range;
use tfe_runtime::Share;
use tfe_runtime::step::{Control, Impulse};
use tfe_runtime::{Element, Mixed, Model, Solve};

/// A run to be: which model, with which element and step.
///
/// ```
/// use tfe::prelude::*;
///
/// #[dynamics(coordinates(x), lagrangian = m/2*dot(x)^2 - k/2*x^2)]
/// struct Oscillator { m: f64, k: f64 }
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let oscillator = Oscillator { m: 1.0, k: 1.0 };
/// let motion = Simulation::new(&oscillator)
///     .element(Mixed::<4>)
///     .step(0.1)
///     .run(oscillator.state([1.0], [0.0]), 0.0..10.0)?;
/// assert!((motion.last().q[0] - 10.0_f64.cos()).abs() < 1e-8);
/// # Ok(())
/// # }
/// ```
///
/// Defaults: `Mixed::<4>` (order 6), a thousandth of the span as step, every node recorded, iteration to round-off.
///
/// # Models of run-time length
/// A model with `coordinates(q[n])` costs the same to compile at any length. A step takes time and memory linear in the number of coordinates and terms: one fixed-point iteration for the
/// forces at all points of the element, four points to a register.
///
/// ```
/// use tfe::prelude::*;
///
/// #[dynamics(
///     coordinates(q[n]),
///     lagrangian = sum(i in 0..n, m/2*dot(q[i])^2) - sum(i in 0..n-1, k/2*(q[i+1]-q[i])^2 + a/3*(q[i+1]-q[i])^3),
/// )]
/// struct Chain { n: usize, m: f64, k: f64, a: f64 }
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let chain = Chain { n: 100, m: 1.0, k: 1.0, a: 0.25 };
/// let q: Vec<f64> = (0..chain.n).map(|i| (0.03 * i as f64).cos()).collect();
/// let start = chain.state(q, vec![0.0; chain.n]);
/// let motion = Simulation::new(&chain)
///     .element(Mixed::<4>)
///     .step(0.1)
///     .run(start, 0.0..10.0)?;
/// assert!(motion.energy_error() < 1e-7); // order 6 at this step
/// let total: f64 = motion.last().p.iter().sum();
/// assert!(total.abs() < 1e-12); // no force from outside
/// # Ok(())
/// # }
/// ```
///
/// Without the feature `sparse` their kinetic energy must be ½ Σ m v² with constant masses, one for each coordinate; the potential energy and the forces may be any. With it a
/// Lagrangian may have any kinetic energy and holonomic constraints: `constraint(rod[i in 0..n-1]) = …`. What they cannot do is a typed error, [`RunErrorKind::Unsupported`]; the table of calls
/// is in `docs/calls.md`.
#[derive(Debug)]
pub struct Simulation<'m, M: 'm, const N: usize, L: Length<N> = FixedLength> {
    pub(super) model: Share<'m, M>,
    /// The default where it is not chosen.
    pub(super) element: Option<Element>,
    pub(super) step: Option<f64>,
    pub(super) nodes: Option<Vec<f64>>,
    pub(super) control: Control,
    pub(super) record_every: usize,
    pub(super) impulses: Vec<L::Impulse>,
    pub(super) breaks: Vec<f64>,
    pub(super) events: Watching<'m, M, N, L>,
    /// What was asked for.
    pub(super) at_kinks: Option<bool>,
    pub(super) progress: bool,
    /// What was asked for and cannot be done.
    pub(super) refusal: Option<RunErrorKind>,
}

// Not derived: models need not be `Clone`.
impl<M, const N: usize, L: Length<N>> Clone for Simulation<'_, M, N, L> {
    fn clone(&self) -> Self {
        Self {
            model: self.model.clone(),
            nodes: self.nodes.clone(),
            impulses: self.impulses.clone(),
            breaks: self.breaks.clone(),
            events: self.events.clone(),
            refusal: self.refusal.clone(),
            ..*self
        }
    }
}

impl<'m, M, const N: usize, L: Length<N>> Simulation<'m, M, N, L> {
    /// A run of `model` with the defaults.
    pub fn new(model: &'m M) -> Self
    where
        M: Declared<N, Length = L>,
    {
        Self {
            model: model.into(),
            element: None,
            step: None,
            nodes: None,
            control: Control::default(),
            record_every: 1,
            impulses: Vec::new(),
            breaks: Vec::new(),
            events: Watching::NOTHING,
            at_kinks: None,
            progress: false,
            refusal: None,
        }
    }

    /// The element: `Mixed::<4>`, which is the default, `Primal::<3>.reduced()`, `Element::mixed(n)`, …; for models of run-time length without the feature `sparse` those that are Runge–Kutta methods, with
    /// constraints those of them with Gauss points.
    #[must_use]
    pub fn element(mut self, element: impl Into<Element>) -> Self {
        self.element = Some(element.into());
        self
    }

    /// The step h, in the units of time; by default a thousandth of the span, where there is one. Where the span is no whole number of steps the last one is shorter.
    #[must_use]
    pub fn step(mut self, step: f64) -> Self {
        self.step = Some(step);
        self
    }

    /// The nodes: every element goes from one of these times to the next, and ends at every [break](Self::break_at) besides. They begin and end with the span of the run;
    /// instead of a [step](Self::step). [`steps`](Self::steps), which has no end, does not use them.
    ///
    /// ```
    /// use tfe::prelude::*;
    ///
    /// #[dynamics(coordinates(x), lagrangian = dot(x)^2/2 + 1/x)]
    /// struct Fall;
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// // From rest at a distance of one, x = cos² u at t = (u + sin u cos u)/√2: shorter steps towards the centre.
    /// let time = |u: f64| (u + u.sin() * u.cos()) / 2.0_f64.sqrt();
    /// let nodes: Vec<f64> = (0..=30).map(|k| time(0.05 * f64::from(k))).collect();
    /// let simulation = Simulation::new(&Fall).element(Mixed::<8>).nodes(nodes.iter().copied());
    /// let motion = simulation.run(Fall.state([1.0], [0.0]), 0.0..time(1.5))?;
    /// assert_eq!(motion.states().len(), 31);
    /// assert!((motion.last().q[0] - 1.5_f64.cos().powi(2)).abs() < 1e-8);
    /// assert!(simulation.run(Fall.state([1.0], [0.0]), 0.0..1.0).is_err()); // the nodes end elsewhere
    /// # Ok(())
    /// # }
    /// ```
    #[must_use]
    pub fn nodes(mut self, times: impl IntoIterator<Item = f64>) -> Self {
        self.nodes = Some(times.into_iter().collect());
        self
    }

    /// What the iteration inside an element may leave, relative to the state. It is judged by the rest of the geometric series of its increments, a fixed point by a 64th of that. Elements of a
    /// run leave errors of the same sign, so that they add up; below some 1e-15 all values do the same, since roundings end the iteration. The default iterates to round-off; above 1e-14
    /// the sums of a step are no longer carried with what rounding takes from them (`docs/theory.md` §10.4). Models with constraints take 1e-9 for anything larger.
    #[must_use]
    pub fn tolerance(mut self, tolerance: f64) -> Self {
        self.control.tolerance = tolerance;
        self
    }

    /// The most iterations an element may take before the run stops with an error, 100 by default.
    #[must_use]
    pub fn max_iterations(mut self, iterations: u32) -> Self {
        self.control.max_iterations = iterations;
        self
    }

    /// How the element's equations are solved; `Solve::Auto` by default, which cuts steps whose solution is not proven to continue the motion ([`Solve::Trusting`] does
    /// not; `docs/theory.md` §10.6).
    ///
    /// Models of run-time length begin with the fixed point; with the feature `sparse`, steps that contract badly go to Newton's method with a sparse factorisation, without it they
    /// are errors, and so is `Solve::Newton`.
    #[must_use]
    pub fn solver(mut self, solve: Solve) -> Self {
        self.control.solve = solve;
        self
    }

    /// Records every `k`-th node (and always the first and the last). With `k` > 1 the elements' polynomials are not kept, so a long run takes
    /// little memory but [`Motion::at`](crate::Motion::at) knows the recorded nodes only. 0 counts as 1.
    #[must_use]
    pub fn record_every(mut self, k: usize) -> Self {
        self.record_every = k.max(1);
        self
    }

    /// Makes an element end at `time`: where a force jumps, an element across the jump would lose its order.
    #[must_use]
    pub fn break_at(mut self, time: f64) -> Self {
        self.breaks.push(time);
        self
    }

    /// Whether steps are cut where a force has a kink or a jump: where the argument of an `abs` or `sign`, the condition of a `select`, or the difference of the arguments
    /// of a `min` or `max` changes its sign, in the state or in time (`docs/theory.md` §10.7). Elements keep their order then, and the run stays on the grid asked for;
    /// [`Statistics::kinks`](crate::Statistics::kinks) counts the crossings. A motion that would slide along a jump is an error, [`StepError::Slides`](crate::runtime::StepError::Slides).
    ///
    /// [`run`](Self::run), [`steps`](Self::steps) and [`run_estimated`](Self::run_estimated) do so only if asked, runs with an [`accuracy`](Self::accuracy) unless forbidden;
    /// `run_linearised`, `run_sensitive`, `gradient`, `hessian` and linearised [sections](Self::section) refuse to, as [`RunErrorKind::KinksUnsupported`]: derivatives do not know that the times of
    /// the cuts move. Those of models of run-time length have none across a kink, [`RunErrorKind::Unsupported`].
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
    /// let simulation = Simulation::new(&landing).element(Mixed::<6>).step(0.02).at_kinks(true);
    /// let motion = simulation.run(landing.state([0.05], [0.0]), 0.0..1.0)?;
    /// assert!(motion.statistics().kinks > 5);
    /// let energies = motion.energies();
    /// assert!(energies.iter().all(|energy| (energy - 0.5).abs() < 1e-12));
    /// # Ok(())
    /// # }
    /// ```
    #[must_use]
    pub fn at_kinks(mut self, are_cut: bool) -> Self {
        self.at_kinks = Some(are_cut);
        self
    }

    /// Shows the progress of long runs on standard error, once a second.
    #[must_use]
    pub fn progress(mut self) -> Self {
        self.progress = true;
        self
    }

    /// How elements are solved.
    pub(crate) fn with_control(self, control: Control) -> Self {
        Self { control, ..self }
    }

    pub(crate) fn model(&self) -> &M {
        &self.model
    }

    /// What it looks for.
    pub(crate) fn watching(self, events: &Watching<'m, M, N, L>) -> Self {
        let events = events.clone();
        Self { events, ..self }
    }

    /// With what elements are looked at a second time.
    pub(super) fn again(&self) -> Again<'m, M> {
        Again {
            model: self.model.clone(),
            chosen: self.chosen(),
        }
    }

    /// Lets elements end where a loss looks at the motion.
    pub(super) fn look_at(&mut self, loss: &Loss<'_, N, L>, span: &Range<f64>) {
        let nodes = self.nodes.as_deref().unwrap_or_default();
        let known = [nodes, &self.breaks[..], &[span.start, span.end]].concat();
        self.breaks.extend(loss.nodes(&known));
    }

    /// What was asked of the elements.
    pub(super) fn grid(&self) -> Grid<'_, L::Impulse> {
        Grid {
            step: self.step,
            nodes: self.nodes.as_deref(),
            breaks: &self.breaks,
            impulses: &self.impulses,
        }
    }

    /// How elements are solved.
    pub(super) fn chosen(&self) -> Chosen {
        Chosen {
            element: self.chosen_element(),
            control: self.control,
            at_kinks: self.at_kinks == Some(true),
        }
    }

    pub(super) fn chosen_element(&self) -> Element {
        self.element.unwrap_or_else(|| Element::from(Mixed::<4>))
    }
}

impl<'m, M: Model<N>, const N: usize> Simulation<'m, M, N> {
    /// Adds an impulse: a generalized force of the given time integral that acts at one instant. Inside an element it is weighted by the test
    /// functions, at a node it changes the momentum there (`docs/theory.md`, impulses). The node at that instant shows the momentum before it. A run that goes back in time takes it
    /// away, as it does what any force gives.
    #[must_use]
    pub fn impulse(mut self, time: f64, impulse: [f64; N]) -> Self {
        self.impulses.push(Impulse {
            time,
            value: impulse,
        });
        self
    }
}

impl<'m, M, const N: usize, L> Simulation<'m, M, N, L>
where
    M: Simulated<N, L> + Send + Sync + 'm,
    L: Length<N>,
{
    /// The same of the model with another value of a parameter, if one can be made.
    pub(crate) fn with_parameter(&self, index: usize, value: f64) -> Option<Self> {
        Some(Self {
            model: remodel(&*self.model, &[(index, value)])?,
            ..self.clone()
        })
    }
}
