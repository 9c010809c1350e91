//! Checks of the start, the impulses and the model before a run.

use crate::error::RunErrorKind;
use crate::numbers::is_tolerance;
use tfe_runtime::constrained::{self, Residual};
use tfe_runtime::family;
use tfe_runtime::step::Impulse;
use tfe_runtime::{Form, Model, State};

/// Whether energy is conserved by the model, so that a jump of it indicates too long a step. Linear models are
/// excluded: their steps have another kind of error.
pub(crate) const fn conserves_energy<M: Model<N>, const N: usize>() -> bool {
    let facts = M::FACTS;
    !(facts.time_dependent || facts.forced || facts.linear) && M::CONSTRAINTS.is_empty()
}

/// The same for a model of run-time length.
pub(crate) const fn conserves_energies<M: family::Model>() -> bool {
    let facts = M::FACTS;
    !(facts.time_dependent || facts.forced || facts.linear || M::CONSTRAINED)
}

/// Whether H may be linear in the momenta.
pub(super) const fn may_be_of_first_order<M: Model<N>, const N: usize>() -> bool {
    matches!(M::FORM, Form::Hamiltonian) && M::FACTS.quadratic_in_z
}

/// Refuses a tolerance with which iterations would accept anything, or nothing.
pub(crate) fn check_tolerance(tolerance: f64) -> Result<(), RunErrorKind> {
    if is_tolerance(tolerance) {
        return Ok(());
    }
    Err(RunErrorKind::Tolerance { tolerance })
}

/// Refuses breaks at times that are not numbers, at which no element would end. One at infinity is never reached.
pub(crate) fn check_breaks(breaks: &[f64]) -> Result<(), RunErrorKind> {
    if breaks.iter().any(|time| time.is_nan()) {
        return Err(RunErrorKind::Break);
    }
    Ok(())
}

/// Refuses start values that are not finite.
pub(crate) fn check_start<const N: usize>(state: &State<N>) -> Result<(), RunErrorKind> {
    check_finite(&state.q, &state.p)
}

/// The same for vectors of any length.
pub(super) fn check_finite(q: &[f64], p: &[f64]) -> Result<(), RunErrorKind> {
    for (coordinate, (&q, &p)) in q.iter().zip(p).enumerate() {
        if !(q.is_finite() && p.is_finite()) {
            return Err(RunErrorKind::Start { coordinate, q, p });
        }
    }
    Ok(())
}

/// Refuses a start, or impulses, with a time or components that are not finite.
pub(super) fn check_run<const N: usize>(
    start: &State<N>,
    impulses: &[Impulse<N>],
) -> Result<(), RunErrorKind> {
    check_start(start)?;
    for impulse in impulses {
        check_impulse(impulse.time, &impulse.value)?;
    }
    Ok(())
}

/// Refuses an impulse with a time or components that are not finite.
pub(super) fn check_impulse(time: f64, impulse: &[f64]) -> Result<(), RunErrorKind> {
    if time.is_finite() && impulse.iter().all(|one| one.is_finite()) {
        return Ok(());
    }
    Err(RunErrorKind::Impulse { time })
}

/// Refuses a start that violates the constraints.
pub(crate) fn check_constraints<M: Model<N>, const N: usize>(
    model: &M,
    time: f64,
    h: f64,
    start: &State<N>,
) -> Result<(), RunErrorKind> {
    if const { M::CONSTRAINTS.is_empty() } {
        return Ok(());
    }
    let v = constrained::velocity_of(model, time, &start.q, &start.p, &[0.0; N]);
    let Ok(v) = v else {
        // A singular constraint is reported by the first element.
        return Ok(());
    };
    check_residuals(
        time,
        constrained::start_residuals(model, time, &start.q, &v, h),
    )
}

/// Refuses violations of the constraints at the start.
fn check_residuals(time: f64, residuals: Vec<Residual>) -> Result<(), RunErrorKind> {
    let holds = |one: &Residual| one.relative() <= constrained::START_TOLERANCE;
    if residuals.iter().all(holds) {
        Ok(())
    } else {
        Err(RunErrorKind::Inconsistent { time, residuals })
    }
}
