//! Steps of models with constraints, by Newton's method with multipliers.

use crate::constrained::at_rest::{is_rounding, work_of_roundings};
use crate::constrained::choose::choose;
use crate::constrained::constrains::Constrains;
use crate::constrained::element::{ConstrainedForm, ElementConstraints, IsRounding};
use crate::constrained::layout::{Layout, check_element};
use crate::constrained::node::{Bordered, own_velocity, solve_velocity};
use crate::constrained::own::violated;
use crate::constrained::residual::{largest_gap, relative_residual};
use crate::constrained::rows::{Independence, Rows, norm};
use crate::control::START_TOLERANCE;
use crate::equations::{Span, combination};
use crate::error::{ConstraintError, StepError};
use crate::evidence::{Energy, Evidence, conserves_energy, rounding};
use crate::method::{Interval, Last, Memory, Method, set_kicks, total};
use crate::model::{CoordinateName, Model, State};
use crate::newton::{Beginning, Control, Solve, newton};
use crate::scheme::{SchemeRef, Tables};
use crate::velocity_form::VelocityForm;
use crate::workspace::{Parts, Scratch, Workspace};

/// Moves `state` over one element; see [`Method::advance`].
pub(crate) fn advance<M, T, const N: usize>(
    method: &Method<'_, M, T>,
    memory: &mut Memory<N>,
    workspace: Workspace<'_>,
    interval: Interval<'_, N>,
    state: &mut State<N>,
) -> Result<(), StepError>
where
    M: Model<N>,
    T: Tables,
{
    let (model, scheme) = (method.model, method.tables.view());
    check_element(M::CONSTRAINTS, scheme.element)?;
    if matches!(method.control.solve, Solve::FixedPoint) {
        return Err(ConstraintError::NeedsNewton.into());
    }
    let (t, h) = (interval.start, interval.length);
    let mut parts = Parts::of(workspace, &scheme.element, M::FORM, M::CONSTRAINTS.len())?;
    let is_foreseen = core::mem::take(&mut memory.is_foreseen) && memory.has_reached(state);
    let warm = is_foreseen || method.prepare(memory, &mut parts, h, state)?;
    set_kicks(&scheme, &interval, parts.kicks);
    let step = Step {
        model,
        scheme,
        control: method.control.with_constraints(),
        layout: Layout::new(&scheme.element, N, M::CONSTRAINTS.len()),
        times: (t, h),
        start: state,
        warm,
        is_rounding: &|row, t, at| is_rounding(model, row, (t, h), at),
    };
    let mut rows = Rows::at_start(parts.rows, model, t, &state.q);
    let mut scratch = Scratch {
        unknowns: parts.unknowns,
        step: parts.step,
        tangent: parts.tangent,
        pivots: parts.tangent_pivots,
    };
    let begun = step.begin(memory, &mut rows, parts.active, &mut scratch)?;
    let low = begun.low;
    let span = Span {
        t,
        h,
        start: state,
        low: &low,
        kicks: &*parts.kicks,
        damping: 0.0,
    };
    let mut form = ConstrainedForm::new(
        VelocityForm::new(
            model,
            (scheme, span),
            parts.kept,
            (&mut memory.mass, &mut memory.statistics),
        ),
        step.layout,
        rows,
        parts.active,
        total(interval.impulses, h),
    );
    let evidence = step.solve(&mut form, &mut scratch)?;
    let (end, end_low) = form.end_state(scratch.unknowns)?;
    let constraints = &mut form.constraints;
    step.check_end(constraints, scratch.unknowns, &end)?;
    let end_rows = constraints.rows.independence();
    let is_conserved = const { conserves_energy::<M, N>() }
        && interval.impulses.is_empty()
        && !constraints.rows.drifts();
    let energy = is_conserved.then(|| {
        let velocities = [begun.velocity, constraints.end_place(scratch.unknowns).2];
        Energy::with(model, (t, h), [state, &end], &velocities)
    });
    let end_velocity = constraints.end_place(scratch.unknowns).2;
    let rounding = || {
        rounding(model, (t, h), [state, &end])
            + work_of_roundings(model, (t, h), &end.q, &end_velocity)
    };
    evidence.check_with(method.control.solve, energy, scheme.element, &rounding)?;
    // Between steps the rows are those of the constraints as declared.
    constraints
        .rows
        .restore_multipliers(&step.layout, scratch.unknowns);
    memory.last = Some(Last {
        t,
        h,
        start: *state,
        start_low: low,
        end,
    });
    memory.independence = Some([begun.independence, end_rows]);
    memory.low = end_low;
    memory.statistics.steps += 1;
    *state = end;
    Ok(())
}

