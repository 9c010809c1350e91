//! What a run notices about itself: steps at which the method grows, not the model.

use crate::stability::growth::is_a_stable;
use crate::stability::linear_model::LinearModel;
use std::fmt;
use tfe_runtime::{Element, Model, State};

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
    warnings: Vec<Warning>,
}

impl Watch {
    pub(super) fn new(element: Element) -> Self {
        Self {
            element: (!is_a_stable(element)).then_some(element),
            next: 0,
            last: None,
            is_unstable: false,
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
        if continued
            && let Some(Warning::UnstableStep {
                step,
                radius,
                exact,
                ..
            }) = self.warnings.last_mut()
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

    pub(super) fn into_warnings(self) -> Vec<Warning> {
        self.warnings
    }
}
