//! The models of an ensemble: one model for all runs, or one for each.

use super::error::EnsembleError;
use super::plan::{WIDTH, start_of};
use tfe_runtime::bundle::{Bundle, One, Trajectories, Varied};
use tfe_runtime::step::Control;
use tfe_runtime::{Element, Model, ModelError, State};

/// The models of an ensemble, of either kind of length; internal.
pub trait Models<'m, M>: Copy + Sync + 'm {
    /// The model of one run.
    fn model(&self, index: usize) -> &'m M;

    /// The number of runs for a number of starts.
    ///
    /// # Errors
    /// [`EnsembleError::Starts`] if the number of starts does not fit the number of models.
    fn count(&self, starts: usize) -> Result<usize, EnsembleError>;
}

/// Models of fixed size, whose runs may go side by side.
pub trait Members<'m, M: Model<N>, const N: usize>: Models<'m, M> {
    /// The type that advances eight trajectories side by side.
    type Lanes: Trajectories<'m, M, N> + Send + Sync + 'm;

    /// Whether the models permit runs side by side. Models that do not pass their check do not: each of their runs has
    /// an error of its own.
    fn share_kernels(&self) -> bool;

    /// Creates an empty bundle of trajectories.
    ///
    /// # Errors
    /// [`ModelError`] if the element does not exist.
    fn bundle(
        &self,
        element: Element,
        control: Control,
    ) -> Result<Bundle<'m, M, N, WIDTH, Self::Lanes>, ModelError>;

    /// Puts the runs from `first` on into the bundle, one per lane.
    fn place(
        &self,
        bundle: &mut Bundle<'m, M, N, WIDTH, Self::Lanes>,
        first: usize,
        starts: &[State<N>],
    );
}

/// The same model in all runs.
#[derive(Debug)]
pub struct OneModel<'m, M>(pub(super) &'m M);

/// A model for each run.
#[derive(Debug)]
pub struct ManyModels<'m, M>(pub(super) &'m [M]);

// Not derived: the models are borrowed, they need not be `Clone`.
impl<M> Clone for OneModel<'_, M> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<M> Copy for OneModel<'_, M> {}

impl<M> Clone for ManyModels<'_, M> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<M> Copy for ManyModels<'_, M> {}

impl<'m, M: Sync> Models<'m, M> for OneModel<'m, M> {
    fn model(&self, _index: usize) -> &'m M {
        self.0
    }

    fn count(&self, starts: usize) -> Result<usize, EnsembleError> {
        Ok(starts)
    }
}

impl<'m, M: Sync> Models<'m, M> for ManyModels<'m, M> {
    fn model(&self, index: usize) -> &'m M {
        &self.0[index]
    }

    fn count(&self, starts: usize) -> Result<usize, EnsembleError> {
        let models = self.0.len();
        if starts != 1 && starts != models {
            return Err(EnsembleError::Starts { models, starts });
        }
        Ok(models)
    }
}

impl<'m, M: Model<N> + Sync, const N: usize> Members<'m, M, N> for OneModel<'m, M> {
    type Lanes = One<'m, M>;

    fn share_kernels(&self) -> bool {
        self.0.check().is_ok()
    }

    fn bundle(
        &self,
        element: Element,
        control: Control,
    ) -> Result<Bundle<'m, M, N, WIDTH, One<'m, M>>, ModelError> {
        Bundle::new(self.0, element, control)
    }

    fn place(
        &self,
        bundle: &mut Bundle<'m, M, N, WIDTH, One<'m, M>>,
        _first: usize,
        starts: &[State<N>],
    ) {
        bundle.start(starts);
    }
}

impl<'m, M: Model<N> + Sync, const N: usize> Members<'m, M, N> for ManyModels<'m, M> {
    type Lanes = Varied<'m, M>;

    /// Hand-written kernels that do not number their parameters read them from a single model, so lanes with different
    /// models cannot share them. Parameters without a number, and the functions of inputs, are also those of a single
    /// model.
    fn share_kernels(&self) -> bool {
        self.0.first().is_some_and(|first| {
            let beside = unnumbered(first);
            let share = |model: &M| first.shares_inputs(model) && unnumbered(model) == beside;
            let is_good = |model: &M| model.check().is_ok();
            first.parameters() > 0 && self.0.iter().all(share) && self.0.iter().all(is_good)
        })
    }

    fn bundle(
        &self,
        element: Element,
        control: Control,
    ) -> Result<Bundle<'m, M, N, WIDTH, Varied<'m, M>>, ModelError> {
        Bundle::of_models(self.model(0), element, control)
    }

    fn place(
        &self,
        bundle: &mut Bundle<'m, M, N, WIDTH, Varied<'m, M>>,
        first: usize,
        starts: &[State<N>],
    ) {
        bundle.start_with(&self.0[first..], starts);
    }
}

/// The data that the kernels of a model read in addition to its numbered parameters.
fn unnumbered<M: Model<N>, const N: usize>(model: &M) -> Vec<u64> {
    let mut all = Vec::new();
    model.unnumbered(&mut |value| all.push(value));
    all
}

/// The starts of up to eight runs from `first` on.
pub(super) fn some_starts<const N: usize>(
    starts: &[State<N>],
    first: usize,
    count: usize,
) -> Vec<State<N>> {
    let runs = first..(first + WIDTH).min(count);
    runs.map(|index| *start_of(starts, index)).collect()
}
