//! A stepper that owns its memory.

mod over;

use alloc::vec;
use alloc::vec::Vec;

use crate::condense::Direction;
use crate::constrained::rows::Independence;
use crate::constrained::{Foreseen, Trail};
use crate::cut::{Halving, Instant, in_halves, may_be_cut};
use crate::dense::DenseElement;
use crate::element::{Element, ElementError};
use crate::error::{ConstraintError, StepError};
use crate::kinks::{Kinked, in_arcs, switches};
use crate::method::{Impulse, Interval, Last, Memory, Method, may_be_phase};
use crate::model::{Model, State};
use crate::newton::{Control, Solve};
use crate::points::storage::Heap;
use crate::points::tables;
use crate::points::{Points, Together, are_possible};
use crate::propagator::Propagator;
use crate::scheme::{SchemeTable, Tables};
use crate::share::Share;
use crate::statistics::Statistics;
use crate::transition::TransitionError;
use crate::workspace::{Workspace, interior_len, linearised_len, numbers_len, pivots_len, width};
use over::Ahead;

/// Steps a model with one element, on memory of its own.
///
/// # Example
/// ```
/// # use tfe_runtime::{CoordinateName, Facts, First, Form, Mixed, Model, Real, Second, State};
/// use tfe_runtime::step::{Control, Stepper};
///
/// # struct Oscillator;
/// # impl Model<1> for Oscillator {
/// #     const FORM: Form = Form::Hamiltonian;
/// #     const FACTS: Facts = Facts::UNKNOWN;
/// #     fn energy_function<R: Real>(&self, _: R, q: &[R; 1], p: &[R; 1]) -> R {
/// #         (q[0] * q[0] + p[0] * p[0]) * R::from_f64(0.5)
/// #     }
/// #     fn first<R: Real>(&self, _: R, q: &[R; 1], p: &[R; 1], first: &mut First<R, 1>) {
/// #         (first.z, first.q) = (*p, *q);
/// #     }
/// #     fn first_and_mass<R: Real>(
/// #         &self, t: R, q: &[R; 1], p: &[R; 1], first: &mut First<R, 1>, zz: &mut [[R; 1]; 1],
/// #     ) {
/// #         self.first(t, q, p, first);
/// #         zz[0][0] = R::from_f64(1.0);
/// #     }
/// #     fn second<R: Real>(
/// #         &self, t: R, q: &[R; 1], p: &[R; 1], first: &mut First<R, 1>, second: &mut Second<R, 1>,
/// #     ) {
/// #         self.first_and_mass(t, q, p, first, &mut second.zz);
/// #         second.qq[0][0] = R::from_f64(1.0);
/// #     }
/// #     fn coordinate_name(_: usize) -> CoordinateName {
/// #         CoordinateName { name: "x", index: None }
/// #     }
/// # }
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let mut stepper = Stepper::new(&Oscillator, Mixed::<4>.into(), Control::default())?;
/// let mut state = State { q: [1.0], p: [0.0] };
/// for step in 0..10 {
///     stepper.advance(0.1 * step as f64, 0.1, &mut state, &[])?;
/// }
/// assert!((state.q[0] - 1.0_f64.cos()).abs() < 1e-9);
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Stepper<'m, M, const N: usize> {
    model: Share<'m, M>,
    table: SchemeTable,
    control: Control,
    memory: Memory<N>,
    numbers: Vec<f64>,
    pivots: Vec<usize>,
    impulses: Vec<Impulse<N>>,
    /// Nobody asks for the inside of every element.
    ends_only: bool,
    /// Of a linear model, once it has paid.
    propagator: Option<Propagator<N>>,
    /// All points at once, where model and element allow it.
    points: Option<Points<N, Heap>>,
    /// Steps of one length so far.
    alike: (f64, usize),
    /// The workspace does not hold the last step.
    skipped: bool,
    /// Of a last step that was cut.
    pieces: Vec<Piece<N>>,
    /// Where the last element has ended, if that was behind the node.
    ahead: Option<Ahead<N>>,
    /// An element of the last step went over one of its nodes.
    passes_node: bool,
    /// Steps are cut at kinks, if there are any.
    at_kinks: bool,
    /// What was asked for; what is in use may trust more.
    solve: Solve,
    /// Of a run of the same motion, where the iteration of the next step may start.
    foreseen: Foreseen,
}

