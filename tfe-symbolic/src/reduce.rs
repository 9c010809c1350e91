//! Models made from models: each pass turns a declared model into another one, after which everything sees an ordinary model.
//!
//! ```text
//! Declared ──pass──▶ Declared ──pass──▶ … ──▶ Variant
//! ```
//!
//! A pass works on lowered expressions, so what it makes is differentiated like anything else. Coordinates are found by their names in the
//! model at hand, which passes before may have changed; values of entries hold nothing of the state and mean the same in all of them.

mod fields;
mod frozen;
mod inertia;
mod notation;
mod removal;
mod target;
mod truncated;

use crate::ast::Name;
use crate::declared::{Declared, Variant};
use crate::diagnostic::{Kind, Span};
use crate::graph::ExprId;
pub(crate) use target::Target;

/// The largest degree of a truncation: the number of terms grows with its power.
pub(crate) const MAX_DEGREE: u32 = 12;

/// A pass with its place and what it does in words.
#[derive(Clone, Debug)]
pub(crate) struct Step {
    pub(crate) pass: Pass,
    pub(crate) span: Span,
    /// `truncated to degree 4`
    pub(crate) words: String,
}

/// What is done to a model.
#[derive(Clone, Debug)]
pub(crate) enum Pass {
    /// The Taylor polynomial about a point.
    Truncated { degree: u32, point: Vec<Assignment> },
    /// Coordinates that follow given functions.
    Frozen(Vec<Assignment>),
}

/// `x = l`
#[derive(Clone, Debug)]
pub(crate) struct Assignment {
    pub(crate) target: Target,
    /// Where the target stands.
    pub(crate) span: Span,
    pub(crate) value: ExprId,
}

/// A mistake and its place.
type Mistake = (Span, Kind);

/// A model on its way from pass to pass.
struct Reduction {
    model: Declared,
    /// The fields that passes have added, with what they are.
    added: Vec<(String, String)>,
}

impl Reduction {
    fn pass(&mut self, step: &Step) -> Result<(), Mistake> {
        let place = |kind| (step.span, kind);
        match &step.pass {
            Pass::Truncated { degree, point } => self.truncate(*degree, point, place),
            Pass::Frozen(held) => self.freeze(held, place),
        }
    }
}

/// The model `name`, made from another one by passes from left to right; `fields` are all that formulas and entries use, in the order of the
/// struct.
///
/// # Errors
/// The first thing that stands in the way.
pub(crate) fn variant(
    original: &Declared,
    name: &Name,
    steps: &[Step],
    fields: &[String],
) -> Result<Variant, Mistake> {
    let model = Declared {
        name: name.node.clone(),
        solvers: Vec::new(),
        variants: Vec::new(),
        ..original.clone()
    };
    let mut reduction = Reduction {
        model,
        added: Vec::new(),
    };
    for step in steps {
        reduction.pass(step)?;
    }
    let Reduction { mut model, added } = reduction;
    if let Some(coordinate) = inertia::missing(&mut model) {
        let kind = Kind::MasslessCoordinate {
            model: name.node.clone(),
            name: coordinate,
        };
        return Err((name.span, kind));
    }
    fields::keep_used(&mut model, fields, &added);
    let words: Vec<&str> = steps.iter().map(|step| step.words.as_str()).collect();
    let made = words.join("; ");
    model.notation = notation::of(&model, &original.name, &made);
    Ok(Variant { model, made, added })
}
