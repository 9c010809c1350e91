//! Steps of models with constraints, by Newton's method with multipliers.

use crate::constrained::choose::choose;
use crate::constrained::element::ConstrainedForm;
use crate::constrained::layout::Layout;
use crate::constrained::layout::refused;
use crate::constrained::node::{Bordered, own_velocity, solve_velocity};
use crate::constrained::own::violated;
use crate::constrained::residual::relative_residual;
use crate::constrained::rows::Rows;
use crate::control::START_TOLERANCE;
use crate::equations::Span;
use crate::error::{ConstraintError, StepError};
use crate::evidence::{Energy, conserves_energy, rounding};
use crate::legendre::largest;
use crate::method::{Interval, Last, Memory, Method, set_kicks, total};
use crate::model::{CoordinateName, Model, State};
use crate::newton::{Beginning, Solve, newton};
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
    let scheme = method.tables.view();
    let element = scheme.element;
    if let Some(constraint) = refused::<M, N>(&element) {
        return Err(ConstraintError::Element {
            element,
            constraint,
        }
        .into());
    }
    if matches!(method.control.solve, Solve::FixedPoint) {
        return Err(ConstraintError::NeedsNewton.into());
    }
    let Interval {
        start: t,
        length: h,
        impulses,
    } = interval;
    let count = M::CONSTRAINTS.len();
    let mut parts = Parts::of(workspace, &element, M::FORM, count)?;
    let is_foreseen = core::mem::take(&mut memory.is_foreseen) && memory.has_reached(state);
    let warm = is_foreseen || method.prepare(memory, &mut parts, h, state)?;
    set_kicks(&scheme, &interval, parts.kicks);
    let kicks: &[[f64; N]] = parts.kicks;
    let layout = Layout::new(&element, N, count);
    let mut rows = Rows::at_start(parts.rows, method.model, t, &state.q);
    let start_rows = match memory.independence {
        Some([_, end]) if warm => end,
        _ => rows.independence(),
    };
    if !warm {
        parts.active.fill(0);
    }
    let units = choose(&mut rows, method.model, (t, &state.q), parts.active);
    let mean = mean_rate(&scheme, parts.unknowns[..layout.rates()].as_chunks().0);
    combine(
        method.model,
        &mut rows,
        (t, h),
        &state.q,
        (&mean, &units),
        parts.active,
    );
    if warm && rows.is_combined() {
        for place in layout.multipliers() {
            rows.combine_multipliers(&mut parts.unknowns[place]);
        }
    }
    // After a failure there is no polynomial to continue from.
    memory.last = None;
    let low = if warm { memory.low } else { State::ZERO };
    let cold = |unknowns: &mut [f64],
                tangent: &mut [f64],
                step: &mut [f64],
                pivots: &mut [usize],
                rows: &Rows<'_, N>,
                active: &[usize]| {
        let mut bordered = Bordered {
            matrix: tangent,
            vector: step,
            pivots,
        };
        let at = (&state.q, &state.p);
        let v = solve_velocity(method.model, t, at, &[0.0; N], rows, active, &mut bordered)?;
        constant(&layout, &v, unknowns);
        Ok::<_, StepError>(v)
    };
    let mut start_velocity = [0.0; N];
    let end_places = layout.end(0)..layout.node(0);
    if warm {
        // The velocity at the end of the last element, which that element has left there.
        start_velocity.copy_from_slice(&parts.unknowns[end_places.clone()]);
        let rates = layout.rates();
        let end: [f64; N] = end_velocity(&scheme, parts.unknowns[..rates].as_chunks().0);
        parts.unknowns[end_places].copy_from_slice(&end);
    } else {
        let v = cold(
            parts.unknowns,
            parts.tangent,
            parts.step,
            parts.tangent_pivots,
            &rows,
            parts.active,
        )?;
        let left = method.control.with_constraints().tolerance;
        check_start(method.model, (t, h, left), state, &v, &rows)?;
        start_velocity = v;
        let moving = (&v, &units);
        combine(
            method.model,
            &mut rows,
            (t, h),
            &state.q,
            moving,
            parts.active,
        );
    }
    let mut scratch = Scratch {
        unknowns: parts.unknowns,
        step: parts.step,
        tangent: parts.tangent,
        pivots: parts.tangent_pivots,
    };
    let mut form = ConstrainedForm::new(
        VelocityForm {
            model: method.model,
            scheme,
            span: Span {
                t,
                h,
                start: state,
                low: &low,
                kicks,
                damping: 0.0,
            },
            forces: parts.forces,
            momenta: parts.momenta,
            masses: parts.masses,
            mass_pivots: parts.mass_pivots,
            constant_mass: &mut memory.mass,
            statistics: &mut memory.statistics,
        },
        layout,
        rows,
        parts.active,
        total(impulses, h),
    );
    let control = method.control.with_constraints();
    let beginning = if warm {
        Beginning::Near
    } else {
        Beginning::Far
    };
    let first = newton(&mut form, &control, &mut scratch, beginning, false);
    let evidence = match first {
        Ok(evidence) => evidence,
        Err(error) if !warm => return Err(error),
        Err(_) => {
            // The continued polynomial may be a worse initial guess than a constant velocity.
            form.constraints.rows.evaluate(method.model, t, &state.q);
            cold(
                scratch.unknowns,
                scratch.tangent,
                scratch.step,
                scratch.pivots,
                &form.constraints.rows,
                form.constraints.active,
            )?;
            newton(&mut form, &control, &mut scratch, Beginning::Far, false)?
        }
    };
    let (end, end_low) = form.end_state(scratch.unknowns)?;
    if !(largest(&end.q).is_finite() && largest(&end.p).is_finite()) {
        return Err(StepError::NonFinite);
    }
    form.check_end(scratch.unknowns, control.tolerance)?;
    let end_rows = form.constraints.rows.independence();
    // Constraints that depend on the time do work.
    let is_conserved = conserves_energy::<M, N>()
        && impulses.is_empty()
        && form.constraints.rows.drift.iter().all(|a| *a == 0.0);
    let energy = is_conserved.then(|| {
        let velocities = [start_velocity, form.end_place(scratch.unknowns).2];
        Energy::with(method.model, (t, h), [state, &end], &velocities)
    });
    let rounding = || rounding(method.model, (t, h), [state, &end]);
    evidence.check_with(method.control.solve, energy, element, &rounding)?;
    // Between steps the rows are those of the constraints as declared.
    if form.constraints.rows.is_combined() {
        for place in layout.multipliers() {
            form.constraints
                .rows
                .declared_multipliers(&mut scratch.unknowns[place]);
        }
    }
    memory.last = Some(Last {
        t,
        h,
        start: *state,
        start_low: low,
        end,
    });
    memory.independence = Some([start_rows, end_rows]);
    memory.low = end_low;
    memory.statistics.steps += 1;
    *state = end;
    Ok(())
}

