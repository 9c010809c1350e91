//! Steps of families whose forces are the unknowns: M q̈ = f(q, q̇, t) with a constant diagonal M.

use super::inertia::Inertia;
#[cfg(feature = "sparse")]
use super::lanes::Scale;
#[cfg(feature = "sparse")]
use super::newton::Tangent;
use super::space::{Leg, Outcome, Problem, Space};
use super::{FamilyDense, FamilyError, FamilyModel, FamilyState};
use crate::error::StepError;
use crate::newton::{Control, Preference, Solve};
#[cfg(feature = "sparse")]
use crate::newton::{Monitor, SERVES, Verdict};
use crate::points::four::Four;
use crate::points::tables::Tables;
use crate::real::Lanes;
use crate::scheme::{SchemeTable, Tables as _};
use crate::statistics::{Contraction, Statistics};
use alloc::vec;

/// A stepper of this kind: a fixed-point iteration, and where that contracts badly Newton's method.
#[derive(Clone, Debug)]
pub(super) struct Forces<'m, M> {
    model: &'m M,
    table: SchemeTable,
    control: Control,
    problem: Problem,
    registers: Registers,
    pub(super) statistics: Statistics,
    preference: Preference,
    #[cfg(feature = "sparse")]
    tangent: Option<Tangent>,
    /// Time, length and ends of the last step.
    last: Option<(f64, f64)>,
    start: FamilyState,
    end: FamilyState,
    low: FamilyState,
    next_low: FamilyState,
}

/// The unknowns in the widest registers of the processor.
#[derive(Clone, Debug)]
enum Registers {
    #[cfg(all(feature = "simd", target_arch = "x86_64"))]
    Quads(Space<crate::quad::Quad>, pulp::x86::V3),
    Lanes(Space<Lanes<4>>),
}

impl<'m, M: FamilyModel> Forces<'m, M> {
    /// A stepper at rest; the model has been checked.
    ///
    /// # Errors
    /// [`FamilyError`]: a kinetic energy that is not ½ Σ m v², Newton's method without the feature for it.
    pub(super) fn new(
        model: &'m M,
        table: SchemeTable,
        control: Control,
    ) -> Result<Self, FamilyError> {
        if control.solve == Solve::Newton && !cfg!(feature = "sparse") {
            return Err(FamilyError::NoNewton);
        }
        let n = model.len();
        let problem = Problem {
            inertia: Inertia::of(model)?,
            tables: Tables::new(&table.view()),
            velocity: vec![0.0; n],
            velocity_low: vec![0.0; n],
        };
        let zero = FamilyState {
            q: vec![0.0; n],
            p: vec![0.0; n],
        };
        Ok(Self {
            model,
            registers: Registers::new::<M>(n, problem.tables.groups),
            table,
            control,
            problem,
            statistics: Statistics::NONE,
            preference: Preference::NONE,
            #[cfg(feature = "sparse")]
            tangent: None,
            last: None,
            start: zero.clone(),
            end: zero.clone(),
            low: zero.clone(),
            next_low: zero,
        })
    }

    /// As [`FamilyStepper::advance`](super::FamilyStepper::advance), for a state that is finite and as long as the model.
    pub(super) fn advance(
        &mut self,
        t: f64,
        h: f64,
        state: &mut FamilyState,
    ) -> Result<(), StepError> {
        let last = self.last.take().filter(|_| self.end == *state);
        match last {
            Some((_, length)) => self.problem.tables.set_ratio(&self.table, h / length),
            None => {
                self.low.q.fill(0.0);
                self.low.p.fill(0.0);
            }
        }
        self.start.q.copy_from_slice(&state.q);
        self.start.p.copy_from_slice(&state.p);
        self.solve(t, h, last.is_some())?;
        self.statistics.steps += 1;
        self.last = Some((t, h));
        core::mem::swap(&mut self.low, &mut self.next_low);
        state.q.copy_from_slice(&self.end.q);
        state.p.copy_from_slice(&self.end.p);
        Ok(())
    }

