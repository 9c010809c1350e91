//! Why models could not be compared.

use crate::error::RunErrorKind;
use std::error::Error;
use std::fmt;
use tfe_runtime::ElementError;

/// Why a [`Fidelity`](super::Fidelity) made no ladder.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum FidelityError {
    /// There is no model.
    NoRungs,
    /// Two rungs have one name.
    SameName {
        /// The name.
        name: String,
    },
    /// No output is declared by all rungs, or none was asked for.
    NoOutputs {
        /// Each rung with what it declares.
        declared: Vec<(String, Vec<String>)>,
    },
    /// An output that was asked for is not declared by a rung.
    UnknownOutput {
        /// What was asked for.
        output: String,
        /// The rung.
        rung: String,
        /// What it declares.
        declared: Vec<String>,
    },
    /// A model of run-time length does not fit together.
    Model {
        /// The rung.
        rung: String,
        /// Why.
        source: RunErrorKind,
    },
    /// No element was left to try.
    NoElements,
    /// An element does not exist (number of nodes, quadrature).
    Element(ElementError),
    /// No accuracy was asked for.
    NoAccuracies,
    /// An accuracy is not positive, or not finite.
    Accuracy {
        /// What was asked for.
        accuracy: f64,
    },
    /// The span is not to be divided into no parts, nor into more than there may be steps.
    Parts {
        /// The number of parts asked for.
        parts: usize,
        /// The most steps of a run.
        most: usize,
    },
    /// The span is empty, or its ends are not finite.
    Span {
        /// The start asked for.
        start: f64,
        /// The end asked for.
        end: f64,
    },
    /// The last rung, which the others should be compared with, could not be run.
    Reference(RunErrorKind),
    /// Runs of the last rung have no outputs that are numbers.
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
                "an accuracy is {accuracy}, but it must be finite and greater than zero"
            ),
            Self::Parts { parts, most } => write!(
                f,
                "a span of at most {most} steps cannot have {parts} parts; ask for at least one part and as many steps"
            ),
            Self::Span { start, end } => write!(
                f,
                "the span {start}..{end} is empty, has an end that is not finite, or is too short for so many steps"
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

/// Names as a sentence has them.
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
