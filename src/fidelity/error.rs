//! The errors of model comparisons.

use crate::error::RunErrorKind;
use crate::numbers::Short;
use std::error::Error;
use std::fmt;
use tfe_runtime::ElementError;

/// Why a [`Fidelity`](super::Fidelity) made no comparison.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum FidelityError {
    /// No model was added.
    NoRungs,
    /// Two models (rungs) have the same name.
    SameName {
        /// The name.
        name: String,
    },
    /// No output is declared by all models, or the list of outputs is empty.
    NoOutputs {
        /// Each rung with what it declares.
        declared: Vec<(String, Vec<String>)>,
    },
    /// An output that was asked for is not declared by one of the models.
    UnknownOutput {
        /// The output asked for.
        output: String,
        /// The rung.
        rung: String,
        /// The outputs that it declares.
        declared: Vec<String>,
    },
    /// A model does not pass its [check](crate::Model::check): lengths or indices do not fit each other.
    Model {
        /// The rung.
        rung: String,
        /// The cause.
        source: RunErrorKind,
    },
    /// The list of elements is empty.
    NoElements,
    /// An element does not exist: an impossible number of nodes, or a quadrature that its family does not have.
    Element(ElementError),
    /// The list of accuracies is empty.
    NoAccuracies,
    /// An accuracy is not positive, or not finite.
    Accuracy {
        /// The value asked for.
        accuracy: f64,
    },
    /// The number of parts of the span is zero, or larger than the largest number of steps.
    Parts {
        /// The number of parts asked for.
        parts: usize,
        /// The largest number of steps of a run.
        most: usize,
    },
    /// The span is empty, or its ends are not finite.
    Span {
        /// The start asked for.
        start: f64,
        /// The end asked for.
        end: f64,
    },
    /// The reference, a run of the last model, failed.
    Reference(RunErrorKind),
    /// The outputs of the reference are not finite.
    ReferenceValue,
}

impl fmt::Display for FidelityError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoRungs => {
                f.write_str("there is no model to compare; add some with `.rung(name, &model, start)`, the fullest last")
            }
            Self::SameName { name } => {
                write!(f, "two rungs have the name `{name}`; give each its own")
            }
            Self::NoOutputs { declared } => no_outputs(f, declared),
            Self::UnknownOutput {
                output,
                rung,
                declared,
            } => write!(
                f,
                "the rung `{rung}` declares no output `{output}`, but {}; outputs that are compared must be declared by all rungs",
                list(declared)
            ),
            Self::Model { rung, source } => write!(f, "the rung `{rung}` cannot be run: {source}"),
            Self::NoElements => {
                f.write_str("there is no element to try; name some in `.elements([…])`, or leave that out")
            }
            Self::Element(error) => error.fmt(f),
            Self::NoAccuracies => f.write_str(
                "there is no accuracy to meet; name some in `.accuracies([…])`, or leave that out",
            ),
            Self::Accuracy { accuracy } => write!(
                f,
                "an accuracy is {accuracy}, but it must be finite and greater than zero",
                accuracy = Short(*accuracy)
            ),
            Self::Parts { parts, most } => write!(
                f,
                "a span of at most {most} steps cannot have {parts} parts; ask for at least one part and as many steps"
            ),
            Self::Span { start, end } => write!(
                f,
                "the span {start}..{end} is empty, has an end that is not finite, or is too short for so many steps",
                start = Short(*start),
                end = Short(*end)
            ),
            Self::Reference(kind) => write!(
                f,
                "there is nothing to compare with: the last rung could not be run, {kind}"
            ),
            Self::ReferenceValue => f.write_str(
                "there is nothing to compare with: outputs of the last rung are not finite at all times",
            ),
        }
    }
}

fn no_outputs(f: &mut fmt::Formatter<'_>, declared: &[(String, Vec<String>)]) -> fmt::Result {
    f.write_str("no output is common to all rungs")?;
    for (rung, names) in declared {
        write!(f, "; `{rung}` declares {}", list(names))?;
    }
    f.write_str("; declare what matters in each by `output(name) = …`, under one name")
}

/// Names as a list in a sentence.
fn list(names: &[String]) -> String {
    if names.is_empty() {
        return "none".to_owned();
    }
    let quoted: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
    quoted.join(", ")
}

impl Error for FidelityError {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        match self {
            Self::Element(error) => Some(error),
            Self::Model { source: kind, .. } | Self::Reference(kind) => Some(kind),
            _ => None,
        }
    }
}
