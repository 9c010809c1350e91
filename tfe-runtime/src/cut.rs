//! Steps in halves, where the whole step fails (T-116).

use crate::control::Solve;
use crate::error::StepError;
use core::convert::Infallible;

/// The number of times a step is halved before it fails.
const MAX_HALVINGS: u32 = 10;

/// Something that acts at one instant of a step, such as an impulse.
pub(crate) trait Instant: Clone {
    fn time(&self) -> f64;
}

/// For models on which nothing acts.
impl Instant for Infallible {
    fn time(&self) -> f64 {
        match *self {}
    }
}

/// A list from which the elements of a piece can be chosen.
pub(crate) trait Kicks<K>: AsRef<[K]> {
    /// The elements of `from` for which `choice` holds.
    fn chosen(from: &[K], choice: &dyn Fn(&K) -> bool) -> Self;
}

#[cfg(feature = "alloc")]
impl<K: Clone> Kicks<K> for alloc::vec::Vec<K> {
    fn chosen(from: &[K], choice: &dyn Fn(&K) -> bool) -> Self {
        from.iter().filter(|kick| choice(kick)).cloned().collect()
    }
}

/// An empty list, for use without an allocator.
impl Kicks<Infallible> for [Infallible; 0] {
    fn chosen(_: &[Infallible], _: &dyn Fn(&Infallible) -> bool) -> Self {
        []
    }
}

/// A stepper whose steps can be divided.
pub(crate) trait Halving {
    type State;
    type Kick: Instant;
    type Kicks: Kicks<Self::Kick>;

    /// Moves `state` from t to t + h by one element; leaves it unchanged if that fails.
    fn whole(
        &mut self,
        t: f64,
        h: f64,
        state: &mut Self::State,
        kicks: &[Self::Kick],
    ) -> Result<(), StepError>;

    /// Called for each piece that has succeeded.
    fn passed(&mut self, t: f64, h: f64, kicks: Self::Kicks);
}

/// Whether a step failed because Newton's method found no root, or none that is known to continue the motion: a shorter
/// step, or one from elsewhere, may succeed.
pub(crate) fn is_of_newton(error: &StepError) -> bool {
    matches!(
        error,
        StepError::Unproven { .. }
            | StepError::EnergyJump { .. }
            | StepError::NonFinite
            | StepError::SingularTangent { .. }
            | StepError::NewtonStalled { .. }
    )
}

/// Whether a shorter step may go well where one has failed with `error`.
pub(crate) fn may_be_cut(error: &StepError, linear: bool, solve: Solve) -> bool {
    let is_of_the_iteration = is_of_newton(error) || matches!(error, StepError::Legendre(_));
    is_of_the_iteration && !linear && solve.cuts()
}

/// Moves `state` from t to t + h in two halves, which are halved again where necessary; false if even the shortest
/// pieces fail.
#[cold]
pub(crate) fn in_halves<S: Halving + ?Sized>(
    stepper: &mut S,
    (t, h): (f64, f64),
    state: &mut S::State,
    kicks: &[S::Kick],
    depth: u32,
) -> bool {
    let half = 0.5 * h;
    let middle = t + half;
    if middle == t || middle == t + h {
        return false;
    }
    let is_late = |kick: &S::Kick| {
        if h > 0.0 {
            kick.time() >= middle
        } else {
            kick.time() <= middle
        }
    };
    let early = S::Kicks::chosen(kicks, &|kick| !is_late(kick));
    let late = S::Kicks::chosen(kicks, &is_late);
    for (start, kicks) in [(t, early), (middle, late)] {
        let done = match stepper.whole(start, half, state, kicks.as_ref()) {
            Ok(()) => {
                stepper.passed(start, half, kicks);
                true
            }
            Err(_) if depth == MAX_HALVINGS => false,
            Err(_) => in_halves(stepper, (start, half), state, kicks.as_ref(), depth + 1),
        };
        if !done {
            return false;
        }
    }
    true
}
