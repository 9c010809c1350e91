//! Evidence that the solution found for an element is the one that continues the motion (T-115, T-117).

use crate::control::{POSITION_ROUND_OFF, Solve};
use crate::element::Element;
use crate::equations::Increment;
use crate::error::StepError;
use crate::legendre::energy_at;
use crate::model::{Model, State};

/// Evidence that an iteration has found a root near its start. If the increments shrink by a factor from the first one
/// on, they stay in a ball around the start, and the root is the only one in that ball (T-115). An iteration that
/// wandered before it contracted may have found any root.
pub(crate) struct Evidence {
    /// The largest ratio of an increment to the one before.
    ratio: f64,
    last: f64,
    /// The number of increments that were large enough to count.
    count: u32,
    /// The largest ratio that is accepted as a proof.
    limit: f64,
    /// The largest acceptable second increment, relative to the state.
    reach: f64,
}

impl Evidence {
    /// The largest ratio that is accepted as a proof for Newton's method: half of what the theorem of Newton and
    /// Kantorovich allows, because the observed ratios are not bounds of the others.
    const PROVEN: f64 = 0.25;

    /// The same for the fixed-point iteration, whose ratios vary less, in case Newton's method can take over.
    pub(crate) const CONTRACTS: f64 = 0.5;

    /// The same where Newton's method cannot take over: by Banach's theorem any contraction suffices.
    pub(crate) const CONTRACTS_ALONE: f64 = 1.0;

    /// Increments below this size, relative to the state, cannot lead to another root.
    pub(crate) const FAR: f64 = 1e-3;

    /// The largest acceptable second increment of Newton's method, which measures the error of the linearisation at the
    /// start.
    const CURVED: f64 = 0.03;

    /// From the largest ratio among increments above [`FAR`](Self::FAR); `yielding` tells whether Newton's method can
    /// take over.
    #[inline(always)]
    pub(crate) fn of_fixed_point(ratio: f64, yielding: bool) -> Self {
        Self {
            ratio,
            last: f64::INFINITY,
            count: 0,
            limit: if yielding {
                Self::CONTRACTS
            } else {
                Self::CONTRACTS_ALONE
            },
            reach: f64::INFINITY,
        }
    }

    pub(crate) fn of_newton() -> Self {
        Self {
            limit: Self::PROVEN,
            reach: Self::CURVED,
            ..Self::of_fixed_point(0.0, true)
        }
    }

    /// Takes the next increment. `own` tells whether its matrix was made in this step: contraction with the matrix of
    /// another step is no evidence.
    #[inline(always)]
    pub(crate) fn see(&mut self, increment: Increment, own: bool) {
        let size = increment.relative;
        // In short steps, velocities and multipliers may oscillate by the rounding error of the constraints divided by
        // the step.
        if size > Self::FAR && increment.position > POSITION_ROUND_OFF {
            let curved = self.count == 1 && size > self.reach;
            let ratio = if curved { 1.0 } else { size / self.last };
            if self.ratio < ratio {
                self.ratio = ratio;
            }
        }
        self.last = if own { size } else { f64::INFINITY };
        self.count += u32::from(own);
    }

    /// # Errors
    /// [`StepError::Unproven`]; [`StepError::EnergyJump`] where the energies at start and end, which the model
    /// conserves, differ by more than even a proven root allows, and by more than their [`rounding`].
    pub(crate) fn check_with(
        &self,
        solve: Solve,
        energy: Option<Energy>,
        element: Element,
        rounding: &dyn Fn() -> f64,
    ) -> Result<(), StepError> {
        if solve == Solve::Trusting {
            return Ok(());
        }
        let Some(energy) = energy else {
            return self.check(solve);
        };
        let is_proven = self.check(solve);
        let most = if is_proven.is_ok() {
            Energy::MAX_OF_PROVEN
        } else {
            Energy::MAX_OF_OTHERS
        };
        if energy.is_kept(most, element, 0.0) || energy.is_kept(most, element, rounding()) {
            return Ok(());
        }
        is_proven?;
        let Energy { before, after, .. } = energy;
        Err(StepError::EnergyJump { before, after })
    }

