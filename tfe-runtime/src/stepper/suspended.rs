//! What a stepper leaves behind without its model.

use super::carried::Carried;
use super::setup::Stepper;
use crate::constrained::Foreseen;
use crate::element::{Element, ElementError};
use crate::model::Model;
use crate::newton::Control;
use crate::scheme::{SchemeTable, Tables};
use crate::share::Share;
use crate::statistics::Statistics;
use alloc::vec::Vec;

/// All that a stepper carries from step to step, without its model: with it the next step is the same to the last bit.
#[derive(Clone, Debug)]
pub struct Suspended<const N: usize> {
    element: Element,
    /// Those of the model, and what it has beside them, to the bit.
    parameters: Vec<u64>,
    carried: Carried<N>,
}

fn parameters<M: Model<N>, const N: usize>(model: &M) -> Vec<u64> {
    let bits = |index| model.parameter(index).to_bits();
    let mut all: Vec<u64> = (0..model.parameters()).map(bits).collect();
    model.unnumbered(&mut |value| all.push(value));
    all
}

impl<const N: usize> Suspended<N> {
    /// The element of the stepper.
    #[must_use]
    pub fn element(&self) -> Element {
        self.element
    }
}

impl<'m, M, const N: usize> Stepper<'m, M, N>
where
    M: Model<N>,
{
    /// Leaves the model.
    #[must_use]
    pub fn suspend(self) -> Suspended<N> {
        Suspended {
            element: self.table.element(),
            parameters: parameters(&*self.model),
            carried: self.carried,
        }
    }

    /// A stepper that goes on where another one was [suspended](Self::suspend), with nothing counted yet; one at rest where the model had other parameters, lengths or vectors of
    /// numbers.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn resume(
        model: Share<'m, M>,
        control: Control,
        suspended: Suspended<N>,
    ) -> Result<Self, ElementError> {
        if suspended.parameters != parameters(&*model) {
            return Self::sharing(model, suspended.element, control);
        }
        let mut carried = suspended.carried;
        carried.memory.statistics = Statistics::NONE;
        Ok(Self {
            model,
            table: SchemeTable::new(suspended.element)?,
            control,
            carried,
            weights: None,
            is_of_points: false,
            at_kinks: false,
            solve: control.solve,
            foreseen: Foreseen::default(),
            extra: Vec::new(),
            backwards: None,
        })
    }
}
