//! The pilot run: two elements of successive orders over the same steps, whose difference estimates the local error.

use super::super::mesh::Mesh;
use super::super::times::up_to_break;
use super::repeatable::Repeatable;
use super::runs::MOST_ITERATIONS;
use crate::accuracy::{Course, Pair, Trace, next};
use crate::error::RunErrorKind;
use tfe_runtime::{Element, Statistics, StepError};

/// The tolerance of the iterations relative to the local error, so that iteration errors do not affect the estimate.
const TOLERANCE: f64 = 1e-3;

/// An element and one of the next order. Both start each step from the state that the second has reached.
pub(super) struct Pilots<'r, R: Repeatable<N>, const N: usize> {
    run: &'r R,
    /// The stepper whose error is estimated, and the one of higher order.
    steppers: [R::Stepper; 2],
    state: R::State,
    /// The states that both have reached, and these states as rows of numbers.
    ends: [R::State; 2],
    rows: [Vec<f64>; 2],
    trace: Trace,
    apart: Vec<f64>,
    sizes: Vec<f64>,
    mesh: Mesh<N>,
    breaks: Vec<f64>,
    end: f64,
    /// The Newton iterations of the last attempt; then the number of accepted steps with Newton iterations, and of all.
    newton: u64,
    kept: (usize, usize),
    /// Whether the last attempt failed because the motion slides along a jump of the force.
    slides: bool,
}

impl<'r, R: Repeatable<N>, const N: usize> Pilots<'r, R, N> {
    pub(super) fn new(
        run: &'r R,
        element: Element,
        course: &Course,
        start: &R::State,
    ) -> Result<Self, RunErrorKind> {
        let Course { span, local, .. } = course;
        let mut control = run.control();
        control.tolerance = TOLERANCE * local;
        control.max_iterations = control.max_iterations.min(MOST_ITERATIONS);
        let stepper = |element| run.stepper(element, control, false);
        let steppers = [
            stepper(element)?,
            stepper(next(element).unwrap_or(Element::mixed(element.nodes())))?,
        ];
        let trace = Trace::new(run.coordinates(), run.columns());
        let width = trace.width();
        let mut pair = Self {
            run,
            state: start.clone(),
            ends: [start.clone(), start.clone()],
            rows: [vec![0.0; width], vec![0.0; width]],
            trace,
            apart: Vec::new(),
            sizes: Vec::new(),
            mesh: run.even(&[span.start, span.end], (span.end - span.start).abs())?,
            breaks: course.breaks.clone(),
            end: span.end,
            newton: 0,
            kept: (0, 0),
            slides: false,
            steppers,
        };
        let [_, row] = &mut pair.rows;
        run.row(&mut pair.steppers[1], &run.at(span.start, start), row);
        pair.trace.pass(row, 0, false);
        pair.trace.sizes_with(row, &mut pair.sizes);
        Ok(pair)
    }

    /// The work of both steppers.
    pub(super) fn work(&self) -> Statistics {
        let [mut work, other] = self.steppers.each_ref().map(R::statistics);
        work.merge(&other);
        work
    }

    /// The fraction of accepted steps that used Newton's method.
    pub(super) fn by_newton(&self) -> f64 {
        self.kept.0 as f64 / self.kept.1.max(1) as f64
    }
}

impl<R: Repeatable<N>, const N: usize> Pair for Pilots<'_, R, N> {
    fn attempt(&mut self, t: f64, h: f64) -> bool {
        let reached = t + h;
        let is_reached = |time: &&f64| (*time - reached).abs() <= 4.0 * f64::EPSILON * time.abs();
        // The end of the span is hit to the bit, since an impulse may act there.
        let (next, h) = match self.breaks.iter().find(is_reached) {
            Some(time) => (*time, up_to_break(t, *time)),
            None if is_reached(&&self.end) => (self.end, self.end - t),
            None => (reached, h),
        };
        let newton = |stepper: &R::Stepper| {
            let Statistics {
                newton_iterations, ..
            } = R::statistics(stepper);
            newton_iterations
        };
        let before = newton(&self.steppers[1]);
        for k in [1, 0] {
            let stepper = &mut self.steppers[k];
            self.ends[k].clone_from(&self.state);
            let step = self
                .run
                .advance(stepper, (t, next, h), &self.mesh, &mut self.ends[k]);
            if let Err(error) = step {
                self.slides = error == StepError::Slides;
                return false;
            }
            let at = self.run.at(next, &self.ends[k]);
            self.run.row(stepper, &at, &mut self.rows[k]);
        }
        self.newton = newton(&self.steppers[1]) - before;
        let [row, better] = &self.rows;
        self.trace.apart(row, better, &mut self.apart);
        self.trace.sizes_with(better, &mut self.sizes);
        true
    }

    fn is_stopped(&self) -> bool {
        self.slides
    }

    fn apart(&self) -> &[f64] {
        &self.apart
    }

    fn sizes(&self) -> &[f64] {
        &self.sizes
    }

    fn keep(&mut self) {
        self.state.clone_from(&self.ends[1]);
        self.trace.pass(&self.rows[1], 0, false);
        self.kept.0 += usize::from(self.newton > 0);
        self.kept.1 += 1;
    }
}