/// A part of a step that was cut.
#[derive(Clone, Debug)]
struct Piece<const N: usize> {
    last: Last<N>,
    impulses: Vec<Impulse<N>>,
    dense: DenseElement<N>,
    independence: Option<[Independence; 2]>,
    /// The workspace after it.
    numbers: Vec<f64>,
    pivots: Vec<usize>,
}

// Not derived: the model is borrowed, it need not be `Clone`.
impl<M, const N: usize> Clone for Stepper<'_, M, N> {
    fn clone(&self) -> Self {
        Self {
            model: self.model.clone(),
            table: self.table.clone(),
            control: self.control,
            memory: self.memory.clone(),
            numbers: self.numbers.clone(),
            pivots: self.pivots.clone(),
            impulses: self.impulses.clone(),
            ends_only: self.ends_only,
            propagator: self.propagator.clone(),
            points: self.points.clone(),
            alike: self.alike,
            skipped: self.skipped,
            pieces: self.pieces.clone(),
            ahead: self.ahead.clone(),
            passes_node: self.passes_node,
            at_kinks: self.at_kinks,
            solve: self.solve,
            foreseen: self.foreseen.clone(),
        }
    }
}

/// All that a stepper carries from step to step, without its model: with it the next step is the same to the last bit.
#[derive(Clone, Debug)]
pub struct Suspended<const N: usize> {
    element: Element,
    memory: Memory<N>,
    numbers: Vec<f64>,
    pivots: Vec<usize>,
    impulses: Vec<Impulse<N>>,
    ends_only: bool,
    propagator: Option<Propagator<N>>,
    points: Option<Points<N, Heap>>,
    alike: (f64, usize),
    skipped: bool,
    pieces: Vec<Piece<N>>,
    ahead: Option<Ahead<N>>,
    passes_node: bool,
}

impl<const N: usize> Suspended<N> {
    /// The element of the stepper.
    #[must_use]
    pub fn element(&self) -> Element {
        self.element
    }
}

