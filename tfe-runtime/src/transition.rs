//! Transition matrices: the derivative of a step by its start, by implicit differentiation (T-30).
//!
//! Rows are solved for the unknown rates given (p₀, q₀); the interior block of a primal element,
//! singular at isolated steps, is never inverted.

mod wanted;

#[cfg(feature = "alloc")]
use crate::backwards::Backwards;
use crate::condense::{Direction, EndForces, Parameter, System, check_sums};
use crate::constrained::element::ConstrainedForm;
use crate::constrained::layout::Layout;
use crate::constrained::rows::Rows;
use crate::equations::Span;
pub use crate::error::TransitionError;
use crate::error::{ConstraintError, StepError};
#[cfg(feature = "alloc")]
use crate::inside::InsideLoss;
#[cfg(feature = "alloc")]
use crate::method::Last;
use crate::method::{Impulse, Interval, Memory, Method, may_be_phase, set_kicks, total};
use crate::model::Model;
#[cfg(feature = "alloc")]
use crate::model::State;
use crate::phase_form::PhaseForm;
use crate::scheme::Tables;
use crate::velocity_form::VelocityForm;
use crate::workspace::{Parts, Workspace, linearised_len};
#[cfg(feature = "alloc")]
use crate::workspace::{numbers_len, pivots_len, transition_len};
#[cfg(feature = "alloc")]
use alloc::{vec, vec::Vec};
#[cfg(feature = "alloc")]
use wanted::MatrixInside;
use wanted::{Matrix, Product, Wanted};

/// Writes the transition matrix of one step from `state`, 2N × 2N, row by row, ordered (p, q);
/// returns the end of the step.
///
/// # Errors
/// [`TransitionError::Element`] if the element is invalid; [`TransitionError::Step`] if the model does not pass its
/// [check](Model::check), the step fails or its tangent is singular; [`TransitionError::Shape`] if `matrix` is shorter than
/// 4N².
#[cfg(feature = "alloc")]
pub fn of_step<M, const N: usize>(
    model: &M,
    element: crate::element::Element,
    state: &State<N>,
    t: f64,
    h: f64,
    matrix: &mut [f64],
) -> Result<State<N>, TransitionError>
where
    M: Model<N>,
{
    let control = crate::newton::Control::default();
    let mut stepper = crate::stepper::Stepper::new(model, element, control)?;
    let mut end = *state;
    stepper.advance(t, h, &mut end, &[])?;
    stepper.transition(matrix)?;
    Ok(end)
}

/// Writes the transition matrix of one step of length h of a linear model without forces of its own, 2N × 2N, row by
/// row, ordered (p, q). It is that of the step at rest at the origin (T-30), which need not be solved.
///
/// # Errors
/// [`TransitionError`] if the model does not pass its [check](Model::check), the element is invalid, its tangent is
/// singular, or `matrix` is shorter than 4N².
#[cfg(feature = "alloc")]
pub fn of_rest<M, const N: usize>(
    model: &M,
    element: crate::element::Element,
    h: f64,
    matrix: &mut [f64],
) -> Result<(), TransitionError>
where
    M: Model<N>,
{
    model.check()?;
    let tables = crate::scheme::SchemeTable::new(element)?;
    let constraints = M::CONSTRAINTS.len();
    let mut numbers = vec![0.0; numbers_len(element, M::FORM, N, constraints)];
    let mut pivots = vec![0; pivots_len(element, M::FORM, N, constraints)];
    let mut extra = vec![0.0; transition_len(element, M::FORM, N, constraints)];
    let mut memory = Memory::new();
    memory.last = Some(Last {
        t: 0.0,
        h,
        start: State::ZERO,
        start_low: State::ZERO,
        end: State::ZERO,
    });
    let method = Method {
        model,
        tables: &tables,
        control: crate::newton::Control::default(),
    };
    let workspace = Workspace {
        numbers: &mut numbers,
        pivots: &mut pivots,
    };
    method.transition(&mut memory, workspace, &mut extra, &[], matrix)
}

