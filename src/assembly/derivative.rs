//! Derivatives of solutions of assembled problems by parameters and by the values prescribed at the ends (T-156).

use super::error::AssemblyError;
use super::newton::{Assembly, By, Iterate, Problem};
use crate::sensitivity::slopes::directions;
use tfe_runtime::Element;
use tfe_runtime::condenser::Direction;

/// The derivatives of a solution (nodes, interior unknowns and globals) by each quantity of `by`: the linear system of
/// Newton's method with other right sides.
pub(crate) fn derivatives<P: Problem<N>, const N: usize>(
    element: Element,
    problem: &P,
    iterate: &Iterate<N>,
    dense: usize,
    by: &[By],
) -> Result<Vec<Iterate<N>>, AssemblyError> {
    if by.is_empty() {
        return Ok(Vec::new());
    }
    // A direction for each quantity on which the elements depend.
    let (mut more, mut length) = (Vec::new(), None);
    let place = |by: &By| {
        let direction = match by {
            By::Parameter(index) => directions(problem.model(), &[*index]).pop()?,
            By::Length => {
                length = Some(more.len());
                Direction::default()
            }
            By::Row(_) => return None,
        };
        more.push(direction);
        Some(more.len() - 1)
    };
    let places: Vec<Option<usize>> = by.iter().map(place).collect();
    let by: Vec<_> = by.iter().copied().zip(places).collect();
    let (globals, elements) = (iterate.globals.len(), iterate.nodes.len() - 1);
    let sides = (&more[..], length, by.len());
    let mut assembly = Assembly::by::<P::Model>(element, elements, (globals, dense), sides)
        .map_err(AssemblyError::Element)?;
    assembly.link(problem, iterate)?;
    assembly.changes(problem, iterate, &by)
}
