//! Which impulses act in part of an element.

use tfe_runtime::step::Impulse;

/// How many of the impulses in an element act before a time in it; h is negative where it goes back in time. Where an event ends a part at this time the others act behind it, so that each acts once.
pub(super) fn behind<const N: usize>(impulses: &[Impulse<N>], time: f64, h: f64) -> usize {
    let is_ahead = |impulse: &Impulse<N>| h.signum() * impulse.time >= h.signum() * time;
    impulses.iter().take_while(|one| !is_ahead(one)).count()
}
