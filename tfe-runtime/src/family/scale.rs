//! The sizes to which increments of the iteration of models of run-time length are compared.

use super::space::{Problem, Sizes, StepInput};
use crate::equations::Increment;
use crate::legendre::largest;

/// The sizes to which increments are compared.
#[derive(Clone, Copy)]
pub(super) struct Scale {
    h: f64,
    q: f64,
    velocity: f64,
}

impl Scale {
    pub(super) fn of(problem: &Problem, input: StepInput<'_>) -> Self {
        Self {
            h: input.h,
            q: largest(&input.start.q),
            velocity: largest(&problem.velocity),
        }
    }

    pub(super) fn increment(&self, Sizes { changed, size }: Sizes) -> Increment {
        let h = self.h;
        let velocity = relative(h, self.velocity, size, changed);
        let moved = self.velocity + h.abs() * size;
        let position = relative(h, self.q, moved, 0.5 * h.abs() * changed);
        // Either both are NaN or neither.
        let relative = velocity.max(position);
        Increment { relative, position }
    }
}

/// |h δ| divided by the larger of |start| and |h x|; 0/0 is zero, and NaN stays NaN.
#[inline(always)]
fn relative(h: f64, start: f64, x: f64, step: f64) -> f64 {
    let scale = start.max(h.abs() * x);
    if step == 0.0 {
        0.0
    } else {
        h.abs() * step / scale
    }
}
