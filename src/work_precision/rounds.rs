//! Repeats runs in turn for timing.
//!
//! The speed of a processor varies with time. If runs are repeated in turn, no run has all its repetitions in a slow
//! period.

use super::measure::{Best, Discretisation, Measure};
use super::peer::{Peer, Rival};
use super::point::Point;
use super::reference::Known;
use super::subject::{PhasePoint, Subject};
use std::time::Duration;
use tfe_runtime::step::Control;

/// The number of rounds after the first.
pub(crate) const ROUNDS: u32 = 4;

/// A point of a curve, whose run can be repeated.
pub(super) struct Timed<'g> {
    pub(super) point: Point,
    scheme: Discretisation<'g>,
    spent: Duration,
}

impl<'g> Timed<'g> {
    /// Makes the first run.
    pub(super) fn look<M: Subject<S>, S: PhasePoint>(
        measure: &Measure<'_, M, S>,
        scheme: Discretisation<'g>,
        tolerances: &[f64],
    ) -> Self {
        let (tolerance, outcome) = measure.look_with(scheme, tolerances);
        let Discretisation {
            element,
            control,
            grid,
        } = scheme;
        let scheme = Discretisation {
            control: Control {
                tolerance,
                ..control
            },
            ..scheme
        };
        let seconds = outcome.as_ref().map_or(0.0, |one| one.seconds);
        Self {
            point: Point {
                element,
                solve: control.solve,
                step: grid.step(),
                tolerance,
                outcome,
            },
            scheme,
            spent: Duration::try_from_secs_f64(seconds).unwrap_or_default(),
        }
    }

    /// Repeats the run until it has taken the time `until` in total.
    fn repeat<M: Subject<S>, S: PhasePoint>(
        &mut self,
        measure: &Measure<'_, M, S>,
        until: Duration,
    ) {
        let Ok(measured) = &mut self.point.outcome else {
            return;
        };
        let best = Best {
            seconds: &mut measured.seconds,
            repetitions: &mut measured.repetitions,
            spent: &mut self.spent,
        };
        // The same run succeeded before.
        best.repeat(until, || measure.time(self.scheme).ok());
    }
}

/// Repeats all runs in turn, each for `repeat_for` in total.
pub(super) fn repeat<M: Subject<S>, S: PhasePoint>(
    measure: &Measure<'_, M, S>,
    curves: &mut [Vec<Timed<'_>>],
    (rivals, peers): (&[Rival<'_, S>], &mut [Peer]),
    repeat_for: Duration,
) {
    let first = |peer: &Peer| {
        let seconds = peer.points.iter().map(|point| {
            let seconds = point.measured().map_or(0.0, |one| one.seconds);
            Duration::try_from_secs_f64(seconds).unwrap_or_default()
        });
        seconds.collect::<Vec<_>>()
    };
    let mut spent: Vec<Vec<Duration>> = peers.iter().map(first).collect();
    for round in 1..=ROUNDS {
        let until = repeat_for / ROUNDS * round;
        for timed in curves.iter_mut().flatten() {
            timed.repeat(measure, until);
        }
        for ((rival, peer), spent) in rivals.iter().zip(&mut *peers).zip(&mut spent) {
            rival.repeat(peer, spent, until);
        }
    }
}

/// Runs all other integrators once.
pub(super) fn look_at_peers<S: PhasePoint>(
    rivals: &[Rival<'_, S>],
    reference: &Known<S>,
    end: f64,
) -> Vec<Peer> {
    let looks = rivals.iter().map(|rival| rival.look(reference, end));
    looks.collect()
}
