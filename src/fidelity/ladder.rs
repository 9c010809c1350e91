//! The result of a model comparison: the runs of each model and the choices.

use crate::error::RunErrorKind;
use crate::work_precision::measurements::pareto;
use crate::work_precision::{Cost, Reference};
use tfe_runtime::{Element, Statistics};

/// A model with an element and a step size: its cost, and the error of its outputs.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// The name of the model (rung).
    pub rung: String,
    /// The element.
    pub element: Element,
    /// The step size, in units of time, positive.
    pub step: f64,
    /// The largest relative error of the outputs, but not less than the [error of the model](Rung::model_error),
    /// because a run that is nearer to the reference than its own model is so by chance, and not less than the
    /// uncertainty of the reference.
    pub error: f64,
    /// The largest relative error of the outputs as computed.
    pub distance: f64,
    /// The time of the steps in seconds, the shortest of all repetitions.
    pub seconds: f64,
    /// The number of repetitions.
    pub repetitions: u32,
    /// The number of evaluations of first and of second derivatives together.
    pub evaluations: u64,
    /// Counts of steps, iterations, evaluations and factorisations of one run.
    pub statistics: Statistics,
}

impl Choice {
    /// The cost in a given measure.
    pub fn cost(&self, cost: Cost) -> f64 {
        match cost {
            Cost::Time => self.seconds,
            Cost::Evaluations => self.evaluations as f64,
            Cost::Iterations => self.statistics.iterations as f64,
            Cost::Steps => self.statistics.steps as f64,
        }
    }
}

/// A run of one model (rung) with one element and one step size.
#[derive(Clone, Debug, PartialEq)]
pub struct RungPoint {
    /// The element.
    pub element: Element,
    /// The step size, in units of time, positive.
    pub step: f64,
    /// The result, or why the run stopped.
    pub outcome: Result<Choice, RunErrorKind>,
}

/// All runs of one model.
#[derive(Clone, Debug, PartialEq)]
pub struct Rung {
    pub(super) name: String,
    pub(super) points: Vec<RungPoint>,
    pub(super) model_error: Option<f64>,
}

impl Rung {
    /// The name of the model.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// All runs, including those that failed: element by element, the longest step first.
    pub fn points(&self) -> &[RungPoint] {
        &self.points
    }

    /// The runs that reached the end of the span.
    pub fn choices(&self) -> impl Iterator<Item = &Choice> {
        self.points
            .iter()
            .filter_map(|one| one.outcome.as_ref().ok())
    }

    /// The number of runs that failed.
    pub fn failed(&self) -> usize {
        self.points.len() - self.choices().count()
    }

    /// The error of the model: that of its outputs when steps are so short that the discretisation error no longer
    /// matters.
    ///
    /// `None` for the last model, which is the reference, and if the error of the model could not be distinguished from
    /// that of the steps: because it is below the smallest accuracy asked for, or no step was short enough.
    pub fn model_error(&self) -> Option<f64> {
        self.model_error
    }

    /// The Pareto front of this model: the runs for which no other run has both a smaller error and a smaller cost,
    /// the cheapest first.
    pub fn front(&self, cost: Cost) -> Vec<&Choice> {
        let known = |choice: &&Choice| choice.error.is_finite() && choice.cost(cost).is_finite();
        let places = self
            .choices()
            .filter(known)
            .map(|choice| (choice.cost(cost), choice.error, choice));
        let front = pareto(places.collect());
        front.into_iter().map(|(_, _, choice)| choice).collect()
    }
}

/// The result of a [`Fidelity`](super::Fidelity): the models with their runs, and the cheapest run for each accuracy.
///
/// `Display` prints a table with one line for each accuracy asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Ladder {
    pub(super) title: String,
    pub(super) rungs: Vec<Rung>,
    pub(super) outputs: Vec<String>,
    pub(super) accuracies: Vec<f64>,
    pub(super) reference: Reference,
    pub(super) cost: Cost,
}

impl Ladder {
    /// The title of charts.
    pub fn title(&self) -> &str {
        &self.title
    }

    /// All models in the order in which they were added; the last one is the reference model.
    pub fn rungs(&self) -> &[Rung] {
        &self.rungs
    }

    /// The outputs that were compared.
    pub fn outputs(&self) -> &[String] {
        &self.outputs
    }

    /// The accuracies asked for.
    pub fn accuracies(&self) -> &[f64] {
        &self.accuracies
    }

    /// The reference with which outputs were compared.
    pub fn reference(&self) -> &Reference {
        &self.reference
    }

    /// Changes the measure of cost for choices and charts.
    #[must_use]
    pub fn against(mut self, cost: Cost) -> Self {
        self.cost = cost;
        self
    }

    /// Whether errors of this size can be distinguished from those of the reference: whether it is at least twice the
    /// uncertainty of the reference.
    pub fn is_known(&self, accuracy: f64) -> bool {
        accuracy >= 2.0 * self.reference.uncertainty()
    }

    /// The cheapest run of all models with an error of at most `accuracy`; `None` if no run is so accurate, or if such
    /// an error cannot be distinguished from that of the reference ([`is_known`](Self::is_known)).
    pub fn cheapest(&self, accuracy: f64) -> Option<&Choice> {
        if !self.is_known(accuracy) {
            return None;
        }
        let all = self.rungs.iter().flat_map(Rung::choices);
        let enough = all.filter(|choice| choice.error <= accuracy);
        enough.min_by(|a, b| a.cost(self.cost).total_cmp(&b.cost(self.cost)))
    }
}
