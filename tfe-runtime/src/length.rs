//! Whether the number of coordinates is known at compile time.

use crate::model::Model;

/// The number of coordinates is a constant: [`Model`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FixedLength;

/// The number of coordinates is a field of the model: `family::Model`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RunTimeLength;

/// A model declared by `#[dynamics]`, or by hand through [`Model`], of either kind of length.
///
/// It lets one name, such as `Simulation::new`, stand for both kinds. N is the number of coordinates where that is
/// constant, and 0 elsewhere.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a model",
    label = "not a model",
    note = "models are structs with `#[dynamics(...)]`"
)]
pub trait Declared<const N: usize> {
    /// [`FixedLength`] or [`RunTimeLength`].
    type Length;

    /// Passes to `report` the times at which the kernels have kinks or jumps, such as those of the tables of given inputs:
    /// elements should end there. By default there are none.
    fn breaks<F: FnMut(f64)>(&self, _report: &mut F) {}
}

impl<M: Model<N>, const N: usize> Declared<N> for M {
    type Length = FixedLength;

    fn breaks<F: FnMut(f64)>(&self, report: &mut F) {
        self.breaks_of_inputs(report);
    }
}
