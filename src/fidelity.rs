//! Model comparison: which of several models of one system, with which element and step size, is just accurate enough.

mod error;
mod ladder;
mod output;
mod rung;
mod search;
mod truth;

use crate::work_precision::grid::Grid;
use crate::work_precision::report;
use crate::work_precision::rounds::ROUNDS;
use crate::work_precision::{Cost, PhasePoint, Subject};
use rung::{Outputs, Runs, Scene};
use search::Search;
use std::fmt;
use std::ops::Range;
use std::time::Duration;
use tfe_runtime::{Element, Mixed};
use truth::Truth;

pub use error::FidelityError;
pub use ladder::{Choice, Ladder, Rung, RungPoint};

/// Runs several models of one scene, and finds the cheapest that computes the scene's outputs with a given accuracy.
///
/// The models are called rungs, the result a ladder. All models begin at the same start, expressed in the coordinates
/// of each; they may differ in their coordinates and their kind of length. The last rung is the reference model.
/// Compared are the outputs, `output(name) = …`, that all models declare:
///
/// ```text
/// error = max |y(t) − y_ref(t)| / max |y_ref(t)|      over all outputs y, at the ends of equal parts of the span        (T-110)
/// ```
///
/// where the second maximum is taken over the same times for each output separately; the error is absolute for an
/// output that is zero at all of them. Each model is run with each element and with step sizes halved from a part of
/// the span, until its error no longer falls: what is left is the error of the model, or of rounding.
///
/// ```
/// use tfe::prelude::*;
///
/// #[dynamics(
///     coordinates(theta), lagrangian = m/2*l^2*dot(theta)^2 - m*g*l/2*theta^2,
///     output(x) = l*theta,
/// )]
/// struct Linear { m: f64, l: f64, g: f64 }
///
/// #[dynamics(
///     coordinates(theta), lagrangian = m/2*l^2*dot(theta)^2 + m*g*l*cos(theta),
///     output(x) = l*sin(theta),
/// )]
/// struct Full { m: f64, l: f64, g: f64 }
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let (linear, full) = (Linear { m: 1.0, l: 1.0, g: 9.81 }, Full { m: 1.0, l: 1.0, g: 9.81 });
/// let ladder = Fidelity::new(0.0..4.0)
///     .rung("linear", &linear, linear.state([0.1], [0.0]))
///     .rung("full", &full, full.state([0.1], [0.0])) // the last rung is what the others are compared with
///     .elements([Mixed::<3>.into(), Mixed::<5>.into()])
///     .accuracies([1e-1, 1e-2, 1e-4, 1e-6])
///     .run()?;
/// println!("{ladder}");
///
/// // Over four seconds the linear pendulum gets ahead by some thousandths of the amplitude.
/// let model_error = ladder.rungs()[0].model_error().ok_or("it was run to its floor")?;
/// assert!(1e-3 < model_error && model_error < 1e-2);
/// let choice = ladder.cheapest(1e-6).ok_or("the full model can do it")?;
/// assert!(choice.rung == "full" && choice.error <= 1e-6);
/// # let folder = std::env::temp_dir().join(format!("tfe-fidelity-{}", std::process::id()));
/// # std::fs::create_dir_all(&folder)?;
/// # /*
/// ladder.save("ladder.svg")?; // or .csv, .html
/// # */
/// # ladder.save(folder.join("ladder.csv"))?;
/// # std::fs::remove_dir_all(&folder)?;
/// # Ok(())
/// # }
/// ```
///
/// Times are those of the steps alone, on one processor, the best of several repetitions if a run is short, as in
/// [`WorkPrecision`](crate::WorkPrecision). Nothing inside elements is recorded, so that linear models of fixed size
/// step by a matrix product where that is cheaper, as they do with [`record_every`](crate::Simulation::record_every).
///
/// The reference is a run of the last rung with `Mixed::<9>`, by steps that are never cut and whose size is halved
/// until two runs agree to a tenth of the smallest accuracy or no longer approach each other. No choice is made for
/// accuracies below twice the uncertainty of the reference.
pub struct Fidelity<'m> {
    span: Range<f64>,
    title: String,
    rungs: Vec<(String, Box<dyn Runs + 'm>)>,
    outputs: Option<Vec<String>>,
    elements: Vec<Element>,
    accuracies: Vec<f64>,
    parts: usize,
    most_steps: usize,
    repeat_for: Duration,
    cost: Cost,
    progress: bool,
}

