//! Kernels that run through their sites in a single loop, so that they can report their progress.

use crate::emit::Emitter;
use crate::indices::{index, less, loop_name};
use proc_macro2::TokenStream;
use quote::quote;
use tfe_symbolic::expr::input::{Affine, IndexSymbol, Input};
use tfe_symbolic::program::{Array, Operand, Program, Statement};

/// The only loop of a kernel, and the lowest coordinate that a turn touches, counted from the loop's index.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Strides {
    /// The index of the loop among the statements.
    pub(crate) at: usize,
    /// The coordinate i + lowest.
    pub(crate) lowest: i64,
    /// Whether every entry of L_q is written exactly once, as a value and not as an addition to what is there.
    pub(crate) assigns: bool,
}

/// `None` if coordinates are visited in another order.
pub(crate) fn of(program: &Program, coordinates: &Affine) -> Option<Strides> {
    let is_loop = |statement: &Statement| matches!(statement, Statement::Loop { .. });
    let at = program.statements.iter().position(is_loop)?;
    let (before, rest) = program.statements.split_at(at);
    let (
        Statement::Loop {
            variable,
            start,
            end,
            body,
        },
        after,
    ) = rest.split_first()?
    else {
        return None;
    };
    if body.iter().chain(after).any(is_loop) {
        return None;
    }
    let turn = Affine::symbol(IndexSymbol::Loop(*variable));
    let mut places = touched(body).map(|place| beyond(place, &turn));
    let lowest = places.try_fold(i64::MAX, |lowest, place| Some(lowest.min(place?)))?;
    // Statements after the loop belong to coordinates that its last turns have not completed.
    let is_behind = |place: &Affine| beyond(place, end).is_some_and(|by| by >= lowest);
    if !(lowest < i64::MAX && touched(after).all(is_behind)) {
        return None;
    }
    // One entry in each turn, from the first coordinate on, and the last coordinate after the loop.
    let assigns = match (&stored(before)[..], &stored(body)[..], &stored(after)[..]) {
        ([], [turn_place], [last]) => beyond(turn_place, &turn).is_some_and(|by| {
            beyond(start, &Affine::constant(-by)) == Some(0)
                && beyond(last, end) == Some(by)
                && beyond(coordinates, last) == Some(1)
        }),
        _ => false,
    };
    Some(Strides {
        at,
        lowest,
        assigns,
    })
}

/// The places of L_q that statements write.
fn stored(statements: &[Statement]) -> Vec<&Affine> {
    let mut places = Vec::new();
    for statement in statements {
        if let Statement::Store { output, .. } = statement
            && output.array == Array::ByQ
        {
            places.push(&output.row);
        }
    }
    places
}

/// place − from, where that is a constant.
fn beyond(place: &Affine, from: &Affine) -> Option<i64> {
    (place.terms == from.terms).then(|| place.constant - from.constant)
}

/// The coordinates that statements read or write.
fn touched(statements: &[Statement]) -> impl Iterator<Item = &Affine> {
    statements.iter().flat_map(|statement| {
        let written = match statement {
            Statement::Store { output, .. } => {
                matches!(output.array, Array::ByQ | Array::ByZ | Array::Force)
                    .then_some(&output.row)
            }
            _ => None,
        };
        statement
            .operands()
            .into_iter()
            .filter_map(read)
            .chain(written)
    })
}

fn read(operand: &Operand) -> Option<&Affine> {
    match operand {
        Operand::Input(
            Input::Coordinate(place) | Input::Velocity(place) | Input::Momentum(place),
        ) => Some(place),
        _ => None,
    }
}

impl Emitter<'_> {
    /// The body of a kernel that borrows its slices by `lend`, anew after each stride of the loop, and reports its
    /// progress; a short loop is left to `all_at_once`.
    pub(crate) fn in_strides(
        mut self,
        program: &Program,
        Strides { at, lowest, .. }: Strides,
        lend: &TokenStream,
        all_at_once: &TokenStream,
    ) -> Option<TokenStream> {
        self.survey(&program.statements);
        let (before, rest) = program.statements.split_at(at);
        let (turns, after) = rest.split_first()?;
        let Statement::Loop {
            variable,
            start,
            end,
            body,
        } = turns
        else {
            return None;
        };
        let before = self.statements(before);
        let (variable, start, end) = (loop_name(*variable), index(start), index(end));
        let body = self.statements(body);
        let after = self.statements(after);
        let by = index(&Affine::constant(lowest.saturating_abs()));
        let below = match lowest {
            ..0 => less(&quote!(__to), &by),
            0 => quote!(__to),
            1.. => quote!(__to + #by),
        };
        let parameters = self.parameters();
        Some(quote! {
            let __end = #end;
            if __end <= __tfe::STRIDE {
                // Slices that are arguments are known to lie apart.
                let (q, z, first) = __sweep.slices();
                return #all_at_once;
            }
            #parameters
            #lend
            #before
            let mut __from = #start;
            while __from < __end {
                let __to = ::core::cmp::Ord::min(__tfe::STRIDE.saturating_add(__from), __end);
                #lend
                for #variable in __from..__to { #body }
                // What is left at the end belongs to whoever called.
                if __to < __end {
                    __sweep.passed(#below);
                }
                __from = __to;
            }
            #lend
            #after
        })
    }
}
