//! Transition matrices: the derivative of a step by its start, by implicit differentiation (T-30).
//!
//! Rows are solved for the unknown rates given (p₀, q₀); the interior block of a primal element,
//! singular at isolated steps, is never inverted.

#[cfg(feature = "alloc")]
use crate::backwards::Backwards;
use crate::condense::{
    Direction, EndForces, System, phase_ends, phase_weights, velocity_ends, velocity_weights,
};
use crate::constrained::element::ConstrainedForm;
use crate::constrained::layout::Layout;
use crate::constrained::linearise;
use crate::constrained::rows::Rows;
use crate::equations::Span;
use crate::error::StepError;
pub use crate::error::TransitionError;
#[cfg(feature = "alloc")]
use crate::inside::{Columns, InsideLoss, Seeds};
use crate::method::{Impulse, Interval, Memory, Method, may_be_phase, set_kicks, total};
use crate::model::Model;
#[cfg(feature = "alloc")]
use crate::model::State;
use crate::phase_form::PhaseForm;
use crate::scheme::Tables;
use crate::velocity_form::VelocityForm;
use crate::workspace::{Parts, Workspace, linearised_len};
#[cfg(feature = "alloc")]
use alloc::{vec, vec::Vec};

/// Writes the transition matrix of one step from `state`, 2N × 2N, row by row, ordered (p, q);
/// returns the end of the step.
///
/// # Errors
/// [`TransitionError`] if the element is none, the step fails, or `matrix` is shorter than 4N².
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

/// What is made of the linear system of an element.
enum Asked<'a, const N: usize> {
    /// The derivatives of the end, row by row, with the columns of the sides.
    Matrix(Matrix<'a>),
    /// Their product with λ, from the left: that with the columns of the start takes the place of λ, those of the directions are added to others.
    Product(Product<'a, N>),
}

/// Where derivatives go.
struct Matrix<'a> {
    ends: &'a mut [f64],
    /// Those of the polynomials of the element, where they are asked for.
    #[cfg(feature = "alloc")]
    inside: Option<&'a mut Vec<f64>>,
}

/// What is multiplied, and where the product goes.
struct Product<'a, const N: usize> {
    /// λ
    lambda: &'a mut [f64],
    by_direction: &'a mut [f64],
    /// For all parameters at once, which are no directions then.
    #[cfg(feature = "alloc")]
    at_once: Option<&'a mut Backwards<N>>,
    /// What else is asked for: a loss of the inside of the element.
    #[cfg(feature = "alloc")]
    inside: Option<&'a InsideLoss>,
}