    /// The equations of one element: the fixed point while it contracts well, else Newton's method.
    fn solve(&mut self, t: f64, h: f64, is_warm: bool) -> Result<(), StepError> {
        let solve = self.control.solve;
        let yielding = cfg!(feature = "sparse") && solve == Solve::Auto;
        self.dispatch(t, h, Task::Prepare { is_warm });
        if solve != Solve::Newton && (!yielding || self.preference.is_fixed_point()) {
            let outcome = self.dispatch(t, h, Task::Iterate { yielding });
            let iterations = u64::from(outcome.iterations);
            self.statistics.iterations += iterations;
            self.statistics.fixed_point_iterations += iterations;
            self.statistics.contraction = Contraction::of(outcome.contraction);
            self.count_evaluations(iterations);
            if outcome.converged && self.dispatch(t, h, Task::End).converged {
                self.preference.confirm_fixed_point();
                return Ok(());
            }
            if !yielding {
                return Err(self.stalled(&outcome, false));
            }
            self.preference.leave_fixed_point();
            self.statistics.fallbacks += 1;
            self.dispatch(t, h, Task::Prepare { is_warm: false });
        } else {
            self.preference.count_newton();
        }
        self.newton(t, h)
    }

    #[cfg(not(feature = "sparse"))]
    fn newton(&mut self, _: f64, _: f64) -> Result<(), StepError> {
        // Refused when the stepper is made.
        Err(StepError::NonFinite)
    }

    /// Newton's method; the factors are kept while they serve, also from step to step.
    #[cfg(feature = "sparse")]
    fn newton(&mut self, t: f64, h: f64) -> Result<(), StepError> {
        let mut tangent = match self.tangent.take() {
            Some(tangent) => tangent,
            None => Tangent::new(self.model, self.table.view().points())
                .ok_or(StepError::SingularTangent { unknown: 0 })?,
        };
        let outcome = self.newton_with(&mut tangent, t, h);
        self.tangent = Some(tangent);
        let outcome = outcome?;
        if outcome.converged && self.dispatch(t, h, Task::End).converged {
            return Ok(());
        }
        Err(self.stalled(&outcome, true))
    }

    #[cfg(feature = "sparse")]
    fn newton_with(&mut self, tangent: &mut Tangent, t: f64, h: f64) -> Result<Outcome, StepError> {
        let mut monitor = Monitor::new(self.control.tolerance);
        let known = tangent.serves(h);
        let mut fresh = !known;
        let mut outcome = Outcome {
            converged: false,
            iterations: 0,
            residual: f64::INFINITY,
            contraction: 1.0,
        };
        while outcome.iterations < self.control.max_iterations {
            if fresh {
                let (q, z) = (&mut tangent.q[..], &mut tangent.z[..]);
                self.dispatch(t, h, Task::Positions { q, z });
                let scheme = self.table.view();
                self.statistics.tangent_evaluations += scheme.points() as u64;
                tangent.factor(self.model, &scheme, &self.problem, t, h)?;
                self.statistics.factorizations += 1;
            }
            let rest = &mut tangent.rest[..];
            self.dispatch(t, h, Task::Rest { rest });
            self.count_evaluations(1);
            tangent.solve();
            let leg = Leg {
                t,
                h,
                start: &self.start,
                low: &self.low,
            };
            let (changed, size) = self.registers.correct(&self.problem, &tangent.rest);
            let increment = Scale::of(&self.problem, &leg).increment(changed, size);
            outcome.iterations += 1;
            self.statistics.iterations += 1;
            self.statistics.newton_iterations += 1;
            let verdict = monitor.judge(increment);
            outcome.residual = monitor.last();
            outcome.contraction = monitor.rate();
            match verdict {
                Ok(Verdict::Converged) => outcome.converged = true,
                Ok(Verdict::GoOn) => outcome.converged = monitor.is_noise(fresh),
                Err(error) => {
                    tangent.forget();
                    return Err(error);
                }
            }
            if outcome.converged {
                return Ok(outcome);
            }
            // The first increment alone tells no rate: an old matrix may show a second one.
            let untried = known && outcome.iterations == 1;
            fresh = !untried && monitor.rate() > SERVES;
        }
        tangent.forget();
        Ok(outcome)
    }

    fn count_evaluations(&mut self, iterations: u64) {
        let points = self.table.view().points() as u64;
        self.statistics.residual_evaluations += iterations * points;
    }

    fn stalled(&self, outcome: &Outcome, newton: bool) -> StepError {
        let (iterations, residual) = (outcome.iterations, outcome.residual);
        let tolerance = self.control.tolerance;
        match (residual.is_finite() && !outcome.converged, newton) {
            (false, _) => StepError::NonFinite,
            (true, true) => StepError::NewtonStalled {
                iterations,
                residual,
                tolerance,
            },
            (true, false) => StepError::FixedPointStalled {
                iterations,
                residual,
                tolerance,
            },
        }
    }

