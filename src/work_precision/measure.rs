//! Makes one run, timed and examined.

use super::grid::Grid;
use super::point::Measured;
use super::reference::Known;
use super::subject::{PhasePoint, Subject};
use crate::error::RunErrorKind;
use crate::motion::{action, energy_scale};
use crate::numbers::raise;
use std::hint::black_box;
use std::ops::Range;
use std::time::{Duration, Instant};
use tfe_runtime::Element;
use tfe_runtime::step::Control;

/// The largest number of repetitions of a run: the best of a hundred is close to the best of a thousand.
const MAX_REPETITIONS: u32 = 100;

/// The data common to all runs.
pub(super) struct Measure<'a, M, S> {
    pub(super) model: &'a M,
    pub(super) start: &'a S,
    pub(super) reference: &'a Known<S>,
}

/// The element, the control and the mesh of one run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Discretisation<'g> {
    pub(crate) element: Element,
    pub(crate) control: Control,
    pub(crate) grid: &'g Grid,
}

impl<M: Subject<S>, S: PhasePoint> Measure<'_, M, S> {
    fn stepper(&self, scheme: Discretisation<'_>) -> Result<M::Stepper<'_>, RunErrorKind> {
        self.model.stepper(scheme.element, scheme.control)
    }

    /// Makes a run and examines it; the clock is stopped meanwhile.
    pub(super) fn look(&self, scheme: Discretisation<'_>) -> Result<Measured, RunErrorKind> {
        let (grid, mut stepper) = (scheme.grid, self.stepper(scheme)?);
        let mut observer = Observer::new(self, &mut stepper, grid.node(0));
        let (mut state, mut from, mut time) = (self.start.clone(), 0, Duration::ZERO);
        for look in grid.looks() {
            time += advance::<M, S>(&mut stepper, grid, from..look.node, &mut state)?;
            from = look.node;
            observer.look(&mut stepper, grid.node(look.node), &state, look.compare);
        }
        let mut measured = observer.into_measured();
        measured.seconds = time.as_secs_f64();
        measured.repetitions = 1;
        measured.statistics = M::statistics(&stepper);
        measured.at_reference_floor = measured.error() <= self.reference.uncertainty();
        Ok(measured)
    }

    /// Makes a run without examining it.
    pub(super) fn time(&self, scheme: Discretisation<'_>) -> Result<Duration, RunErrorKind> {
        let (grid, mut state) = (scheme.grid, self.start.clone());
        advance::<M, S>(
            &mut self.stepper(scheme)?,
            grid,
            0..grid.steps(),
            &mut state,
        )
    }

    /// Makes the run with each tolerance, the smallest first, and returns the one with the largest tolerance that does
    /// not increase the error noticeably.
    pub(super) fn look_with(
        &self,
        scheme: Discretisation<'_>,
        tolerances: &[f64],
    ) -> (f64, Result<Measured, RunErrorKind>) {
        let with = |tolerance| {
            let control = Control {
                tolerance,
                ..scheme.control
            };
            (tolerance, self.look(Discretisation { control, ..scheme }))
        };
        let mut sorted = tolerances.to_vec();
        sorted.sort_by(f64::total_cmp);
        let Some((tightest, mut looser)) = sorted.split_first() else {
            return with(scheme.control.tolerance);
        };
        let mut best = with(*tightest);
        while best.1.is_err()
            && let Some((next, rest)) = looser.split_first()
        {
            looser = rest;
            let tried = with(*next);
            if tried.1.is_ok() {
                best = tried;
            }
        }
        let Ok(limit) = best.1.as_ref().map(|one| {
            let error = one.error().max(self.reference.uncertainty());
            SHOWS * error
        }) else {
            return best;
        };
        let found = looser.iter().rev().map(|tolerance| with(*tolerance));
        let mut found =
            found.filter(|(_, outcome)| outcome.as_ref().is_ok_and(|one| one.error() <= limit));
        found.next().unwrap_or(best)
    }
}

/// The largest increase of the error relative to the smallest tolerance.
const SHOWS: f64 = 1.25;

