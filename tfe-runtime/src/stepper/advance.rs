//! Steps of a stepper: ordinary ones, in halves, in arcs between kinks, by the matrix of a linear model.

use super::any::AnyStepper;
use super::common::Common;
use super::piece::Ends;
use super::setup::Stepper;
use crate::constrained::trail::Of;
use crate::cut::{Halving, Instant};
use crate::dense::DenseElement;
use crate::error::StepError;
use crate::kinks::{Kinked, are_constraints_chosen, in_arcs, switches};
use crate::method::{Impulse, Interval, Memory, Method};
use crate::model::{Model, State};
use crate::newton::{Control, Solve};
use crate::points::Together;
use crate::propagator::Propagator;
use crate::scheme::Tables;
use crate::workspace::Workspace;
use alloc::vec::Vec;

/// A stepper of any model whose forces have kinks.
type AnyKinked<'a, const N: usize> = dyn 'a
    + Kinked<State = State<N>, Kick = Impulse<N>, Kicks = Vec<Impulse<N>>, Inside = DenseElement<N>>;

impl<M, const N: usize> Stepper<'_, M, N>
where
    M: Model<N>,
{
    /// Moves `state` from t to t + h. The initial guess continues the last step if `state` is where that ended; any
    /// other state may be given as well.
    ///
    /// A step whose iteration fails, or does not prove that it has found the root that continues the motion (T-115), is
    /// cut into halves, and these again, into up to 1024 pieces. [`Statistics::cuts`](crate::Statistics::cuts) counts
    /// such steps, and [`dense`](Self::dense) and [`transition`](Self::transition) are those of all pieces together.
    ///
    /// # Errors
    /// `state` is unchanged then. [`StepError::InvalidStep`] for a length that is zero or not finite;
    /// [`StepError::NonFinite`], [`Legendre`](StepError::Legendre), [`SingularTangent`](StepError::SingularTangent),
    /// [`NewtonStalled`](StepError::NewtonStalled) or [`FixedPointStalled`](StepError::FixedPointStalled) if the equations
    /// are not solved even in pieces; [`Unproven`](StepError::Unproven) or [`EnergyJump`](StepError::EnergyJump) if the
    /// solution may not be the motion; [`Slides`](StepError::Slides) or [`TooManyKinks`](StepError::TooManyKinks) at kinks;
    /// [`Constraint`](StepError::Constraint) with constraints.
    pub fn advance(
        &mut self,
        t: f64,
        h: f64,
        state: &mut State<N>,
        impulses: &[Impulse<N>],
    ) -> Result<(), StepError> {
        self.common.carried.pieces.clear();
        if Self::MAY_HAVE_KINKS && self.common.at_kinks && self.has_kinks(t, state) {
            return self.advance_in_arcs(t, h, state, impulses);
        }
        if Self::HAS_CONSTRAINTS {
            return self.any().advance_constrained(t, h, state, impulses);
        }
        match self.whole(t, h, state, impulses) {
            Ok(()) => Ok(()),
            Err(error) => self.any().divide(error, (t, h), state, impulses),
        }
    }

    /// This stepper as one of any model.
    fn any(&mut self) -> &mut (dyn AnyStepper<N> + '_) {
        self
    }

    /// Whether kernels have branches that depend on a sign; if they have none, this is not evaluated again. At a start
    /// without velocity the answer is unknown: the step reports the reason.
    fn has_kinks(&mut self, t: f64, state: &State<N>) -> bool {
        let mut switches = Vec::new();
        if !self.switches(t, state, &mut switches) {
            return false;
        }
        self.common.at_kinks = !switches.is_empty();
        if Self::HAS_CONSTRAINTS {
            self.common.has_constraint_kinks = are_constraints_chosen(&*self.model, t, &state.q);
        }
        // Dense output is needed for every step.
        self.common.carried.ends_only &= !self.common.at_kinks;
        self.common.at_kinks
    }

    #[cold]
    fn advance_in_arcs(
        &mut self,
        t: f64,
        h: f64,
        state: &mut State<N>,
        impulses: &[Impulse<N>],
    ) -> Result<(), StepError> {
        let memory = &self.common.carried.memory;
        let (start, low, steps) = (*state, memory.low, memory.statistics.steps);
        let begins_behind = memory.is_behind_kink;
        let any: &mut AnyKinked<'_, N> = self;
        let outcome = in_arcs(any, (t, h), state, impulses);
        self.trust(false);
        let carried = &mut self.common.carried;
        carried.memory.statistics.steps = steps + u64::from(outcome.is_ok());
        if outcome.is_err() {
            (*state, carried.memory.low, carried.memory.last) = (start, low, None);
            carried.memory.is_behind_kink = begins_behind;
            carried.pieces.clear();
        }
        outcome
    }

    /// Whether a propagator is to be used.
    fn is_propagated(&self) -> bool {
        self.common.carried.ends_only && !matches!(self.common.control.solve, Solve::FixedPoint)
    }

    /// Moves `state` by the propagator of a linear model; false where an ordinary step is to be made.
    ///
    /// The propagator costs 2N + 1 steps: it is made after as many of the same length.
    fn propagate(&mut self, t: f64, h: f64, state: &mut State<N>) -> bool {
        if !self.common.carried.is_alike(h) {
            return false;
        }
        let known = &self.common.carried.propagator;
        if !known.as_ref().is_some_and(|one| one.is_of(h)) {
            let Ok(made) = Propagator::of(h, &mut |start| self.increment(h, start)) else {
                return false;
            };
            self.common.carried.propagator = Some(made);
        }
        self.common.carried.propagate((t, h), state)
    }

    /// Moves `state` by the iteration with all points of the element at once.
    fn together(&mut self, t: f64, h: f64, state: &mut State<N>) -> Together {
        let carried = &mut self.common.carried;
        let Some(points) = &mut carried.points else {
            return Together::LeftToOthers;
        };
        let method = (&*self.model, &self.common.table, &self.common.control);
        let outcome = points.step(method, &mut carried.memory, (t, h), state);
        match outcome {
            Together::Arrived if carried.ends_only => carried.skipped = true,
            Together::Arrived => {
                self.write_back();
                self.common.carried.skipped = false;
            }
            Together::LeftToOthers => {
                // An ordinary step continues from what is in its workspace.
                if carried.skipped && !self.write_back() {
                    self.common.carried.memory.last = None;
                }
                self.forget_points();
            }
            Together::Stalled(_) => {}
        }
        outcome
    }

    /// Makes the next step with all points at once start without continuing the last one.
    fn forget_points(&mut self) {
        if let Some(points) = &mut self.common.carried.points {
            points.forget();
        }
    }

    /// Copies rates and forces of the last step to where an ordinary step expects them; false if there is no last step.
    pub(super) fn write_back(&mut self) -> bool {
        if !Self::MAY_HAVE_POINTS {
            return false;
        }
        self.common.make_room();
        let points = self.common.carried.points.as_mut();
        points.is_some_and(|points| {
            points.write_back::<M>(&self.common.table, &mut self.common.carried.numbers)
        })
    }

    /// The increment of a state by an ordinary step, with its rounding error.
    fn increment(&self, h: f64, start: &State<N>) -> Result<State<N>, StepError> {
        let mut memory = Memory::new();
        let mut end = *start;
        let carried = &self.common.carried;
        let (mut numbers, mut pivots) = (carried.numbers.clone(), carried.pivots.clone());
        self.ordinary(&mut memory, (&mut numbers, &mut pivots), (0.0, h), &mut end)?;
        for a in 0..N {
            end.p[a] = (end.p[a] - start.p[a]) + memory.low.p[a];
            end.q[a] = (end.q[a] - start.q[a]) + memory.low.q[a];
        }
        Ok(end)
    }

    /// A step of a linear model, whose equations have a single root.
    pub(super) fn ordinary(
        &self,
        memory: &mut Memory<N>,
        (numbers, pivots): (&mut [f64], &mut [usize]),
        (start, length): (f64, f64),
        state: &mut State<N>,
    ) -> Result<(), StepError> {
        let method = Method {
            model: &*self.model,
            tables: &self.common.table,
            control: Control {
                solve: Solve::Trusting,
                ..self.common.control
            },
        };
        let interval = Interval {
            start,
            length,
            impulses: &[],
        };
        method.advance(memory, Workspace { numbers, pivots }, interval, state)
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
        let given = &mut self.common.carried.impulses;
        given.clear();
        given.extend_from_slice(impulses);
        self.common.is_of_points = false;
        if Self::MAY_BE_PROPAGATED
            && self.is_propagated()
            && impulses.is_empty()
            && self.propagate(t, h, state)
        {
            return Ok(());
        }
        if Self::MAY_HAVE_POINTS && impulses.is_empty() && h.is_finite() && h != 0.0 {
            match self.together(t, h, state) {
                Together::Arrived => {
                    self.common.is_of_points = true;
                    return Ok(());
                }
                Together::Stalled(error) => return Err(error),
                Together::LeftToOthers => {}
            }
        }
        if Self::MAY_HAVE_POINTS && !impulses.is_empty() {
            // It continues from the workspace, which a step with all points at once has not filled.
            self.look_inside();
        }
        self.common.carried.skipped = false;
        self.common.make_room();
        let interval = Interval {
            start: t,
            length: h,
            impulses,
        };
        let carried = &mut self.common.carried;
        let workspace = Workspace {
            numbers: &mut carried.numbers,
            pivots: &mut carried.pivots,
        };
        let method = Method {
            model: &*self.model,
            tables: &self.common.table,
            control: self.common.control,
        };
        method.advance(&mut carried.memory, workspace, interval, state)
    }

    fn passed(&mut self, t: f64, h: f64, kicks: Vec<Impulse<N>>) {
        self.look_inside();
        let dense = self.dense_of_last(None, t, t + h);
        self.common.keep_piece(dense, kicks);
    }
}

