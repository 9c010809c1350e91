//! Requirements on lengths and indices that are not known here: fields are checked once for each model before it is
//! evaluated, const parameters where the kernels are compiled for their values.

use super::{Index, Lowerer};
use crate::expr::graph::{ExprId, Graph, Node, SumRange};
use crate::expr::input::{Affine, IndexSymbol, Input};
use crate::expr::rewrite::substitute;
use crate::model::declared::{Extent, Requirement};

impl Lowerer<'_> {
    /// Whether some array of coordinates has a length known at run time only.
    pub(super) fn is_of_run_time_length(&self) -> bool {
        self.model.is_of_run_time_length()
    }

    /// Notes that an index of which nothing can be said here has to stay inside its array.
    pub(super) fn require_index(&mut self, array: &str, place: &Affine, length: Extent) {
        let nest = self.needed(place);
        // Loops count from zero on, and do not come to an index below it.
        let low = self.extreme(place, false);
        let low = low.filter(|low| low != place && !place.holds_entry() && may_be_below_zero(low));
        if let Some(low) = low
            && nest.iter().all(has_turns)
        {
            self.require_index(array, &low, length.clone());
        }
        let requirement = Requirement::Index {
            array: array.to_owned(),
            text: self.in_words(place),
            ranges: self.stands_in(place),
            nest,
            place: place.clone(),
            length,
        };
        self.require(requirement);
    }

    /// An index as kernels may read it. What does not change from term to term of an inner sum is computed once, before
    /// that sum, also where the sum is empty. An index that is outside its array on such turns, whatever the lengths, is
    /// kept inside the sum.
    pub(super) fn kept_inside(&self, place: Affine, length: Option<&Affine>) -> Affine {
        let Some(length) = length.filter(|length| !self.stays_inside(&place, length)) else {
            return place;
        };
        let own = self.needed(&place);
        let is_own = |index: &Index| own.iter().any(|range| range.variable == index.variable);
        let around = self.loops_around(&place);
        let inner = around.iter().rev().find(|index| !is_own(index));
        let (Some(inner), false) = (inner, place.holds_entry()) else {
            return place;
        };
        let on_own: Vec<Index> = around
            .iter()
            .filter(|index| is_own(index))
            .cloned()
            .collect();
        let is_outside = |loops: &[Index]| {
            let side = self.always_outside_on(loops, &place, Some(length));
            side.is_some()
        };
        if !is_outside(&on_own) || is_outside(&around) {
            return place;
        }
        let within = Affine::symbol(IndexSymbol::Within(inner.variable));
        place.plus_scaled(&within, 1).unwrap_or(place)
    }

    /// Notes that an array field has to be as long as its largest index asks for. An index that fields choose says nothing
    /// about the end of the array, and only has to stay inside.
    pub(super) fn require_length(&mut self, field: &str, place: &Affine) {
        if place.variables().is_empty() && place.as_constant().is_none() {
            return self.require_index(field, place, Extent::OfField(field.to_owned()));
        }
        let one = Affine::constant(1);
        let Some(length) = self
            .extreme(place, true)
            .and_then(|high| high.plus_scaled(&one, 1))
        else {
            return;
        };
        let low = self.extreme(place, false).and_then(|low| low.as_constant());
        if low.is_none_or(|low| low < 0) {
            self.require_index(field, place, Extent::OfField(field.to_owned()));
        }
        let requirement = Requirement::FieldLength {
            field: field.to_owned(),
            text: self.in_words(place),
            ranges: self.stands_in(place),
            length,
        };
        self.require(requirement);
    }

    /// Notes that the range of the sites around has to hold something.
    pub(super) fn require_turns(&mut self, range: &SumRange) {
        if let Some(requirement) = self.turns_of(range, None) {
            self.require(requirement);
        }
    }

    /// Notes that the range of the innermost sum, or of the sites around, must not end below its start.
    pub(super) fn require_order(&mut self, range: &SumRange) {
        let Some(requirement) = self.turns_of(range, Some(Vec::new())) else {
            return;
        };
        self.require(requirement.clone());
        let mut known = self.requirements.iter();
        let at = known.position(|known| *known == requirement);
        self.summed.extend(at.map(|at| (at, range.clone())));
    }

    /// What is required of the innermost range, where it is the same on all turns of the sums around.
    fn turns_of(&self, range: &SumRange, empty: Option<Vec<Affine>>) -> Option<Requirement> {
        let varies = |(symbol, _): &(IndexSymbol, i64)| matches!(symbol, IndexSymbol::Loop(_));
        let mut bounds = range.start.terms.iter().chain(&range.end.terms);
        if bounds.any(varies) || has_turns(range) {
            return None;
        }
        let index = Affine::symbol(IndexSymbol::Loop(range.variable));
        // As declared: the loop may count from zero.
        let offset = self.indices.last().map(|index| &index.offset);
        let own = |bound: &Affine| {
            let own = offset.and_then(|offset| bound.plus_scaled(offset, 1));
            own.unwrap_or_else(|| bound.clone())
        };
        Some(Requirement::Turns {
            ranges: self.stands_in(&index),
            start: own(&range.start),
            end: own(&range.end),
            empty,
        })
    }

    /// Completes what is required of sums, once all formulas are known: programs put all sums over a range into one loop.
    pub(super) fn settle_empty_sums(&mut self, formulas: &[ExprId]) {
        if self.summed.is_empty() {
            return;
        }
        let places = places_in_loops(&self.graph, formulas);
        for (at, range) in std::mem::take(&mut self.summed) {
            if let Requirement::Turns { empty, .. } = &mut self.requirements[at] {
                *empty = kept(&places, &range);
            }
        }
    }

    fn require(&mut self, requirement: Requirement) {
        // Loops of models of run-time length carry parts of a sum to the next turn, which models of fixed size do where the
        // range is literal only.
        let is_about_turns = matches!(requirement, Requirement::Turns { .. });
        let is_checked = self.is_of_run_time_length() || !is_about_turns;
        if is_checked && !self.requirements.contains(&requirement) {
            self.requirements.push(requirement);
        }
    }

    /// The loops around that say where an index goes, outermost first.
    fn needed(&self, place: &Affine) -> Vec<SumRange> {
        let mut needed: Vec<SumRange> = Vec::new();
        for index in self.indices.iter().rev() {
            let asks = |affine: &Affine| affine.depends_on(index.variable);
            if asks(place) || needed.iter().any(|r| asks(&r.start) || asks(&r.end)) {
                needed.push(SumRange {
                    variable: index.variable,
                    start: index.start.clone(),
                    end: index.end.clone(),
                });
            }
        }
        needed.reverse();
        needed
    }
}

