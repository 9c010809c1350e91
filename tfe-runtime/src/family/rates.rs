//! The stepper of models of run-time length whose rates are the unknowns: any kinetic energy, any element, constraints
//! (T-45, T-72, T-73).
//!
//! ```text
//! v_l = Σ_j E_lj ν_j ,     q_l = q₀ + h Σ_j C_lj ν_j
//! Σ_l P_il L_v,l − p₀ + h A₀ᵀ m₀ − h Σ_l G_il F_l = 0 ,     F = L_q + Q − Aᵀμ̇ ,     μ̇_l = Σ_j m_j P_j′(2c_l − 1)
//! φ(q₁)/h = 0 ,     Σ_l b_l P_j′(2c_l − 1) φ(q_l)/h = 0
//! ```
//!
//! It is a simplified Newton iteration with one sparse matrix for rates and multipliers; its factors are kept while
//! they contract well enough, also from step to step.

use super::at_rest::sparse;
use super::blocked::Blocked;
use super::dense::DenseElement;
use super::held::Solved;
use super::inertia::masses;
use super::model::{FamilyState, Gradient, Model};
use super::node::Node;
use super::pattern::Pattern;
use super::point::Point;
use super::rows::Rows;
use super::settling::Declarations;
use super::start::Start;
use super::tangent::Parts;
use crate::basis::legendre_slopes;
use crate::consistency::ModelError;
use crate::constrained::reach::speeds;
use crate::control::{POSITION_ROUND_OFF, ROUGH_ROUND_OFF};
use crate::double_double::DoubleDouble;
use crate::equations::{Increment, relative};
use crate::error::StepError;
use crate::evidence::Evidence;
use crate::legendre::largest;
use crate::method::{continued_ratio, set_extrapolation};
use crate::newton::{Control, Monitor, SERVES, Solve, Verdict};
use crate::scheme::{SchemeRef, SchemeTable, Tables as _};
use crate::statistics::Statistics;
use alloc::vec;
use alloc::vec::Vec;
use core::ops::Deref;

/// A stepper of this kind.
#[derive(Clone, Debug)]
pub(super) struct Rates<M> {
    model: M,
    table: SchemeTable,
    pub(super) control: Control,
    pub(super) statistics: Statistics,
    constraints: usize,
    declarations: Declarations,
    matrix: Blocked,
    parts: Parts,
    node: Node,
    /// The unknowns: the rates of each coordinate, then the multipliers of each constraint.
    unknowns: Vec<f64>,
    step: Vec<f64>,
    /// The length of the step for which the matrix was factored.
    factored: f64,
    /// Whether starts that violate the constraints are refused.
    refuses: bool,
    /// Whether the next step begins shortly behind a kink of constraints, with a velocity that they may only have allowed
    /// before.
    pub(super) is_behind_kink: bool,
    pub(super) points: Vec<Point>,
    rows: Rows,
    /// A at the start.
    start_rows: Vec<f64>,
    q_end: Vec<f64>,
    v_end: Vec<f64>,
    /// The length of the last step.
    last: Option<f64>,
    pub(super) start: FamilyState,
    pub(super) end: FamilyState,
    low: FamilyState,
    impulse: Vec<f64>,
    force: Vec<f64>,
}

impl<M> Rates<M> {
    /// The same memory with the model held in another way, and all counts zero.
    pub(super) fn hand_over<H>(self, model: H) -> Rates<H> {
        Rates {
            model,
            table: self.table,
            control: self.control,
            statistics: Statistics::NONE,
            constraints: self.constraints,
            declarations: self.declarations,
            matrix: self.matrix,
            parts: self.parts,
            node: self.node,
            unknowns: self.unknowns,
            step: self.step,
            factored: self.factored,
            refuses: self.refuses,
            is_behind_kink: self.is_behind_kink,
            points: self.points,
            rows: self.rows,
            start_rows: self.start_rows,
            q_end: self.q_end,
            v_end: self.v_end,
            last: self.last,
            start: self.start,
            end: self.end,
            low: self.low,
            impulse: self.impulse,
            force: self.force,
        }
    }
}

