//! The working memory of one element, provided by the caller, so that stepping does not allocate.

use crate::constrained::layout::Layout;
use crate::constrained::rows::rows_len;
use crate::element::Element;
use crate::equations::Kept;
use crate::error::StepError;
use crate::model::Form;

/// Scratch space of one element, [`numbers_len`] numbers and [`pivots_len`] indices.
///
/// It holds the unknowns of the last step, from which the next one starts. It belongs to one
/// [`Memory`](crate::step::Memory) and must not be changed between steps.
#[derive(Debug)]
pub struct Workspace<'a> {
    /// Numbers.
    pub numbers: &'a mut [f64],
    /// Row exchanges of factorisations.
    pub pivots: &'a mut [usize],
}

/// The number of unknown rates at one place: N velocities, or N forces and N velocities.
pub(crate) const fn width(element: &Element, form: Form, coordinates: usize) -> usize {
    match form {
        Form::Hamiltonian if element.has_phase_form() => 2 * coordinates,
        _ => coordinates,
    }
}

/// The number of interior unknowns of an element: rates and, with constraints, the velocity at the end and all
/// multipliers.
pub(crate) const fn interior_len(
    element: &Element,
    form: Form,
    coordinates: usize,
    constraints: usize,
) -> usize {
    if constraints == 0 {
        element.unknowns() * width(element, form, coordinates)
    } else {
        Layout::new(element, coordinates, constraints).size()
    }
}

/// The length of [`Workspace::numbers`] for a valid element and a model with these numbers of coordinates and
/// constraints.
#[must_use]
pub const fn numbers_len(
    element: Element,
    form: Form,
    coordinates: usize,
    constraints: usize,
) -> usize {
    let (k, u) = (element.points(), element.unknowns());
    let m = interior_len(&element, form, coordinates, constraints);
    // Unknowns, their initial guess, increments; forces and momenta at the points; impulses and mass matrices of the
    // rows; extrapolation matrix; rows of constraints; tangent.
    3 * m
        + 2 * k * coordinates
        + u * coordinates * (1 + coordinates)
        + u * u
        + rows_len(coordinates, constraints)
        + m * m
}

/// The length of [`Workspace::pivots`].
#[must_use]
pub const fn pivots_len(
    element: Element,
    form: Form,
    coordinates: usize,
    constraints: usize,
) -> usize {
    let m = interior_len(&element, form, coordinates, constraints);
    m + element.unknowns() * coordinates + constraints
}

/// The additional memory that a transition matrix needs.
#[must_use]
pub const fn transition_len(
    element: Element,
    form: Form,
    coordinates: usize,
    constraints: usize,
) -> usize {
    linearised_len(element, form, coordinates, constraints, 0)
}

/// The same with derivatives by this number of further directions.
#[must_use]
pub const fn linearised_len(
    element: Element,
    form: Form,
    coordinates: usize,
    constraints: usize,
    directions: usize,
) -> usize {
    let m = interior_len(&element, form, coordinates, constraints);
    // A right-hand side for each direction, and the derivatives of the momentum at the end.
    (2 * coordinates + directions) * m + coordinates * (m + coordinates + directions)
}

/// The workspace divided into its parts.
pub(crate) struct Parts<'a, const N: usize> {
    /// The unknown rates: U rows; in phase form U rows of forces, then U rows of velocities.
    pub(crate) unknowns: &'a mut [f64],
    /// The initial guess of the iteration.
    pub(crate) origin: &'a mut [f64],
    /// Residual or increment.
    pub(crate) step: &'a mut [f64],
    /// What the equations of the element keep.
    pub(crate) kept: Kept<'a, N>,
    /// The contributions of impulses to the rows.
    pub(crate) kicks: &'a mut [[f64; N]],
    /// The extrapolation matrix from old to new unknowns; U × U.
    pub(crate) extrapolation: &'a mut [f64],
    /// The rows of constraints.
    pub(crate) rows: &'a mut [f64],
    /// The tangent of Newton's method, or its LU factors.
    pub(crate) tangent: &'a mut [f64],
    pub(crate) tangent_pivots: &'a mut [usize],
    /// One for each constraint that is independent of those before it, zero for the others.
    pub(crate) active: &'a mut [usize],
}

impl<'a, const N: usize> Parts<'a, N> {
    pub(crate) fn of(
        workspace: Workspace<'a>,
        element: &Element,
        form: Form,
        constraints: usize,
    ) -> Result<Self, StepError> {
        let (k, u) = (element.points(), element.unknowns());
        let m = interior_len(element, form, N, constraints);
        let needed = numbers_len(*element, form, N, constraints);
        let indices = pivots_len(*element, form, N, constraints);
        if workspace.numbers.len() < needed || workspace.pivots.len() < indices {
            let given = workspace.numbers.len();
            return Err(StepError::Workspace { needed, given });
        }
        let (unknowns, rest) = workspace.numbers.split_at_mut(m);
        let (origin, rest) = rest.split_at_mut(m);
        let (step, rest) = rest.split_at_mut(m);
        let (forces, rest) = rest.split_at_mut(k * N);
        let (momenta, rest) = rest.split_at_mut(k * N);
        let (kicks, rest) = rest.split_at_mut(u * N);
        let (masses, rest) = rest.split_at_mut(u * N * N);
        let (extrapolation, rest) = rest.split_at_mut(u * u);
        let (rows, rest) = rest.split_at_mut(rows_len(N, constraints));
        let (tangent, _) = rest.split_at_mut(m * m);
        let (tangent_pivots, rest) = workspace.pivots.split_at_mut(m);
        let (mass_pivots, rest) = rest.split_at_mut(u * N);
        let (active, _) = rest.split_at_mut(constraints);
        Ok(Self {
            unknowns,
            origin,
            step,
            kept: Kept {
                forces: forces.as_chunks_mut().0,
                momenta: momenta.as_chunks_mut().0,
                masses,
                mass_pivots,
            },
            kicks: kicks.as_chunks_mut().0,
            extrapolation,
            rows,
            tangent,
            tangent_pivots,
            active,
        })
    }
}

/// The working memory of an iteration.
pub(crate) struct Scratch<'a> {
    pub(crate) unknowns: &'a mut [f64],
    pub(crate) step: &'a mut [f64],
    pub(crate) tangent: &'a mut [f64],
    pub(crate) pivots: &'a mut [usize],
}