/// A step, without the type of the model.
struct Step<'a, const N: usize> {
    model: &'a dyn Constrains<N>,
    scheme: SchemeRef<'a>,
    control: Control,
    layout: Layout,
    /// The time at the start, and the length.
    times: (f64, f64),
    start: &'a State<N>,
    /// Whether the unknowns continue the last step, or are foreseen.
    warm: bool,
    is_rounding: &'a IsRounding<'a, N>,
}

/// What a step begins with.
struct Begun<const N: usize> {
    /// The velocity at the start.
    velocity: [f64; N],
    /// The rounding error of the start.
    low: State<N>,
    /// The independence of the rows at the start.
    independence: Independence,
}

impl<const N: usize> Step<'_, N> {
    /// Chooses independent rows, and completes the initial guess.
    fn begin(
        &self,
        memory: &mut Memory<N>,
        rows: &mut Rows<'_, N>,
        active: &mut [usize],
        scratch: &mut Scratch<'_>,
    ) -> Result<Begun<N>, StepError> {
        // After a failure there is no polynomial to continue from.
        memory.last = None;
        if self.warm {
            self.check_continuity(&self.velocity_at_end(scratch.unknowns), rows)?;
        }
        let independence = match memory.independence {
            Some([_, end]) if self.warm => end,
            _ => rows.independence(),
        };
        if !self.warm {
            active.fill(0);
        }
        let units = choose(rows, self.model, (self.times.0, &self.start.q), active);
        let rates = self.layout.rates();
        let mean = combination(self.scheme.advance, scratch.unknowns[..rates].as_chunks().0);
        self.combine(rows, (&mean, &units), active);
        if self.warm {
            rows.combine_multipliers(&self.layout, scratch.unknowns);
        }
        let (velocity, low) = if self.warm {
            (self.continued(scratch.unknowns), memory.low)
        } else {
            let v = self.cold(rows, active, scratch)?;
            if memory.is_behind_kink {
                let State { q, p } = self.start;
                let before = own_velocity(self.model, self.times.0, q, p, &v)?;
                self.check_continuity(&before, rows)?;
            } else {
                self.check_start(&v, rows)?;
            }
            self.combine(rows, (&v, &units), active);
            (v, State::ZERO)
        };
        Ok(Begun {
            velocity,
            low,
            independence,
        })
    }

    /// Solves the element by Newton's method, once more from a constant velocity where the continued polynomial is a
    /// worse initial guess.
    fn solve<M: Model<N>>(
        &self,
        form: &mut ConstrainedForm<'_, M, N>,
        scratch: &mut Scratch<'_>,
    ) -> Result<Evidence, StepError> {
        if self.warm {
            let first = newton(form, &self.control, scratch, Beginning::Near, false);
            if first.is_ok() {
                return first;
            }
            self.begin_again(&mut form.constraints, scratch)?;
        }
        newton(form, &self.control, scratch, Beginning::Far, false)
    }

    /// Begins once more, from a constant velocity.
    fn begin_again(
        &self,
        constraints: &mut ElementConstraints<'_, N>,
        scratch: &mut Scratch<'_>,
    ) -> Result<(), StepError> {
        let (t, q) = (self.times.0, &self.start.q);
        constraints.rows.evaluate(self.model, t, q);
        self.cold(&constraints.rows, constraints.active, scratch)?;
        Ok(())
    }

    /// Sets the velocity at the end to that of the continued polynomial. Returns the velocity at the start: that at the
    /// end of the last element, which that element has left in the place of the other.
    fn continued(&self, unknowns: &mut [f64]) -> [f64; N] {
        let start = self.velocity_at_end(unknowns);
        let rates = unknowns[..self.layout.rates()].as_chunks().0;
        let end: [f64; N] = end_velocity(&self.scheme, rates);
        unknowns[self.layout.end(0)..self.layout.node(0)].copy_from_slice(&end);
        start
    }

    /// The velocity at the end of the element with these unknowns.
    fn velocity_at_end(&self, unknowns: &[f64]) -> [f64; N] {
        let mut end = [0.0; N];
        end.copy_from_slice(&unknowns[self.layout.end(0)..self.layout.node(0)]);
        end
    }

    /// Sets the initial guess of constant velocity and zero reactions; returns the velocity.
    fn cold(
        &self,
        rows: &Rows<'_, N>,
        active: &[usize],
        scratch: &mut Scratch<'_>,
    ) -> Result<[f64; N], StepError> {
        let mut bordered = Bordered {
            matrix: scratch.tangent,
            vector: scratch.step,
            pivots: scratch.pivots,
        };
        let (t, at) = (self.times.0, (&self.start.q, &self.start.p));
        let guess = [0.0; N];
        let v = solve_velocity(self.model, t, at, &guess, rows, active, &mut bordered)?;
        constant(&self.layout, &v, scratch.unknowns);
        Ok(v)
    }

    /// Replaces linearly dependent rows by combinations, for an element with this mean rate and coordinates in these
    /// units.
    fn combine(
        &self,
        rows: &mut Rows<'_, N>,
        (rate, units): (&[f64; N], &[f64; N]),
        active: &mut [usize],
    ) {
        let mut marks = self.model.declared().iter().zip(&*active);
        if marks.all(|(one, mark)| !one.kind.is_holonomic() || *mark != 0) {
            return;
        }
        let ((t, h), start) = (self.times, &self.start.q);
        let mut middle = *start;
        for a in 0..N {
            middle[a] += 0.5 * h * rate[a];
        }
        let places = [(t, start), (t + 0.5 * h, &middle)];
        rows.combine(self.model, places, (rate, units), active);
    }

    /// Refuses a start to which the motion has led, with velocity `v`, but whose positions constraints do not allow: their
    /// values jump there.
    fn check_continuity(&self, v: &[f64; N], rows: &Rows<'_, N>) -> Result<(), StepError> {
        let (q, (t, _)) = (&self.start.q, self.times);
        let gap = largest_gap(norm(q), norm(v), self.times);
        for (c, constraint) in self.model.declared().iter().enumerate() {
            let distance = rows.distance(c);
            if distance > gap && !(self.is_rounding)((rows, c), t, (q, v)) {
                return Err(ConstraintError::Discontinuous {
                    constraint: CoordinateName::single(constraint.name),
                    distance,
                }
                .into());
            }
        }
        Ok(())
    }

    /// Refuses a start that violates the constraints by more than the tolerance of iterations may have left.
    fn check_start(&self, v: &[f64; N], rows: &Rows<'_, N>) -> Result<(), StepError> {
        let (model, (t, h)) = (self.model, self.times);
        let State { q, p } = self.start;
        let declared = model.declared();
        let v = own_velocity(model, t, q, p, v)?;
        let refused = |c: usize, position: bool, residual: f64| {
            Err(ConstraintError::Start {
                constraint: CoordinateName::single(declared[c].name),
                position,
                residual,
            }
            .into())
        };
        let is_rounding = |c| (self.is_rounding)((rows, c), t, (q, &v));
        for c in 0..declared.len() {
            let (position, velocity) = relative_residual(rows, c, q, &v, h);
            for (residual, is_position) in [(position, true), (velocity, false)] {
                if !(residual <= START_TOLERANCE || is_rounding(c)) {
                    return refused(c, is_position, residual);
                }
            }
        }
        let as_declared = (!rows.is_combined()).then_some(rows);
        match violated(model, t, (q, &v), (h, self.control.tolerance), as_declared) {
            Some((c, is_position, residual)) if !is_rounding(c) => {
                refused(c, is_position, residual)
            }
            _ => Ok(()),
        }
    }

    /// Refuses an end that is not finite or violates the constraints.
    fn check_end(
        &self,
        constraints: &mut ElementConstraints<'_, N>,
        unknowns: &[f64],
        end: &State<N>,
    ) -> Result<(), StepError> {
        if !end.is_finite() {
            return Err(StepError::NonFinite);
        }
        constraints.check_end(
            self.model,
            unknowns,
            self.control.tolerance,
            self.is_rounding,
        )
    }
}

/// The initial guess of constant velocity and zero reactions.
fn constant<const N: usize>(layout: &Layout, v: &[f64; N], unknowns: &mut [f64]) {
    unknowns.fill(0.0);
    unknowns[..layout.rates()].as_chunks_mut().0.fill(*v);
    unknowns[layout.end(0)..layout.node(0)].copy_from_slice(v);
}

/// The velocity at the end of the element, from the polynomial of the rates.
fn end_velocity<const N: usize>(scheme: &SchemeRef<'_>, rates: &[[f64; N]]) -> [f64; N] {
    let mut v = [0.0; N];
    // Every Legendre polynomial is one at τ = 1.
    for weights in scheme.rate.chunks_exact(rates.len()) {
        for (weight, rate) in weights.iter().zip(rates) {
            for a in 0..N {
                v[a] += weight * rate[a];
            }
        }
    }
    v
}