/// Refuses sums that are not as many as the columns.
fn check_sums<const N: usize>(
    directions: &[Direction],
    lambda: &[f64],
    by_direction: &[f64],
) -> Result<(), TransitionError> {
    if lambda.len() == 2 * N && by_direction.len() == directions.len() {
        return Ok(());
    }
    Err(TransitionError::Shape {
        needed: 2 * N + directions.len(),
        given: lambda.len().min(2 * N) + by_direction.len(),
    })
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
    /// `extra` needs [`linearised_len`] numbers; `impulses` are those of the step, and do not move with directions that move its time.
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
        let asked = Asked::Matrix(Matrix {
            ends: &mut matrix[..needed],
            #[cfg(feature = "alloc")]
            inside: None,
        });
        self.differentiate(memory, workspace, extra, (impulses, directions), asked)
    }

    /// The same, and the derivatives of the Legendre coefficients of the element's polynomials.
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
        let asked = Asked::Matrix(Matrix {
            ends,
            inside: Some(inside),
        });
        self.differentiate(memory, workspace, extra, given, asked)
    }

    /// Multiplies that matrix with `lambda`, 2N numbers, from the left: its first 2N columns take the place of `lambda`, the others are added to the g numbers `by_direction`. Without
    /// constraints it costs one solution with the factors of the tangent, whatever the number of directions.
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
        let asked = Asked::Product(Product {
            lambda,
            by_direction,
            #[cfg(feature = "alloc")]
            at_once: None,
            #[cfg(feature = "alloc")]
            inside: None,
        });
        self.differentiate(memory, workspace, extra, (impulses, directions), asked)
    }

    /// The same with a loss of the inside of the element.
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
        let asked = Asked::Product(Product {
            lambda,
            by_direction,
            at_once: None,
            inside,
        });
        self.differentiate(memory, workspace, extra, given, asked)
    }

    /// The same by all parameters at once, of a model without constraints.
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
        let asked = Asked::Product(Product {
            lambda,
            by_direction: &mut [],
            at_once: Some(backwards),
            inside,
        });
        self.differentiate(memory, workspace, extra, (impulses, &[]), asked)
    }

    fn differentiate<const N: usize>(
        &self,
        memory: &mut Memory<N>,
        workspace: Workspace<'_>,
        extra: &mut [f64],
        (impulses, directions): (&[Impulse<N>], &[Direction]),
        asked: Asked<'_, N>,
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
        let interval = Interval {
            start: last.t,
            length: last.h,
            impulses,
        };
        set_kicks(&scheme, &interval, parts.kicks);
        // The factors of a linear model are overwritten with equal ones, but that is not promised.
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
        // One right side, or solution, for each of the 2N directions of the start, and of the others.
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
            let is_combined = rows.is_combined();
            if is_combined {
                for place in layout.multipliers() {
                    rows.combine_multipliers(&mut parts.unknowns[place]);
                }
            }
            let mut form = ConstrainedForm::new(
                VelocityForm {
                    model: self.model,
                    scheme,
                    span,
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
                total(impulses),
            );
            let x = &*parts.unknowns;
            let linearised = match asked {
                Asked::Matrix(matrix) => {
                    let solved = linearise(&mut form, x, directions, false, system, matrix.ends);
                    #[cfg(feature = "alloc")]
                    let solved = solved.and_then(|sides| {
                        let Some(inside) = matrix.inside else {
                            return Ok(sides);
                        };
                        let columns = Columns {
                            scheme,
                            h: last.h,
                            directions,
                            sides,
                        };
                        *inside = columns.of_constrained(&mut form.inner, x, matrix.ends)?;
                        Ok(sides)
                    });
                    solved.map(|_| ())
                }
                Asked::Product(product) => multiply(&mut form, x, directions, system, product),
            };
            if is_combined {
                for place in layout.multipliers() {
                    form.constraints
                        .rows
                        .declared_multipliers(&mut parts.unknowns[place]);
                }
            }
            return Ok(linearised?);
        }
        if const { may_be_phase::<M, N>() } && scheme.element.has_phase_form() {
            let mut equations = PhaseForm {
                model: self.model,
                scheme,
                span,
                momenta: parts.momenta,
                velocities: parts.forces,
                masses: parts.masses,
                swept: false,
                statistics: &mut memory.statistics,
            };
            system.of_phase(&mut equations, parts.unknowns, directions);
            let (scheme, x) = (&equations.scheme, &*parts.unknowns);
            match asked {
                Asked::Matrix(matrix) => {
                    let sides = &*system.solve()?.sides;
                    phase_ends::<N>(scheme, span.h, x, directions, sides, matrix.ends);
                    #[cfg(feature = "alloc")]
                    if let Some(inside) = matrix.inside {
                        let columns: Columns<'_, N> = Columns {
                            scheme: *scheme,
                            h: span.h,
                            directions,
                            sides,
                        };
                        *inside = columns.of_phase(x);
                    }
                }
                Asked::Product(product) => {
                    let (lambda, by_direction) = (product.lambda, product.by_direction);
                    let sums = (&*lambda, &mut *by_direction, &mut *system.residual);
                    phase_weights::<N>(scheme, span.h, x, directions, sums);
                    #[cfg(feature = "alloc")]
                    {
                        let seeds = Seeds::of(product.inside, scheme, span.h);
                        seeds.add_to_phase(x, (directions, span.h), by_direction, system.residual);
                    }
                    let _mu = system.product(lambda, by_direction)?;
                    #[cfg(feature = "alloc")]
                    if let Some(backwards) = product.at_once {
                        backwards.of_phase(&equations, x, _mu);
                    }
                }
            }
        } else {
            let mut equations = VelocityForm {
                model: self.model,
                scheme,
                span,
                forces: parts.forces,
                momenta: parts.momenta,
                masses: parts.masses,
                mass_pivots: parts.mass_pivots,
                constant_mass: &mut memory.mass,
                statistics: &mut memory.statistics,
            };
            #[cfg(feature = "alloc")]
            let mut asked = asked;
            #[cfg(feature = "alloc")]
            if let Asked::Product(product) = &mut asked
                && let Some(backwards) = &mut product.at_once
                && backwards.try_iteration(
                    &mut equations,
                    parts.unknowns,
                    (product.inside, product.lambda),
                )?
            {
                return Ok(());
            }
            let mut forces = EndForces::of(forces, m);
            system.of_velocities(&mut equations, parts.unknowns, directions, &mut forces)?;
            let (x, h) = (&*parts.unknowns, span.h);
            match asked {
                Asked::Matrix(matrix) => {
                    let sides = &*system.solve()?.sides;
                    velocity_ends(&scheme, h, x, directions, &forces, sides, matrix.ends);
                    #[cfg(feature = "alloc")]
                    if let Some(inside) = matrix.inside {
                        let columns = Columns {
                            scheme,
                            h,
                            directions,
                            sides,
                        };
                        *inside = columns.of_velocities(&mut equations, x)?;
                    }
                }
                Asked::Product(product) => {
                    let (lambda, by_direction) = (product.lambda, product.by_direction);
                    let mut _of_p = [0.0; N];
                    _of_p.copy_from_slice(&lambda[..N]);
                    let sums = (&mut *lambda, &mut *by_direction, &mut *system.residual);
                    velocity_weights(&scheme, h, x, (directions, &forces), sums);
                    #[cfg(feature = "alloc")]
                    let seeds = Seeds::of(product.inside, &scheme, h);
                    #[cfg(feature = "alloc")]
                    {
                        let sums = (&mut *lambda, &mut *by_direction, &mut *system.residual);
                        seeds.add_to_velocities(&mut equations, x, directions, sums)?;
                    }
                    let _mu = system.product(lambda, by_direction)?;
                    #[cfg(feature = "alloc")]
                    if let Some(backwards) = product.at_once {
                        let sums = (&_of_p, _mu);
                        backwards.of_velocities(&mut equations, x, sums, &seeds.forces)?;
                    }
                }
            }
        }
        Ok(())
    }
}

