//! Selects the impulses that act at the start of an element, inside it, or before a time inside it.

use super::mesh::within;
use crate::motion::is_same_time;
use tfe_runtime::step::Impulse;

/// Adds the impulses at time t to the momenta of a model of run-time length; subtracts them if h < 0 (backward
/// integration). Returns whether there were any.
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

/// The number of impulses of an element that act before a time; h < 0 in backward integration. An impulse at the very
/// time acts after it, so that it acts once where an event splits the element there.
pub(super) fn behind<const N: usize>(impulses: &[Impulse<N>], time: f64, h: f64) -> usize {
    let is_ahead = |impulse: &Impulse<N>| h.signum() * impulse.time >= h.signum() * time;
    impulses.iter().take_while(|one| !is_ahead(one)).count()
}

/// The impulses that act in the element from `t` to `next`.
pub(super) fn inside<const N: usize>(
    impulses: &[Impulse<N>],
    (t, next): (f64, f64),
) -> Vec<Impulse<N>> {
    let acts = |impulse: &&Impulse<N>| within(impulse.time, t, next);
    impulses.iter().filter(acts).copied().collect()
}

/// Adds those of the impulses, from the first on, that act at time t to the momenta; subtracts them if h < 0. Returns
/// their number.
pub(super) fn kick_at<const N: usize>(
    impulses: &[Impulse<N>],
    (t, h): (f64, f64),
    momenta: &mut [f64; N],
) -> usize {
    let is_here = |impulse: &&Impulse<N>| is_same_time(impulse.time, t);
    let count = impulses.iter().take_while(is_here).count();
    for impulse in &impulses[..count] {
        for (p, change) in momenta.iter_mut().zip(impulse.value) {
            *p += h.signum() * change;
        }
    }
    count
}

/// Removes the impulses at a time.
pub(super) fn remove_at<const N: usize>(impulses: &mut Vec<Impulse<N>>, time: f64) {
    impulses.retain(|impulse| impulse.time != time);
}
