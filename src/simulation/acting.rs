//! Which impulses act in part of an element.

use tfe_runtime::step::Impulse;

/// How many of the impulses in an element act before a time in it; h is negative where it goes back in time.
pub(super) fn behind<const N: usize>(impulses: &[Impulse<N>], time: f64, h: f64) -> usize {
    let is_ahead = |impulse: &Impulse<N>| h.signum() * impulse.time >= h.signum() * time;
    impulses.iter().take_while(|one| !is_ahead(one)).count()
}

/// How many of them act in less than a length from its start.
pub(super) fn within<const N: usize>(impulses: &[Impulse<N>], start: f64, length: f64) -> usize {
    let is_before = |impulse: &&Impulse<N>| (impulse.time - start).abs() < length.abs();
    impulses.iter().take_while(is_before).count()
}
