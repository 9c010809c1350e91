//! Models with the time as a further coordinate, stepped in a time τ of their own.

use crate::diagnostic::Kind;
use crate::expr::constant::Constant;
use crate::expr::differentiate::derivative;
use crate::expr::graph::{ExprId, Graph};
use crate::expr::input::{Affine, Input};
use crate::expr::rewrite::UNROLL_LIMIT;
use crate::model::declared::{
    CLOCK, CLOCK_MOMENTUM, CoordinateArray, Declared, Force, TimeTransformation,
};

/// The model in the time τ, for a Hamiltonian model with a known number N of coordinates:
///
/// ```text
/// H̃(q, t, p, p_t) = g (H + p_t) ,     Q̃ = g Q ,     Q̃_t = −g Σ Q_a ∂H/∂p_a
/// ```
///
/// with t for the time wherever it stood, as coordinate N.
///
/// # Errors
/// [`Kind::PowerOfLoop`] if there are forces and the velocities ∂H/∂p cannot be written out.
pub(super) fn extended(mut model: Declared, rate: ExprId) -> Result<Declared, Kind> {
    let Some(clock) = model.dof.as_constant() else {
        // Reported where it is declared.
        return Ok(model);
    };
    let index = Affine::constant(clock);
    let graph = &mut model.graph;
    let rate = with_clock(graph, rate, &index);
    let hamiltonian = with_clock(graph, model.energy, &index);
    for force in &mut model.forces {
        force.value = with_clock(graph, force.value, &index);
    }
    for observable in &mut model.observables {
        observable.value = with_clock(graph, observable.value, &index);
    }
    let power = power(graph, &model.forces, hamiltonian)?;
    for force in &mut model.forces {
        force.value = graph.multiply(rate, force.value);
    }
    if !graph.as_constant(power).is_some_and(Constant::is_zero) {
        let loss = graph.multiply(rate, power);
        model.forces.push(Force {
            ranges: Vec::new(),
            target: index.clone(),
            value: graph.negate(loss),
        });
    }
    let momentum = graph.input(Input::Momentum(index.clone()));
    let balance = graph.add(hamiltonian, momentum);
    model.energy = graph.multiply(rate, balance);
    model.time_transformation = Some(TimeTransformation {
        hamiltonian,
        clock: usize::try_from(clock).unwrap_or_default(),
    });
    model.coordinates.push(single(CLOCK, &index));
    model.momenta.push(single(CLOCK_MOMENTUM, &index));
    model.dof = Affine::constant(clock + 1);
    Ok(model)
}

fn single(name: &str, index: &Affine) -> CoordinateArray {
    CoordinateArray {
        name: name.to_owned(),
        first: index.clone(),
        length: None,
    }
}

/// The expression with a coordinate in place of the time.
fn with_clock(graph: &mut Graph, id: ExprId, clock: &Affine) -> ExprId {
    graph.with_leaves(id, &mut |graph, input| {
        (*input == Input::Time).then(|| graph.input(Input::Coordinate(clock.clone())))
    })
}

/// Σ Q_a ∂H/∂p_a
fn power(graph: &mut Graph, forces: &[Force], hamiltonian: ExprId) -> Result<ExprId, Kind> {
    let mut power = graph.integer(0);
    if forces.is_empty() {
        return Ok(power);
    }
    let too_long = || Kind::PowerOfLoop {
        limit: UNROLL_LIMIT as usize,
    };
    let hamiltonian = graph.unroll(hamiltonian).map_err(|_| too_long())?;
    if graph.contains_sum(hamiltonian) {
        return Err(too_long());
    }
    for force in forces {
        for (target, value) in force.written_out(graph) {
            let velocity = derivative(graph, hamiltonian, &Input::Momentum(target));
            let part = graph.multiply(value, velocity);
            power = graph.add(power, part);
        }
    }
    Ok(power)
}