    fn dispatch(&mut self, t: f64, h: f64, task: Task<'_>) -> Outcome {
        let leg = Leg {
            t,
            h,
            start: &self.start,
            low: &self.low,
        };
        let job = Job {
            model: self.model,
            problem: &mut self.problem,
            control: &self.control,
            leg,
            end: (&mut self.end, &mut self.next_low),
            task,
        };
        match &mut self.registers {
            #[cfg(all(feature = "simd", target_arch = "x86_64"))]
            Registers::Quads(space, isa) => isa.vectorize(InRegisters { space, job }),
            Registers::Lanes(space) => job.run(space),
        }
    }

    /// The polynomial of the last step.
    pub(super) fn dense(&self, start: f64, end: f64) -> FamilyDense {
        let Some((_, h)) = self.last else {
            return FamilyDense::constant((start, end), self.start.clone());
        };
        let scheme = self.table.view();
        let points = scheme.points();
        let force = |point: usize, a: usize| self.registers.force_at(point, a);
        let rate = |point: usize, a: usize| {
            let integral: f64 = (0..points)
                .map(|j| scheme.position[point * points + j] * force(j, a))
                .sum();
            self.problem.velocity[a] + h * self.problem.inertia.inverse[a] * integral
        };
        let ends = (self.start.clone(), self.end.clone());
        FamilyDense::of(&scheme, (start, end), h, ends, &rate, &force)
    }
}

impl Registers {
    fn new<M: FamilyModel>(n: usize, groups: usize) -> Self {
        #[cfg(all(feature = "simd", target_arch = "x86_64"))]
        if let Some(isa) = pulp::x86::V3::try_new() {
            let like = crate::quad::Quad::of(isa, [0.0; 4]);
            return Self::Quads(Space::new::<M>(like, n, groups), isa);
        }
        Self::Lanes(Space::new::<M>(Lanes([0.0; 4]), n, groups))
    }

    #[cfg(feature = "sparse")]
    fn correct(&mut self, problem: &Problem, steps: &[f64]) -> (f64, f64) {
        match self {
            #[cfg(all(feature = "simd", target_arch = "x86_64"))]
            Self::Quads(space, _) => space.correct(problem, steps),
            Self::Lanes(space) => space.correct(problem, steps),
        }
    }

    fn force_at(&self, point: usize, a: usize) -> f64 {
        match self {
            #[cfg(all(feature = "simd", target_arch = "x86_64"))]
            Self::Quads(space, _) => space.force_at(point, a),
            Self::Lanes(space) => space.force_at(point, a),
        }
    }
}

/// A part of a step.
#[cfg_attr(
    not(feature = "sparse"),
    expect(dead_code, reason = "Newton's method alone asks for some")
)]
enum Task<'a> {
    /// Forces to begin with.
    Prepare { is_warm: bool },
    /// The fixed-point iteration.
    Iterate { yielding: bool },
    /// What is left of the equations.
    Rest { rest: &'a mut [f64] },
    /// Where the points are.
    Positions { q: &'a mut [f64], z: &'a mut [f64] },
    /// The end of the element.
    End,
}

/// A part of a step, with what it needs.
struct Job<'a, M> {
    model: &'a M,
    problem: &'a mut Problem,
    control: &'a Control,
    leg: Leg<'a>,
    end: (&'a mut FamilyState, &'a mut FamilyState),
    task: Task<'a>,
}

impl<M: FamilyModel> Job<'_, M> {
    #[inline(always)]
    fn run<V: Four>(self, space: &mut Space<V>) -> Outcome {
        let Self {
            model,
            problem,
            control,
            leg,
            ..
        } = self;
        let mut outcome = Outcome {
            converged: true,
            iterations: 0,
            residual: 0.0,
            contraction: 0.0,
        };
        match self.task {
            Task::Prepare { is_warm } => space.prepare(model, problem, leg, is_warm),
            Task::Iterate { yielding } => {
                outcome = space.iterate(model, problem, control, leg, yielding);
            }
            Task::Rest { rest } => space.rest(model, problem, leg, rest),
            Task::Positions { q, z } => space.positions::<M>(problem, leg, q, z),
            Task::End => outcome.converged = space.end(problem, leg, self.end.0, self.end.1),
        }
        outcome
    }
}

/// The same in code for one instruction set.
#[cfg(all(feature = "simd", target_arch = "x86_64"))]
struct InRegisters<'a, M> {
    space: &'a mut Space<crate::quad::Quad>,
    job: Job<'a, M>,
}

#[cfg(all(feature = "simd", target_arch = "x86_64"))]
impl<M: FamilyModel> pulp::NullaryFnOnce for InRegisters<'_, M> {
    type Output = Outcome;
    #[inline(always)]
    fn call(self) -> Outcome {
        self.job.run(self.space)
    }
}
