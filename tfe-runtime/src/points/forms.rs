//! Which of the three forms of the equations a model has, and with which elements; known at compile time.

use crate::element::Element;
use crate::model::{Form, Model};
use crate::registers::storage::MAX_GROUPS;

/// Whether all points can be iterated at once: for a nonlinear model without constraints, and an element with at most
/// 16 points that has one of the forms.
pub(crate) const fn are_possible<M, const N: usize>(element: &Element) -> bool
where
    M: Model<N>,
{
    let is_small = element.points() <= 4 * MAX_GROUPS;
    N > 0 && is_small && !M::FACTS.linear && M::CONSTRAINTS.is_empty() && has_form::<M, N>(element)
}

/// The coordinates that take part in the iteration: all that are not ignorable.
pub(crate) const fn acting<M, const N: usize>() -> [bool; N]
where
    M: Model<N>,
{
    let (mut acting, mut a) = ([true; N], 0);
    while a < N {
        acting[a] = !M::IGNORABLE[a];
        a += 1;
    }
    acting
}

/// Whether the equations are M q̈ = f.
pub(crate) const fn is_second_order<M, const N: usize>() -> bool
where
    M: Model<N>,
{
    M::FACTS.constant_mass && M::FACTS.separable && !M::FACTS.time_dependent
}

/// Whether rates of momenta are unknowns as well.
pub(crate) const fn is_phase<M, const N: usize>() -> bool
where
    M: Model<N>,
{
    matches!(M::FORM, Form::Hamiltonian)
}

/// Whether the element has one of the three forms for the model as it was declared: true unless the element requires
/// velocities of a Hamiltonian.
pub(crate) const fn has_form<M, const N: usize>(element: &Element) -> bool
where
    M: Model<N>,
{
    match M::FORM {
        Form::Lagrangian => true,
        Form::Hamiltonian => element.has_phase_form() || is_second_order::<M, N>(),
    }
}

/// Whether the rates at the points have to be projected, because there are more points than unknown rates.
pub(crate) const fn is_projected<M, const N: usize>(element: &Element) -> bool
where
    M: Model<N>,
{
    !element.is_collocated() && !is_second_order::<M, N>()
}
