//! Warnings of a run about itself: steps in which the numerical solution grows but the motion does not, and jumps of
//! the energy.

use crate::evaluate::Evaluate;
use crate::length::Length;
use crate::motion::{Motion, Node, Warning};
use crate::stability::growth::Growth;
use crate::stability::linear_model::LinearModel;
use std::mem;
use tfe_runtime::{Element, Model, State};

/// Collects the warnings of a run: examines some of its elements, and the energy of its recorded nodes.
#[derive(Clone, Debug)]
pub struct Watch {
    /// `None` for an A-stable element, which needs no checks.
    element: Option<Element>,
    /// The number of the element that is examined next.
    next: usize,
    /// The number of the element examined last.
    last: Option<usize>,
    /// Whether that element was unstable; the next unstable one then belongs to the same warning.
    is_unstable: bool,
    energy: Energy,
    warnings: Vec<Warning>,
}

impl Watch {
    pub(super) fn new(element: Element) -> Self {
        Self {
            element: (!element.is_a_stable()).then_some(element),
            next: 0,
            last: None,
            is_unstable: false,
            energy: Energy::default(),
            warnings: Vec::new(),
        }
    }

    /// Begins with the only node of a motion, and the warning about its masses.
    pub(super) fn begin<const N: usize, L: Length<N>>(
        &mut self,
        motion: &Motion<N, L>,
        masses: Option<Warning>,
    ) {
        self.pass(Recorded::last_of(motion, false), &|_| 0.0);
        self.add(masses);
    }

    /// Examines the element that begins at `t` in `state` if its number is 0, 1, 2, 4, 8, … A continued run examines
    /// its first element, then those of 2, 4, … times its number.
    pub(super) fn look<M: Model<N>, const N: usize>(
        &mut self,
        model: &M,
        number: usize,
        (t, h): (f64, f64),
        state: &State<N>,
    ) {
        if number >= self.next {
            self.next = (2 * number).max(1);
            self.examine(model, number, (t, h), state);
        }
    }

    /// Examines an element regardless of its number, such as one that failed.
    pub(super) fn examine<M: Model<N>, const N: usize>(
        &mut self,
        model: &M,
        number: usize,
        (t, h): (f64, f64),
        state: &State<N>,
    ) {
        if const { !M::CONSTRAINTS.is_empty() } {
            // For these the state alone does not determine the stability.
            return;
        }
        if let Some(element) = self.choose(number) {
            let growth = match LinearModel::about(model, t, state) {
                Ok(linear) => linear.growth(element, h),
                Err(_) => None,
            };
            self.judge(element, (t, h), growth);
        }
    }

    /// The element that is examined, unless that of this number was the last.
    fn choose(&mut self, number: usize) -> Option<Element> {
        let element = self.element?;
        let last = self.last.replace(number);
        (last != Some(number)).then_some(element)
    }

    /// Warns of a growth that the model does not have; it belongs to the last warning if the element examined before
    /// was unstable, too.
    fn judge(&mut self, element: Element, (t, h): (f64, f64), growth: Option<Growth>) {
        let continued = self.is_unstable;
        self.is_unstable = growth.is_some();
        let Some(growth) = growth else { return };
        let is_one = |warning: &&mut Warning| matches!(warning, Warning::UnstableStep { .. });
        if continued
            && let Some(Warning::UnstableStep {
                step,
                radius,
                exact,
                ..
            }) = self.warnings.iter_mut().rev().find(is_one)
        {
            if growth.radius > *radius {
                (*step, *radius, *exact) = (h, growth.radius, growth.exact);
            }
            return;
        }
        self.warnings.push(Warning::UnstableStep {
            time: t,
            step: h,
            element,
            radius: growth.radius,
            exact: growth.exact,
        });
    }

    /// Checks the energy of a recorded node; `rounding` returns the rounding error of the energy for the time since the
    /// node before.
    pub(super) fn pass(&mut self, node: Recorded, rounding: &dyn Fn(f64) -> f64) {
        let Recorded {
            time,
            energy,
            action,
            is_conserved,
        } = node;
        if !energy.is_finite() {
            if !self.energy.is_lost {
                self.warnings.push(Warning::EnergyNotFinite { time });
            }
            self.energy.is_lost = true;
            self.energy.last = None;
            return;
        }
        // p·v is twice the kinetic energy of a Lagrangian. For other Hamiltonians half of it still serves as a scale.
        let kinetic = 0.5 * action.abs();
        self.energy.scale = self.energy.scale.max(kinetic);
        let last = self.energy.last.replace((time, energy));
        let since = last.map_or(0.0, |(from, _)| time - from);
        let last = last.filter(|_| is_conserved);
        let behind = (self.energy.bursts).pass((time, energy), kinetic, is_conserved);
        let kinds = [last.map(|(_, before)| (before, self.energy.scale)), behind];
        let is_one =
            |(before, scale): &(f64, f64)| is_jump([*before, energy], *scale, &|| rounding(since));
        if let Some((before, _)) = kinds.into_iter().flatten().find(is_one) {
            self.jumps(time, before, energy);
            self.energy.bursts.before = None; // Each jump counts once.
        }
    }

