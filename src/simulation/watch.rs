//! What a run notices about itself: steps at which the method grows, not the model.

pub(super) mod resolution;

use crate::motion::Node;
use crate::stability::growth::is_a_stable;
use crate::stability::linear_model::LinearModel;
use nalgebra::DMatrix;
use std::fmt;
use tfe_runtime::legendre::energy_at;
use tfe_runtime::{Element, First, Form, Model, State};

/// What is doubtful about a motion that was computed without an error.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Warning {
    /// The step lies in an unstable interval of the linearised model: the method grows where the model does not.
    ///
    /// The second derivatives of the model are held at their values at a visited state; the transition matrix of the element
    /// for this linear model has an eigenvalue of modulus `radius`, where the linear model itself moves by `exact` in the same
    /// time. Nonlinear motions leave such a neighbourhood sooner or later, and then the amplitude or the energy is wrong.
    ///
    /// Looked for at the start, in elements 1, 2, 4, 8, … and where a run fails, so that a long run costs no more; several in
    /// a row are one warning. Elements that are stable at every step (all but primal ones without reduced quadrature) are not examined.
    UnstableStep {
        /// Where the first such element begins.
        time: f64,
        /// The length of the element that grows most; negative in a run backwards.
        step: f64,
        /// The element.
        element: Element,
        /// The factor by which that element amplifies the mode: its spectral radius, unless the model has other modes that grow.
        radius: f64,
        /// The factor |e^{λh}| by which the linear model amplifies it.
        exact: f64,
    },
    /// The mass matrix ∂²L/∂v² at the start has eigenvalues of both signs: forces speed up where they should slow down, mostly for a wrong sign in the Lagrangian.
    ///
    /// Looked for at the start of a run, for Lagrangians without constraints.
    MassIndefinite {
        /// The start.
        time: f64,
        /// The least eigenvalue.
        least: f64,
        /// The largest one.
        largest: f64,
    },
    /// The energy at a node is not finite: the momentum belongs to no velocity there (the mass matrix is singular), or the model has a singular point.
    EnergyNotFinite {
        /// The first such node.
        time: f64,
    },
    /// The energy of a model that conserves it changes between two nodes by more than a tenth of the kinetic energy that the motion has had: the step is too long for
    /// the motion, or the motion has passed a singular point.
    ///
    /// Looked for at every recorded node, unless the model is linear, forced, damped, depends on time or has constraints; not across impulses.
    EnergyJump {
        /// The node after the largest jump.
        time: f64,
        /// The energy before it.
        before: f64,
        /// The energy after it.
        after: f64,
        /// How many such jumps there are.
        count: usize,
    },
    /// An element and three of a third of its length (nine of a ninth where it was cut) end at different places, or the element after it when these are carried on: the step is too
    /// long to resolve the motion (`docs/theory.md`, (T-121)).
    ///
    /// Looked for in the elements whose iteration did not contract quickly, by their numbers 0, 1, 2, 4, 8, … among these; not in linear models, nor with
    /// [`Solve::Trusting`](crate::Solve::Trusting).
    Unresolved {
        /// Where the first such element begins.
        time: f64,
        /// The length of that element; negative in a run backwards.
        step: f64,
        /// The largest distance of both ends, as a part of what the motion extends over.
        distance: f64,
        /// How many such elements were found.
        count: usize,
    },
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UnstableStep {
                time,
                step,
                element,
                radius,
                exact,
            } => write!(
                f,
                "from t = {time} on, the step {step} lies in an unstable interval of `{element}` for the linearised model: \
                 a step multiplies a mode by {radius:.6} that the model multiplies by {exact:.6}; take a shorter step, \
                 or an element that is stable at every step, `{}` or `{}`",
                Element::mixed(element.nodes()),
                element.reduced(),
            ),
            Self::MassIndefinite {
                time,
                least,
                largest,
            } => write!(
                f,
                "the mass matrix at t = {time} has eigenvalues of both signs, {least:.3e} and {largest:.3e}: look for a wrong sign in the kinetic energy"
            ),
            Self::EnergyNotFinite { time } => write!(
                f,
                "the energy at t = {time} is not finite: the mass matrix is singular there, or the model has a singular point"
            ),
            Self::EnergyJump {
                time,
                before,
                after,
                count,
            } => {
                write!(
                    f,
                    "the energy, which the model conserves, jumps from {before:.6e} to {after:.6e} at t = {time}"
                )?;
                match count {
                    0 | 1 => {}
                    2 => f.write_str(" and once more")?,
                    _ => write!(f, " and at {} other nodes", count - 1)?,
                }
                f.write_str(": take a shorter step, or look for a singular point of the model")
            }
            Self::Unresolved {
                time,
                step,
                distance,
                ..
            } => write!(
                f,
                "the step {step} at t = {time} does not resolve the motion: shorter steps end elsewhere by {distance:.2} of what the motion extends over; \
                 take a shorter step or an element with more nodes"
            ),
        }
    }
}