impl<M: Model, H: Deref<Target = M>> Rates<H> {
    /// A stepper that has made no step; the model has been checked.
    ///
    /// # Errors
    /// [`ModelError`]
    pub(super) fn new(model: H, table: SchemeTable, control: Control) -> Result<Self, ModelError> {
        if control.solve == Solve::FixedPoint {
            return Err(ModelError::NeedsNewton);
        }
        let (n, m) = (model.len(), model.constraints());
        let rows = Rows::new(&*model);
        let scheme = table.view();
        let unknowns = scheme.unknowns();
        let point =
            |node: &f64| Point::new(n, rows.values.len(), m, legendre_slopes(*node, unknowns));
        let points = scheme.nodes.iter().map(point).collect();
        let (parts, matrix) = Parts::new(&*model, &rows, unknowns).ok_or(ModelError::TooLarge)?;
        let node = Node::new(&*model, &rows).ok_or(ModelError::TooLarge)?;
        let zero = || FamilyState {
            q: vec![0.0; n],
            p: vec![0.0; n],
        };
        let size = matrix.size();
        Ok(Self {
            declarations: Declarations::of(&*model),
            model,
            control,
            statistics: Statistics::NONE,
            constraints: m,
            matrix,
            parts,
            node,
            unknowns: vec![0.0; size],
            step: vec![0.0; size],
            factored: f64::NAN,
            refuses: true,
            is_behind_kink: false,
            points,
            start_rows: vec![0.0; rows.values.len()],
            rows,
            q_end: vec![0.0; n],
            v_end: vec![0.0; n],
            last: None,
            start: zero(),
            end: zero(),
            low: zero(),
            impulse: vec![0.0; n],
            force: vec![0.0; n],
            table,
        })
    }

