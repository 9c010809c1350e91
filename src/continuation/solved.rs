//! An orbit of a branch with its multipliers, its tangent and its test functions.

use super::arc::Row;
use super::branch::Member;
use super::events::{Circumstances, Tests};
use super::problem::Continued;
use crate::assembly::{Assembly, Iterate};
use crate::periodic::OrbitError;
use crate::periodic::orbit::{multipliers_of, trivial_of};
use crate::periodic::problem::Periodic;
use crate::periodic_schur::Multiplier;
use tfe_runtime::Model;

/// An orbit with the data needed to continue from it.
#[derive(Clone)]
pub(super) struct Solved<M, const N: usize> {
    pub(super) member: Member<M, N>,
    pub(super) floquet: Vec<Multiplier>,
    /// A unit vector.
    pub(super) tangent: Iterate<N>,
    /// dT/dλ, if the period is a given function of the parameter.
    pub(super) rate: f64,
    pub(super) tests: Tests,
    pub(super) iterations: u32,
}

impl<M, const N: usize> Solved<M, N> {
    pub(super) fn parameter(&self) -> f64 {
        let globals = &self.member.iterate.globals;
        globals.last().copied().unwrap_or(f64::NAN)
    }
}

/// An orbit from a converged iterate.
pub(super) fn solved<M: Model<N> + Clone, const N: usize>(
    problem: &Continued<'_, M, N>,
    assembly: &Assembly<N>,
    iterate: Iterate<N>,
    tangent: Iterate<N>,
    iterations: u32,
) -> Result<Solved<M, N>, OrbitError> {
    let transitions = assembly.transitions().to_vec();
    // The motions that the constraints allow are evaluated at the current parameter.
    let orbit = Periodic {
        model: &problem.model,
        ..problem.orbit.clone()
    };
    orbit.check_repeats(&iterate)?;
    let floquet = multipliers_of(&orbit, &iterate.nodes, &transitions)?;
    let trivial = trivial_of(&floquet, orbit.trivial());
    let slope = tangent.globals.last().copied().unwrap_or(f64::NAN);
    // The determinant at fixed parameter is dλ/ds times that with arc length.
    let sign = match problem.row {
        Row::Parameter(_) => assembly.sign() * slope.signum(),
        Row::Arc { .. } => assembly.sign(),
    };
    let tests = Tests::new(&Circumstances {
        slope,
        sign,
        floquet: &floquet,
        trivial: &trivial,
        symplectic: !M::FACTS.forced,
    });
    Ok(Solved {
        rate: problem.rate,
        member: Member {
            model: problem.model.clone(),
            iterate,
            transitions,
            period: problem.orbit.period,
            unfolding: problem.orbit.unfolding,
        },
        floquet,
        tangent,
        tests,
        iterations,
    })
}