impl<'m, M, const N: usize> Stepper<'m, M, N>
where
    M: Model<N>,
{
    /// Leaves the model.
    #[must_use]
    pub fn suspend(self) -> Suspended<N> {
        Suspended {
            element: self.table.element(),
            memory: self.memory,
            numbers: self.numbers,
            pivots: self.pivots,
            impulses: self.impulses,
            ends_only: self.ends_only,
            propagator: self.propagator,
            points: self.points,
            alike: self.alike,
            skipped: self.skipped,
            pieces: self.pieces,
            ahead: self.ahead,
            passes_node: self.passes_node,
        }
    }

    /// A stepper that goes on where another one was [suspended](Self::suspend), with nothing counted yet.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn resume(
        model: Share<'m, M>,
        control: Control,
        suspended: Suspended<N>,
    ) -> Result<Self, ElementError> {
        let mut memory = suspended.memory;
        memory.statistics = Statistics::NONE;
        Ok(Self {
            model,
            table: SchemeTable::new(suspended.element)?,
            control,
            memory,
            numbers: suspended.numbers,
            pivots: suspended.pivots,
            impulses: suspended.impulses,
            ends_only: suspended.ends_only,
            propagator: suspended.propagator,
            points: suspended.points,
            alike: suspended.alike,
            skipped: suspended.skipped,
            pieces: suspended.pieces,
            ahead: suspended.ahead,
            passes_node: suspended.passes_node,
            at_kinks: false,
            solve: control.solve,
            foreseen: Foreseen::default(),
        })
    }

    /// Constants, so that nothing is compiled for models that have none.
    const MAY_HAVE_KINKS: bool = !M::FACTS.smooth;
    const HAS_CONSTRAINTS: bool = !M::CONSTRAINTS.is_empty();

    /// Likewise, for models that never step like this.
    const MAY_HAVE_POINTS: bool = !M::FACTS.linear && M::CONSTRAINTS.is_empty();

    /// Likewise a constant: whether all steps of one length have the same matrix.
    const MAY_BE_PROPAGATED: bool =
        M::FACTS.linear && !M::FACTS.time_dependent && M::CONSTRAINTS.is_empty();

    /// A stepper at rest.
    ///
    /// # Errors
    /// [`ElementError`] if the element is none.
    pub fn new(model: &'m M, element: Element, control: Control) -> Result<Self, ElementError> {
        Self::sharing(Share::Borrowed(model), element, control)
    }

    /// The same of a model that may belong to the stepper.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn sharing(
        model: Share<'m, M>,
        element: Element,
        control: Control,
    ) -> Result<Self, ElementError> {
        let table = SchemeTable::new(element)?;
        let scheme = table.view();
        let is_possible = are_possible::<M, N>(&scheme.element) && control.solve != Solve::Newton;
        let points = if Self::MAY_HAVE_POINTS && is_possible {
            Points::new(&*model, tables::Tables::of(&scheme))
        } else {
            None
        };
        let mut stepper = Self {
            model,
            table,
            control,
            memory: Memory::new(),
            numbers: Vec::new(),
            pivots: Vec::new(),
            impulses: Vec::new(),
            ends_only: false,
            propagator: None,
            points,
            alike: (0.0, 0),
            skipped: false,
            pieces: Vec::new(),
            ahead: None,
            passes_node: false,
            at_kinks: false,
            solve: control.solve,
            foreseen: Foreseen::default(),
        };
        if stepper.points.is_none() {
            stepper.make_room();
        }
        Ok(stepper)
    }

    /// Memory for the tangent of an element, if there is none yet: megabytes for thirty coordinates, and no use while a fixed point contracts.
    fn make_room(&mut self) {
        if self.numbers.is_empty() {
            (self.numbers, self.pivots) = self.room();
        }
    }

    fn room(&self) -> (Vec<f64>, Vec<usize>) {
        let element = self.table.element();
        let numbers = numbers_len(element, M::FORM, N, M::CONSTRAINTS.len());
        let pivots = pivots_len(element, M::FORM, N, M::CONSTRAINTS.len());
        (vec![0.0; numbers], vec![0; pivots])
    }

    /// Goes on with another model, of which nothing is known yet; what the steps so far have cost stays counted.
    ///
    /// # Errors
    /// None that [`new`](Self::new) did not have.
    pub fn set_model(&mut self, model: Share<'m, M>) -> Result<(), ElementError> {
        let control = Control {
            solve: self.solve,
            ..self.control
        };
        let mut other = Self::sharing(model, self.table.element(), control)?;
        (other.ends_only, other.at_kinks) = (self.ends_only, self.at_kinks);
        other.memory.statistics = self.memory.statistics;
        *self = other;
        Ok(())
    }

    /// Changes what iterations may leave from the next step on: [`Control::tolerance`].
    pub fn set_tolerance(&mut self, tolerance: f64) {
        self.control.tolerance = tolerance;
    }

    /// Says that [`dense`](Self::dense) and [`transition`](Self::transition) will be asked for now and then only.
    ///
    /// Linear models with constant coefficients then step by a matrix, y₁ = y₀ + D y₀ + c, made after 2N + 1 steps of one length: a product of a
    /// 2N × 2N matrix and a vector a step. Afterwards the inside of an element costs a step of its own.
    #[must_use]
    pub fn ends_only(self) -> Self {
        Self {
            ends_only: true,
            ..self
        }
    }

    /// Cuts steps where the argument of an `abs` or `sign`, the condition of a `select`, or the difference of the arguments of a `min` or `max` changes its sign, so that
    /// elements keep their order (T-119); [`Statistics::kinks`] counts the crossings. Models without such functions step as before.
    #[must_use]
    pub fn at_kinks(self) -> Self {
        Self {
            at_kinks: true,
            ..self
        }
    }

    /// Moves `state` from t to t + h. The first iterate continues the last step if `state` is
    /// where that ended; a state of one's own is as welcome.
    ///
    /// A step whose iteration fails, or does not prove that it found the root that continues the motion (T-115), is cut into halves, and these again, up to 1024
    /// pieces; [`Statistics::cuts`] counts such steps, and [`dense`](Self::dense) and [`transition`](Self::transition) are those of all pieces together.
    ///
    /// # Errors
    /// [`StepError`]; `state` is unchanged then.
    pub fn advance(
        &mut self,
        t: f64,
        h: f64,
        state: &mut State<N>,
        impulses: &[Impulse<N>],
    ) -> Result<(), StepError> {
        self.pieces.clear();
        if Self::MAY_HAVE_KINKS && self.at_kinks && self.has_kinks(t, state) {
            return self.advance_in_arcs(t, h, state, impulses);
        }
        if Self::HAS_CONSTRAINTS {
            return self.advance_constrained(t, h, state, impulses);
        }
        self.advance_plainly(t, h, state, impulses)
    }

    /// Adds the last step to a trail, for models with constraints and elements of Gauss points; a step that was cut is left out.
    pub fn leave(&self, trail: &mut Trail) {
        let scheme = self.table.view();
        if let Some(last) = &self.memory.last
            && self.may_foresee()
        {
            trail.push::<M, N>(&scheme, (last.t, last.h), &self.numbers);
        }
    }

    /// Has the iteration of the step from t to t + h start from what another run has found there, if a trail reaches that far and the last step is continued.
    pub fn foresee(&mut self, trail: &Trail, (t, h): (f64, f64)) {
        if self.may_foresee() {
            let scheme = self.table.view();
            self.foreseen.look::<M, N>(trail, &scheme, (t, h));
        }
    }

    fn may_foresee(&self) -> bool {
        let element = self.table.element();
        let is_gauss = element == Element::mixed(element.nodes());
        Self::HAS_CONSTRAINTS && is_gauss && self.ahead.is_none() && self.pieces.is_empty()
    }

    /// A step without a look at kinks.
    fn advance_plainly(
        &mut self,
        t: f64,
        h: f64,
        state: &mut State<N>,
        impulses: &[Impulse<N>],
    ) -> Result<(), StepError> {
        let error = match self.whole(t, h, state, impulses) {
            Err(error) if may_be_cut(&error, M::FACTS.linear, self.control.solve) => error,
            outcome => return outcome,
        };
        let (start, low, steps) = (*state, self.memory.low, self.memory.statistics.steps);
        let arrived = in_halves(self, (t, h), state, impulses, 1);
        self.memory.statistics.steps = steps;
        if !arrived {
            (*state, self.memory.low, self.memory.last) = (start, low, None);
            self.pieces.clear();
            return Err(error);
        }
        self.memory.statistics.steps += 1;
        self.memory.statistics.cuts += 1;
        Ok(())
    }

    /// Whether kernels choose by the sign of anything; where they do not nobody asks again.
    fn has_kinks(&mut self, t: f64, state: &State<N>) -> bool {
        let mut switches = Vec::new();
        self.switches(t, state, &mut switches);
        self.at_kinks = !switches.is_empty();
        // The inside of every step is looked at.
        self.ends_only &= !self.at_kinks;
        self.at_kinks
    }

    #[cold]
    fn advance_in_arcs(
        &mut self,
        t: f64,
        h: f64,
        state: &mut State<N>,
        impulses: &[Impulse<N>],
    ) -> Result<(), StepError> {
        let (start, low, steps) = (*state, self.memory.low, self.memory.statistics.steps);
        let outcome = in_arcs(self, (t, h), state, impulses);
        self.trust(false);
        self.memory.statistics.steps = steps + u64::from(outcome.is_ok());
        if outcome.is_err() {
            (*state, self.memory.low, self.memory.last) = (start, low, None);
            self.pieces.clear();
        }
        outcome
    }

    /// Whether a matrix is asked for.
    fn is_propagated(&self) -> bool {
        self.ends_only && !matches!(self.control.solve, Solve::FixedPoint)
    }

    /// Moves `state` by the matrix of a linear model; false where an ordinary step is to be done.
    ///
    /// The matrix costs 2N + 1 steps: it is made after as many of the same length.
    fn propagate(&mut self, t: f64, h: f64, state: &mut State<N>) -> bool {
        self.alike = if self.alike.0 == h {
            (h, self.alike.1.saturating_add(1))
        } else {
            (h, 1)
        };
        if self.alike.1 <= 2 * N + 1 {
            return false;
        }
        if !self.propagator.as_ref().is_some_and(|one| one.is_of(h)) {
            let Ok(made) = Propagator::of(h, |start| self.increment(h, start)) else {
                return false;
            };
            self.propagator = Some(made);
        }
        let Some(propagator) = &self.propagator else {
            return false;
        };
        let start = *state;
        let mut low = match &self.memory.last {
            Some(last) if last.end.is_same(&start) => self.memory.low,
            _ => State::ZERO,
        };
        let start_low = low;
        if !propagator.advance(state, &mut low) {
            // The ordinary step says why.
            return false;
        }
        self.memory.last = Some(Last {
            t,
            h,
            start,
            start_low,
            end: *state,
        });
        self.memory.low = low;
        self.memory.statistics.steps += 1;
        self.memory.statistics.products += 1;
        self.skipped = true;
        true
    }

    /// Moves `state` with all points of the element at once.
    fn together(&mut self, t: f64, h: f64, state: &mut State<N>) -> Together {
        let Some(points) = &mut self.points else {
            return Together::LeftToOthers;
        };
        let method = (&*self.model, &self.table, &self.control);
        let outcome = points.step(method, &mut self.memory, (t, h), state);
        match outcome {
            Together::Arrived if self.ends_only => self.skipped = true,
            Together::Arrived => {
                self.write_back();
                self.skipped = false;
            }
            Together::LeftToOthers => {
                // An ordinary step continues what is in its workspace.
                if self.skipped && !self.write_back() {
                    self.memory.last = None;
                }
                self.forget_points();
            }
            Together::Stalled(_) => {}
        }
        outcome
    }

    /// Says that the next step with all points at once continues nothing.
    fn forget_points(&mut self) {
        if let Some(points) = &mut self.points {
            points.forget();
        }
    }

    /// Rates and forces of the last step to where an ordinary step has them; false if there is none.
    fn write_back(&mut self) -> bool {
        self.make_room();
        let points = self.points.as_mut();
        points.is_some_and(|points| points.write_back::<M>(&self.table, &mut self.numbers))
    }

    /// By how much an ordinary step moves a state, rounding included.
    fn increment(&self, h: f64, start: &State<N>) -> Result<State<N>, StepError> {
        let mut memory = Memory::new();
        let mut end = *start;
        let (mut numbers, mut pivots) = (self.numbers.clone(), self.pivots.clone());
        self.ordinary(&mut memory, (&mut numbers, &mut pivots), (0.0, h), &mut end)?;
        for a in 0..N {
            end.p[a] = (end.p[a] - start.p[a]) + memory.low.p[a];
            end.q[a] = (end.q[a] - start.q[a]) + memory.low.q[a];
        }
        Ok(end)
    }

    /// A step that was done before, or that nothing can mislead.
    fn ordinary(
        &self,
        memory: &mut Memory<N>,
        (numbers, pivots): (&mut [f64], &mut [usize]),
        (start, length): (f64, f64),
        state: &mut State<N>,
    ) -> Result<(), StepError> {
        let method = Method {
            model: &*self.model,
            tables: &self.table,
            control: Control {
                solve: Solve::Trusting,
                ..self.control
            },
        };
        let interval = Interval {
            start,
            length,
            impulses: &[],
        };
        method.advance(memory, Workspace { numbers, pivots }, interval, state)
    }

    /// The workspace of the last step, where it was gone past.
    fn retrace(&self) -> Option<Vec<f64>> {
        let last = self.memory.last.filter(|_| self.skipped)?;
        let (mut numbers, mut pivots) = self.room();
        let mut state = last.start;
        let (mut memory, place) = (Memory::new(), (last.t, last.h));
        self.ordinary(&mut memory, (&mut numbers, &mut pivots), place, &mut state)
            .ok()
            .map(|()| numbers)
    }

    /// The polynomial of the last step, from time `start` to time `end`.
    ///
    /// Before the first step, and after a failed one, it is the constant zero.
    #[must_use]
    pub fn dense(&self, start: f64, end: f64) -> DenseElement<N> {
        self.dense_in(None, start, end)
    }

    /// The same in the memory of one that is not needed any more.
    #[must_use]
    pub fn dense_in(
        &self,
        spare: Option<DenseElement<N>>,
        start: f64,
        end: f64,
    ) -> DenseElement<N> {
        let pieces = self.pieces.iter().map(|piece| piece.dense.clone());
        DenseElement::of_pieces((start, end), pieces.collect())
            .unwrap_or_else(|| self.dense_of_last(spare, start, end))
    }

    fn dense_of_last(
        &self,
        spare: Option<DenseElement<N>>,
        start: f64,
        end: f64,
    ) -> DenseElement<N> {
        let scheme = self.table.view();
        let Some(last) = self.memory.last else {
            return DenseElement::constant(start, end, State::ZERO);
        };
        let retraced = self.retrace();
        let numbers = retraced.as_ref().unwrap_or(&self.numbers);
        if const { !M::CONSTRAINTS.is_empty() } {
            let m = interior_len(&scheme.element, M::FORM, N, M::CONSTRAINTS.len());
            let points = scheme.points() * N;
            let momenta = &numbers[3 * m + points..3 * m + 2 * points];
            let rates = &numbers[..scheme.unknowns() * N];
            let (rates, momenta) = (rates.as_chunks().0, momenta.as_chunks().0);
            let ends = (&last.start, &last.end);
            return DenseElement::constrained(&scheme, (start, end), last.h, ends, rates, momenta);
        }
        // The workspace begins with the unknowns, their start and the increments.
        let m = scheme.unknowns() * width(&scheme.element, M::FORM, N);
        let unknowns = numbers[..m].as_chunks().0;
        let (rates, forces) = if const { may_be_phase::<M, N>() } && scheme.element.has_phase_form()
        {
            let (pi, kappa) = unknowns.split_at(scheme.points());
            (kappa, pi)
        } else {
            (
                unknowns,
                numbers[3 * m..3 * m + scheme.points() * N].as_chunks().0,
            )
        };
        let interval = Interval {
            start: last.t,
            length: last.h,
            impulses: &self.impulses,
        };
        let times = (start, end);
        DenseElement::of(&scheme, times, &last, rates, forces, &interval, spare)
    }

    /// Writes the transition matrix of the last step, 2N × 2N, row by row, ordered (p, q).
    ///
    /// # Errors
    /// [`TransitionError`] if there is no last step, its tangent
    /// is singular, or `matrix` is too short.
    pub fn transition(&mut self, matrix: &mut [f64]) -> Result<(), TransitionError> {
        self.linearise(&[], matrix)
    }

    /// Writes the derivative of the end of the last step by its start and by g directions, 2N × (2N + g), row by row, the first columns and all rows ordered (p, q).
    ///
    /// Impulses stay at their times, and the crossings of kinks at which the step was cut at theirs.
    ///
    /// # Errors
    /// As [`transition`](Self::transition).
    pub fn linearise(
        &mut self,
        directions: &[Direction],
        matrix: &mut [f64],
    ) -> Result<(), TransitionError> {
        if self.passes_node {
            // Where constraints lose rank the tangents of the motion are open.
            return Err(StepError::from(ConstraintError::RankChanged).into());
        }
        if self.pieces.is_empty() {
            return self.linearise_last(directions, matrix);
        }
        let width = 2 * N;
        let columns = width + directions.len();
        let needed = width * columns;
        if matrix.len() < needed {
            let given = matrix.len();
            return Err(TransitionError::Shape { needed, given });
        }
        let mut product = vec![0.0; needed];
        for row in 0..width {
            product[row * columns + row] = 1.0;
        }
        let (mut factor, mut next) = (vec![0.0; needed], vec![0.0; needed]);
        // The last one leaves the stepper as the step has left it.
        for piece in 0..self.pieces.len() {
            let own = self.of_piece(directions, piece);
            self.recall(piece);
            self.linearise_last(&own, &mut factor)?;
            for row in 0..width {
                for column in 0..columns {
                    let own = if column < width {
                        0.0
                    } else {
                        factor[row * columns + column]
                    };
                    next[row * columns + column] = (0..width)
                        .map(|k| factor[row * columns + k] * product[k * columns + column])
                        .sum::<f64>()
                        + own;
                }
            }
            core::mem::swap(&mut product, &mut next);
        }
        matrix[..needed].copy_from_slice(&product);
        Ok(())
    }

    /// Multiplies the matrix of [`linearise`](Self::linearise) with `lambda`, 2N numbers ordered (p, q), from the left: its columns of the start take the place of `lambda`,
    /// those of the directions are added to `by_direction`. Without constraints the cost does not grow with the number of directions but for their explicit derivatives.
    ///
    /// # Errors
    /// As [`transition`](Self::transition).
    pub fn adjoint(
        &mut self,
        directions: &[Direction],
        lambda: &mut [f64],
        by_direction: &mut [f64],
    ) -> Result<(), TransitionError> {
        if self.passes_node {
            return Err(StepError::from(ConstraintError::RankChanged).into());
        }
        if self.pieces.is_empty() {
            return self.adjoint_of_last(directions, lambda, by_direction);
        }
        for piece in (0..self.pieces.len()).rev() {
            let own = self.of_piece(directions, piece);
            self.recall(piece);
            self.adjoint_of_last(&own, lambda, by_direction)?;
        }
        // The stepper is where the step has left it.
        self.recall(self.pieces.len() - 1);
        Ok(())
    }

    /// The directions of a piece of the last step, as parts of those of the whole.
    fn of_piece(&self, directions: &[Direction], piece: usize) -> Vec<Direction> {
        let begin = self.pieces[0].last.t;
        let length: f64 = self.pieces.iter().map(|piece| piece.last.h).sum();
        let Last { t, h, .. } = self.pieces[piece].last;
        let own = |direction: &Direction| Direction {
            time: direction.time + (t - begin) / length * direction.length,
            length: h / length * direction.length,
            ..*direction
        };
        directions.iter().map(own).collect()
    }

    /// Goes back to where a piece of the last step has ended.
    fn recall(&mut self, piece: usize) {
        let piece = &self.pieces[piece];
        self.memory.last = Some(piece.last);
        self.memory.forget_factors();
        self.numbers.clone_from(&piece.numbers);
        self.pivots.clone_from(&piece.pivots);
        self.impulses.clone_from(&piece.impulses);
        self.skipped = false;
    }

    fn linearise_last(
        &mut self,
        directions: &[Direction],
        matrix: &mut [f64],
    ) -> Result<(), TransitionError> {
        self.of_last(directions, |method, memory, workspace, extra, given| {
            method.linearise(memory, workspace, extra, given, matrix)
        })
    }

    fn adjoint_of_last(
        &mut self,
        directions: &[Direction],
        lambda: &mut [f64],
        by_direction: &mut [f64],
    ) -> Result<(), TransitionError> {
        self.of_last(directions, |method, memory, workspace, extra, given| {
            method.adjoint(memory, workspace, extra, given, (lambda, by_direction))
        })
    }

    /// Differentiates the last step with what is known of it.
    fn of_last(
        &mut self,
        directions: &[Direction],
        differentiate: impl FnOnce(
            Method<'_, M, SchemeTable>,
            &mut Memory<N>,
            Workspace<'_>,
            &mut [f64],
            (&[Impulse<N>], &[Direction]),
        ) -> Result<(), TransitionError>,
    ) -> Result<(), TransitionError> {
        let element = self.table.element();
        let constraints = M::CONSTRAINTS.len();
        let length = linearised_len(element, M::FORM, N, constraints, directions.len());
        let mut extra = vec![0.0; length];
        self.make_room();
        if let Some(numbers) = self.retrace() {
            self.numbers = numbers;
            self.skipped = false;
        }
        let workspace = Workspace {
            numbers: &mut self.numbers,
            pivots: &mut self.pivots,
        };
        let method = Method {
            model: &*self.model,
            tables: &self.table,
            control: self.control,
        };
        let given = (self.impulses.as_slice(), directions);
        differentiate(method, &mut self.memory, workspace, &mut extra, given)
    }

    /// The element with which it steps.
    #[must_use]
    pub fn element(&self) -> Element {
        self.table.element()
    }

    /// How it solves elements.
    #[must_use]
    pub fn control(&self) -> Control {
        Control {
            solve: self.solve,
            ..self.control
        }
    }

    /// The model that is stepped.
    #[must_use]
    pub fn model(&self) -> &M {
        &self.model
    }

    /// What the steps so far have cost.
    #[must_use]
    pub fn statistics(&self) -> &Statistics {
        &self.memory.statistics
    }

    /// The same since the last call.
    pub fn take_statistics(&mut self) -> Statistics {
        core::mem::take(&mut self.memory.statistics)
    }
}

