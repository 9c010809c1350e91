//! Which impulses act in part of an element, or before it.

use crate::motion::is_same_time;
use tfe_runtime::step::Impulse;

/// Adds to momenta the impulses on a model of run-time length that act where an element of this length begins, or takes them away where it goes back in time; whether there are any.
pub(super) fn kick(impulses: &[(f64, Vec<f64>)], (t, h): (f64, f64), momenta: &mut [f64]) -> bool {
    let mut is_kicked = false;
    for (_, impulse) in impulses.iter().filter(|(time, _)| is_same_time(*time, t)) {
        for (p, change) in momenta.iter_mut().zip(impulse) {
            *p += h.signum() * change;
        }
        is_kicked = true;
    }
    is_kicked
}

/// How many of the impulses in an element act before a time in it; h is negative where it goes back in time. Where an event ends a part at this time the others act behind it, so that each acts once.
pub(super) fn behind<const N: usize>(impulses: &[Impulse<N>], time: f64, h: f64) -> usize {
    let is_ahead = |impulse: &Impulse<N>| h.signum() * impulse.time >= h.signum() * time;
    impulses.iter().take_while(|one| !is_ahead(one)).count()
}