impl<M, T> Method<'_, M, T>
where
    T: Tables,
{
    /// Writes the transition matrix of the last step, 2N × 2N, row by row, ordered (p, q).
    ///
    /// `extra` needs [`transition_len`](crate::workspace::transition_len) numbers; `impulses` are those of the step.
    ///
    /// # Errors
    /// [`TransitionError`] if there is no last step, its tangent is singular, or memory is short.
    pub fn transition<const N: usize>(
        &self,
        memory: &mut Memory<N>,
        workspace: Workspace<'_>,
        extra: &mut [f64],
        impulses: &[Impulse<N>],
        matrix: &mut [f64],
    ) -> Result<(), TransitionError>
    where
        M: Model<N>,
    {
        self.linearise(memory, workspace, extra, (impulses, &[]), matrix)
    }

    /// Writes the derivative of the end of the last step by its start and by g directions, 2N × (2N + g), row by row.
    ///
    /// `extra` needs [`linearised_len`] numbers; `impulses` are those of the step, and do not move with directions that
    /// move its time.
    ///
    /// # Errors
    /// As [`transition`](Self::transition).
    pub fn linearise<const N: usize>(
        &self,
        memory: &mut Memory<N>,
        workspace: Workspace<'_>,
        extra: &mut [f64],
        (impulses, directions): (&[Impulse<N>], &[Direction]),
        matrix: &mut [f64],
    ) -> Result<(), TransitionError>
    where
        M: Model<N>,
    {
        let needed = 2 * N * (2 * N + directions.len());
        if matrix.len() < needed {
            let given = matrix.len();
            return Err(TransitionError::Shape { needed, given });
        }
        let wanted = Matrix {
            ends: &mut matrix[..needed],
        };
        self.differentiate(memory, workspace, extra, (impulses, directions), wanted)
    }

    /// The same, with the derivatives of the Legendre coefficients of the element's polynomials.
    #[cfg(feature = "alloc")]
    pub(crate) fn linearise_inside<const N: usize>(
        &self,
        memory: &mut Memory<N>,
        workspace: Workspace<'_>,
        extra: &mut [f64],
        given: (&[Impulse<N>], &[Direction]),
        (ends, inside): (&mut [f64], &mut Vec<f64>),
    ) -> Result<(), TransitionError>
    where
        M: Model<N>,
    {
        let wanted = MatrixInside { ends, inside };
        self.differentiate(memory, workspace, extra, given, wanted)
    }

    /// Multiplies that matrix by the row `lambda`, 2N numbers, from the left: the result for the first 2N columns
    /// replaces `lambda`, that for the others is added to the g numbers `by_direction`. Without constraints it costs
    /// one solve with the transposed LU factors of the tangent, whatever the number of directions.
    ///
    /// # Errors
    /// As [`transition`](Self::transition).
    pub fn adjoint<const N: usize>(
        &self,
        memory: &mut Memory<N>,
        workspace: Workspace<'_>,
        extra: &mut [f64],
        (impulses, directions): (&[Impulse<N>], &[Direction]),
        (lambda, by_direction): (&mut [f64], &mut [f64]),
    ) -> Result<(), TransitionError>
    where
        M: Model<N>,
    {
        check_sums::<N>(directions, lambda, by_direction)?;
        let wanted = Product {
            lambda,
            by_direction,
            #[cfg(feature = "alloc")]
            at_once: None,
            #[cfg(feature = "alloc")]
            inside: None,
        };
        self.differentiate(memory, workspace, extra, (impulses, directions), wanted)
    }

    /// The same, with a loss that depends on the inside of the element.
    #[cfg(feature = "alloc")]
    pub(crate) fn adjoint_inside<const N: usize>(
        &self,
        memory: &mut Memory<N>,
        workspace: Workspace<'_>,
        extra: &mut [f64],
        given: (&[Impulse<N>], &[Direction]),
        (inside, lambda, by_direction): (Option<&InsideLoss>, &mut [f64], &mut [f64]),
    ) -> Result<(), TransitionError>
    where
        M: Model<N>,
    {
        check_sums::<N>(given.1, lambda, by_direction)?;
        let wanted = Product {
            lambda,
            by_direction,
            at_once: None,
            inside,
        };
        self.differentiate(memory, workspace, extra, given, wanted)
    }

    /// The same by all parameters at once, for a model without constraints.
    #[cfg(feature = "alloc")]
    pub(crate) fn adjoint_at_once<const N: usize>(
        &self,
        memory: &mut Memory<N>,
        workspace: Workspace<'_>,
        extra: &mut [f64],
        impulses: &[Impulse<N>],
        (inside, lambda, backwards): (Option<&InsideLoss>, &mut [f64], &mut Backwards<N>),
    ) -> Result<(), TransitionError>
    where
        M: Model<N>,
    {
        let wanted = Product {
            lambda,
            by_direction: &mut [],
            at_once: Some(backwards),
            inside,
        };
        self.differentiate(memory, workspace, extra, (impulses, &[]), wanted)
    }

    fn differentiate<const N: usize>(
        &self,
        memory: &mut Memory<N>,
        workspace: Workspace<'_>,
        extra: &mut [f64],
        (impulses, directions): (&[Impulse<N>], &[Direction]),
        mut wanted: impl Wanted<N>,
    ) -> Result<(), TransitionError>
    where
        M: Model<N>,
    {
        let Some(last) = memory.last else {
            return Err(TransitionError::NoStep);
        };
        let scheme = self.tables.view();
        let parts = Parts::of(workspace, &scheme.element, M::FORM, M::CONSTRAINTS.len())?;
        let columns = 2 * N + directions.len();
        let constraints = M::CONSTRAINTS.len();
        let needed = linearised_len(scheme.element, M::FORM, N, constraints, directions.len());
        if extra.len() < needed {
            return Err(StepError::Workspace {
                needed,
                given: extra.len(),
            }
            .into());
        }
        check_parameters(self.model, directions)?;
        let interval = Interval {
            start: last.t,
            length: last.h,
            impulses,
        };
        if let Some(time) = moved_impulse(&interval, directions) {
            return Err(TransitionError::MovedImpulse { time });
        }
        set_kicks(&scheme, &interval, parts.kicks);
        // For a linear model the factors are overwritten by equal ones, but that is not guaranteed.
        memory.forget_factors();
        let kicks: &[[f64; N]] = parts.kicks;
        let span = Span {
            t: last.t,
            h: last.h,
            start: &last.start,
            low: &last.start_low,
            kicks,
            damping: 0.0,
        };
        // One right-hand side, and later solution, for each of the 2N components of the start and each of the other
        // directions.
        let m = parts.unknowns.len();
        let (sides, forces) = extra[..needed].split_at_mut(columns * m);
        let mut system = System {
            tangent: parts.tangent,
            pivots: parts.tangent_pivots,
            residual: parts.step,
            sides,
        };
        if const { !M::CONSTRAINTS.is_empty() } {
            let place = (last.t, &last.start.q);
            let mut rows = Rows::at_start_again(parts.rows, self.model, place, parts.active);
            let layout = Layout::new(&scheme.element, N, M::CONSTRAINTS.len());
            rows.combine_multipliers(&layout, parts.unknowns);
            let mut form = ConstrainedForm::new(
                VelocityForm::new(
                    self.model,
                    (scheme, span),
                    parts.kept,
                    (&mut memory.mass, &mut memory.statistics),
                ),
                layout,
                rows,
                parts.active,
                total(impulses, last.h),
            );
            let linearised = wanted.of_constrained(&mut form, parts.unknowns, directions, system);
            form.constraints
                .rows
                .restore_multipliers(&layout, parts.unknowns);
            return Ok(linearised?);
        }
        if const { may_be_phase::<M, N>() } && scheme.element.has_phase_form() {
            let mut equations = PhaseForm::new(
                self.model,
                (scheme, span),
                parts.kept,
                &mut memory.statistics,
            );
            system.of_phase(&mut equations, parts.unknowns, directions);
            wanted.of_phase(&equations, parts.unknowns, directions, system)?;
        } else {
            let mut equations = VelocityForm::new(
                self.model,
                (scheme, span),
                parts.kept,
                (&mut memory.mass, &mut memory.statistics),
            );
            if wanted.by_iteration(&mut equations, parts.unknowns)? {
                return Ok(());
            }
            let mut forces = EndForces::of(forces, m);
            system.of_velocities(&mut equations, parts.unknowns, directions, &mut forces)?;
            let given = (directions, &forces);
            wanted.of_velocities(&mut equations, parts.unknowns, given, system)?;
        }
        Ok(())
    }
}

/// Refuses parameters that the model does not have; their derivatives would be zero.
fn check_parameters<M, const N: usize>(
    model: &M,
    directions: &[Direction],
) -> Result<(), TransitionError>
where
    M: Model<N>,
{
    let is_known = |direction: &Direction| match direction.parameter {
        None => true,
        Some(Parameter::Named(index)) => index < M::SENSITIVITIES.len(),
        Some(Parameter::Any(index)) => index < model.parameters(),
    };
    if directions.iter().all(is_known) {
        Ok(())
    } else {
        Err(StepError::from(ConstraintError::Parameter).into())
    }
}

/// The time of an impulse whose place τ in the element changes along one of the directions.
fn moved_impulse<const N: usize>(
    interval: &Interval<'_, N>,
    directions: &[Direction],
) -> Option<f64> {
    let moves = |tau: f64| (directions.iter()).any(|one| one.time + tau * one.length != 0.0);
    let moved = (interval.impulses.iter()).find(|impulse| moves(interval.place(impulse)));
    moved.map(|impulse| impulse.time)
}