impl<M, const N: usize> Halving for Stepper<'_, M, N>
where
    M: Model<N>,
{
    type State = State<N>;
    type Kick = Impulse<N>;
    type Kicks = Vec<Impulse<N>>;

    fn whole(
        &mut self,
        t: f64,
        h: f64,
        state: &mut State<N>,
        impulses: &[Impulse<N>],
    ) -> Result<(), StepError> {
        self.impulses.clear();
        self.impulses.extend_from_slice(impulses);
        if Self::MAY_BE_PROPAGATED
            && self.is_propagated()
            && impulses.is_empty()
            && self.propagate(t, h, state)
        {
            return Ok(());
        }
        if Self::MAY_HAVE_POINTS && impulses.is_empty() && h.is_finite() && h != 0.0 {
            match self.together(t, h, state) {
                Together::Arrived => return Ok(()),
                Together::Stalled(error) => return Err(error),
                Together::LeftToOthers => {}
            }
        }
        self.skipped = false;
        self.make_room();
        let interval = Interval {
            start: t,
            length: h,
            impulses,
        };
        let workspace = Workspace {
            numbers: &mut self.numbers,
            pivots: &mut self.pivots,
        };
        let method = Method {
            model: &*self.model,
            tables: &self.table,
            control: self.control,
        };
        method.advance(&mut self.memory, workspace, interval, state)
    }

    fn passed(&mut self, t: f64, h: f64, kicks: Vec<Impulse<N>>) {
        if let Some(numbers) = self.retrace() {
            self.numbers = numbers;
            self.skipped = false;
        }
        let dense = self.dense_of_last(None, t, t + h);
        if let Some(last) = self.memory.last {
            self.pieces.push(Piece {
                last,
                impulses: kicks,
                dense,
                independence: self.memory.independence,
                numbers: self.numbers.clone(),
                pivots: self.pivots.clone(),
            });
        }
    }
}

