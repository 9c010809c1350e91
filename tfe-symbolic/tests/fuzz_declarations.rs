//! Random declarations from a fixed seed, and those that once made the engine panic. The example `fuzz_declarations` is the long run.

mod declarations;

use declarations::caught::caught;
use declarations::pipeline::{Outcome, run};
use declarations::reduce::reduced;
use declarations::{Declaration, corpus, regressions};

/// As many as take some seconds without optimisation.
const COUNT: u64 = 2000;
const SEED: u64 = 1;

#[test]
fn random_declarations_are_models_or_have_messages() {
    let corpus = corpus::cases();
    let mut accepted = 0;
    for number in 0..COUNT {
        let declaration = Declaration::random(SEED, number, &corpus);
        match caught(|| run(&declaration)) {
            Ok(Outcome::Accepted) => accepted += 1,
            Ok(Outcome::Rejected) => {}
            Err(panic) => {
                let smallest = reduced(&declaration, |candidate| {
                    let found = caught(|| run(candidate));
                    found.is_err_and(|found| found.place == panic.place)
                });
                panic!("number {number}: {}\n{smallest}", panic.message);
            }
        }
    }
    // Or else the generator would test the messages only.
    assert!(3 * accepted >= COUNT, "{accepted} of {COUNT} accepted");
}

#[test]
fn what_once_made_the_engine_panic_does_not() {
    let mut failures = String::new();
    for (declaration, expected) in regressions::all() {
        match caught(|| run(&declaration)) {
            Ok(outcome) if outcome == expected => {}
            Ok(outcome) => failures += &format!("{outcome:?}:\n{declaration}\n"),
            Err(panic) => failures += &format!("{}:\n{declaration}\n", panic.message),
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

#[test]
fn tokens_of_a_declaration_are_its_text_again() {
    let text = "let a=r#type*1.5e-3^-2,solver(S,Primal::<3>.reduced()),sum(i in 0..n-1,θ_1[i]<=2.)";
    let words = declarations::mutation::tokens(text);
    assert_eq!(words.concat(), text.replace(' ', ""));
    for word in ["r#type", "1.5e-3", "::", "3", "..", "n", "θ_1", "<=", "2."] {
        assert!(words.iter().any(|own| own == word), "{word} in {words:?}");
    }
}

#[test]
fn structs_are_read_as_they_are_written() {
    let text = "<N> m, k: [3], c: [N], w: Vec, n: usize, left: indices, label: String";
    let context = declarations::structs::context(text);
    assert_eq!(declarations::structs::notation(&context), text);
}