    /// # Errors
    /// [`StepError::Unproven`].
    pub(crate) fn check(&self, solve: Solve) -> Result<(), StepError> {
        if self.ratio > self.limit && solve != Solve::Trusting {
            return Err(StepError::Unproven { ratio: self.ratio });
        }
        Ok(())
    }
}

/// The energies at both ends of a step, for models that conserve energy.
#[derive(Clone, Copy)]
pub(crate) struct Energy {
    before: f64,
    after: f64,
    /// How much energy is kinetic at the start, or has become so; half of p·v stands for the kinetic energy.
    turned: f64,
    is_forward: bool,
}

/// Whether the energy of a model is conserved, so that it can be checked. Constraints are checked by their drift
/// instead.
pub(crate) const fn conserves_energy<M: Model<N>, const N: usize>() -> bool {
    !(M::FACTS.time_dependent || M::FACTS.forced)
}

impl Energy {
    /// The largest accepted change of energy, relative to the energy converted between kinetic and potential, for a
    /// root that is otherwise proven: larger changes come from steps that are too long, not from wrong roots.
    const MAX_OF_PROVEN: f64 = 0.5;

    /// The same for other roots.
    const MAX_OF_OTHERS: f64 = 0.1;

    /// `None` where a state has no velocity, which need not be a mistake.
    pub(crate) fn of<M, const N: usize>(
        model: &M,
        (t, h): (f64, f64),
        [start, end]: [&State<N>; 2],
    ) -> Option<Self>
    where
        M: Model<N>,
    {
        let velocity = |t: f64, state: &State<N>| {
            crate::legendre::velocity(model, t, &state.q, &state.p, &[0.0; N]).ok()
        };
        let velocities = [velocity(t, start)?, velocity(t + h, end)?];
        Some(Self::with(model, (t, h), [start, end], &velocities))
    }

    /// The same with velocities that are known.
    pub(crate) fn with<M, const N: usize>(
        model: &M,
        (t, h): (f64, f64),
        [start, end]: [&State<N>; 2],
        [first, last]: &[[f64; N]; 2],
    ) -> Self
    where
        M: Model<N>,
    {
        let (before, kinetic) = energies(model, t, start, first);
        let (after, moving) = energies(model, t + h, end, last);
        let potential = (after - moving) - (before - kinetic);
        Self {
            before,
            after,
            turned: kinetic.abs() + potential.abs(),
            is_forward: h > 0.0,
        }
    }

    /// Whether the change of the energy is at most the fraction `most` of the converted energy, plus rounding. With
    /// dissipative elements, any loss is accepted.
    fn is_kept(&self, most: f64, element: Element, rounded: f64) -> bool {
        let change = self.after - self.before;
        let rounding = 1e-9 * self.before.abs().max(self.after.abs());
        let allowed = most * self.turned + rounding + rounded;
        let is_damped = element.family().damps() && self.is_forward;
        // A NaN does not count as conserved.
        change <= allowed && (is_damped || -change <= allowed)
    }
}

/// The possible rounding error of both energies; zero where it is unknown.
#[cold]
pub(crate) fn rounding<M, const N: usize>(
    model: &M,
    (t, h): (f64, f64),
    [start, end]: [&State<N>; 2],
) -> f64
where
    M: Model<N>,
{
    if const { !conserves_energy::<M, N>() } {
        return 0.0;
    }
    let at = |t: f64, State { q, p }: &State<N>| {
        #[cfg(feature = "std")]
        if let Ok(v) = crate::legendre::velocity(model, t, q, p, &[0.0; N]) {
            return crate::legendre::energy_rounding(model, t, q, p, &v);
        }
        let _ = (model, t, q, p);
        0.0
    };
    at(t, start) + at(t + h, end)
}

/// The energy, and half of p·v.
#[cfg_attr(not(feature = "alloc"), inline(never))] // small programs
fn energies<M, const N: usize>(model: &M, t: f64, state: &State<N>, v: &[f64; N]) -> (f64, f64)
where
    M: Model<N>,
{
    let energy = energy_at(model, t, &state.q, &state.p, v);
    (energy, half_product(&state.p, v))
}

/// ½ p·v
fn half_product<const N: usize>(p: &[f64; N], v: &[f64; N]) -> f64 {
    let mut sum = 0.0;
    for (p, v) in p.iter().zip(v) {
        sum += 0.5 * p * v;
    }
    sum
}