impl<M, const N: usize> Kinked for Stepper<'_, M, N>
where
    M: Model<N>,
{
    type Inside = DenseElement<N>;

    fn inside(&self) -> DenseElement<N> {
        self.dense_of_last(None, 0.0, 1.0)
    }

    fn at(inside: &DenseElement<N>, tau: f64) -> State<N> {
        inside.at(tau)
    }

    fn forget(&mut self) {
        self.memory.last = None;
    }

    fn switches(&self, t: f64, state: &State<N>, values: &mut Vec<f64>) {
        switches(&*self.model, t, state, values);
    }

    fn points(&self) -> (usize, bool) {
        let scheme = self.table.view();
        let has_ends = scheme.nodes.first() == Some(&0.0) || scheme.nodes.last() == Some(&1.0);
        (scheme.points(), has_ends)
    }

    fn crossed(&mut self) {
        self.memory.statistics.kinks += 1;
    }

    fn cuts(&self) -> bool {
        matches!(self.solve, Solve::Auto | Solve::Newton)
    }

    fn trust(&mut self, all: bool) {
        self.control.solve = match (self.solve, all) {
            (Solve::Auto, true) => Solve::Trusting,
            (solve, _) => solve,
        };
    }
}

impl<const N: usize> Instant for Impulse<N> {
    fn time(&self) -> f64 {
        self.time
    }
}