    /// Counts a jump of the energy; the warning tells the largest one.
    fn jumps(&mut self, time: f64, before: f64, energy: f64) {
        let jump = (energy - before).abs();
        let place = self.energy.jump.get_or_insert_with(|| {
            self.warnings.push(Warning::EnergyJump {
                time,
                before,
                after: energy,
                count: 0,
            });
            self.warnings.len() - 1
        });
        if let Some(Warning::EnergyJump {
            time: at,
            before: from,
            after,
            count,
        }) = self.warnings.get_mut(*place)
        {
            *count += 1;
            if jump > (*after - *from).abs() {
                (*at, *from, *after) = (time, before, energy);
            }
        }
    }

    /// Adds warnings, or one if there is one.
    pub(super) fn add(&mut self, warnings: impl IntoIterator<Item = Warning>) {
        self.warnings.extend(warnings);
    }

    pub(super) fn warnings(&self) -> &[Warning] {
        &self.warnings
    }

    pub(super) fn into_warnings(self) -> Vec<Warning> {
        self.warnings
    }
}

/// Whether a conserved energy has changed by more than a tenth of a kinetic energy and by more than rounding error:
/// that of its value, and the one that `more` returns for its computation.
pub(crate) fn is_jump([before, after]: [f64; 2], kinetic: f64, more: &dyn Fn() -> f64) -> bool {
    let rounding = 1e-9 * after.abs().max(before.abs());
    let jump = (after - before).abs();
    jump > (0.1 * kinetic).max(rounding) && jump > 2.0 * more()
}

/// The energy of the nodes so far.
#[derive(Clone, Debug, Default)]
struct Energy {
    /// The time and the energy of the last node.
    last: Option<(f64, f64)>,
    /// The largest kinetic energy so far.
    scale: f64,
    bursts: Bursts,
    is_lost: bool,
    /// The index of the warning about jumps.
    jump: Option<usize>,
}

/// Bursts of the kinetic energy above its mean so far. After one, as a close encounter, an error of the energy that is
/// small beside the kinetic energy in it is large beside that of the motion that follows.
#[derive(Clone, Debug, Default)]
struct Bursts {
    /// The time and the kinetic energy of the last node.
    last: Option<(f64, f64)>,
    /// The time since the start, and the integral of the kinetic energy over it.
    sums: (f64, f64),
    /// The energy at the last node outside of bursts.
    before: Option<f64>,
    /// The largest kinetic energy of the burst.
    peak: f64,
}

impl Bursts {
    /// A burst is over where the kinetic energy is below this part of its largest value.
    const OVER: f64 = 0.25;

    /// Takes a node. Behind a burst, returns the energy before it, and the kinetic energy that is the scale of an error.
    fn pass(
        &mut self,
        (time, energy): (f64, f64),
        kinetic: f64,
        is_conserved: bool,
    ) -> Option<(f64, f64)> {
        if let Some((before, first)) = self.last.replace((time, kinetic)) {
            let step = (time - before).abs();
            self.sums.0 += step;
            self.sums.1 += 0.5 * step * (first + kinetic);
        }
        if !is_conserved {
            self.before = None;
        }
        let mean = self.sums.1 / self.sums.0;
        // The first node has no mean.
        if kinetic > mean {
            self.peak = self.peak.max(kinetic);
            let before = self.before.filter(|_| kinetic < Self::OVER * self.peak)?;
            return Some((before, kinetic));
        }
        let is_behind = mem::take(&mut self.peak) > 0.0;
        let before = self.before.replace(energy)?;
        is_behind.then_some((before, mean))
    }
}

/// The data of a recorded node that are checked.
pub(super) struct Recorded {
    pub(super) time: f64,
    pub(super) energy: f64,
    /// The product p·v.
    pub(super) action: f64,
    /// Whether the energy must be that of the previous node.
    pub(super) is_conserved: bool,
}

impl Recorded {
    /// The data of a node whose energy is still to be computed.
    pub(super) fn of<M, L, const N: usize>(model: &M, node: &Node<N, L>, is_conserved: bool) -> Self
    where
        M: Evaluate<N, L>,
        L: Length<N>,
    {
        Self {
            time: node.t,
            energy: model.energy(node.t, (&node.q, &node.p), &node.v),
            action: node.action(),
            is_conserved,
        }
    }

    /// The data of the last node of a motion.
    pub(super) fn last_of<L: Length<N>, const N: usize>(
        motion: &Motion<N, L>,
        is_conserved: bool,
    ) -> Self {
        let (energy, action) = motion.last_energy();
        Self {
            time: motion.last().t,
            energy,
            action,
            is_conserved,
        }
    }
}
