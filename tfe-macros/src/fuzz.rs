//! Random declarations through the whole expansion: for each of them the macro returns items, and never panics.
//!
//! `FUZZ=100000 cargo test --release -p tfe-macros fuzz -- --nocapture` tries more of them.

#[path = "../../tfe-symbolic/tests/declarations/mod.rs"]
mod declarations;

use crate::expand::expand;
use declarations::caught::caught;
use declarations::reduce::reduced;
use declarations::{Declaration, corpus, regressions, structs};
use proc_macro2::TokenStream;

const SEED: u64 = 2;
/// As many as take some seconds without optimisation.
const COUNT: u64 = 600;

/// What the macro made of a declaration.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Outcome {
    /// A model.
    Expanded,
    /// Messages.
    Refused,
    /// The compiler refuses the tokens or the struct before it calls the macro.
    NotRust,
}

fn outcome(declaration: &Declaration) -> Outcome {
    let item = structs::rust(&declaration.context).parse::<TokenStream>();
    let (Ok(arguments), Ok(item)) = (declaration.arguments.parse(), item) else {
        return Outcome::NotRust;
    };
    if syn::parse2::<syn::ItemStruct>(item.clone()).is_err() {
        return Outcome::NotRust;
    }
    let expansion = expand(arguments, item);
    let is_refused = expansion.to_string().contains("compile_error");
    if let Err(error) = syn::parse2::<syn::File>(expansion) {
        panic!("the expansion is made of no items: {error}");
    }
    match is_refused {
        true => Outcome::Refused,
        false => Outcome::Expanded,
    }
}

#[test]
fn random_declarations_expand_to_items() {
    let count = std::env::var("FUZZ").map_or(COUNT, |text| text.parse().expect("a number"));
    let corpus = corpus::cases();
    let (mut expanded, mut failures) = (0, Vec::new());
    for number in 0..count {
        let declaration = Declaration::random(SEED, number, &corpus);
        match caught(|| outcome(&declaration)) {
            Ok(outcome) => expanded += u64::from(outcome == Outcome::Expanded),
            Err(panic) if failures.contains(&panic.place) => {}
            Err(panic) => {
                let smallest = reduced(&declaration, |candidate| {
                    let found = caught(|| outcome(candidate));
                    found.is_err_and(|found| found.place == panic.place)
                });
                println!("number {number}: {}\n{smallest}\n", panic.message);
                failures.push(panic.place);
            }
        }
        if (number + 1).is_multiple_of(10_000) {
            println!("{} declarations, {expanded} expanded", number + 1);
        }
    }
    assert!(failures.is_empty(), "panics at {failures:?}");
    assert!(3 * expanded >= count, "{expanded} of {count} expanded");
}

#[test]
fn what_once_made_the_macro_panic_does_not() {
    let mut failures = String::new();
    for (declaration, _) in regressions::all() {
        if let Err(panic) = caught(|| outcome(&declaration)) {
            failures += &format!("{}:\n{declaration}\n", panic.message);
        }
    }
    assert!(failures.is_empty(), "{failures}");
}
