//! One step of one trajectory with all points at once: initial guess, iteration, end.

use super::evaluation::{Evaluation, FEW, Placed};
use super::forms::{acting, is_phase, is_second_order};
use super::size::{is_finite, largest};
use super::{Outcome, Points, StepInput, Together, Work};
use crate::error::StepError;
use crate::method::{Last, Memory};
use crate::model::{Model, State};
use crate::newton::{Asked, Control, Monitor, PATIENCE, Solve, Verdict};
use crate::registers::storage::{Keep, List, Storage};
use crate::scheme;
use crate::statistics::Contraction;

impl<const N: usize, S: Storage> Points<N, S> {
    /// A step, with the memory of the stepper.
    #[inline]
    pub(crate) fn step<M>(
        &mut self,
        (model, tables, asked): (&M, &impl scheme::Tables, &impl Asked),
        memory: &mut Memory<N>,
        place: (f64, f64),
        state: &mut State<N>,
    ) -> Together
    where
        M: Model<N>,
    {
        let job = Job {
            points: self,
            model,
            tables,
            asked,
            memory,
            place,
            state,
        };
        job.run()
    }
}

/// A step to be made.
struct Job<'a, M, T, A, S: Storage, const N: usize> {
    pub(super) points: &'a mut Points<N, S>,
    pub(super) model: &'a M,
    pub(super) tables: &'a T,
    pub(super) asked: &'a A,
    pub(super) memory: &'a mut Memory<N>,
    /// Time and length.
    pub(super) place: (f64, f64),
    pub(super) state: &'a mut State<N>,
}

impl<M, T, A, S: Storage, const N: usize> Job<'_, M, T, A, S, N>
where
    M: Model<N>,
    T: scheme::Tables,
    A: Asked,
{
    /// Runs the step in registers of the processor, as one function.
    #[inline(always)]
    pub(super) fn run(self) -> Together {
        #[cfg(all(feature = "simd", target_arch = "x86_64"))]
        if let Some(isa) = self.points.isa {
            return isa.vectorize(InRegisters { job: self, isa });
        }
        let (of, memory) = ((self.model, self.asked), self.memory);
        step_apart(self.points, of, self.tables, memory, self.place, self.state)
    }

    /// The whole step.
    #[inline(always)]
    fn step<V: Placed>(self, like: V) -> Together {
        let Self {
            points,
            model,
            tables,
            asked,
            memory,
            place: (t, h),
            state,
        } = self;
        let control = asked.control();
        let yielding = control.solve != Solve::FixedPoint;
        if yielding && !memory.preference.is_fixed_point() {
            points.forget();
            return Together::LeftToOthers;
        }
        match &memory.last {
            Some(last) if last.end.is_same(state) => {}
            _ => {
                points.forget();
                memory.low = State::ZERO;
            }
        }
        if points.is_warm {
            points.tables.continue_with(tables, h, points.last_step);
        } else {
            points.start_cold(model, t, state);
        }
        let iteration = Iteration {
            points,
            model,
            control,
            place: (t, h),
            start: (state, &memory.low),
            yielding,
        };
        let outcome = iteration.run(like);
        let statistics = &mut memory.statistics;
        let iterations = u64::from(outcome.iterations);
        statistics.iterations += iterations;
        statistics.fixed_point_iterations += iterations;
        statistics.residual_evaluations += iterations * points.tables.points as u64;
        statistics.contraction = Contraction::of(outcome.contraction);
        if let Some(error) = outcome.failure {
            if yielding {
                memory.preference.leave_fixed_point();
                memory.statistics.fallbacks += 1;
                return Together::LeftToOthers;
            }
            memory.last = None;
            return Together::Stalled(error);
        }
        let (end, end_low) = outcome.end;
        (points.is_warm, points.last_step) = (true, h);
        // In place: with many coordinates, copies take time.
        let last = memory.last.get_or_insert(Last::NONE);
        (last.t, last.h, last.end) = (t, h, end);
        if const { A::KEEPS_START } {
            (last.start, last.start_low) = (*state, memory.low);
        }
        (*state, memory.low) = (end, end_low);
        memory.preference.confirm_fixed_point();
        memory.statistics.steps += 1;
        memory.forget_factors();
        Together::Arrived
    }
}

