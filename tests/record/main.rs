//! The record of results: about three hundred computations with all of their numbers, to the last bit.
//!
//! `cargo test --test record` compares them with `tests/reference/record.txt`, up to a relative difference that
//! rounding errors explain: other processors and mathematical libraries may have different last digits. When the engine
//! is changed, every bit matters:
//!
//! ```sh
//! RECORD=bits cargo test --test record     # fails if one bit or one count differs
//! RECORD=write cargo test --test record    # writes the file anew; its change belongs to the commit that causes it, which says why
//! ```

mod cases;

use cases::Outcome;
use std::collections::BTreeMap;
use std::fmt::Write as _;

const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../reference/record.txt");

/// The effect of rounding errors in twenty steps, relative to the largest number of a case.
const ROUNDINGS: f64 = 1e-11;

/// A line of the file: the name, the bits of the numbers in hexadecimal, the counts.
fn line(name: &str, outcome: &Outcome) -> String {
    let mut text = format!("{name} |");
    for number in &outcome.numbers {
        let _ = write!(text, " {:016x}", number.to_bits());
    }
    text.push_str(" |");
    for count in &outcome.counts {
        let _ = write!(text, " {count}");
    }
    text
}

fn read(text: &str) -> BTreeMap<String, Outcome> {
    let mut recorded = BTreeMap::new();
    for line in text.lines() {
        let parts: Vec<&str> = line.split(" |").collect();
        let [name, numbers, counts] = parts[..] else {
            panic!("not a line of a record: {line}");
        };
        let bits = |word| f64::from_bits(u64::from_str_radix(word, 16).expect("bits of a number"));
        let count = |word: &str| word.parse().expect("a count");
        let outcome = Outcome {
            numbers: numbers.split_whitespace().map(bits).collect(),
            counts: counts.split_whitespace().map(count).collect(),
        };
        recorded.insert(name.to_owned(), outcome);
    }
    recorded
}

/// The largest difference relative to the largest number; infinite if only one of the two is a number.
fn difference(new: &[f64], old: &[f64]) -> f64 {
    if new.len() != old.len() {
        return f64::INFINITY;
    }
    let scale = old
        .iter()
        .filter(|x| x.is_finite())
        .fold(1e-300, |largest: f64, x| largest.max(x.abs()));
    let mut worst = 0.0;
    for (new, old) in new.iter().zip(old) {
        let same = new.to_bits() == old.to_bits() || (new.is_nan() && old.is_nan());
        let difference = if same { 0.0 } else { (new - old).abs() / scale };
        if !(difference <= worst) {
            worst = if difference.is_nan() {
                f64::INFINITY
            } else {
                difference
            };
        }
    }
    worst
}

#[test]
fn results_are_those_on_record() {
    let wanted = std::env::var("RECORD").unwrap_or_default();
    let outcomes: Vec<(String, Outcome)> = cases::all()
        .into_iter()
        .map(|case| (case.name, (case.run)()))
        .collect();
    for (name, outcome) in &outcomes {
        let others = outcomes.iter().filter(|(other, _)| other == name).count();
        assert_eq!(others, 1, "two cases are called `{name}`");
        assert!(!outcome.numbers.is_empty(), "`{name}` gives nothing");
    }
    let text = std::fs::read_to_string(FILE).unwrap_or_default();
    let mut recorded = read(&text);
    if wanted == "write" {
        // Cases that do not exist in this build are kept.
        for (name, outcome) in outcomes {
            recorded.insert(name, outcome);
        }
        let lines = recorded
            .iter()
            .map(|(name, outcome)| line(name, outcome) + "\n");
        std::fs::write(FILE, lines.collect::<String>()).expect("the record is written");
        return;
    }
    let (mut equal, mut failures) = (0, String::new());
    for (name, outcome) in &outcomes {
        let Some(old) = recorded.get(name) else {
            let _ = writeln!(failures, "{name}: not on record");
            continue;
        };
        let difference = difference(&outcome.numbers, &old.numbers);
        let same_counts = outcome.counts == old.counts;
        equal += u32::from(difference == 0.0 && same_counts);
        let is_good = if wanted == "bits" {
            difference == 0.0 && same_counts
        } else {
            difference <= ROUNDINGS
        };
        if !is_good {
            let _ = write!(failures, "{name}: off by {difference:.1e}");
            if !same_counts {
                let _ = write!(
                    failures,
                    ", counts {:?}, on record {:?}",
                    outcome.counts, old.counts
                );
            }
            failures.push('\n');
        }
    }
    println!(
        "{equal} of {} cases are those on record to the bit",
        outcomes.len()
    );
    assert!(failures.is_empty(), "{failures}");
}
