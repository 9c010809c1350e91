//! Models whose inputs are given: functions of the time, tables, or numbers held between steps.

mod error;
mod fixed;
mod run_time;
mod sources;
mod table;

use crate::length::{Declared, FixedLength, RunTimeLength};
use sources::{Source, Sources};
use std::fmt;
use std::marker::PhantomData;
use std::sync::Arc;
use table::Table;
use tfe_runtime::{Controlled, MAX_INPUTS, Share, family};

pub use error::InputError;
pub(crate) use sources::Cells;
pub use table::Interpolation;

/// A model whose inputs are given as functions of time; itself a model, with the same coordinates and states.
///
/// [`Simulation::input`](crate::Simulation::input) makes one for a run. Make one yourself where a model is expected:
/// for periodic orbits, boundary-value problems, ensembles, work–precision diagrams. The parameter `L` is the kind of
/// length of the model (fixed or known at run time).
///
/// ```
/// use tfe::Driven;
/// use tfe::prelude::*;
///
/// #[dynamics(coordinates(x), lagrangian = (dot(x)^2 - x^2)/2, input(u), force(x) = u)]
/// struct Oscillator;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// // x″ + x = sin 2t, from x = 0, x′ = −2/3: x = −⅓ sin 2t.
/// let driven = Driven::new(&Oscillator).input("u", |t| (2.0 * t).sin())?;
/// let motion = Simulation::new(&driven).element(Mixed::<6>).step(0.05).run(Oscillator.state([0.0], [-2.0 / 3.0]), 0.0..10.0)?;
/// assert!((motion.last().q[0] + 20.0_f64.sin() / 3.0).abs() < 1e-13);
/// # Ok(())
/// # }
/// ```
pub struct Driven<'m, M, L = FixedLength> {
    model: Share<'m, M>,
    sources: Sources<'m>,
    length: PhantomData<L>,
}

/// A model that declares inputs: implemented for every [`Controlled`] and every [`family::Controlled`], and nothing
/// else.
#[diagnostic::on_unimplemented(
    message = "`{Self}` declares no input",
    label = "a model without inputs",
    note = "inputs are declared by `input(u)` in `#[dynamics(...)]`"
)]
pub trait HasInputs<const N: usize, L>: Send + Sync {
    /// The names of the inputs, in the order of declaration.
    const INPUTS: &'static [&'static str];
}

impl<M: Controlled<N>, const N: usize> HasInputs<N, FixedLength> for M {
    const INPUTS: &'static [&'static str] = M::INPUTS;
}

impl<M: family::Controlled> HasInputs<0, RunTimeLength> for M {
    const INPUTS: &'static [&'static str] = M::INPUTS;
}

/// What can be given inputs: a model that declares some, or a [`Driven`] model that already has some.
#[diagnostic::on_unimplemented(
    message = "`{Self}` declares no input",
    label = "a model without inputs",
    note = "inputs are declared by `input(u)` in `#[dynamics(...)]`"
)]
pub trait Drivable<'m, const N: usize, L>: Sized {
    /// The type of the model that declares the inputs.
    type Declaring: HasInputs<N, L>;

    /// The model with the inputs that it already has; other inputs are zero.
    fn driven(model: Share<'m, Self>) -> Driven<'m, Self::Declaring, L>;
}

impl<'m, M: Controlled<N>, const N: usize> Drivable<'m, N, FixedLength> for M {
    type Declaring = M;

    fn driven(model: Share<'m, M>) -> Driven<'m, M> {
        Driven::sharing(model)
    }
}

impl<'m, M: family::Controlled> Drivable<'m, 0, RunTimeLength> for M {
    type Declaring = M;

    fn driven(model: Share<'m, M>) -> Driven<'m, M, RunTimeLength> {
        Driven::sharing(model)
    }
}

impl<'m, M: Controlled<N>, const N: usize> Drivable<'m, N, FixedLength> for Driven<'m, M> {
    type Declaring = M;

    fn driven(model: Share<'m, Self>) -> Self {
        (*model).clone()
    }
}

impl<'m, M: family::Controlled> Drivable<'m, 0, RunTimeLength> for Driven<'m, M, RunTimeLength> {
    type Declaring = M;