    /// Allows steps to start from states that violate the constraints, and far from their ends, as in iterations over
    /// many elements. Each element still ends on the constraints, and the caller checks whether the elements form one
    /// motion.
    pub(super) fn begin_anywhere(&mut self) {
        self.refuses = false;
        self.control.solve = Solve::Trusting;
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

    /// As [`Stepper::advance`](super::Stepper::advance), for a state that is finite and as long as the model.
    pub(super) fn advance(
        &mut self,
        t: f64,
        h: f64,
        state: &mut FamilyState,
        continues: bool,
    ) -> Result<(), StepError> {
        let last = self.last.take().filter(|_| continues);
        self.start.clone_from(state);
        self.rows.evaluate(&*self.model, t, &self.start.q);
        self.start_rows.copy_from_slice(&self.rows.values);
        match last {
            Some(length) => {
                self.check_start(true, (t, h))?;
                self.continue_rates(h / length);
            }
            None => {
                self.low.q.fill(0.0);
                self.low.p.fill(0.0);
                self.begin(t)?;
                self.check_start(false, (t, h))?;
            }
        }
        let outcome = self.newton(t, h);
        if let Err(error) = outcome {
            if last.is_none() {
                return Err(error);
            }
            // The extrapolated polynomial may be a worse initial guess than a cold start.
            self.rows.evaluate(&*self.model, t, &self.start.q);
            self.begin(t)?;
            self.newton(t, h)?;
        }
        self.finish(t, h)?;
        self.statistics.steps += 1;
        self.last = Some(h);
        state.clone_from(&self.end);
        Ok(())
    }

    /// Extrapolates the polynomial of the last step.
    fn continue_rates(&mut self, ratio: f64) {
        let scheme = self.table.view();
        let count = scheme.unknowns();
        let mut extrapolation = vec![0.0; count * count];
        set_extrapolation(&scheme, continued_ratio(ratio), &mut extrapolation);
        let rates = self.start.q.len() * count;
        let mut new = vec![0.0; count];
        for old in self.unknowns[..rates].chunks_exact_mut(count) {
            for (new, row) in new.iter_mut().zip(extrapolation.chunks_exact(count)) {
                *new = row.iter().zip(&*old).map(|(x, old)| x * old).sum();
            }
            old.copy_from_slice(&new);
        }
    }

    /// The cold initial guess: constant velocities and no reactions. The rows are those of the start.
    fn begin(&mut self, t: f64) -> Result<(), StepError> {
        let count = self.table.view().unknowns();
        self.matrix.forget();
        self.unknowns.fill(0.0);
        self.v_end.fill(0.0);
        let FamilyState { q, p } = &self.start;
        self.node
            .solve(&*self.model, (t, q), p, &self.rows, &mut self.v_end)?;
        let rates = self.unknowns.chunks_exact_mut(count);
        for (rates, v) in rates.zip(&self.v_end) {
            rates.fill(*v);
        }
        Ok(())
    }

    /// Refuses a start that violates the constraints, or to which the motion has led although they jump there.
    fn check_start(&self, has_led: bool, times: (f64, f64)) -> Result<(), StepError> {
        if self.constraints == 0 || !self.refuses {
            return Ok(());
        }
        let start = Start {
            state: &self.start,
            rows: &self.rows,
            node: &self.node,
            admitted: &self.v_end,
            tolerance: self.control.with_constraints().tolerance,
        };
        match (has_led, self.is_behind_kink) {
            (true, _) => start.check_continuity(&*self.model, times, &self.v_end),
            (false, true) => start.check_behind(&*self.model, times),
            (false, false) => start.check(&*self.model, times),
        }
    }

    fn newton(&mut self, t: f64, h: f64) -> Result<(), StepError> {
        let control = if self.constraints > 0 {
            self.control.with_constraints()
        } else {
            self.control
        };
        let mut monitor = Monitor::new(control.tolerance);
        let known = self.matrix.is_factored() && self.factored == h;
        let mut fresh = !known;
        let (mut evidence, mut own, mut settles) = (Evidence::of_newton(), false, false);
        let mut iterations = self.control.max_iterations;
        for iteration in 0..self.control.max_iterations {
            self.evaluate(t, h);
            if fresh {
                self.statistics.tangent_evaluations += self.points.len() as u64;
                self.factor(t, h)?;
                self.statistics.factorizations += 1;
            }
            self.residual(h);
            self.matrix.solve(&mut self.step);
            for (unknown, step) in self.unknowns.iter_mut().zip(&self.step) {
                *unknown -= step;
            }
            self.statistics.iterations += 1;
            self.statistics.newton_iterations += 1;
            let increment = self.measure(h);
            let beside = || self.measure_at_rest(t, h);
            let increment = monitor.beside_reactions(increment, iteration, &beside);
            own |= fresh;
            evidence.see(increment, own);
            match monitor.judge_each((increment, &control), &mut settles, || self.measure_own(h)) {
                Ok(Verdict::Converged) => return evidence.check(self.control.solve),
                Ok(Verdict::GoOn) if !settles && monitor.is_noise(fresh) => {
                    return evidence.check(self.control.solve);
                }
                Ok(Verdict::GoOn) => {}
                Err(error) => {
                    self.matrix.forget();
                    return Err(error);
                }
            }
            // The first increment alone gives no rate: old factors are allowed a second one.
            let untried = known && iteration == 0;
            fresh = !untried && monitor.rate() > SERVES;
            if monitor.is_stuck() {
                iterations = iteration + 1;
                break;
            }
        }
        self.matrix.forget();
        Err(StepError::NewtonStalled {
            iterations,
            residual: monitor.last(),
            tolerance: control.tolerance,
        })
    }

    /// The size of the last increment of the rates relative to the state.
    fn measure(&self, h: f64) -> Increment {
        let rates = self.start.q.len() * self.table.view().unknowns();
        let (x, step) = (&self.unknowns[..rates], &self.step[..rates]);
        let position = relative(h, &self.start.q, x, step);
        // The momentum at the end is as accurate as the velocities, whatever the step; the rest of an increment affects
        // it through the forces only.
        let velocity = 0.25 * relative(1.0, &[], x, step);
        // Either both are NaN or neither; a multiplier that is not finite spoils the rates in the next iteration.
        let relative = velocity.max(position);
        Increment { relative, position }
    }

    /// The same relative to the size of each declaration of coordinates.
    fn measure_own(&self, h: f64) -> Option<f64> {
        let count = self.table.view().unknowns();
        // The rounding errors of positions appear in the velocities divided by the step.
        let noise = POSITION_ROUND_OFF * largest(&self.start.q) / h.abs();
        let noise = if self.constraints > 0 { noise } else { 0.0 };
        self.declarations.own_increment(noise, |a| {
            let of = |numbers: &[f64]| largest(&numbers[a * count..(a + 1) * count]);
            (of(&self.unknowns), of(&self.step))
        })
    }

    /// The last increment, and the rates, beside what the reactions alone would move, if they are rounding errors of that
    /// (T-168).
    #[cold]
    fn measure_at_rest(&self, t: f64, h: f64) -> Option<Increment> {
        if self.constraints == 0 {
            return None;
        }
        let count = self.table.view().unknowns();
        let (rates, multipliers) = self.unknowns.split_at(self.start.q.len() * count);
        let reactions = multipliers.chunks_exact(count);
        let reactions: Vec<f64> = reactions.map(|m| m.iter().map(|m| m.abs()).sum()).collect();
        let v: Vec<f64> = rates.chunks_exact(count).map(|rates| rates[0]).collect();
        let masses = masses(&*self.model, t, &self.start.q, &v);
        let speeds = speeds(h, &masses, &sparse(&self.rows), &reactions);
        // At rest the velocities themselves are rounding errors.
        let pairs = [&self.step[..], rates].into_iter().flat_map(|all| {
            let sizes = all.chunks_exact(count).map(largest);
            sizes.zip(&speeds).filter(|(size, _)| *size != 0.0)
        });
        let size = largest(&pairs.map(|(size, speed)| size / speed).collect::<Vec<_>>());
        let increment = Increment {
            relative: size,
            position: size,
        };
        (size <= ROUGH_ROUND_OFF).then_some(increment)
    }

    /// Evaluates the model at the points, and the constraints at the end.
    fn evaluate(&mut self, t: f64, h: f64) {
        let scheme = self.table.view();
        let (n, m, count) = (self.start.q.len(), self.constraints, scheme.unknowns());
        let (rates, multipliers) = self.unknowns.split_at(n * count);
        for (l, point) in self.points.iter_mut().enumerate() {
            let time = t + h * scheme.nodes[l];
            let velocity = &scheme.velocity[l * count..(l + 1) * count];
            let position = &scheme.position[l * count..(l + 1) * count];
            for (a, rates) in rates.chunks_exact(count).enumerate() {
                point.v[a] = product(velocity, rates);
                point.q[a] = self.start.q[a] + (h * product(position, rates) + self.low.q[a]);
            }
            // Entries that a model never writes stay zero; forces are added to.
            point.force.fill(0.0);
            let first = Gradient {
                z: &mut point.momentum,
                q: &mut point.force,
                force: &mut self.force,
            };
            self.model.first(time, &point.q, &point.v, first);
            if M::FACTS.forced {
                for (force, more) in point.force.iter_mut().zip(&self.force) {
                    *force += more;
                }
            }
            if m > 0 {
                for (rate, m) in point
                    .mu_rate
                    .iter_mut()
                    .zip(multipliers.chunks_exact(count))
                {
                    *rate = product(&point.slopes[1..count], &m[1..]);
                }
                self.rows.evaluate(&*self.model, time, &point.q);
                self.rows
                    .add_reaction(&self.rows.values, -1.0, &point.mu_rate, &mut point.force);
                point.rows.copy_from_slice(&self.rows.values);
                point.phi.copy_from_slice(&self.rows.phi);
            }
        }
        self.statistics.residual_evaluations += self.points.len() as u64;
        if m > 0 {
            for (a, rates) in rates.chunks_exact(count).enumerate() {
                let advance = h * product(scheme.advance, rates);
                self.q_end[a] = self.start.q[a] + (advance + self.low.q[a]);
            }
            self.rows.evaluate(&*self.model, t + h, &self.q_end);
        }
    }

    /// Computes the residual, in `step`.
    fn residual(&mut self, h: f64) {
        self.set_impulse_of_start(h);
        let scheme = self.table.view();
        let (n, count, points) = (self.start.q.len(), scheme.unknowns(), scheme.points());
        let (motion, constraints) = self.step.split_at_mut(n * count);
        for (a, rest) in motion.chunks_exact_mut(count).enumerate() {
            let start = self.start.p[a] - (self.impulse[a] - self.low.p[a]);
            for (i, rest) in rest.iter_mut().enumerate() {
                let (mut momentum, mut force) = (0.0, 0.0);
                for (l, point) in self.points.iter().enumerate() {
                    momentum += scheme.momentum[i * points + l] * point.momentum[a];
                    force += scheme.force[i * points + l] * point.force[a];
                }
                *rest = (momentum - start) - h * force;
            }
        }
        for (c, rest) in constraints.chunks_exact_mut(count).enumerate() {
            rest.fill(0.0);
            for (l, point) in self.points.iter().enumerate() {
                for (rest, slope) in rest.iter_mut().zip(point.slopes).skip(1) {
                    *rest += scheme.weights[l] * slope * point.phi[c] / h;
                }
            }
            rest[0] = self.rows.phi[c] / h;
        }
    }

    /// Computes h A₀ᵀ m₀, in `impulse`.
    fn set_impulse_of_start(&mut self, h: f64) {
        self.impulse.fill(0.0);
        let (n, count) = (self.start.q.len(), self.table.view().unknowns());
        let multipliers = &self.unknowns[n * count..];
        for ((constraint, coordinate), value) in self.rows.places().zip(&self.start_rows) {
            self.impulse[coordinate] += h * (value * multipliers[constraint * count]);
        }
    }

    /// Computes the end of the element.
    fn finish(&mut self, t: f64, h: f64) -> Result<(), StepError> {
        // The end depends on the forces at the final rates, not at the previous ones.
        self.evaluate(t, h);
        self.set_impulse_of_start(h);
        let scheme = self.table.view();
        let count = scheme.unknowns();
        for a in 0..self.start.q.len() {
            let rates = &self.unknowns[a * count..(a + 1) * count];
            let rate = product(scheme.advance, rates) + product(scheme.advance_low, rates);
            (self.end.q[a], self.low.q[a]) = moved(self.start.q[a], h * rate, self.low.q[a]);
            let points = self.points.iter().zip(scheme.weights);
            let force: f64 = points.map(|(point, weight)| weight * point.force[a]).sum();
            let change = h * force - self.impulse[a];
            (self.end.p[a], self.low.p[a]) = moved(self.start.p[a], change, self.low.p[a]);
        }
        if self.constraints > 0 {
            if let Some(point) = self.points.last() {
                self.v_end.copy_from_slice(&point.v);
            }
            let at = (t + h, &self.end.q[..]);
            self.rows.evaluate(&*self.model, at.0, at.1);
            self.node
                .solve(&*self.model, at, &self.end.p, &self.rows, &mut self.v_end)?;
            self.end.p.copy_from_slice(&self.node.slope);
            self.low.p.fill(0.0);
        }
        if !(largest(&self.end.q) + largest(&self.end.p)).is_finite() {
            return Err(StepError::NonFinite);
        }
        Ok(())
    }

    /// The rates of each coordinate, then the multipliers of each constraint, of the last step.
    pub(super) fn unknowns(&self) -> &[f64] {
        &self.unknowns
    }

    /// The factored tangent at the solution of the last step, from t to t + h.
    pub(super) fn linearised(&mut self, t: f64, h: f64) -> Result<Blocked, StepError> {
        self.factor(t, h)?;
        Ok(self.matrix.clone())
    }

    /// Factors the matrix of Newton's method of a step from t to t + h, at the points that were evaluated last.
    fn factor(&mut self, t: f64, h: f64) -> Result<(), StepError> {
        let scheme = self.table.view();
        let element = super::tangent::Element {
            scheme: &scheme,
            t,
            h,
            points: &self.points,
            start_rows: &self.start_rows,
            end_rows: &self.rows.values,
        };
        self.parts.fill(&*self.model, &element, &mut self.matrix);
        self.matrix.factor()?;
        self.factored = h;
        Ok(())
    }

    /// The solution of the last step, from t to t + h.
    pub(super) fn solved<'a>(
        &'a self,
        scheme: &'a SchemeRef<'a>,
        (t, h): (f64, f64),
        second: &'a Pattern,
    ) -> Solved<'a> {
        Solved {
            scheme,
            second,
            t,
            h,
            points: &self.points,
            multipliers: &self.unknowns[self.start.q.len() * scheme.unknowns()..],
            start: &self.start.q,
            end: (&self.end.q, &self.v_end),
            start_rows: &self.start_rows,
            end_rows: &self.rows,
            node: &self.node,
        }
    }

    /// h A₀ᵀ m₀ of the last step.
    pub(super) fn impulse_of_start(&self) -> &[f64] {
        &self.impulse
    }

    /// The polynomial of the last step.
    pub(super) fn dense(&self, start: f64, end: f64) -> DenseElement {
        let Some(h) = self.last else {
            return DenseElement::constant((start, end), self.start.clone());
        };
        let scheme = self.table.view();
        let count = scheme.unknowns();
        let ends = (self.start.clone(), self.end.clone());
        let rate = |unknown: usize, a: usize| self.unknowns[a * count + unknown];
        if self.constraints > 0 {
            let momentum = |point: usize, a: usize| self.points[point].momentum[a];
            return DenseElement::with_jumps(&scheme, (start, end), h, ends, &rate, &momentum);
        }
        let force = |point: usize, a: usize| self.points[point].force[a];
        DenseElement::of(&scheme, (start, end), h, ends, &rate, &force)
    }
}

/// Σ weight · value
pub(super) fn product(weights: &[f64], values: &[f64]) -> f64 {
    weights.iter().zip(values).map(|(w, value)| w * value).sum()
}

/// start + (change + low), and its rounding error.
fn moved(start: f64, change: f64, low: f64) -> (f64, f64) {
    let sum = DoubleDouble::sum(start, change + low);
    (sum.high, sum.low)
}
