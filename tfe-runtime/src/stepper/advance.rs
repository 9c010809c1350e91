//! Steps of a stepper: ordinary ones, in halves, in arcs between kinks, by the matrix of a linear model.

use super::piece::Piece;
use super::setup::Stepper;
use crate::cut::{Halving, Instant, in_halves, may_be_cut};
use crate::dense::DenseElement;
use crate::error::StepError;
use crate::kinks::{Kinked, in_arcs, switches};
use crate::method::{Impulse, Interval, Last, Memory, Method};
use crate::model::{Model, State};
use crate::newton::{Control, Solve};
use crate::points::Together;
use crate::propagator::Propagator;
use crate::scheme::Tables;
use crate::workspace::Workspace;
use alloc::vec::Vec;

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
    /// [`StepError`]; `state` is unchanged then.
    pub fn advance(
        &mut self,
        t: f64,
        h: f64,
        state: &mut State<N>,
        impulses: &[Impulse<N>],
    ) -> Result<(), StepError> {
        self.carried.pieces.clear();
        if Self::MAY_HAVE_KINKS && self.at_kinks && self.has_kinks(t, state) {
            return self.advance_in_arcs(t, h, state, impulses);
        }
        if Self::HAS_CONSTRAINTS {
            return self.advance_constrained(t, h, state, impulses);
        }
        self.advance_plainly(t, h, state, impulses)
    }

    /// A step without a search for kinks.
    pub(super) fn advance_plainly(
        &mut self,
        t: f64,
        h: f64,
        state: &mut State<N>,
        impulses: &[Impulse<N>],
    ) -> Result<(), StepError> {
        let Err(error) = self.whole(t, h, state, impulses) else {
            return Ok(());
        };
        if !may_be_cut(&error, M::FACTS.linear, self.control.solve) {
            // The workspace may not hold the previous step.
            self.carried.memory.last = None;
            return Err(error);
        }
        let (start, low, steps) = (
            *state,
            self.carried.memory.low,
            self.carried.memory.statistics.steps,
        );
        let arrived = in_halves(self, (t, h), state, impulses, 1);
        self.carried.memory.statistics.steps = steps;
        if !arrived {
            (*state, self.carried.memory.low, self.carried.memory.last) = (start, low, None);
            self.carried.pieces.clear();
            return Err(error);
        }
        self.carried.memory.statistics.steps += 1;
        self.carried.memory.statistics.cuts += 1;
        Ok(())
    }

    /// Whether kernels have branches that depend on a sign; if they have none, this is not evaluated again. At a start
    /// without velocity the answer is unknown: the step reports the reason.
    fn has_kinks(&mut self, t: f64, state: &State<N>) -> bool {
        let mut switches = Vec::new();
        if !self.switches(t, state, &mut switches) {
            return false;
        }
        self.at_kinks = !switches.is_empty();
        // Dense output is needed for every step.
        self.carried.ends_only &= !self.at_kinks;
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
        let (start, low, steps) = (
            *state,
            self.carried.memory.low,
            self.carried.memory.statistics.steps,
        );
        let outcome = in_arcs(self, (t, h), state, impulses);
        self.trust(false);
        self.carried.memory.statistics.steps = steps + u64::from(outcome.is_ok());
        if outcome.is_err() {
            (*state, self.carried.memory.low, self.carried.memory.last) = (start, low, None);
            self.carried.pieces.clear();
        }
        outcome
    }

    /// Whether a propagator is to be used.
    fn is_propagated(&self) -> bool {
        self.carried.ends_only && !matches!(self.control.solve, Solve::FixedPoint)
    }

    /// Moves `state` by the propagator of a linear model; false where an ordinary step is to be made.
    ///
    /// The propagator costs 2N + 1 steps: it is made after as many of the same length.
    fn propagate(&mut self, t: f64, h: f64, state: &mut State<N>) -> bool {
        self.carried.alike = if self.carried.alike.0 == h {
            (h, self.carried.alike.1.saturating_add(1))
        } else {
            (h, 1)
        };
        if self.carried.alike.1 <= 2 * N + 1 {
            return false;
        }
        if !self
            .carried
            .propagator
            .as_ref()
            .is_some_and(|one| one.is_of(h))
        {
            let Ok(made) = Propagator::of(h, |start| self.increment(h, start)) else {
                return false;
            };
            self.carried.propagator = Some(made);
        }
        let Some(propagator) = &self.carried.propagator else {
            return false;
        };
        let start = *state;
        let mut low = match &self.carried.memory.last {
            Some(last) if last.end.is_same(&start) => self.carried.memory.low,
            _ => State::ZERO,
        };
        let start_low = low;
        if !propagator.advance(state, &mut low) {
            // The ordinary step reports the reason.
            return false;
        }
        self.carried.memory.last = Some(Last {
            t,
            h,
            start,
            start_low,
            end: *state,
        });
        self.carried.memory.low = low;
        self.carried.memory.statistics.steps += 1;
        self.carried.memory.statistics.products += 1;
        self.carried.skipped = true;
        true
    }

    /// Moves `state` by the iteration with all points of the element at once.
    fn together(&mut self, t: f64, h: f64, state: &mut State<N>) -> Together {
        let Some(points) = &mut self.carried.points else {
            return Together::LeftToOthers;
        };
        let method = (&*self.model, &self.table, &self.control);
        let outcome = points.step(method, &mut self.carried.memory, (t, h), state);
        match outcome {
            Together::Arrived if self.carried.ends_only => self.carried.skipped = true,
            Together::Arrived => {
                self.write_back();
                self.carried.skipped = false;
            }
            Together::LeftToOthers => {
                // An ordinary step continues from what is in its workspace.
                if self.carried.skipped && !self.write_back() {
                    self.carried.memory.last = None;
                }
                self.forget_points();
            }
            Together::Stalled(_) => {}
        }
        outcome
    }

    /// Makes the next step with all points at once start without continuing the last one.
    fn forget_points(&mut self) {
        if let Some(points) = &mut self.carried.points {
            points.forget();
        }
    }

    /// Copies rates and forces of the last step to where an ordinary step expects them; false if there is no last step.
    pub(super) fn write_back(&mut self) -> bool {
        if !Self::MAY_HAVE_POINTS {
            return false;
        }
        self.make_room();
        let points = self.carried.points.as_mut();
        points.is_some_and(|points| points.write_back::<M>(&self.table, &mut self.carried.numbers))
    }

    /// The increment of a state by an ordinary step, with its rounding error.
    fn increment(&self, h: f64, start: &State<N>) -> Result<State<N>, StepError> {
        let mut memory = Memory::new();
        let mut end = *start;
        let (mut numbers, mut pivots) = (self.carried.numbers.clone(), self.carried.pivots.clone());
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
        self.carried.impulses.clear();
        self.carried.impulses.extend_from_slice(impulses);
        self.is_of_points = false;
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
                    self.is_of_points = true;
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
        self.carried.skipped = false;
        self.make_room();
        let interval = Interval {
            start: t,
            length: h,
            impulses,
        };
        let workspace = Workspace {
            numbers: &mut self.carried.numbers,
            pivots: &mut self.carried.pivots,
        };
        let method = Method {
            model: &*self.model,
            tables: &self.table,
            control: self.control,
        };
        method.advance(&mut self.carried.memory, workspace, interval, state)
    }

    fn passed(&mut self, t: f64, h: f64, kicks: Vec<Impulse<N>>) {
        self.look_inside();
        debug_assert!(
            !self.carried.skipped,
            "steps of linear models have no pieces"
        );
        let dense = self.dense_of_last(None, t, t + h);
        if let Some(last) = self.carried.memory.last {
            self.carried.pieces.push(Piece {
                last,
                impulses: kicks,
                dense,
                independence: self.carried.memory.independence,
                numbers: self.carried.numbers.clone(),
                pivots: self.carried.pivots.clone(),
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
        self.carried.memory.last = None;
    }

    fn switches(&mut self, t: f64, state: &State<N>, values: &mut Vec<f64>) -> bool {
        switches(&*self.model, t, state, values)
    }

    fn points(&self) -> (usize, bool) {
        let scheme = self.table.view();
        (scheme.points(), scheme.has_ends())
    }

    fn crossed(&mut self) {
        self.carried.memory.statistics.kinks += 1;
    }

    fn cuts(&self) -> bool {
        self.solve.cuts()
    }

    fn trust(&mut self, all: bool) {
        self.control.solve = self.solve.trusting(all);
    }
}

impl<const N: usize> Instant for Impulse<N> {
    fn time(&self) -> f64 {
        self.time
    }
}
