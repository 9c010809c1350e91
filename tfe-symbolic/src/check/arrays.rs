//! Arrays of coordinates and momenta: their lengths, and their places in the flat vector.

use crate::diagnostic::{Bag, Kind, nearest};
use crate::expr::input::{Affine, IndexSymbol};
use crate::syntax::ast::{Array, Expr, ExprKind, Name};
use crate::syntax::context::{Context, FieldKind};

/// The largest number of coordinates in literal arrays: beyond it, tables of the engine become too large.
pub const MAX_COORDINATES: usize = 10_000;

/// A coordinate or momentum (array) as declared.
#[derive(Clone, Debug, PartialEq)]
pub struct Slots {
    /// The name.
    pub name: Name,
    /// The flat index of its first element: affine in the lengths of the arrays before it.
    pub first: Affine,
    /// The length of an array.
    pub length: Option<Affine>,
}

impl Slots {
    /// Whether a mistake in the length has been reported.
    pub(crate) fn has_wrong_length(&self) -> bool {
        self.length == Some(unknown_length(&self.name.node))
    }
}

/// Assigns to each array its place in the flat vector.
pub(super) fn slots(arrays: Vec<Array>, context: &Context, bag: &mut Bag) -> Vec<Slots> {
    let mut first = Affine::default();
    let mut slots = Vec::new();
    for Array { name, length } in arrays {
        let length = length.map(|length| array_length(&name, &length, context, bag));
        let size = match &length {
            None => 1,
            Some(length) => length
                .as_constant()
                .and_then(|n| usize::try_from(n).ok())
                .unwrap_or(0),
        };
        let before = usize::try_from(first.constant).unwrap_or(usize::MAX);
        if size > MAX_COORDINATES || before.saturating_add(size) > MAX_COORDINATES {
            bag.push(
                name.span,
                Kind::TooManyCoordinates {
                    limit: MAX_COORDINATES,
                },
            );
            // Small enough for all later steps, and of unknown length, so that no further messages follow.
            slots.push(Slots {
                length: Some(unknown_length(&name.node)),
                name,
                first: first.clone(),
            });
            continue;
        }
        let next = first.plus_scaled(length.as_ref().unwrap_or(&Affine::constant(1)), 1);
        slots.push(Slots {
            name,
            first: first.clone(),
            length,
        });
        first = next.unwrap_or(first);
    }
    slots
}

/// A length that is never compared with anything, for use after a mistake in the true one.
fn unknown_length(name: &str) -> Affine {
    Affine::symbol(IndexSymbol::Field(format!("length of {name}")))
}

fn array_length(name: &Name, length: &Expr, context: &Context, bag: &mut Bag) -> Affine {
    match &length.node {
        ExprKind::Number(text) => match text.replace('_', "").parse::<i64>() {
            Ok(0) => {
                bag.push(
                    length.span,
                    Kind::ZeroLength {
                        name: name.node.clone(),
                        field: false,
                    },
                );
            }
            Ok(size) => return Affine::constant(size),
            Err(_)
                if text
                    .bytes()
                    .all(|byte| byte.is_ascii_digit() || byte == b'_') =>
            {
                bag.push(
                    length.span,
                    Kind::NumberTooLarge {
                        number: text.clone(),
                    },
                );
            }
            Err(_) => bag.push(length.span, Kind::LengthNotSimple),
        },
        ExprKind::Name(symbol) if context.const_parameters.contains(symbol) => {
            return Affine::symbol(IndexSymbol::ConstParameter(symbol.clone()));
        }
        ExprKind::Name(symbol) => match context.field(symbol).map(|field| &field.kind) {
            Some(FieldKind::Length) => {
                return Affine::symbol(IndexSymbol::Field(symbol.clone()));
            }
            Some(_) => bag.push(length.span, Kind::LengthNotSimple),
            None => {
                let fields = context.fields.iter();
                let fields = fields.filter(|field| field.kind == FieldKind::Length);
                let parameters = context.const_parameters.iter().map(String::as_str);
                let lengths = parameters.chain(fields.map(|field| field.name.as_str()));
                let nearest = nearest(symbol, lengths);
                bag.push(
                    length.span,
                    Kind::UnknownLength {
                        name: symbol.clone(),
                        nearest,
                    },
                );
            }
        },
        _ => bag.push(length.span, Kind::LengthNotSimple),
    }
    unknown_length(&name.node)
}

pub(super) fn listed(slots: &[Slots]) -> String {
    let names: Vec<String> = slots
        .iter()
        .map(|slots| match &slots.length {
            Some(length) => format!("{}[{length}]", slots.name),
            None => slots.name.node.clone(),
        })
        .collect();
    names.join(", ")
}
