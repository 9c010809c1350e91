//! The pilot run: two elements of successive orders over the same steps, whose difference estimates the local error.

use super::super::times::{Times, up_to_break};
use super::repeatable::{Repeatable, Stepping};
use super::runs::MAX_ITERATIONS;
use crate::accuracy::{Pair, PilotSettings, Trace, next};
use crate::error::RunErrorKind;
use tfe_runtime::{Element, Statistics, StepError};

/// The tolerance of the iterations relative to the local error, so that iteration errors do not affect the estimate.
const TOLERANCE: f64 = 1e-3;

/// An element and one of the next order. Both start each step from the state that the second has reached.
pub(super) struct Pilots<'r> {
    /// The stepper whose error is estimated, and the one of higher order.
    steppers: [Box<dyn Stepping + 'r>; 2],
    state: Vec<f64>,
    /// The states that both have reached, with outputs, as rows of numbers.
    rows: [Vec<f64>; 2],
    trace: Trace,
    differences: Vec<f64>,
    sizes: Vec<f64>,
    mesh: Times,
    breaks: Vec<f64>,
    end: f64,
    /// The Newton iterations of the last attempt; then the number of accepted steps with Newton iterations, and of all.
    newton: u64,
    kept: (usize, usize),
    /// Whether the last attempt failed because the motion slides along a jump of the force.
    slides: bool,
}

impl<'r> Pilots<'r> {
    pub(super) fn new(
        run: &'r dyn Repeatable,
        element: Element,
        settings: &PilotSettings,
    ) -> Result<Self, RunErrorKind> {
        let PilotSettings { span, local, .. } = settings;
        let given = run.given();
        let mut control = given.control;
        control.tolerance = TOLERANCE * local;
        control.max_iterations = control.max_iterations.min(MAX_ITERATIONS);
        let stepper = |element| run.stepper(element, control, false);
        let steppers = [
            stepper(element)?,
            stepper(next(element).unwrap_or(Element::mixed(element.nodes())))?,
        ];
        let trace = given.trace();
        let width = trace.width();
        let (_, start) = &given.start;
        let mut pair = Self {
            state: start.clone(),
            rows: [vec![0.0; width], vec![0.0; width]],
            trace,
            differences: Vec::new(),
            sizes: Vec::new(),
            mesh: given.even(
                element,
                &[span.start, span.end],
                (span.end - span.start).abs(),
            )?,
            breaks: settings.breaks.clone(),
            end: span.end,
            newton: 0,
            kept: (0, 0),
            slides: false,
            steppers,
        };
        let [_, row] = &mut pair.rows;
        pair.steppers[1].row(row);
        pair.trace.pass(row, 0, false);
        pair.trace.sizes_with(row, &mut pair.sizes);
        Ok(pair)
    }

    /// The work of both steppers.
    pub(super) fn work(&self) -> Statistics {
        let [first, second] = &self.steppers;
        let mut work = first.statistics();
        work.merge(&second.statistics());
        work
    }

    /// The fraction of accepted steps that used Newton's method.
    pub(super) fn by_newton(&self) -> f64 {
        self.kept.0 as f64 / self.kept.1.max(1) as f64
    }

    /// The Newton iterations of the second stepper so far.
    fn newton_iterations(&self) -> u64 {
        self.steppers[1].statistics().newton_iterations
    }
}

impl Pair for Pilots<'_> {
    fn attempt(&mut self, t: f64, h: f64) -> bool {
        let reached = t + h;
        let is_reached = |time: &&f64| (*time - reached).abs() <= 4.0 * f64::EPSILON * time.abs();
        // The end of the span is hit to the bit, since an impulse may act there.
        let (next, h) = match self.breaks.iter().find(is_reached) {
            Some(time) => (*time, up_to_break(t, *time)),
            None if is_reached(&&self.end) => (self.end, self.end - t),
            None => (reached, h),
        };
        let before = self.newton_iterations();
        for k in [1, 0] {
            let stepper = &mut self.steppers[k];
            stepper.place(t, &self.state);
            if let Err(error) = stepper.advance(&self.mesh, (t, next, h)) {
                self.slides = error == StepError::Slides;
                return false;
            }
            stepper.row(&mut self.rows[k]);
        }
        self.newton = self.newton_iterations() - before;
        let [row, better] = &self.rows;
        self.trace.differences(row, better, &mut self.differences);
        self.trace.sizes_with(better, &mut self.sizes);
        true
    }

    fn is_stopped(&self) -> bool {
        self.slides
    }

    fn differences(&self) -> &[f64] {
        &self.differences
    }

    fn sizes(&self) -> &[f64] {
        &self.sizes
    }

    fn keep(&mut self) {
        let [_, better] = &self.rows;
        let (reached, _) = better.split_at(self.state.len());
        self.state.copy_from_slice(reached);
        self.trace.pass(better, 0, false);
        self.kept.0 += usize::from(self.newton > 0);
        self.kept.1 += 1;
    }
}