/// The initial guess of constant velocity and zero reactions.
fn constant<const N: usize>(layout: &Layout, v: &[f64; N], unknowns: &mut [f64]) {
    unknowns.fill(0.0);
    unknowns[..layout.rates()].as_chunks_mut().0.fill(*v);
    unknowns[layout.end(0)..layout.node(0)].copy_from_slice(v);
}

/// The mean of the rates, which are those continued from the last element or a cold start.
fn mean_rate<const N: usize>(scheme: &SchemeRef<'_>, rates: &[[f64; N]]) -> [f64; N] {
    let mut mean = [0.0; N];
    for (weight, rate) in scheme.advance.iter().zip(rates) {
        for a in 0..N {
            mean[a] += weight * rate[a];
        }
    }
    mean
}

/// Replaces linearly dependent rows by combinations, for an element with this mean rate and coordinates in these units.
fn combine<M, const N: usize>(
    model: &M,
    rows: &mut Rows<'_, N>,
    (t, h): (f64, f64),
    start: &[f64; N],
    (rate, units): (&[f64; N], &[f64; N]),
    active: &mut [usize],
) where
    M: Model<N>,
{
    let mut marks = M::CONSTRAINTS.iter().zip(&*active);
    if marks.all(|(one, mark)| !one.kind.is_holonomic() || *mark != 0) {
        return;
    }
    let mut middle = *start;
    for a in 0..N {
        middle[a] += 0.5 * h * rate[a];
    }
    let places = [(t, start), (t + 0.5 * h, &middle)];
    rows.combine(model, places, (rate, units), active);
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

/// Refuses a start that violates the constraints by more than the tolerance of iterations may have left.
fn check_start<M, const N: usize>(
    model: &M,
    (t, h, left): (f64, f64, f64),
    state: &State<N>,
    v: &[f64; N],
    rows: &Rows<'_, N>,
) -> Result<(), StepError>
where
    M: Model<N>,
{
    let v = own_velocity(model, t, &state.q, &state.p, v)?;
    let refused = |c: usize, position: bool, residual: f64| {
        Err(ConstraintError::Start {
            constraint: CoordinateName::single(M::CONSTRAINTS[c].name),
            position,
            residual,
        }
        .into())
    };
    for c in 0..M::CONSTRAINTS.len() {
        let (position, velocity) = relative_residual(rows, c, &state.q, &v, h);
        for (residual, is_position) in [(position, true), (velocity, false)] {
            if !(residual <= START_TOLERANCE) {
                return refused(c, is_position, residual);
            }
        }
    }
    let declared = (!rows.is_combined()).then_some(rows);
    match violated(model, t, (&state.q, &v), (h, left), declared) {
        Some((c, is_position, residual)) => refused(c, is_position, residual),
        None => Ok(()),
    }
}