/// Looks at the elements of a run now and then.
#[derive(Clone, Debug)]
pub(super) struct Watch {
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
            element: (!is_a_stable(element)).then_some(element),
            next: 0,
            last: None,
            is_unstable: false,
            energy: Energy::default(),
            warnings: Vec::new(),
        }
    }

    /// Examines the element that begins at `t` in `state` if its number is 0, 1, 2, 4, 8, …
    pub(super) fn look<M: Model<N>, const N: usize>(
        &mut self,
        model: &M,
        number: usize,
        (t, h): (f64, f64),
        state: &State<N>,
    ) {
        if number == self.next {
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

    /// Looks at the mass matrix at the start of a run.
    pub(super) fn weigh<M: Model<N>, const N: usize>(
        &mut self,
        model: &M,
        time: f64,
        (q, v): (&[f64; N], &[f64; N]),
    ) {
        let has_mass = const { matches!(M::FORM, Form::Lagrangian) && M::CONSTRAINTS.is_empty() };
        if !has_mass {
            return;
        }
        let (mut first, mut mass) = (First::ZERO, [[0.0; N]; N]);
        model.first_and_mass(time, q, v, &mut first, &mut mass);
        if let Some((least, largest)) = signs(mass.as_flattened()) {
            self.warnings.push(Warning::MassIndefinite {
                time,
                least,
                largest,
            });
        }
    }

    /// Looks at the energy of a recorded node, whose momentum has the product p·v with its velocity.
    pub(super) fn pass(&mut self, node: Recorded) {
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
        if !is_jump([before, energy], self.energy.scale) {
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

/// Whether an energy that is conserved differs by more than a tenth of a kinetic energy, and than roundings.
pub(crate) fn is_jump([before, after]: [f64; 2], kinetic: f64) -> bool {
    let rounding = 1e-9 * after.abs().max(before.abs());
    (after - before).abs() > (0.1 * kinetic).max(rounding)
}

/// The least and the largest eigenvalue of a symmetric matrix, if they are of different signs beyond roundings.
fn signs(matrix: &[f64]) -> Option<(f64, f64)> {
    const ROUNDING: f64 = 1e-9;
    if !matrix.iter().all(|entry| entry.is_finite()) {
        return None;
    }
    let size = matrix.len().isqrt();
    let eigenvalues = DMatrix::from_row_slice(size, size, matrix).symmetric_eigenvalues();
    let (least, largest) = (eigenvalues.min(), eigenvalues.max());
    let size = least.abs().max(largest.abs());
    (least < -ROUNDING * size && largest > ROUNDING * size).then_some((least, largest))
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
    pub(super) fn of<M: Model<N>, const N: usize>(
        model: &M,
        node: &Node<N>,
        is_conserved: bool,
    ) -> Self {
        let products = node.p.iter().zip(&node.v).map(|(p, v)| p * v);
        Self {
            time: node.t,
            energy: energy_at(model, node.t, &node.q, &node.p, &node.v),
            action: products.sum(),
            is_conserved,
        }
    }
}