    fn driven(model: Share<'m, Self>) -> Self {
        (*model).clone()
    }
}

impl<M, L> Clone for Driven<'_, M, L> {
    fn clone(&self) -> Self {
        Self {
            model: self.model.clone(),
            sources: self.sources.clone(),
            length: PhantomData,
        }
    }
}

impl<M: fmt::Debug, L> fmt::Debug for Driven<'_, M, L> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kinds = self.sources.each.iter().map(|source| match source {
            Source::Zero => "zero",
            Source::Function(_) => "function",
            Source::Table(_) => "table",
        });
        f.debug_struct("Driven")
            .field("model", &self.model)
            .field("inputs", &kinds.collect::<Vec<_>>())
            .finish_non_exhaustive()
    }
}

impl<'m, M, L> Driven<'m, M, L> {
    /// The model with all its inputs zero.
    pub fn new<const N: usize>(model: &'m M) -> Self
    where
        M: Declared<N, Length = L> + HasInputs<N, L>,
    {
        Self::sharing(Share::Borrowed(model))
    }

    pub(crate) fn sharing<const N: usize>(model: Share<'m, M>) -> Self
    where
        M: HasInputs<N, L>,
    {
        Self {
            model,
            sources: Sources::zero(M::INPUTS.len()),
            length: PhantomData,
        }
    }

    /// Gives an input as a function of time. The function is evaluated at the points of elements, several times each,
    /// in any order.
    ///
    /// Where a run evaluates a function that panics or returns a number that is not finite, [it says
    /// so](crate::Simulation::input); elsewhere a panic goes on to the caller, and an element with a number that is
    /// not finite cannot be solved. Derivatives of motions whose events or spans move with the state need the time
    /// derivative of the function. It is taken by differences over 5·10⁻⁴ ∛t, or less where the function changes
    /// faster, so that the function is also evaluated that far outside the span.
    ///
    /// # Errors
    /// [`InputError::Unknown`] if the model does not declare the input.
    pub fn input<const N: usize>(
        mut self,
        name: &str,
        function: impl Fn(f64) -> f64 + Send + Sync + 'm,
    ) -> Result<Self, InputError>
    where
        M: HasInputs<N, L>,
    {
        let place = place(M::INPUTS, name)?;
        self.sources.each[place] = Source::Function(Arc::new(function));
        Ok(self)
    }

    /// Gives an input as a table of values at given times; before the first time and after the last it is constant.
    /// Elements of runs, fits and ensembles of this model end at these times, so that they keep their order of accuracy;
    /// those of orbits, boundary-value problems and optimal controls do not.
    ///
    /// # Errors
    /// [`InputError::Unknown`] if the model does not declare the input, [`InputError::Table`] if the table is invalid.
    pub fn table<const N: usize>(
        mut self,
        name: &str,
        times: &[f64],
        values: &[f64],
        interpolation: Interpolation,
    ) -> Result<Self, InputError>
    where
        M: HasInputs<N, L>,
    {
        let place = place(M::INPUTS, name)?;
        let table = Table::new(times, values, interpolation).map_err(|why| InputError::Table {
            name: name.to_owned(),
            why,
        })?;
        self.sources.each[place] = Source::Table(Arc::new(table));
        Ok(self)
    }

    /// The same model; inputs that are set in `cells` take precedence.
    pub(crate) fn holding(mut self, cells: Arc<Cells>) -> Self {
        self.sources.held = Some(cells);
        self
    }

    /// The same inputs for another model.
    fn of(&self, model: M) -> Self
    where
        M: Send + Sync,
    {
        Self {
            model: Share::own(model),
            ..self.clone()
        }
    }
}

/// The index of an input among those of a model.
pub(crate) fn place(known: &'static [&'static str], name: &str) -> Result<usize, InputError> {
    let mut inputs = known.iter().take(MAX_INPUTS);
    let place = inputs.position(|own| *own == name);
    place.ok_or_else(|| InputError::Unknown {
        name: name.to_owned(),
        known: known.to_vec(),
    })
}
