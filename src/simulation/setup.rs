//! The definition of a run: model, element, step and all options, for models of either kind of length.

use super::events::remodel::remodel;
use super::events::watching::Watching;
use super::kind::{Chosen, Simulated};
use super::mesh::Grid;
use super::resolution::Again;
use crate::error::RunErrorKind;
use crate::length::{Declared, FixedLength, Length, breaks_of};
use crate::motion::{Motion, Warning};
use crate::sensitivity::Loss;
use std::ops::Range;
use tfe_runtime::Share;
use tfe_runtime::step::{Control, Impulse};
use tfe_runtime::{Element, Mixed, Model, Solve};

/// A simulation to be run: a model, the finite element in time, the step size, and further settings such as events,
/// breaks and tolerances.
///
/// Nothing is computed until one of the calls that run it: [`run`](Self::run) over a span, [`steps`](Self::steps)
/// without end, [`accuracy`](Self::accuracy) with a bound on the error, and others. The same simulation can be run
/// many times.
///
/// In each element the weak form of the equations of motion holds, such as for [`Mixed`], the default, with
/// y = (p, q) and the right side f = (L_q + Q, v),
///
/// ```text
/// ∫₀¹ y φ' dτ + h Σ_l b_l f_l φ(c_l) = y₁ φ(1) − y₀ φ(0)     for all polynomials φ of degree n − 1       (T-31)
/// ```
///
/// with n nodes, and the points c_l and weights b_l of the element (`docs/theory.md` §2 and §6). The pages of the
/// elements have their own forms, orders and stability.
///
/// All quantities are in consistent units: the time in the unit in which the model's parameters are given.
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
/// Defaults: element `Mixed::<4>` (order 6), step size one thousandth of the span, every node recorded, each element's
/// equations iterated until the increments are rounding errors.
///
/// # Models of run-time length
/// A model declared with `coordinates(q[n])` takes the same time to compile for any length n. A step takes time and
/// memory linear in the number of coordinates and terms: the forces at all points of the element are iterated to a
/// fixed point, four points to a vector register.
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
/// Without the feature `sparse`, the kinetic energy of such a model must be ½ Σ m v² with constant masses, one for
/// each coordinate; the potential energy and the forces may be arbitrary. With `sparse`, a Lagrangian may have any
/// kinetic energy and holonomic constraints, `constraint(rod[i in 0..n-1]) = …`. A call that such models do not
/// support returns [`RunErrorKind::Unsupported`]; `docs/calls.md` has the table of calls.
#[derive(Debug)]
pub struct Simulation<'m, M: 'm, const N: usize, L: Length<N> = FixedLength> {
    pub(super) model: Share<'m, M>,
    /// `None`: the default element.
    pub(super) element: Option<Element>,
    pub(super) step: Option<f64>,
    pub(super) nodes: Option<Vec<f64>>,
    pub(super) control: Control,
    pub(super) record_every: usize,
    pub(super) impulses: Vec<L::Impulse>,
    pub(super) breaks: Vec<f64>,
    pub(super) events: Watching<'m, M, N, L>,
    /// `None`: the default of the call.
    pub(super) at_kinks: Option<bool>,
    pub(super) progress: bool,
    /// The error of an option that cannot be used; returned when the run begins.
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
    /// A simulation of `model` with the defaults listed at [`Simulation`].
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
            breaks: breaks_of([model]),
            events: Watching::NOTHING,
            at_kinks: None,
            progress: false,
            refusal: None,
        }
    }

    /// Sets the element: `Mixed::<4>` (the default), `Primal::<3>.reduced()`, `Element::mixed(n)`, …
    ///
    /// Models of run-time length accept only elements that are Runge–Kutta methods with their points as stages
    /// ([`Element::is_collocated`]), unless the feature `sparse` is on; if they have constraints, only those with
    /// n − 1 Gauss points. Any other element makes the run return an error.
    #[must_use]
    pub fn element(mut self, element: impl Into<Element>) -> Self {
        self.element = Some(element.into());
        self
    }

    /// Sets the step size h, the length of each element in units of time; must be finite and not zero.
    ///
    /// By default it is one thousandth of the span; calls without a span (`steps`, `hold`, `section`) have no default.
    /// Where the span is not a whole number of steps, the last step is shorter.
    #[must_use]
    pub fn step(mut self, step: f64) -> Self {
        self.step = Some(step);
        self
    }

    /// Sets the nodes, instead of a [step size](Self::step): each element goes from one of these times to the next.
    ///
    /// The first and the last time must be the ends of the span of the run, and the times must be strictly monotonic;
    /// elements also end at every [break](Self::break_at). [`steps`](Self::steps), which has no end, does not use
    /// nodes.
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

    /// Sets the tolerance of the iteration inside an element: the error that it may leave, relative to the state; at
    /// least 0 and below 1.
    ///
    /// The error is estimated as the remainder of the geometric series of the increments (for a fixed-point iteration,
    /// a 64th of the tolerance is required). The default iterates until only rounding errors are left. Iteration
    /// errors of successive elements tend to have the same sign and add up over a run. Values below about 1e-15 all
    /// have the same effect, because rounding ends the iteration first; with a value above 1e-14 the sums of a step
    /// are no longer compensated for rounding (`docs/theory.md` §10.4). Models with constraints replace values above
    /// 1e-9 by 1e-9.
    #[must_use]
    pub fn tolerance(mut self, tolerance: f64) -> Self {
        self.control.tolerance = tolerance;
        self
    }

    /// Sets the largest number of iterations in one element, 100 by default; if an element needs more, the run stops
    /// with an error.
    #[must_use]
    pub fn max_iterations(mut self, iterations: u32) -> Self {
        self.control.max_iterations = iterations;
        self
    }

    /// Sets how the equations of an element are solved; `Solve::Auto` by default.
    ///
    /// `Auto` cuts a step into shorter ones if its solution is not shown to be the one that continues the motion;
    /// [`Solve::Trusting`] accepts it without that check (`docs/theory.md` §10.6).
    ///
    /// Models of run-time length begin with a fixed-point iteration. With the feature `sparse`, steps whose iteration
    /// contracts slowly are solved by Newton's method with a sparse factorisation; without it such steps are errors,
    /// and so is `Solve::Newton`.
    #[must_use]
    pub fn solver(mut self, solve: Solve) -> Self {
        self.control.solve = solve;
        self
    }

    /// Records only every `k`-th node, and always the first and the last; 0 counts as 1.
    ///
    /// With `k` > 1 the polynomials of the elements are not kept. A long run then takes little memory, but
    /// [`Motion::at`](crate::Motion::at) can evaluate the motion at the recorded nodes only.
    #[must_use]
    pub fn record_every(mut self, k: usize) -> Self {
        self.record_every = k.max(1);
        self
    }

    /// Makes an element end at `time`. Use it where a force jumps at a known time: an element across the jump would
    /// lose its order of accuracy.
    #[must_use]
    pub fn break_at(mut self, time: f64) -> Self {
        self.breaks.push(time);
        self
    }

    /// Sets whether steps end where a force or a constraint has a kink or a jump, so that elements keep their order of accuracy.
    ///
    /// Kinks are found where the argument of `abs` or `sign`, the condition of `select`, or the difference of the
    /// arguments of `min` or `max` changes its sign, as a function of the state or of time (`docs/theory.md` §10.7).
    /// The run returns to its grid of steps after each kink; [`Statistics::kinks`](crate::Statistics::kinks) counts
    /// the crossings. A motion that would slide along a jump is an error,
    /// [`StepError::Slides`](crate::runtime::StepError::Slides). Where the gradient of a constraint jumps, as at a bend of
    /// a wire that guides a bead, or a prescribed velocity does, the motion loses the velocity that is no longer allowed,
    /// as in an impact without rebound.
    ///
    /// [`run`](Self::run), [`steps`](Self::steps), [`run_estimated`](Self::run_estimated) and [sections](Self::section)
    /// cut steps at kinks only after `at_kinks(true)`. Runs with an [`accuracy`](Self::accuracy), `run_linearised`,
    /// `run_sensitive`, `gradient` and `hessian` do so unless `at_kinks(false)` was called. Derivatives include the change
    /// of the times at which steps are cut (T-167); without cuts they are wrong across jumps. For models of run-time
    /// length, derivatives across a kink at which a step is cut fail with [`RunErrorKind::Unsupported`].
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

    /// Sets how elements are solved.
    pub(crate) fn with_control(self, control: Control) -> Self {
        Self { control, ..self }
    }

    pub(crate) fn model(&self) -> &M {
        &self.model
    }

    /// Sets the events.
    pub(crate) fn watching(self, events: &Watching<'m, M, N, L>) -> Self {
        let events = events.clone();
        Self { events, ..self }
    }

    /// The model and the solver for comparisons of elements.
    pub(super) fn again(&self) -> Again<'m, M> {
        Again {
            model: self.model.clone(),
            chosen: self.chosen(),
        }
    }

    /// Makes elements end at the times at which a loss observes the motion.
    pub(super) fn look_at(&mut self, loss: &Loss<'_, N, L>, span: &Range<f64>) {
        let nodes = self.nodes.as_deref().unwrap_or_default();
        let known = [nodes, &self.breaks[..], &[span.start, span.end]].concat();
        self.breaks.extend(loss.nodes(&known));
    }

    /// The options of the mesh.
    pub(super) fn grid(&self) -> Grid<'_, L::Impulse> {
        Grid {
            step: self.step,
            nodes: self.nodes.as_deref(),
            breaks: &self.breaks,
            impulses: &self.impulses,
        }
    }

    /// The element and how it is solved.
    pub(super) fn chosen(&self) -> Chosen {
        Chosen {
            element: self.chosen_element(),
            control: self.control,
            at_kinks: self.at_kinks == Some(true),
        }
    }

    /// The same with steps cut at kinks unless the user has decided otherwise: derivatives across a jump are wrong without
    /// the change of the time at which the motion crosses it.
    pub(super) fn cut_at_kinks(&self) -> Self {
        let mut run = self.clone();
        run.at_kinks.get_or_insert(true);
        run
    }

    pub(super) fn chosen_element(&self) -> Element {
        self.element.unwrap_or_else(|| Element::from(Mixed::<4>))
    }
}

