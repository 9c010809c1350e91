//! The crate `diffsol`, with dense matrices of `nalgebra` and hand-written products with the Jacobian.

use super::{Outcome, Problem, Run};
use crate::system::{System, product, rates};
use diffsol::{NalgebraLU, NalgebraMat, OdeBuilder, OdeSolverMethod, OdeSolverStopReason, Vector};
use std::hint::black_box;
use std::time::Instant;

type M = NalgebraMat<f64>;
type LU = NalgebraLU<f64>;

macro_rules! method {
    ($name:ident, $solver:ident $(::<$linear:ty>)?) => {
        /// Runs with a tolerance for each component.
        pub fn $name<S: System<N>, const N: usize, const D: usize>(
            problem: &Problem<'_, S, N, D>,
            tolerance: f64,
        ) -> Outcome<D> {
            let (system, start) = (problem.system, problem.y);
            let built = OdeBuilder::<M>::new()
                .rtol(tolerance)
                .atol(problem.absolute(tolerance))
                .rhs_implicit(
                    |y: &[f64], _: &[f64], _: f64, dy: &mut [f64]| rates::<S, N>(system, y, dy),
                    |y: &[f64], _: &[f64], _: f64, w: &[f64], out: &mut [f64]| {
                        product::<S, N>(system, y, w, out);
                    },
                )
                .init(|_: &[f64], _: f64, y: &mut [f64]| y.copy_from_slice(&start), D)
                .build()?;
            let mut solver = built.$solver$(::<$linear>)?()?;
            let clock = Instant::now();
            solver.set_stop_time(problem.end)?;
            while !matches!(solver.step()?, OdeSolverStopReason::TstopReached) {}
            black_box(solver.state().y);
            let time = clock.elapsed();
            let mut y = [0.0; D];
            y.copy_from_slice(&solver.state().y.clone_as_vec());
            Ok(Run {
                y,
                time,
                evaluations: 0,
            })
        }
    };
}

method!(bdf, bdf::<LU>);
method!(tr_bdf2, tr_bdf2::<LU>);
method!(esdirk34, esdirk34::<LU>);
method!(tsit45, tsit45);