impl<M, const N: usize> AnyStepper<N> for Stepper<'_, M, N>
where
    M: Model<N>,
{
    fn common(&mut self) -> &mut Common<N> {
        &mut self.common
    }

    fn dimensions(&self) -> Of<'static> {
        Of::model::<M, N>()
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

    fn at(&self, inside: &DenseElement<N>, tau: f64) -> State<N> {
        inside.at(tau)
    }

    fn forget(&mut self) {
        self.common.carried.memory.last = None;
    }

    fn switches(&mut self, t: f64, state: &State<N>, values: &mut Vec<f64>) -> bool {
        switches(&*self.model, t, state, values)
    }

    fn points(&self) -> (usize, bool) {
        let scheme = self.common.table.view();
        // Constraints are evaluated at the ends of every element.
        let has_ends = scheme.has_ends() || self.common.has_constraint_kinks;
        (scheme.points(), has_ends)
    }

    fn crossed(&mut self, switch: usize) {
        self.common.carried.memory.statistics.kinks += 1;
        self.common.last_piece_ends(Ends::Root(switch));
    }

    fn stepped_over(&mut self) {
        self.common.last_piece_ends(Ends::Behind);
    }

    fn has_constraint_kinks(&self) -> bool {
        self.common.has_constraint_kinks
    }

    fn ahead(&self, inside: &DenseElement<N>, part: f64, end: &State<N>) -> State<N> {
        let (here, there) = (inside.at(1.0), inside.at(1.0 + part));
        State {
            q: core::array::from_fn(|a| end.q[a] + (there.q[a] - here.q[a])),
            p: core::array::from_fn(|a| end.p[a] + (there.p[a] - here.p[a])),
        }
    }

    fn begin_behind(&mut self, is_behind: bool) {
        self.common.carried.memory.is_behind_kink = is_behind;
    }

    fn cuts(&self) -> bool {
        self.common.solve.cuts()
    }

    fn trust(&mut self, all: bool) {
        self.common.control.solve = self.common.solve.trusting(all);
    }
}

impl<const N: usize> Instant for Impulse<N> {
    fn time(&self) -> f64 {
        self.time
    }
}