impl<M: Simulated<N, L>, const N: usize, L: Length<N>> Simulation<'_, M, N, L> {
    /// Whether forces may have kinks or jumps inside steps.
    pub(super) fn crosses_kinks(&self) -> bool {
        self.at_kinks != Some(true) && !M::FACTS.smooth
    }

    /// Warns of derivatives along a motion without the changes of the times of jumps.
    pub(super) fn warn_of_kinks(&self, motion: &mut Motion<N, L>) {
        if self.crosses_kinks() {
            motion.add_warning(Warning::KinksCrossed);
        }
    }
}

impl<'m, M: Model<N>, const N: usize> Simulation<'m, M, N> {
    /// Adds an impulse: a generalized force that acts at the instant `time` and has the time integral `impulse`, one
    /// number for each coordinate, in units of that coordinate's momentum.
    ///
    /// Inside an element the impulse is weighted by the test functions (T-49); at a node it changes the momentum there,
    /// and the recorded node at that instant shows the momentum before the impulse, except at the end of the span: the
    /// last node has it. In a run backwards in time the impulse is subtracted, as the effect of any force is. An impulse
    /// outside the span of a run is an error, [`RunErrorKind::Impulse`](crate::RunErrorKind::Impulse), and not left out
    /// as a [break](Self::break_at) is; those before the checkpoint of a run that is [resumed](Self::resume) have acted.
    ///
    /// ```
    /// use tfe::prelude::*;
    ///
    /// #[dynamics(coordinates(x), lagrangian = m/2*dot(x)^2)]
    /// struct Mass { m: f64 }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let mass = Mass { m: 2.0 };
    /// let simulation = Simulation::new(&mass).step(0.5).impulse(1.0, [3.0]);
    /// let motion = simulation.run(mass.state([0.0], [0.0]), 0.0..2.0)?;
    /// assert!(motion.states()[2].p[0].abs() < 1e-14); // at t = 1, before it
    /// assert!((motion.last().p[0] - 3.0).abs() < 1e-14);
    /// assert!((motion.last().q[0] - 1.5).abs() < 1e-14); // a second with v = 3/2
    /// # Ok(())
    /// # }
    /// ```
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
    /// The same run with another value of a parameter, if the parameters of the model can be set.
    pub(crate) fn with_parameter(&self, index: usize, value: f64) -> Option<Self> {
        Some(Self {
            model: remodel(&*self.model, &[(index, value)])?,
            ..self.clone()
        })
    }
}
