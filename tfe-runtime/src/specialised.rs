//! The engine of emitted solvers: a stepper for one element and one step length, with all memory inside the struct.

use crate::cut::{Halving, in_halves, may_be_cut};
use crate::element::Element;
use crate::error::StepError;
use crate::method::{Interval, Memory, Method};
use crate::model::{Model, State};
use crate::newton::{Control, Solve, Standard};
use crate::points::forms::{are_possible, is_projected, is_second_order};
use crate::points::tables::Tables;
use crate::points::{Points, Together};
use crate::registers::storage::Storage;
use crate::scheme::Scheme;
use crate::statistics::Statistics;
use crate::workspace::Workspace;
use core::convert::Infallible;

/// Whether the program may be large, which is assumed if it has an allocator. Otherwise steps evaluate one point after
/// the other (evaluating all at once is 1.3 to 3.4 times as fast even without wide registers, but takes 12 kilobytes
/// more for a pendulum) and are not cut (which would take 8 kilobytes).
const IS_LARGE: bool = cfg!(feature = "alloc");

/// With at most this many registers of unknowns, the memory of a step is made anew in each step; larger memory is kept,
/// as it does not fit into registers anyway.
const MAX_IN_REGISTERS: usize = 8;

/// The sizes of [`Inline`](crate::registers::storage::Inline) for a model and an element; zeros where steps evaluate
/// one point after the other.
#[must_use]
pub const fn sizes<M, const N: usize>(element: Element) -> [usize; 7]
where
    M: Model<N>,
{
    if !IS_LARGE || !are_possible::<M, N>(&element) {
        return [0; 7];
    }
    let (points, groups) = (element.points(), element.points().div_ceil(4));
    let first = if is_second_order::<M, N>() { 0 } else { groups };
    let (varying, square) = if M::FACTS.constant_mass {
        (0, N)
    } else {
        (groups, 0)
    };
    // Matrices for several registers of points are in memory in any case.
    let is_much = N * groups > MAX_IN_REGISTERS || !M::FACTS.constant_mass && groups > 1;
    let kept = if is_much { 1 } else { 0 };
    let projected = if is_projected::<M, N>(&element) { 1 } else { 0 };
    [points, groups, first, varying, square, kept, projected]
}

/// Steps of one length, with all memory inside the struct.
#[derive(Clone, Debug)]
pub struct Specialised<const N: usize, S: Storage, const NUMBERS: usize, const PIVOTS: usize> {
    start: f64,
    step: f64,
    /// The number of steps so far, from which the time is computed in each step.
    steps: f64,
    memory: Memory<N>,
    /// Evaluates all points at once, where model and element allow it.
    points: Option<Points<N, S>>,
    numbers: [f64; NUMBERS],
    pivots: [usize; PIVOTS],
}

impl<const N: usize, S: Storage, const NUMBERS: usize, const PIVOTS: usize>
    Specialised<N, S, NUMBERS, PIVOTS>
{
    /// A solver at time zero that has made no step.
    #[must_use]
    pub fn new<M>(model: &M, tables: S::Fixed, step: f64) -> Self
    where
        M: Model<N>,
    {
        Self {
            start: 0.0,
            step,
            steps: 0.0,
            memory: Memory::new(),
            points: if const { S::GROUPS > 0 }
                && step.is_finite()
                && step != 0.0
                && model.check().is_ok()
            {
                Points::new(model, Tables::new(tables))
            } else {
                None
            },
            numbers: [0.0; NUMBERS],
            pivots: [0; PIVOTS],
        }
    }

    /// The time at which the next step starts.
    #[must_use]
    pub fn time(&self) -> f64 {
        self.start + self.steps * self.step
    }

    /// Makes the next step start at `time`.
    pub fn set_time(&mut self, time: f64) {
        (self.start, self.steps) = (time, 0.0);
    }

    /// The step length.
    #[must_use]
    pub fn step(&self) -> f64 {
        self.step
    }

    /// The cost of all steps so far.
    #[must_use]
    pub fn statistics(&self) -> &Statistics {
        self.memory.statistics()
    }

    /// Moves `state` over one element, in pieces where the whole step fails (only in programs with an allocator,
    /// although it is not used).
    ///
    /// # Errors
    /// [`StepError`]; `state` is unchanged then. For a model that does not pass its [check](Model::check) that is
    /// [`StepError::Inconsistent`].
    #[inline]
    pub fn advance<M, const P: usize, const U: usize>(
        &mut self,
        model: &M,
        scheme: &Scheme<P, U>,
        state: &mut State<N>,
    ) -> Result<(), StepError>
    where
        M: Model<N>,
    {
        // Nothing at all for models whose fields cannot be wrong. A solver is made without an error to tell.
        if model.check().is_err() {
            return Err(StepError::Inconsistent);
        }
        let place = (self.time(), self.step);
        match self.together((model, scheme), place, state) {
            Together::Arrived => {}
            other => self.otherwise((model, scheme), place, state, other)?,
        }
        self.steps += 1.0;
        Ok(())
    }

    /// A step with all points at once, where that is possible.
    #[inline(always)]
    fn together<M, const P: usize, const U: usize>(
        &mut self,
        (model, scheme): (&M, &Scheme<P, U>),
        place: (f64, f64),
        state: &mut State<N>,
    ) -> Together
    where
        M: Model<N>,
    {
        match &mut self.points {
            Some(points) if const { S::GROUPS > 0 } => {
                points.step((model, scheme, &Standard), &mut self.memory, place, state)
            }
            _ => Together::LeftToOthers,
        }
    }

    /// The rest of a step that could not be made with all points at once. Not inlined: it is long and rarely needed.
    #[cfg_attr(feature = "alloc", inline(never))]
    fn otherwise<M, const P: usize, const U: usize>(
        &mut self,
        (model, scheme): (&M, &Scheme<P, U>),
        (t, h): (f64, f64),
        state: &mut State<N>,
        together: Together,
    ) -> Result<(), StepError>
    where
        M: Model<N>,
    {
        let mut run = Run {
            engine: self,
            model,
            scheme,
        };
        match run.continued(together, (t, h), state) {
            Err(error) if IS_LARGE && may_be_cut(&error, M::FACTS.linear, Solve::Auto) => {
                run.in_pieces((t, h), state, error)
            }
            outcome => outcome,
        }
    }
}

