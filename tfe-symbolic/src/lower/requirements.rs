//! Requirements on lengths and indices that are not known here: fields are checked once for each model before it is
//! evaluated, const parameters where the kernels are compiled for their values.

use super::{Index, Lowerer};
use crate::expr::graph::SumRange;
use crate::expr::input::{Affine, IndexSymbol};
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

    /// Notes that the range of the innermost sum has to hold something, where it is the same on all turns of the sums around.
    pub(super) fn require_turns(&mut self, range: &SumRange) {
        let varies = |(symbol, _): &(IndexSymbol, i64)| matches!(symbol, IndexSymbol::Loop(_));
        let mut bounds = range.start.terms.iter().chain(&range.end.terms);
        let length = range.end.plus_scaled(&range.start, -1);
        let known = length.and_then(|length| length.as_constant());
        if bounds.any(varies) || known.is_some_and(|length| length > 0) {
            return;
        }
        let index = Affine::symbol(IndexSymbol::Loop(range.variable));
        // As declared: the loop may count from zero.
        let offset = self.indices.last().map(|index| &index.offset);
        let own = |bound: &Affine| {
            let own = offset.and_then(|offset| bound.plus_scaled(offset, 1));
            own.unwrap_or_else(|| bound.clone())
        };
        let requirement = Requirement::Turns {
            ranges: self.stands_in(&index),
            start: own(&range.start),
            end: own(&range.end),
        };
        self.require(requirement);
    }

    fn require(&mut self, requirement: Requirement) {
        // Sums without terms are zero in models of fixed size; loops of others carry parts of a sum to the next turn.
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

/// Whether a range is known to hold something.
fn has_turns(range: &SumRange) -> bool {
    let length = range.end.plus_scaled(&range.start, -1);
    let length = length.and_then(|length| length.as_constant());
    length.is_some_and(|length| length > 0)
}
