//! Models made from models: each pass turns a declared model into another one, which is then treated like any other
//! model.
//!
//! ```text
//! Declared ──pass──▶ Declared ──pass──▶ … ──▶ Variant
//! ```
//!
//! A pass works on lowered expressions, so that its result is differentiated like any other model. Coordinates are
//! found by their names in the present model, which earlier passes may have changed; values of entries do not depend on
//! the state and mean the same in all of them. May import `derive` for kinds of constraints and what a sign decides,
//! `model`, `syntax`, `diagnostic` and `expr`.

mod as_syntax;
mod elastic;
mod fields;
mod frozen;
mod inertia;
mod notation;
mod removal;
mod rigid;
mod routh;
mod target;
mod truncated;

use crate::diagnostic::{Kind, Span};
use crate::expr::graph::ExprId;
use crate::model::declared::{Declared, Projection, Variant};
use crate::syntax::ast::Name;
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
    /// Cyclic coordinates that are ignored.
    Routh(Vec<Ignored>),
    /// Springs that become constraints.
    Rigid(Vec<Spring>),
    /// Constraints that become springs.
    Elastic(Vec<Spring>),
}

/// `x = l`
#[derive(Clone, Debug)]
pub(crate) struct Assignment {
    pub(crate) target: Target,
    /// Where the target stands.
    pub(crate) span: Span,
    pub(crate) value: ExprId,
}

/// `phi`
#[derive(Clone, Debug)]
pub(crate) struct Ignored {
    pub(crate) target: Target,
    pub(crate) span: Span,
}

/// `rod = k`
#[derive(Clone, Debug)]
pub(crate) struct Spring {
    /// The name of the constraint.
    pub(crate) constraint: Target,
    /// Where it stands.
    pub(crate) span: Span,
    /// The field that is the stiffness.
    pub(crate) stiffness: Name,
}

/// A mistake and its place.
type Mistake = (Span, Kind);

/// A model on its way from pass to pass.
struct Reduction {
    model: Declared,
    /// The fields that passes have added, with their meanings.
    added: Vec<(String, String)>,
    /// The remaining coordinates, by their indices in the original; as long as only cyclic ones have been removed.
    kept: Vec<usize>,
    /// Those that were removed, in the order of the fields of their momenta.
    from_state: Vec<usize>,
}

impl Reduction {
    fn pass(&mut self, step: &Step, fields: &[String]) -> Result<(), Mistake> {
        let place = |kind| (step.span, kind);
        match &step.pass {
            Pass::Truncated { degree, point } => self.truncate(*degree, point, place),
            Pass::Frozen(held) => self.freeze(held, place),
            Pass::Routh(ignored) => self.ignore(ignored, fields, place),
            Pass::Rigid(springs) => springs.iter().try_for_each(|spring| self.stiffen(spring)),
            Pass::Elastic(springs) => springs.iter().try_for_each(|spring| self.soften(spring)),
        }
    }
}

/// The model `name`, made from another one by passes from left to right; `fields` are all fields that formulas and
/// entries use, in the order of the struct.
///
/// # Errors
/// The first obstacle.
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
    let dof = original.dof.as_constant();
    let dof = dof.and_then(|dof| usize::try_from(dof).ok()).unwrap_or(0);
    let mut reduction = Reduction {
        model,
        added: Vec::new(),
        kept: (0..dof).collect(),
        from_state: Vec::new(),
    };
    for step in steps {
        reduction.pass(step, fields)?;
    }
    let Reduction {
        mut model,
        added,
        kept,
        from_state,
    } = reduction;
    // Any other pass changes what momenta mean.
    let is_routh = |step: &Step| matches!(step.pass, Pass::Routh(_));
    let projection = steps.iter().all(is_routh).then_some(Projection {
        original: dof,
        kept,
        held: from_state,
    });
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
    Ok(Variant {
        model,
        made,
        added,
        projection,
    })
}
