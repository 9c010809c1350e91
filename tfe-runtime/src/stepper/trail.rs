//! Exchange of initial guesses between runs of the same motion.

use super::common::Common;
use super::setup::Stepper;
use crate::constrained::Trail;
use crate::constrained::trail::Of;
use crate::element::Element;
use crate::model::Model;
use crate::scheme::Tables;

impl<M, const N: usize> Stepper<'_, M, N>
where
    M: Model<N>,
{
    /// Adds the last step to a trail, for models with constraints and elements with Gauss points; a step that was cut
    /// is left out.
    pub fn leave(&self, trail: &mut Trail) {
        if Self::HAS_CONSTRAINTS {
            self.common.leave(Of::model::<M, N>(), trail);
        }
    }

    /// Uses the solution of another run as initial guess of the step from t to t + h, if its trail reaches that far and
    /// the last step is continued.
    pub fn foresee(&mut self, trail: &Trail, (t, h): (f64, f64)) {
        if Self::HAS_CONSTRAINTS {
            self.common.foresee(Of::model::<M, N>(), trail, (t, h));
        }
    }
}

impl<const N: usize> Common<N> {
    fn leave(&self, of: Of<'_>, trail: &mut Trail) {
        if let Some(last) = &self.carried.memory.last
            && self.may_foresee()
        {
            let scheme = self.table.view();
            trail.push(&scheme, of, (last.t, last.h), &self.carried.numbers);
        }
    }

    fn foresee(&mut self, of: Of<'_>, trail: &Trail, step: (f64, f64)) {
        if self.may_foresee() {
            let scheme = self.table.view();
            self.foreseen.look(trail, &scheme, of, step);
        }
    }

    fn may_foresee(&self) -> bool {
        let element = self.table.element();
        let is_gauss = element == Element::mixed(element.nodes());
        is_gauss && self.carried.ahead.is_none() && self.carried.pieces.is_empty()
    }
}
