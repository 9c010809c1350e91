//! Random declarations, and the way through the engine that each of them takes.
//!
//! Half of them are mutations of valid declarations (`corpus`, `mutation`), half are written by the rules of the language (`grammar`, `formula`).
//! A declaration depends on the seed, its number and the corpus only.
//!
//! Used by the tests `fuzz_declarations` of this crate and `fuzz` of `tfe-macros`, and by the example `fuzz_declarations`.

#![allow(dead_code)] // Each of the three uses another part.

pub mod caught;
pub mod corpus;
pub mod formula;
pub mod grammar;
pub mod mutation;
pub mod names;
pub mod pipeline;
pub mod random;
pub mod reduce;
pub mod regressions;
pub mod structs;

use random::Random;
use tfe_symbolic::syntax::context::Context;

/// How many in a thousand declarations by the grammar are changed in one place, too.
const MISTAKEN: usize = 400;

/// A struct and the arguments of its attribute.
#[derive(Clone, Debug, PartialEq)]
pub struct Declaration {
    /// The struct.
    pub context: Context,
    /// What stands between the parentheses of `#[dynamics(…)]`.
    pub arguments: String,
}

impl Declaration {
    /// The declaration of this number: mutations of the corpus have even numbers.
    pub fn random(seed: u64, number: u64, corpus: &[Self]) -> Self {
        let mut random = Random::new(seed, number);
        if number.is_multiple_of(2) {
            mutation::mutated(&mut random, corpus)
        } else {
            let mut declaration = grammar::declaration(&mut random);
            if random.per_mille(MISTAKEN) {
                mutation::change(&mut random, &mut declaration, corpus);
            }
            declaration
        }
    }
}

/// As a case of the corpus.
impl std::fmt::Display for Declaration {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        writeln!(f, "struct: {}", structs::notation(&self.context))?;
        write!(f, "--- declaration\n{}", self.arguments)
    }
}
