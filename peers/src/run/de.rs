//! The crate `differential-equations`.

use super::{Outcome, Problem, Run};
use crate::system::{System, product, rates};
use differential_equations::control::ControlFlag;
use differential_equations::error::Error as Failure;
use differential_equations::interpolate::Interpolation;
use differential_equations::linalg::Matrix;
use differential_equations::methods::{
    BackwardDifferentiationFormula, ExplicitRungeKutta, ImplicitRungeKutta, SymplecticIntegrator,
};
use differential_equations::ode::{ODE, OrdinaryNumericalMethod, solve_ode};
use differential_equations::solout::Solout;
use differential_equations::solution::Solution;
use std::hint::black_box;
use std::time::Instant;

struct Equations<'s, S, const N: usize>(&'s S);

impl<S: System<N>, const N: usize, const D: usize> ODE<f64, [f64; D]> for Equations<'_, S, N> {
    #[inline]
    fn diff(&self, _: f64, y: &[f64; D], dy: &mut [f64; D]) {
        rates::<S, N>(self.0, y, dy);
    }

    fn jacobian(&self, _: f64, y: &[f64; D], jacobian: &mut Matrix<f64>) {
        let (mut unit, mut column) = ([0.0; D], [0.0; D]);
        for j in 0..D {
            unit[j] = 1.0;
            product::<S, N>(self.0, y, &unit, &mut column);
            unit[j] = 0.0;
            for (i, value) in column.iter().enumerate() {
                jacobian[(i, j)] = *value;
            }
        }
    }
}

/// An output that keeps nothing.
struct Nothing;

impl<const D: usize> Solout<f64, [f64; D]> for Nothing {
    fn solout<I>(
        &mut self,
        _: f64,
        _: f64,
        _: &[f64; D],
        _: &[f64; D],
        _: &mut I,
        _: &mut Solution<f64, [f64; D]>,
    ) -> ControlFlag<f64, [f64; D]>
    where
        I: Interpolation<f64, [f64; D]> + ?Sized,
    {
        ControlFlag::Continue
    }
}

/// The limit of steps: more than any of our settings needs.
const STEPS: usize = 20_000_000;

fn run<M, S: System<N>, const N: usize, const D: usize>(
    problem: &Problem<'_, S, N, D>,
    mut method: M,
) -> Outcome<D>
where
    M: OrdinaryNumericalMethod<f64, [f64; D]> + Interpolation<f64, [f64; D]>,
{
    let equations = Equations::<S, N>(problem.system);
    let clock = Instant::now();
    let solution = solve_ode(
        &mut method,
        &equations,
        0.0,
        problem.end,
        &problem.y,
        &mut Nothing,
    );
    let solution = black_box(solution).map_err(|failure| said(&failure))?;
    let time = clock.elapsed();
    Ok(Run {
        y: *method.y(),
        time,
        evaluations: solution.evals.function as u64,
    })
}

/// The reason for a failure, without the state, which would be long.
fn said<const D: usize>(failure: &Failure<f64, [f64; D]>) -> &'static str {
    match failure {
        Failure::BadInput { .. } => "bad input",
        Failure::MaxSteps { .. } => "too many steps",
        Failure::StepSize { .. } => "the step became too small",
        Failure::Stiffness { .. } => "stiff",
        _ => "failed",
    }
}

macro_rules! adaptive {
    ($name:ident, $method:expr) => {
        /// Runs with a tolerance for each component.
        pub fn $name<S: System<N>, const N: usize, const D: usize>(
            problem: &Problem<'_, S, N, D>,
            tolerance: f64,
        ) -> Outcome<D> {
            let method = $method.rtol([tolerance; D]);
            run(
                problem,
                method.atol(problem.absolute(tolerance)).max_steps(STEPS),
            )
        }
    };
}

adaptive!(dopri5, ExplicitRungeKutta::dopri5());
adaptive!(dop853, ExplicitRungeKutta::dop853());
adaptive!(verner98, ExplicitRungeKutta::rkv988e());
adaptive!(verner87, ExplicitRungeKutta::rkv877e());
adaptive!(radau5, ImplicitRungeKutta::radau5());
adaptive!(bdf, BackwardDifferentiationFormula::adaptive());

/// The composition of Forest and Ruth, of order 4, with a whole number of equal steps.
pub fn forest_ruth<S: System<N>, const N: usize, const D: usize>(
    problem: &Problem<'_, S, N, D>,
    steps: f64,
) -> Outcome<D> {
    run(
        problem,
        SymplecticIntegrator::ruth_forest(problem.end / steps).max_steps(STEPS),
    )
}