/// A step, with the model and the tables that the engine does not own.
struct Run<'a, M, E, const P: usize, const U: usize> {
    engine: &'a mut E,
    model: &'a M,
    scheme: &'a Scheme<P, U>,
}

impl<
    M: Model<N>,
    const P: usize,
    const U: usize,
    const N: usize,
    S: Storage,
    const NUMBERS: usize,
    const PIVOTS: usize,
> Halving for Run<'_, M, Specialised<N, S, NUMBERS, PIVOTS>, P, U>
{
    type State = State<N>;
    type Kick = Infallible;
    type Kicks = [Infallible; 0];

    #[inline]
    fn whole(
        &mut self,
        t: f64,
        h: f64,
        state: &mut State<N>,
        _: &[Infallible],
    ) -> Result<(), StepError> {
        let method = (self.model, self.scheme);
        let together = self.engine.together(method, (t, h), state);
        self.continued(together, (t, h), state)
    }

    /// Dense output is not available here.
    fn passed(&mut self, _: f64, _: f64, _: [Infallible; 0]) {}
}

impl<
    M: Model<N>,
    const P: usize,
    const U: usize,
    const N: usize,
    S: Storage,
    const NUMBERS: usize,
    const PIVOTS: usize,
> Run<'_, M, Specialised<N, S, NUMBERS, PIVOTS>, P, U>
{
    /// Continues a step that has been tried with all points at once.
    #[inline]
    fn continued(
        &mut self,
        together: Together,
        place: (f64, f64),
        state: &mut State<N>,
    ) -> Result<(), StepError> {
        match together {
            Together::Arrived => return Ok(()),
            Together::Stalled(error) => return Err(error),
            Together::LeftToOthers => {}
        }
        if const { S::GROUPS > 0 }
            && let Some(points) = &mut self.engine.points
        {
            // An ordinary step continues from what is in its workspace.
            points.write_back::<M>(self.scheme, &mut self.engine.numbers);
            points.forget();
        }
        self.ordinary(place, state)
    }

    /// Evaluates one point after the other. Not inlined: it is called from two places.
    #[cfg_attr(feature = "alloc", inline(never))]
    fn ordinary(&mut self, place: (f64, f64), state: &mut State<N>) -> Result<(), StepError> {
        let engine = &mut *self.engine;
        let workspace = Workspace {
            numbers: &mut engine.numbers,
            pivots: &mut engine.pivots,
        };
        let interval = Interval {
            start: place.0,
            length: place.1,
            impulses: &[],
        };
        let method = Method {
            model: self.model,
            tables: self.scheme,
            control: Control::default(),
        };
        method.advance(&mut engine.memory, workspace, interval, state)
    }

    #[cold]
    fn in_pieces(
        &mut self,
        place: (f64, f64),
        state: &mut State<N>,
        error: StepError,
    ) -> Result<(), StepError> {
        let memory = &self.engine.memory;
        let (start, low, steps) = (*state, memory.low, memory.statistics.steps);
        let arrived = in_halves(self, place, state, &[], 1);
        let memory = &mut self.engine.memory;
        memory.statistics.steps = steps;
        if !arrived {
            (*state, memory.low, memory.last) = (start, low, None);
            return Err(error);
        }
        memory.statistics.steps += 1;
        memory.statistics.cuts += 1;
        Ok(())
    }
}
