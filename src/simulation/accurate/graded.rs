//! Equal or graded steps: which a run may use, and the pilot run that finds where steps must be short.

use super::pilots::Pilots;
use super::repeatable::Repeatable;
use crate::accuracy::{
    Asked, Graded, Grading, PilotSettings, damping_element_for, element_for, explore, factor_for,
};
use tfe_runtime::{Element, Facts, Statistics};

/// The grading that consists of given nodes; the factor 1 reproduces them.
pub(super) fn graded_by(nodes: &[f64], element: Element) -> Option<Graded> {
    let lengths = nodes.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    Some(Graded {
        grading: Grading::new(nodes, &lengths.collect::<Vec<_>>())?,
        element,
        factor: 1.0,
    })
}

/// Finds by a pilot run, whose first step is `first`, where steps must be short; `None` where equal steps are as good.
///
/// Unless the element was chosen, it is one with numerical damping if `damps`, except where the motion is not stiff:
/// where the fixed-point iteration converged in nearly all steps of the pilot run, an element with Gauss points is
/// used.
pub(super) fn graded(
    run: &dyn Repeatable,
    asked: &Asked,
    damps: bool,
    first: f64,
    work: &mut Statistics,
) -> Option<Graded> {
    /// The largest fraction of steps solved by Newton's method for which a motion counts as not stiff.
    const FEW: f64 = 0.1;
    /// The local error of the pilot run. A smaller one makes the pilot run longer than the runs that follow; with a
    /// larger one it may step over fast phases.
    const LOCAL: f64 = 1e-7;
    let smooth = asked.element.unwrap_or_else(|| element_for(asked.accuracy));
    let element = match asked.element {
        Some(element) => element,
        None if damps => damping_element_for(asked.accuracy),
        None => smooth,
    };
    let length = (asked.span.end - asked.span.start).abs();
    let settings = PilotSettings {
        span: asked.span.clone(),
        breaks: asked.breaks.clone(),
        longest: asked.longest.map_or(length, |step| step.abs().min(length)),
        power: element.order() as f64 + 1.0,
        first,
        local: LOCAL,
    };
    let mut pair = Pilots::new(run, element, &settings).ok()?;
    let grading = explore(&settings, &mut pair);
    *work = pair.work();
    let grading = grading?;
    let element = if asked.element.is_none() && pair.by_newton() < FEW {
        smooth
    } else {
        element
    };
    let steps = grading.sum(asked.span.end);
    Some(Graded {
        grading,
        element,
        factor: factor_for(asked.accuracy, element, settings.local, steps),
    })
}

/// The kinds of steps that a run may use.
#[derive(Clone, Copy, Debug)]
pub(super) enum Steps {
    Equal,
    /// Short steps where the motion is fast, if that saves work; `damps` permits elements with numerical damping.
    Varying {
        damps: bool,
    },
}

impl Steps {
    /// Whether steps may vary. Equal steps preserve the structure of conservative autonomous models, and allow linear
    /// models to reuse one matrix for all steps. First-order equations, written as p·f(q), have no structure that
    /// unequal steps would spoil.
    pub(super) const fn may_vary(facts: Facts, is_of_first_order: bool) -> bool {
        facts.time_dependent || ((facts.forced || is_of_first_order) && !facts.linear)
    }

    pub(super) fn of(may_vary: bool, is_constrained: bool) -> Self {
        if may_vary {
            Self::Varying {
                damps: !is_constrained,
            }
        } else {
            Self::Equal
        }
    }
}
