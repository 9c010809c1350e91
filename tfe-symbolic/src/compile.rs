//! The pipeline from text to a declared model.

use crate::check::{self, Arguments};
use crate::diagnostic::{Bag, Diagnostic, Span};
use crate::lower::lower;
use crate::model::declared::Declared;
use crate::syntax::ast::{ExprKind, Item, Spanned};
use crate::syntax::context::{Context, FieldKind};
use crate::syntax::parse::{first_word, missing_commas, parse_item, split_arguments};
use crate::vocabulary::Argument;

/// Reads a whole attribute: splits, parses, checks, lowers.
///
/// `arguments` is the text between the parentheses of `#[dynamics(…)]`; spans are byte ranges in it.
///
/// # Errors
/// All mistakes found, in the order of the text.
pub fn declare(arguments: &str, context: &Context) -> Result<Declared, Vec<Diagnostic>> {
    let mut bag = Bag::new();
    let arguments = parse(arguments, &mut bag);
    let context = understood(context, &arguments.items);
    let model = check::model(arguments, &context, &mut bag);
    let declared = lower(&model, &context, &mut bag);
    match bag.finish(declared)? {
        Some(declared) => Ok(declared),
        // If lowering has no result, the reason is in the bag.
        None => Err(Vec::new()),
    }
}

/// Lists of indices are for models of run-time length; elsewhere they are fields that formulas cannot use.
fn understood(context: &Context, items: &[Spanned<Item>]) -> Context {
    let is_length = |name: &String| {
        let kind = context.field(name).map(|field| &field.kind);
        kind == Some(&FieldKind::Length)
    };
    let of_run_time = items.iter().any(|item| match &item.node {
        Item::Coordinates(arrays) => arrays.iter().any(|array| {
            let length = array.length.as_ref().map(|length| &length.node);
            matches!(length, Some(ExprKind::Name(name)) if is_length(name))
        }),
        _ => false,
    });
    let mut context = context.clone();
    if !of_run_time {
        for field in &mut context.fields {
            if field.kind == FieldKind::Indices {
                field.kind = FieldKind::Other("Vec<usize>".to_owned());
            }
        }
    }
    context
}

fn parse(text: &str, bag: &mut Bag) -> Arguments {
    let whole = Span::new(0, text.trim_end().len());
    let mut arguments = Arguments {
        whole,
        ..Arguments::default()
    };
    missing_commas(text, bag);
    for range in split_arguments(text) {
        let argument = &text[range.clone()];
        match parse_item(argument, range.start, bag) {
            Some(item) => arguments.items.push(item),
            None => {
                arguments.incomplete = true;
                match broken_let(argument, range.start) {
                    Some(item) => arguments.items.push(item),
                    None => {
                        let argument = Argument::of_word(first_word(argument));
                        arguments.names_missing |= argument.is_none_or(Argument::declares_names);
                    }
                }
            }
        }
    }
    arguments
}

/// A `let` that could not be read still declares its name.
fn broken_let(argument: &str, offset: usize) -> Option<Spanned<Item>> {
    let rest = argument.trim_start().strip_prefix("let")?;
    let name = first_word(rest);
    if name.is_empty() || !rest.starts_with(char::is_whitespace) {
        return None;
    }
    let start = offset + argument.len() - rest.trim_start().len();
    let span = Span::new(start, start + name.len());
    let name = Spanned::new(name.to_owned(), span);
    let value = Spanned::new(ExprKind::Error, span);
    Some(Spanned::new(Item::Let { name, value }, span))
}
