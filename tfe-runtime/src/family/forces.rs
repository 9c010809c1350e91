//! The stepper of models of run-time length whose forces are the unknowns: M q̈ = f(q, q̇, t) with a constant diagonal
//! M.

use super::dense::DenseElement;
use super::inertia::Inertia;
use super::model::{FamilyState, Model};
#[cfg(feature = "sparse")]
use super::newton::Tangent;
use super::registers::{Outcome, Registers};
#[cfg(feature = "sparse")]
use super::scale::Scale;
use super::settling::Settling;
#[cfg(feature = "sparse")]
use super::settling::in_velocity;
use super::space::{Kind, Problem, StepInput};
use crate::consistency::ModelError;
use crate::error::StepError;
#[cfg(feature = "sparse")]
use crate::evidence::Evidence;
use crate::newton::{Control, Preference, Solve};
#[cfg(feature = "sparse")]
use crate::newton::{Monitor, SERVES, Verdict};
use crate::points::tables::Tables;
use crate::scheme::{SchemeTable, Tables as _};
use crate::statistics::{Contraction, Statistics};
#[cfg(feature = "sparse")]
use crate::unlike::raise;
use alloc::vec;
use core::ops::Deref;

/// A fixed-point iteration and, where that contracts badly, Newton's method.
#[derive(Clone, Debug)]
pub(super) struct Forces<M> {
    model: M,
    table: SchemeTable,
    pub(super) control: Control,
    problem: Problem,
    registers: Registers,
    pub(super) statistics: Statistics,
    preference: Preference,
    settling: Settling,
    #[cfg(feature = "sparse")]
    tangent: Option<Tangent>,
    /// Time and length of the last step.
    last: Option<(f64, f64)>,
    start: FamilyState,
    end: FamilyState,
    low: FamilyState,
    next_low: FamilyState,
}

impl<M> Forces<M> {
    /// The same memory with the model held in another way, and all counts zero.
    pub(super) fn hand_over<H>(self, model: H) -> Forces<H> {
        Forces {
            model,
            table: self.table,
            control: self.control,
            problem: self.problem,
            registers: self.registers,
            statistics: Statistics::NONE,
            preference: self.preference,
            settling: self.settling,
            #[cfg(feature = "sparse")]
            tangent: self.tangent,
            last: self.last,
            start: self.start,
            end: self.end,
            low: self.low,
            next_low: self.next_low,
        }
    }
}