/// A step without wide registers. Not inlined, because it has several callers; its arguments are passed one by one, so
/// that they need not be in memory.
#[inline(never)]
fn step_apart<M, T, A, S: Storage, const N: usize>(
    points: &mut Points<N, S>,
    (model, asked): (&M, &A),
    tables: &T,
    memory: &mut Memory<N>,
    place: (f64, f64),
    state: &mut State<N>,
) -> Together
where
    M: Model<N>,
    T: scheme::Tables,
    A: Asked,
{
    let job = Job {
        points,
        model,
        tables,
        asked,
        memory,
        place,
        state,
    };
    job.step(crate::Lanes([0.0; 4]))
}

/// The iteration of a step.
struct Iteration<'a, M, S: Storage, const N: usize> {
    points: &'a mut Points<N, S>,
    model: &'a M,
    control: Control,
    /// Time and length.
    place: (f64, f64),
    /// The start and its rounding error.
    start: (&'a State<N>, &'a State<N>),
    /// Whether Newton's method can take over.
    yielding: bool,
}

impl<M, S: Storage, const N: usize> Iteration<'_, M, S, N>
where
    M: Model<N>,
{
    /// From the start to the end of the step.
    #[inline(always)]
    fn run<V: Placed>(self, like: V) -> Outcome<N> {
        let Self {
            points,
            model,
            control,
            yielding,
            ..
        } = self;
        let mut local = None;
        let groups = points.tables.groups;
        let work = Work::<N, S>::of::<M>(&mut points.work, &mut local, groups);
        let acting = &const { acting::<M, N>() };
        if points.is_warm {
            if const { is_second_order::<M, N>() || is_phase::<M, N>() } {
                (points.tables.continued()).apply(like, acting, &points.forces, &mut work.forces);
            } else {
                // The first iteration uses them to compute the contributions of the low words of the tables.
                work.forces.copy_from_slice(&points.forces);
            }
            if const { !is_second_order::<M, N>() } {
                (points.tables.continued()).apply(like, &[true; N], &points.rates, &mut work.rates);
            }
        } else {
            work.forces.copy_from_slice(&points.forces);
            work.rates.copy_from_slice(&points.rates);
        }
        if const { is_second_order::<M, N>() } {
            points.inertia.set_step::<M, _>(like, self.place.1);
        }
        let mut input = StepInput {
            t: self.place.0,
            h: self.place.1,
            start: self.start.0,
            low: self.start.1,
            tables: &points.tables,
            inertia: &points.inertia,
            factors: if const { is_second_order::<M, N>() } {
                points.inertia.inverse_diagonal
            } else {
                [1.0; N]
            },
            force_factors: [1.0; N],
        };
        work.distance = largest(like, &input.start.q);
        if const { is_second_order::<M, N>() } {
            work.begin_second_order::<_, M>(like, &input);
            work.speed = largest(like, &work.velocity);
        } else {
            work.speed = largest(like, &input.start.p);
        }
        let is_rough = control.is_rough();
        let mut monitor = Monitor::of_fixed_point(control.tolerance);
        let most = if yielding {
            control.max_iterations.min(PATIENCE)
        } else {
            control.max_iterations
        };
        let (mut iterations, mut refresh, mut converged) = (0, true, false);
        // Whether the increments of small coordinates are compared with these.
        let mut settles = false;
        if const { is_second_order::<M, N>() } {
            work.integrate_twice::<_, M>(like, &input);
            if is_rough {
                work.accelerated().set_drift::<_, _, M>(like, &input);
            } else {
                work.accelerated().set_exact_drift::<_, _, M>(like, &input);
            }
        } else if !is_rough {
            work.rows().set_low::<_, _, M>(like, &input);
        }
        let mut new_place = None;
        let at = match points.places.kept() {
            Some(kept) if const { N > FEW } => like.place(kept),
            _ => new_place.insert(Evaluation::zero(like)),
        };
        loop {
            while iterations < most {
                // The conditions are constants, so that only one of the three iterations is compiled.
                let increment = if const { is_second_order::<M, N>() } {
                    work.sweep_second_order::<V, M>(like, model, &input, at)
                } else if const { is_phase::<M, N>() } {
                    work.sweep_phase::<V, M>(like, model, &input, at, (iterations == 0, refresh))
                } else {
                    work.sweep_velocity::<V, M>(like, model, &input, at, refresh)
                };
                iterations += 1;
                let verdict = if settles {
                    monitor.settle(increment.relative)
                } else {
                    monitor.judge(increment)
                };
                match verdict {
                    Ok(Verdict::Converged) => {
                        converged = true;
                        break;
                    }
                    Ok(Verdict::GoOn) => {}
                    Err(_) => break,
                }
                // The initial guess is accurate to a few digits, so that one evaluation of the mass matrices usually
                // suffices.
                refresh = monitor.rate() > 0.1;
                let may_be_hopeless = yielding && iterations > 2 && !settles;
                let is_hopeless = may_be_hopeless && monitor.is_hopeless(most - iterations + 1);
                if is_hopeless || monitor.is_stuck() {
                    break;
                }
                if const { is_second_order::<M, N>() } {
                    work.integrate_twice::<_, M>(like, &input);
                }
            }
            let of = &points.declarations;
            let may_settle = const { N > 1 } && of.are_several && !is_rough && !settles;
            if !(converged && may_settle && input.weigh::<M>(work, of)) {
                break;
            }
            (settles, converged) = (true, false);
            monitor.begin_to_settle();
            if const { is_second_order::<M, N>() } {
                work.integrate_twice::<_, M>(like, &input);
            }
        }
        converged |= monitor.is_at_round_off();
        // No closures here: they would be compiled for the instruction set of the crate and not for that of the caller.
        let evidence = monitor.evidence(yielding).check(control.solve);
        let (mut end, mut failure) = ((State::ZERO, State::ZERO), None);
        if converged && evidence.is_ok() {
            let place = (&mut end.0, &mut end.1);
            if const { is_second_order::<M, N>() } {
                if is_rough {
                    work.finish_second_order::<V, M, false>(like, &input, place);
                } else {
                    work.finish_second_order::<V, M, true>(like, &input, place);
                }
            } else if is_rough {
                work.finish::<V, false>(like, &input, place);
            } else {
                work.finish::<V, true>(like, &input, place);
            }
            if is_finite(like, &end.0) {
                // Until here the old forces are kept, because a failed step would have to start from them.
                points.forces.take(&mut work.forces);
                points.rates.take(&mut work.rates);
                points.velocity = work.velocity;
            } else {
                failure = Some(StepError::NonFinite);
            }
        } else {
            failure = Some(match evidence {
                Err(unproven) if converged => unproven,
                _ => {
                    // A copy, so that the monitor itself may stay in registers.
                    let last = monitor;
                    last.stalled(iterations, &control)
                }
            });
        }
        Outcome {
            end,
            failure,
            iterations,
            contraction: monitor.rate(),
        }
    }
}

#[cfg(all(feature = "simd", target_arch = "x86_64"))]
struct InRegisters<'a, M, T, A, S: Storage, const N: usize> {
    job: Job<'a, M, T, A, S, N>,
    isa: pulp::x86::V3,
}

#[cfg(all(feature = "simd", target_arch = "x86_64"))]
impl<M: Model<N>, T: scheme::Tables, A: Asked, S: Storage, const N: usize> pulp::NullaryFnOnce
    for InRegisters<'_, M, T, A, S, N>
{
    type Output = Together;
    #[inline(always)]
    fn call(self) -> Together {
        self.job
            .step(crate::registers::quad::Quad::of(self.isa, [0.0; 4]))
    }
}
