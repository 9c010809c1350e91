//! The crate `ode_solvers`: DOPRI5 and DOP853 after Hairer, Nørsett and Wanner.

use super::{Outcome, Problem, Run};
use crate::system::{System, rates};
use nalgebra::SVector;
use ode_solvers::dop_shared::OutputType;
use ode_solvers::{Dop853, Dopri5};
use std::hint::black_box;
use std::time::Instant;

type Vector<const D: usize> = SVector<f64, D>;

struct Equations<'s, S, const N: usize>(&'s S);

impl<S: System<N>, const N: usize, const D: usize> ode_solvers::System<f64, Vector<D>>
    for Equations<'_, S, N>
{
    #[inline]
    fn system(&self, _: f64, y: &Vector<D>, dy: &mut Vector<D>) {
        rates::<S, N>(self.0, y.as_slice(), dy.as_mut_slice());
    }
}

/// The limit of steps: more than any of our settings needs.
const STEPS: u32 = 20_000_000;
/// The solver tests for stiffness after every this many steps, and would stop: so never.
const NEVER: u32 = u32::MAX;

/// The solver has one absolute tolerance for all components. Units are chosen such that one is enough; it is relative
/// to the mean size.
fn absolute<S: System<N>, const N: usize, const D: usize>(
    problem: &Problem<'_, S, N, D>,
    tolerance: f64,
) -> f64 {
    tolerance * problem.sizes.iter().sum::<f64>() / D as f64
}

macro_rules! run {
    ($name:ident, $solver:ident, $safety:expr, $beta:expr, $least:expr, $most:expr) => {
        /// With the default constants, and only the accepted steps as output, which is the least possible.
        pub fn $name<S: System<N>, const N: usize, const D: usize>(
            problem: &Problem<'_, S, N, D>,
            tolerance: f64,
        ) -> Outcome<D> {
            let mut solver = $solver::from_param(
                Equations::<S, N>(problem.system),
                0.0,
                problem.end,
                problem.end,
                Vector::from(problem.y),
                tolerance,
                absolute(problem, tolerance),
                $safety,
                $beta,
                $least,
                $most,
                problem.end,
                0.0,
                STEPS,
                NEVER,
                OutputType::Sparse,
            );
            let clock = Instant::now();
            let statistics = black_box(solver.integrate())?;
            let time = clock.elapsed();
            let end = solver.y_out().last().ok_or("no step was accepted")?;
            let mut y = [0.0; D];
            y.copy_from_slice(end.as_slice());
            Ok(Run {
                y,
                time,
                evaluations: u64::from(statistics.num_eval),
            })
        }
    };
}

run!(dopri5, Dopri5, 0.9, 0.04, 0.2, 10.0);
run!(dop853, Dop853, 0.9, 0.0, 0.333, 6.0);