/// The product of the derivatives of a constrained element with λ, from the left.
#[cfg(feature = "alloc")]
fn multiply<M: Model<N>, const N: usize>(
    form: &mut ConstrainedForm<'_, M, N>,
    x: &[f64],
    directions: &[Direction],
    system: System<'_>,
    product: Product<'_, N>,
) -> Result<(), StepError> {
    let columns = 2 * N + directions.len();
    let mut ends = vec![0.0; 2 * N * columns];
    let sides = linearise(form, x, directions, false, system, &mut ends)?;
    let Product {
        lambda,
        by_direction,
        inside,
        ..
    } = product;
    let weights = lambda.to_vec();
    lambda.fill(0.0);
    let mut add = |weights: &[f64], rows: &[f64]| {
        for (weight, row) in weights.iter().zip(rows.chunks_exact(columns)) {
            let sums = lambda.iter_mut().chain(by_direction.iter_mut());
            for (sum, entry) in sums.zip(row) {
                *sum += weight * entry;
            }
        }
    };
    add(&weights, &ends);
    if let Some(inside) = inside {
        let own = Columns {
            scheme: form.inner.scheme,
            h: form.inner.span.h,
            directions,
            sides,
        };
        let rows = own.of_constrained(&mut form.inner, x, &ends)?;
        add(&inside.coefficients, &rows);
    }
    Ok(())
}

#[cfg(not(feature = "alloc"))]
fn multiply<M: Model<N>, const N: usize>(
    _: &mut ConstrainedForm<'_, M, N>,
    _: &[f64],
    _: &[Direction],
    _: System<'_>,
    _: Product<'_, N>,
) -> Result<(), StepError> {
    // Gradients are asked for where there is an allocator.
    Err(StepError::NonFinite)
}
