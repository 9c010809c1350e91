//! The crate `utsuroi`: leapfrog and Yoshida's compositions of it, with equal steps.

use super::{Outcome, Problem, Run};
use crate::system::System;
use nalgebra::SVector;
use std::hint::black_box;
use std::time::Instant;
use utsuroi::{DynamicalSystem, State, StormerVerlet, Yoshida4, Yoshida6, Yoshida8};

struct Equations<'s, S, const N: usize>(&'s S);

impl<S: System<N>, const N: usize> DynamicalSystem for Equations<'_, S, N> {
    type State = State<N, 2>;

    #[inline]
    fn derivatives(&self, _: f64, state: &Self::State) -> Self::State {
        let (q, v) = (&state.y().data.0[0], &state.dy().data.0[0]);
        let acceleration = self.0.acceleration(q, v);
        State::from_derivative(*state.dy(), SVector::from(acceleration))
    }
}

macro_rules! composition {
    ($name:ident, $method:expr, $evaluations:expr) => {
        /// Runs with a whole number of equal steps.
        pub fn $name<S: System<N>, const N: usize, const D: usize>(
            problem: &Problem<'_, S, N, D>,
            steps: f64,
        ) -> Outcome<D> {
            let equations = Equations::<S, N>(problem.system);
            let (mut q, mut v) = ([0.0; N], [0.0; N]);
            q.copy_from_slice(&problem.y[..N]);
            v.copy_from_slice(&problem.y[N..]);
            let mut state = State::new(SVector::from(q), SVector::from(v));
            let (count, h) = (steps as u64, problem.end / steps);
            let clock = Instant::now();
            for k in 0..count {
                state = $method.step(&equations, k as f64 * h, &state, h);
            }
            black_box(&state);
            let time = clock.elapsed();
            let mut y = [0.0; D];
            y[..N].copy_from_slice(state.y().as_slice());
            y[N..].copy_from_slice(state.dy().as_slice());
            Ok(Run {
                y,
                time,
                evaluations: $evaluations * count,
            })
        }
    };
}

composition!(leapfrog, StormerVerlet, 2);
composition!(yoshida4, Yoshida4, 6);
composition!(yoshida6, Yoshida6, 14);
composition!(yoshida8, Yoshida8, 30);
