//! What was found of each model, and which is chosen.

use crate::error::RunErrorKind;
use crate::work_precision::measurements::pareto;
use crate::work_precision::{Cost, Reference};
use tfe_runtime::{Element, Statistics};

/// A model with an element and a step: what it costs, and how far off its outputs are.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// The name of the rung.
    pub rung: String,
    /// The element.
    pub element: Element,
    /// The step, in the units of time, positive.
    pub step: f64,
    /// The largest relative error of the outputs; no less than the [error of the model](Rung::model_error), since a run that is nearer to the truth than
    /// its own model is so by chance, nor than the uncertainty of the reference.
    pub error: f64,
    /// The largest relative error of the outputs as it was found.
    pub distance: f64,
    /// Seconds that the steps took, the least of all repetitions.
    pub seconds: f64,
    /// How often the run was repeated for that.
    pub repetitions: u32,
    /// Evaluations of first and of second derivatives together.
    pub evaluations: u64,
    /// Steps, iterations, evaluations, factorisations of one run.
    pub statistics: Statistics,
}

impl Choice {
    /// What it costs.
    pub fn cost(&self, cost: Cost) -> f64 {
        match cost {
            Cost::Time => self.seconds,
            Cost::Evaluations => self.evaluations as f64,
            Cost::Iterations => self.statistics.iterations as f64,
            Cost::Steps => self.statistics.steps as f64,
        }
    }
}

/// A run of one rung.
#[derive(Clone, Debug, PartialEq)]
pub struct RungPoint {
    /// The element.
    pub element: Element,
    /// The step, in the units of time, positive.
    pub step: f64,
    /// What was found, or why the run stopped.
    pub outcome: Result<Choice, RunErrorKind>,
}

/// The runs of one model.
#[derive(Clone, Debug, PartialEq)]
pub struct Rung {
    pub(super) name: String,
    pub(super) points: Vec<RungPoint>,
    pub(super) model_error: Option<f64>,
}

impl Rung {
    /// The name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// All runs, those that failed included: element by element, the longest step first.
    pub fn points(&self) -> &[RungPoint] {
        &self.points
    }

    /// The runs that reached their end.
    pub fn choices(&self) -> impl Iterator<Item = &Choice> {
        self.points
            .iter()
            .filter_map(|one| one.outcome.as_ref().ok())
    }

    /// How many runs failed.
    pub fn failed(&self) -> usize {
        self.points.len() - self.choices().count()
    }

    /// The error of the model: that of its outputs when steps are so short that they no longer matter.
    ///
    /// `None` of the last rung, which is the truth, and where errors of the model were not told from those of the steps: below the smallest accuracy that was
    /// asked for, or where no step was short enough.
    pub fn model_error(&self) -> Option<f64> {
        self.model_error
    }

    /// The runs for which no other run of this model has both a smaller error and a smaller cost, the cheapest first.
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

/// What a [`Fidelity`](super::Fidelity) found: rungs with their runs, and the cheapest for each accuracy.
///
/// Printed it is a table with a line for each accuracy asked for.
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

    /// All rungs, the last of them the truth, in the order in which they were added.
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

    /// What outputs were compared with.
    pub fn reference(&self) -> &Reference {
        &self.reference
    }

    /// With another cost in choices and charts.
    #[must_use]
    pub fn against(mut self, cost: Cost) -> Self {
        self.cost = cost;
        self
    }

    /// Whether errors so small can be told: twice the uncertainty of the reference or more.
    pub fn is_known(&self, accuracy: f64) -> bool {
        accuracy >= 2.0 * self.reference.uncertainty()
    }

    /// The cheapest run of all rungs with errors of at most `accuracy`; `None` where no run is so accurate, or none can be told to be
    /// ([`is_known`](Self::is_known)).
    pub fn cheapest(&self, accuracy: f64) -> Option<&Choice> {
        if !self.is_known(accuracy) {
            return None;
        }
        let all = self.rungs.iter().flat_map(Rung::choices);
        let enough = all.filter(|choice| choice.error <= accuracy);
        enough.min_by(|a, b| a.cost(self.cost).total_cmp(&b.cost(self.cost)))
    }
}