/// Whether there are lengths for which an index is below zero.
pub(super) fn may_be_below_zero(index: &Affine) -> bool {
    index.constant < 0 || index.terms.iter().any(|(_, factor)| *factor < 0)
}

/// The coordinates, velocities and momenta in the sums of formulas, with the ranges of the sums around that they depend on.
fn places_in_loops(graph: &Graph, formulas: &[ExprId]) -> Vec<(SumRange, Affine)> {
    let mut places = Vec::new();
    for id in graph.reachable(formulas) {
        let Node::Loop { range, body } = graph.node(id) else {
            continue;
        };
        for input in graph.inputs_of(*body) {
            if let Input::Coordinate(place) | Input::Velocity(place) | Input::Momentum(place) =
                input
                && place.depends_on(range.variable)
            {
                places.push((range.clone(), place));
            }
        }
    }
    places
}

/// The places at which a loop that adds to the places i and i + 1 leaves, after its last turn, what was meant for the next
/// one: where the loop has no turns, a zero. `None` if such a place is not the same on all turns of the loops around.
fn kept(places: &[(SumRange, Affine)], range: &SumRange) -> Option<Vec<Affine>> {
    let is_same = |other: &SumRange| other.start == range.start && other.end == range.end;
    let own: Vec<&(SumRange, Affine)> = places.iter().filter(|(own, _)| is_same(own)).collect();
    let beyond = range.end.plus_scaled(&Affine::constant(1), 1)?;
    let ends: Vec<Affine> = own
        .iter()
        .map(|(own, place)| substitute(place, own.variable, &range.end))
        .collect();
    let mut kept = Vec::new();
    for ((own, place), end) in own.into_iter().zip(&ends) {
        let next = substitute(place, own.variable, &beyond);
        if !ends.contains(&next) || kept.contains(end) {
            continue;
        }
        if !end.variables().is_empty() || end.holds_entry() {
            return None;
        }
        kept.push(end.clone());
    }
    Some(kept)
}

/// Whether a range is known to hold something.
fn has_turns(range: &SumRange) -> bool {
    let length = range.end.plus_scaled(&range.start, -1);
    let length = length.and_then(|length| length.as_constant());
    length.is_some_and(|length| length > 0)
}