impl<M: Model, H: Deref<Target = M>> Forces<H> {
    /// A stepper that has made no step; the model has been checked.
    ///
    /// # Errors
    /// [`ModelError`] for a kinetic energy that is not ½ Σ m v², and for Newton's method without the feature for it.
    pub(super) fn new(model: H, table: SchemeTable, control: Control) -> Result<Self, ModelError> {
        if control.solve == Solve::Newton && !cfg!(feature = "sparse") {
            return Err(ModelError::NoNewton);
        }
        let n = model.len();
        let problem = Problem {
            inertia: Inertia::of(&*model)?,
            tables: Tables::of(&table.view()),
            velocity: vec![0.0; n],
            velocity_low: vec![0.0; n],
        };
        let zero = FamilyState {
            q: vec![0.0; n],
            p: vec![0.0; n],
        };
        Ok(Self {
            settling: Settling::of(&*model),
            model,
            registers: Registers::new(Kind::of::<M>(), n, problem.tables.groups),
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

    /// Makes the next step start without continuing the last one.
    pub(super) fn forget(&mut self) {
        self.last = None;
    }

    pub(super) fn table(&self) -> &SchemeTable {
        &self.table
    }

    /// Whether the last step ended at this state.
    pub(super) fn ends_in(&self, state: &FamilyState) -> bool {
        self.last.is_some() && self.end == *state
    }

    /// As [`Stepper::advance`](super::Stepper::advance), for a state that is finite and as long as the model;
    /// `continues` tells whether the last step ended there.
    pub(super) fn advance(
        &mut self,
        t: f64,
        h: f64,
        state: &mut FamilyState,
        continues: bool,
    ) -> Result<(), StepError> {
        let last = self.last.take().filter(|_| continues);
        match last {
            Some((_, length)) => {
                self.problem.tables.set_ratio(&self.table, h / length);
                core::mem::swap(&mut self.start, &mut self.end);
            }
            None => {
                self.low.q.fill(0.0);
                self.low.p.fill(0.0);
                self.start.q.copy_from_slice(&state.q);
                self.start.p.copy_from_slice(&state.p);
            }
        }
        self.solve(t, h, last.is_some())?;
        self.statistics.steps += 1;
        self.last = Some((t, h));
        core::mem::swap(&mut self.low, &mut self.next_low);
        state.q.copy_from_slice(&self.end.q);
        state.p.copy_from_slice(&self.end.p);
        Ok(())
    }

    /// Solves the equations of one element: by fixed-point iteration while it contracts well, else by Newton's method.
    fn solve(&mut self, t: f64, h: f64, is_warm: bool) -> Result<(), StepError> {
        let solve = self.control.solve;
        let yielding = cfg!(feature = "sparse") && solve != Solve::FixedPoint;
        self.prepare(t, h, is_warm);
        if solve != Solve::Newton && (!yielding || self.preference.is_fixed_point()) {
            let input = StepInput {
                t,
                h,
                start: &self.start,
                low: &self.low,
            };
            let outcome = self.registers.iterate(
                &*self.model,
                &self.problem,
                (&self.control, yielding),
                input,
                &mut self.settling,
            );
            let iterations = u64::from(outcome.iterations);
            self.statistics.iterations += iterations;
            self.statistics.fixed_point_iterations += iterations;
            self.statistics.contraction = Contraction::of(outcome.contraction);
            self.count_evaluations(iterations);
            if outcome.converged && self.end(t, h) {
                self.preference.confirm_fixed_point();
                return Ok(());
            }
            if !yielding {
                return Err(self.stalled(&outcome, false));
            }
            self.preference.leave_fixed_point();
            self.statistics.fallbacks += 1;
        } else {
            self.preference.count_newton();
            if is_warm && self.newton(t, h).is_ok() {
                return Ok(());
            }
        }
        // The extrapolated polynomial may be a worse initial guess than a cold start.
        self.prepare(t, h, false);
        #[cfg(feature = "sparse")]
        self.registers.release();
        self.newton(t, h)
    }

    fn prepare(&mut self, t: f64, h: f64, is_warm: bool) {
        let input = StepInput {
            t,
            h,
            start: &self.start,
            low: &self.low,
        };
        self.registers
            .prepare(&*self.model, &mut self.problem, input, is_warm);
    }

    #[cfg(not(feature = "sparse"))]
    fn newton(&mut self, _: f64, _: f64) -> Result<(), StepError> {
        // This is refused when the stepper is made.
        Err(StepError::NonFinite)
    }

    /// Simplified Newton iteration; the sparse factors are kept while they contract well enough, also from step to
    /// step.
    #[cfg(feature = "sparse")]
    fn newton(&mut self, t: f64, h: f64) -> Result<(), StepError> {
        let mut tangent = match self.tangent.take() {
            Some(tangent) => tangent,
            None => Tangent::new(&*self.model, self.table.view().points())
                .ok_or(StepError::SingularTangent { unknown: 0 })?,
        };
        let outcome = self.newton_with(&mut tangent, t, h);
        self.tangent = Some(tangent);
        let outcome = outcome?;
        if outcome.converged && self.end(t, h) {
            return Ok(());
        }
        Err(self.stalled(&outcome, true))
    }

    #[cfg(feature = "sparse")]
    fn newton_with(&mut self, tangent: &mut Tangent, t: f64, h: f64) -> Result<Outcome, StepError> {
        let mut monitor = Monitor::new(self.control.tolerance);
        let known = tangent.serves(h);
        let mut fresh = !known;
        let (mut evidence, mut own, mut settles) = (Evidence::of_newton(), false, false);
        let scheme = self.table.view();
        let points = scheme.points();
        let mut outcome = Outcome {
            converged: false,
            iterations: 0,
            residual: f64::INFINITY,
            contraction: 1.0,
        };
        let input = StepInput {
            t,
            h,
            start: &self.start,
            low: &self.low,
        };
        let scale = Scale::of(&self.problem, input);
        while outcome.iterations < self.control.max_iterations {
            if fresh {
                let (q, z) = (&mut tangent.q[..], &mut tangent.z[..]);
                self.registers.positions(&self.problem, input, q, z);
                self.statistics.tangent_evaluations += points as u64;
                tangent.factor(&*self.model, &scheme, &self.problem, t, h)?;
                self.statistics.factorizations += 1;
            }
            self.registers
                .rest(&*self.model, &self.problem, input, &mut tangent.rest);
            self.statistics.residual_evaluations += points as u64;
            tangent.solve();
            let sizes = self.registers.correct(&self.problem, &tangent.rest);
            let increment = scale.increment(sizes);
            outcome.iterations += 1;
            self.statistics.iterations += 1;
            self.statistics.newton_iterations += 1;
            own |= fresh;
            evidence.see(increment, own);
            let own_step = || self.own_step(h, &tangent.rest);
            let verdict = monitor.judge_each((increment, &self.control), &mut settles, own_step);
            outcome.residual = monitor.last();
            outcome.contraction = monitor.rate();
            match verdict {
                Ok(Verdict::Converged) => outcome.converged = true,
                Ok(Verdict::GoOn) => outcome.converged = !settles && monitor.is_noise(fresh),
                Err(error) => {
                    tangent.forget();
                    return Err(error);
                }
            }
            if outcome.converged {
                // Factors from a refused root are no evidence for a root that is found with them.
                let proof = evidence.check(self.control.solve);
                return proof.map(|()| outcome).inspect_err(|_| tangent.forget());
            }
            // The first increment alone gives no rate: old factors are allowed a second one.
            let untried = known && outcome.iterations == 1;
            fresh = !untried && monitor.rate() > SERVES;
            if monitor.is_stuck() {
                break;
            }
        }
        tangent.forget();
        Ok(outcome)
    }

    /// The size of an increment of the forces relative to each declaration of coordinates.
    #[cfg(feature = "sparse")]
    fn own_step(&self, h: f64, step: &[f64]) -> Option<f64> {
        let points = self.problem.tables.points;
        (self.settling.declarations).own_increment(0.0, |a| {
            let (mut force, mut change) = (0.0, 0.0);
            for l in 0..points {
                raise(&mut force, self.registers.force_at(l, a).abs());
                raise(&mut change, step[a * points + l].abs());
            }
            in_velocity(&self.problem, (h, a), (force, change))
        })
    }

    fn count_evaluations(&mut self, iterations: u64) {
        let points = self.table.view().points() as u64;
        self.statistics.residual_evaluations += iterations * points;
    }

    fn stalled(&self, outcome: &Outcome, newton: bool) -> StepError {
        let (iterations, residual) = (outcome.iterations, outcome.residual);
        let tolerance = self.control.tolerance;
        // Without an iteration there is no increment.
        let is_known = residual.is_finite() || iterations == 0;
        match (is_known && !outcome.converged, newton) {
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

    fn end(&mut self, t: f64, h: f64) -> bool {
        let input = StepInput {
            t,
            h,
            start: &self.start,
            low: &self.low,
        };
        self.registers
            .end(&self.problem, input, &mut self.end, &mut self.next_low)
    }

    /// The polynomial of the last step.
    pub(super) fn dense(&self, start: f64, end: f64) -> DenseElement {
        let Some((_, h)) = self.last else {
            return DenseElement::constant((start, end), self.start.clone());
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
        DenseElement::of(&scheme, (start, end), h, ends, &rate, &force)
    }
}
