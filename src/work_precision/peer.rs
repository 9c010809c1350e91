//! Curves of other integrators, for comparison.

use super::measure::Best;
use super::point::Cost;
use super::reference::Known;
use super::subject::PhasePoint;
use crate::numbers::larger;
use std::error::Error;
use std::time::Duration;

/// The result of one run of another integrator, see [`WorkPrecision::peer`](super::WorkPrecision::peer); `S` is the
/// type of the model's states.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PeerRun<S> {
    /// The state at the end of the span.
    pub end: S,
    /// The time of the run, without its preparation before the first step.
    pub time: Duration,
    /// The number of evaluations of the equations of motion; zero if they are not counted.
    pub evaluations: u64,
}

/// The runs of another integrator, in the order of the settings.
#[derive(Clone, Debug, PartialEq)]
pub struct Peer {
    pub(super) name: String,
    pub(super) points: Vec<PeerPoint>,
}

/// One run of another integrator.
#[derive(Clone, Debug, PartialEq)]
pub struct PeerPoint {
    /// The setting: its tolerance, or its step size.
    pub setting: f64,
    /// The measurements, or the message of the integrator if it failed.
    pub outcome: Result<PeerMeasured, String>,
}

/// The measurements of a run of another integrator, as in [`Measured`](super::Measured).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PeerMeasured {
    /// Error of the coordinates at the end of the span.
    pub error_q: f64,
    /// Error of the momenta at the end of the span.
    pub error_p: f64,
    /// The time of the steps in seconds, the shortest of all repetitions.
    pub seconds: f64,
    /// The number of repetitions.
    pub repetitions: u32,
    /// The number of evaluations of the equations of motion; zero if they are not counted.
    pub evaluations: u64,
    /// Whether the error is no larger than the uncertainty of the reference.
    pub at_reference_floor: bool,
}

impl Peer {
    /// The name of the integrator.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// All runs, including those that failed.
    pub fn points(&self) -> &[PeerPoint] {
        &self.points
    }

    /// The number of runs that failed.
    pub fn failed(&self) -> usize {
        let failed = |point: &&PeerPoint| point.outcome.is_err();
        self.points.iter().filter(failed).count()
    }
}

impl PeerPoint {
    /// The measurements, if the run reached the end of the span.
    pub fn measured(&self) -> Option<&PeerMeasured> {
        self.outcome.as_ref().ok()
    }
}

impl PeerMeasured {
    /// The larger of the errors of coordinates and momenta.
    pub fn error(&self) -> f64 {
        larger(self.error_q, self.error_p)
    }

    /// The cost of the run; `None` in a measure that is not counted for other integrators.
    pub fn cost(&self, cost: Cost) -> Option<f64> {
        match cost {
            Cost::Time => Some(self.seconds),
            Cost::Evaluations => (self.evaluations > 0).then_some(self.evaluations as f64),
            Cost::Iterations | Cost::Steps => None,
        }
    }
}

/// Makes a run of another integrator with one setting.
type Run<'m, S> = dyn Fn(f64) -> Result<PeerRun<S>, Box<dyn Error>> + 'm;

/// Another integrator that was not run yet.
pub(super) struct Rival<'m, S> {
    pub(super) name: String,
    pub(super) settings: Vec<f64>,
    pub(super) run: Box<Run<'m, S>>,
}

impl<S: PhasePoint> Rival<'_, S> {
    /// Makes the first run with each setting.
    pub(super) fn look(&self, reference: &Known<S>, end: f64) -> Peer {
        let point = |setting: &f64| PeerPoint {
            setting: *setting,
            outcome: self.look_at(*setting, reference, end),
        };
        Peer {
            name: self.name.clone(),
            points: self.settings.iter().map(point).collect(),
        }
    }

    fn look_at(
        &self,
        setting: f64,
        reference: &Known<S>,
        end: f64,
    ) -> Result<PeerMeasured, String> {
        let run = (self.run)(setting).map_err(|error| error.to_string())?;
        let (q, p) = (run.end.q(), run.end.p());
        for (vector, length) in [("q", q.len()), ("p", p.len())] {
            let expected = reference.length();
            if length != expected {
                return Err(format!(
                    "the vector {vector} of the end has {length} elements, but the model has {expected} coordinates"
                ));
            }
        }
        let finite = q.iter().chain(p).all(|x| x.is_finite());
        let errors = reference.errors(end, &run.end).filter(|_| finite);
        let (error_q, error_p) = errors.ok_or("the end is not finite")?;
        let mut measured = PeerMeasured {
            error_q,
            error_p,
            seconds: run.time.as_secs_f64(),
            repetitions: 1,
            evaluations: run.evaluations,
            at_reference_floor: false,
        };
        measured.at_reference_floor = measured.error() <= reference.uncertainty();
        Ok(measured)
    }

    /// Repeats all runs until each of them has taken the time `until` in total, including `spent`.
    pub(super) fn repeat(&self, peer: &mut Peer, spent: &mut [Duration], until: Duration) {
        for (point, spent) in peer.points.iter_mut().zip(spent) {
            let Ok(measured) = &mut point.outcome else {
                continue;
            };
            let best = Best {
                seconds: &mut measured.seconds,
                repetitions: &mut measured.repetitions,
                spent,
            };
            // The same run succeeded before.
            best.repeat(until, || (self.run)(point.setting).ok().map(|run| run.time));
        }
    }
}
