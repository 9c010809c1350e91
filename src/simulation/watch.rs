//! What a run notices about itself: steps at which the method grows, not the model.

use crate::evaluate::Evaluate;
use crate::length::Length;
use crate::motion::{Motion, Node, Warning};
use crate::stability::linear_model::LinearModel;
use tfe_runtime::{Element, Model, State};

/// Looks at the elements of a run now and then.
#[derive(Clone, Debug)]
pub struct Watch {
    /// None if it needs no watching.
    element: Option<Element>,
    /// The number of the element that is examined next.
    next: usize,
    /// The number of the one examined last.
    last: Option<usize>,
    /// Whether that one was unstable: the next unstable one belongs to the same warning.
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

    /// Examines the element that begins at `t` in `state` if its number is 0, 1, 2, 4, 8, …; of a run that goes on, the first one, and those of twice its number and so forth.
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

    /// Examines the element in any case, as one that failed.
    pub(super) fn examine<M: Model<N>, const N: usize>(
        &mut self,
        model: &M,
        number: usize,
        (t, h): (f64, f64),
        state: &State<N>,
    ) {
        if const { !M::CONSTRAINTS.is_empty() } {
            // Nothing is known of these from the state alone.
            return;
        }
        let Some(element) = self.element else { return };
        if self.last == Some(number) {
            return;
        }
        self.last = Some(number);
        let growth = LinearModel::about(model, t, state)
            .ok()
            .and_then(|linear| linear.growth(element, h));
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

    /// Looks at the energy of a recorded node, whose momentum has the product p·v with its velocity; `rounding` says what the energy may be rounded by.
    pub(super) fn pass(&mut self, node: Recorded, rounding: &dyn Fn() -> f64) {
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
        // Twice the kinetic energy of velocities, half of it for Hamiltonians of any kind: no more than a scale.
        self.energy.scale = self.energy.scale.max(0.5 * action.abs());
        let last = self.energy.last.replace(energy);
        let (Some(before), true) = (last, is_conserved) else {
            return;
        };
        if !is_jump([before, energy], self.energy.scale, rounding) {
            return;
        }
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

    /// One more, if there is one.
    pub(super) fn add(&mut self, warning: Option<Warning>) {
        self.warnings.extend(warning);
    }

    pub(super) fn warnings(&self) -> &[Warning] {
        &self.warnings
    }

    pub(super) fn into_warnings(self) -> Vec<Warning> {
        self.warnings
    }
}

/// Whether an energy that is conserved differs by more than a tenth of a kinetic energy, and than roundings: of its value, and of what `more` says that each was computed with.
pub(crate) fn is_jump([before, after]: [f64; 2], kinetic: f64, more: &dyn Fn() -> f64) -> bool {
    let rounding = 1e-9 * after.abs().max(before.abs());
    let jump = (after - before).abs();
    jump > (0.1 * kinetic).max(rounding) && jump > 2.0 * more()
}

/// What the energy of the nodes has been.
#[derive(Clone, Debug, Default)]
struct Energy {
    last: Option<f64>,
    /// The largest kinetic energy so far.
    scale: f64,
    is_lost: bool,
    /// Which of the warnings is that of jumps.
    jump: Option<usize>,
}

/// What is looked at in a recorded node.
pub(super) struct Recorded {
    pub(super) time: f64,
    pub(super) energy: f64,
    /// p·v
    pub(super) action: f64,
    /// Whether the energy has to be that of the node before.
    pub(super) is_conserved: bool,
}

impl Recorded {
    /// Of a node whose energy is not known yet.
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

    /// Of the last node of a motion.
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