/// The best of several times of one run.
#[derive(Debug)]
pub(crate) struct Best<'a> {
    /// The seconds of the fastest repetition so far.
    pub(crate) seconds: &'a mut f64,
    pub(crate) repetitions: &'a mut u32,
    /// The time of all repetitions.
    pub(crate) spent: &'a mut Duration,
}

impl Best<'_> {
    /// Repeats the run until it has taken the time `until` in total, or fails.
    pub(crate) fn repeat(self, until: Duration, mut run: impl FnMut() -> Option<Duration>) {
        while *self.spent < until && *self.repetitions < MAX_REPETITIONS {
            let Some(time) = run() else {
                break;
            };
            *self.spent = self.spent.saturating_add(time);
            *self.seconds = self.seconds.min(time.as_secs_f64());
            *self.repetitions += 1;
        }
    }
}

/// Advances `state` over some elements of the mesh; returns the computing time.
pub(crate) fn advance<M: Subject<S>, S: PhasePoint>(
    stepper: &mut M::Stepper<'_>,
    grid: &Grid,
    elements: Range<usize>,
    state: &mut S,
) -> Result<Duration, RunErrorKind> {
    let clock = Instant::now();
    for k in elements {
        let (t, _, h) = grid.element(k);
        M::advance(stepper, t, h, state).map_err(|source| RunErrorKind::Solve {
            element: k,
            time: t,
            step: h,
            source,
        })?;
    }
    black_box(&state);
    Ok(clock.elapsed())
}

/// Records the errors of a run at its nodes.
struct Observer<'a, M: Subject<S>, S: PhasePoint> {
    model: &'a M,
    reference: &'a Known<S>,
    start_energy: f64,
    /// The largest change of the energy.
    change: f64,
    /// The largest |p·v|.
    action: f64,
    velocity: M::Velocity,
    measured: Measured,
}

impl<'a, M: Subject<S>, S: PhasePoint> Observer<'a, M, S> {
    fn new(measure: &Measure<'a, M, S>, stepper: &mut M::Stepper<'_>, time: f64) -> Self {
        let mut observer = Self {
            model: measure.model,
            reference: measure.reference,
            start_energy: 0.0,
            change: 0.0,
            action: 0.0,
            velocity: measure.model.rest(),
            measured: Measured {
                error_q: 0.0,
                error_p: 0.0,
                max_error_q: 0.0,
                max_error_p: 0.0,
                energy_error: 0.0,
                constraint_position: 0.0,
                constraint_velocity: 0.0,
                seconds: 0.0,
                repetitions: 0,
                statistics: tfe_runtime::Statistics::NONE,
                at_reference_floor: false,
            },
        };
        observer.start_energy = observer.energy(stepper, time, measure.start);
        observer.look_at_constraints(time, measure.start);
        observer
    }

    fn look(&mut self, stepper: &mut M::Stepper<'_>, time: f64, state: &S, compare: bool) {
        let energy = self.energy(stepper, time, state);
        raise(&mut self.change, (energy - self.start_energy).abs());
        self.look_at_constraints(time, state);
        if compare && let Some((q, p)) = self.reference.errors(time, state) {
            (self.measured.error_q, self.measured.error_p) = (q, p);
            raise(&mut self.measured.max_error_q, q);
            raise(&mut self.measured.max_error_p, p);
        }
    }

    fn energy(&mut self, stepper: &mut M::Stepper<'_>, time: f64, state: &S) -> f64 {
        let energy = self.model.energy(stepper, time, state, &mut self.velocity);
        raise(
            &mut self.action,
            action(self.velocity.as_ref(), state.p()).abs(),
        );
        energy
    }

    fn into_measured(self) -> Measured {
        let scale = energy_scale(self.start_energy, self.action);
        Measured {
            energy_error: self.change / scale,
            ..self.measured
        }
    }

    fn look_at_constraints(&mut self, time: f64, state: &S) {
        if const { !M::CONSTRAINED } {
            return;
        }
        let (position, velocity) = self.model.residuals(time, state, &self.velocity);
        raise(&mut self.measured.constraint_position, position);
        raise(&mut self.measured.constraint_velocity, velocity);
    }
}
