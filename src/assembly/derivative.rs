//! Derivatives of solved chains by parameters, and by what is asked for at their ends (T-156).

use super::chain::Chain;
use super::error::AssemblyError;
use super::newton::{Iterate, Problem, changes};
use crate::sensitivity::slopes::directions;
use tfe_runtime::Element;
use tfe_runtime::condenser::{Condensed, Condenser, Direction, Placed};

/// What a solution is differentiated by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum By {
    /// A parameter of the model, by its index among all.
    Parameter(usize),
    /// The number that an equation at the ends asks for, by its row.
    Row(usize),
    /// The length of the span, where it is given.
    Length,
}

/// How a solution, with its interiors and globals, changes with each of these: the equations of Newton's method, with other right sides.
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
    let (globals, elements) = (iterate.globals.len(), iterate.nodes.len() - 1);
    let model = problem.model();
    // A direction for each but the rows, behind those of the globals.
    let indices: Vec<usize> = (by.iter())
        .filter_map(|by| match by {
            By::Parameter(index) => Some(*index),
            By::Row(_) | By::Length => None,
        })
        .collect();
    let mut all = vec![Direction::default(); globals];
    let mut parameters = directions(model, &indices).into_iter();
    let mut place = |by: &By| {
        let direction = match by {
            By::Parameter(_) => parameters.next()?,
            By::Length => Direction::default(),
            By::Row(_) => return None,
        };
        all.push(direction);
        Some(2 * N + all.len() - 1)
    };
    let places: Vec<Option<usize>> = by.iter().map(&mut place).collect();
    let columns = 2 * N + all.len() + 1;
    let mut condenser = Condenser::<N>::new::<P::Model>(element).map_err(AssemblyError::Element)?;
    let m = condenser.interior();
    let mut chain = Chain::with_right_sides(2 * N, globals, elements, dense, by.len());
    let mut ends = vec![0.0; 2 * N * columns];
    let mut responses = vec![0.0; elements * m * columns];
    for element in 0..elements {
        let (time, length) = problem.place(element);
        problem.directions(element, &mut all[..globals]);
        for (by, place) in by.iter().zip(&places) {
            if let (By::Length, Some(place)) = (by, place) {
                all[place - 2 * N] = problem.stretched(element);
            }
        }
        let placed = Placed {
            time,
            length,
            start: &iterate.nodes[element],
            interior: &iterate.interiors[element * m..(element + 1) * m],
            damping: problem.damping(),
        };
        let condensed = Condensed {
            ends: &mut ends,
            response: &mut responses[element * m * columns..(element + 1) * m * columns],
        };
        let done = condenser.linearise(model, placed, &all, condensed);
        done.map_err(|source| AssemblyError::Linearise {
            element,
            time,
            source,
        })?;
        let link = chain.link_mut(element);
        for (row, end) in ends.chunks_exact(columns).enumerate() {
            link.matrix[row * 2 * N..(row + 1) * 2 * N].copy_from_slice(&end[..2 * N]);
            link.global[row * globals..(row + 1) * globals]
                .copy_from_slice(&end[2 * N..2 * N + globals]);
        }
        for (side, place) in places.iter().enumerate() {
            let right = &mut chain.right_side_mut(side).links;
            for (row, end) in ends.chunks_exact(columns).enumerate() {
                right[element * 2 * N + row] = place.map_or(0.0, |place| end[place]);
            }
        }
    }
    problem.close(iterate, chain.closure_mut())?;
    for k in 0..dense {
        problem.span(k, iterate, chain.dense_mut(k));
    }
    for (side, by) in by.iter().enumerate() {
        let right = chain.right_side_mut(side);
        right.closure.fill(0.0);
        right.dense.fill(0.0);
        match by {
            By::Parameter(index) => problem.close_by(*index, iterate, &mut right.closure)?,
            By::Row(row) => right.closure[*row] = 1.0,
            By::Length => {}
        }
    }
    (chain.solve()).map_err(|_| AssemblyError::Singular { iterations: 0 })?;
    let found = places.iter().enumerate().map(|(side, place)| {
        let mut change = changes(&chain, side, (elements, m), (&responses, columns));
        if let Some(place) = place {
            let rows = responses.chunks_exact(columns);
            for (x, row) in change.interiors.iter_mut().zip(rows) {
                *x += row[*place];
            }
        }
        change
    });
    Ok(found.collect())
}