impl<'m> Fidelity<'m> {
    /// A comparison over the span, backwards in time if it ends before it starts; as yet without models.
    pub fn new(span: Range<f64>) -> Self {
        Self {
            span,
            title: "A ladder of models".to_owned(),
            rungs: Vec::new(),
            outputs: None,
            elements: vec![Mixed::<3>.into(), Mixed::<5>.into(), Mixed::<9>.into()],
            accuracies: (1..=10).map(|digits| 10_f64.powi(-digits)).collect(),
            parts: 16,
            most_steps: 1 << 17,
            repeat_for: Duration::from_millis(20),
            cost: Cost::Time,
            progress: false,
        }
    }

    /// Adds a model (a rung) with its start. The last one added is the reference model, with which the others are
    /// compared; it is itself a candidate.
    #[must_use]
    pub fn rung<M: Subject<S>, S: PhasePoint + 'm>(
        mut self,
        name: impl Into<String>,
        model: &'m M,
        start: S,
    ) -> Self {
        let scene = Scene { model, start };
        self.rungs.push((name.into(), Box::new(scene)));
        self
    }

    /// Sets the outputs to compare; by default those that all models declare. One site of an array is `"strain[3]"`.
    #[must_use]
    pub fn outputs<N: Into<String>>(mut self, names: impl IntoIterator<Item = N>) -> Self {
        self.outputs = Some(names.into_iter().map(Into::into).collect());
        self
    }

    /// Sets the elements to try: `Mixed` of 3, 5 and 9 nodes by default.
    #[must_use]
    pub fn elements(mut self, elements: impl IntoIterator<Item = Element>) -> Self {
        self.elements = elements.into_iter().collect();
        self
    }

    /// Sets the accuracies for which the result shows a choice: 10⁻¹, 10⁻², … 10⁻¹⁰ by default. Step sizes are not
    /// refined beyond the smallest of them; [`Ladder::cheapest`] takes any accuracy.
    #[must_use]
    pub fn accuracies(mut self, accuracies: impl IntoIterator<Item = f64>) -> Self {
        self.accuracies = accuracies.into_iter().collect();
        self
    }

    /// Sets the number of equal parts of the span at whose ends (and at its start) outputs are compared: 16 by
    /// default. No step is longer than a part.
    #[must_use]
    pub fn parts(mut self, parts: usize) -> Self {
        self.parts = parts;
        self
    }

    /// Sets the largest number of steps of a run: 131 072 by default.
    #[must_use]
    pub fn most_steps(mut self, steps: usize) -> Self {
        self.most_steps = steps;
        self
    }

    /// Sets for how long a run is repeated to find its best time: 20 ms by default. A run that takes longer is made
    /// once.
    #[must_use]
    pub fn repeat_for(mut self, duration: Duration) -> Self {
        self.repeat_for = duration;
        self
    }

    /// Sets the measure of cost: the computing time, by default.
    #[must_use]
    pub fn against(mut self, cost: Cost) -> Self {
        self.cost = cost;
        self
    }

    /// Sets the title of charts.
    #[must_use]
    pub fn title(mut self, title: impl Into<String>) -> Self {
        self.title = title.into();
        self
    }

    /// Reports the progress on standard error.
    #[must_use]
    pub fn progress(mut self) -> Self {
        self.progress = true;
        self
    }

    /// Makes all runs, one after the other, and repeats them in turn.
    ///
    /// A run that fails is kept as a point with its error ([`RungPoint::outcome`]), also if a start is invalid; the
    /// other runs are made nevertheless.
    ///
    /// # Errors
    /// If there is nothing to compare [`FidelityError::NoRungs`], [`SameName`](FidelityError::SameName),
    /// [`NoOutputs`](FidelityError::NoOutputs), [`UnknownOutput`](FidelityError::UnknownOutput) or
    /// [`Model`](FidelityError::Model); for invalid settings [`NoElements`](FidelityError::NoElements),
    /// [`Element`](FidelityError::Element), [`NoAccuracies`](FidelityError::NoAccuracies),
    /// [`Accuracy`](FidelityError::Accuracy), [`Parts`](FidelityError::Parts) or [`Span`](FidelityError::Span);
    /// [`Reference`](FidelityError::Reference) or [`ReferenceValue`](FidelityError::ReferenceValue) if the reference fails.
    pub fn run(&self) -> Result<Ladder, FidelityError> {
        let grids = self.grids()?;
        let (names, wanted) = self.wanted()?;
        let Some(((_, last), columns)) = self.rungs.last().zip(wanted.last()) else {
            return Err(FidelityError::NoRungs);
        };
        let smallest = self.accuracies.iter().copied().fold(1.0, f64::min);
        self.say(format_args!("reference …"));
        let outputs = |columns| Outputs {
            columns,
            parts: self.parts,
        };
        let truth = Truth::find(
            last.as_ref(),
            outputs(columns),
            (&self.span, &grids),
            smallest,
        )?;
        self.say(format_args!("reference: {}", truth.summary()));
        let mut searches = Vec::new();
        for ((name, rung), columns) in self.rungs.iter().zip(&wanted) {
            self.say(format_args!("{name} …"));
            let mut search = Search::new(rung.as_ref(), outputs(columns), &truth);
            for &element in &self.elements {
                search.halve(element, &grids, smallest);
            }
            searches.push(search);
        }
        for round in 1..=ROUNDS {
            for search in &mut searches {
                search.repeat(self.repeat_for / ROUNDS * round);
            }
        }
        let ends = searches.into_iter().zip(&self.rungs).enumerate();
        let rungs = ends.map(|(k, (search, (name, _)))| {
            let is_truth = k + 1 == self.rungs.len();
            search.into_rung(name, is_truth, smallest)
        });
        Ok(Ladder {
            title: self.title.clone(),
            rungs: rungs.collect(),
            outputs: names,
            accuracies: self.accuracies.clone(),
            reference: *truth.summary(),
            cost: self.cost,
        })
    }

    /// The meshes of all runs, from the longest step on; each step is half the previous one.
    fn grids(&self) -> Result<Vec<Grid>, FidelityError> {
        if self.rungs.is_empty() {
            return Err(FidelityError::NoRungs);
        }
        if self.elements.is_empty() {
            return Err(FidelityError::NoElements);
        }
        for element in &self.elements {
            element.validate().map_err(FidelityError::Element)?;
        }
        if self.accuracies.is_empty() {
            return Err(FidelityError::NoAccuracies);
        }
        let is_right = |accuracy: &f64| accuracy.is_finite() && *accuracy > 0.0;
        if let Some(&accuracy) = self.accuracies.iter().find(|one| !is_right(one)) {
            return Err(FidelityError::Accuracy { accuracy });
        }
        let (parts, most) = (self.parts, self.most_steps);
        if parts == 0 || most < parts {
            return Err(FidelityError::Parts { parts, most });
        }
        let Range { start, end } = self.span;
        let length = end - start;
        let halvings = 0..=(most / parts).ilog2();
        let grid = |halvings: u32| {
            let step = length / parts as f64 * 0.5_f64.powi(halvings as i32);
            Grid::new(&self.span, step).map_err(|_| FidelityError::Span { start, end })
        };
        halvings.map(grid).collect()
    }

    /// The outputs that are compared, and their columns in each rung.
    fn wanted(&self) -> Result<(Vec<String>, Vec<Vec<usize>>), FidelityError> {
        let mut declared = Vec::new();
        for (k, (name, rung)) in self.rungs.iter().enumerate() {
            if self.rungs[..k].iter().any(|(other, _)| other == name) {
                return Err(FidelityError::SameName { name: name.clone() });
            }
            let names = rung.names().map_err(|source| FidelityError::Model {
                rung: name.clone(),
                source,
            })?;
            declared.push(names);
        }
        let names = match &self.outputs {
            Some(names) => names.clone(),
            None => common(&declared),
        };
        if names.is_empty() {
            let rungs = self.rungs.iter().map(|(name, _)| name.clone());
            return Err(FidelityError::NoOutputs {
                declared: rungs.zip(declared).collect(),
            });
        }
        let columns = |((rung, _), declared): (&(String, _), &Vec<String>)| {
            let column = |output: &String| {
                let found = declared.iter().position(|name| name == output);
                found.ok_or_else(|| FidelityError::UnknownOutput {
                    output: output.clone(),
                    rung: rung.clone(),
                    declared: declared.clone(),
                })
            };
            names.iter().map(column).collect()
        };
        let columns = self.rungs.iter().zip(&declared).map(columns);
        let columns = columns.collect::<Result<_, _>>()?;
        Ok((names, columns))
    }

    fn say(&self, line: fmt::Arguments<'_>) {
        report(self.progress, line);
    }
}

/// The names that are in all lists, in the order of the last list.
fn common(declared: &[Vec<String>]) -> Vec<String> {
    let Some((last, others)) = declared.split_last() else {
        return Vec::new();
    };
    let is_common = |name: &&String| others.iter().all(|names| names.contains(name));
    last.iter().filter(is_common).cloned().collect()
}

impl fmt::Debug for Fidelity<'_> {
    /// Shows the settings; models need not be `Debug`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<_> = self.rungs.iter().map(|(name, _)| name).collect();
        f.debug_struct("Fidelity")
            .field("title", &self.title)
            .field("span", &self.span)
            .field("rungs", &names)
            .field("outputs", &self.outputs)
            .field("elements", &self.elements)
            .field("accuracies", &self.accuracies)
            .finish_non_exhaustive()
    }
}
