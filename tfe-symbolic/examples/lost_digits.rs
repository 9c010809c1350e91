//! Searches random models for kernels that lose digits against the formula as it is written.
//!
//! ```text
//! cargo run --release -p tfe-symbolic --example lost_digits [models [seed [first]]]
//! ```
//!
//! Prints the worst models in full and a table of counts.

#[path = "../tests/digits/mod.rs"]
mod digits;

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use digits::report::{Outcome, case_outcomes, offenders, random_outcome, table};

/// Offenders that are printed, and entries of each.
const PRINTED: usize = 40;
const ENTRIES: usize = 2;

fn main() {
    let mut arguments = std::env::args().skip(1).map(|word| word.parse::<usize>());
    let mut argument = |default: usize| match arguments.next() {
        Some(Ok(value)) => value,
        _ => default,
    };
    let (models, seed, first) = (argument(10_000), argument(2) as u64, argument(0));
    let start = Instant::now();
    let next = AtomicUsize::new(first);
    let outcomes = Mutex::new(case_outcomes(seed));
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                loop {
                    let number = next.fetch_add(1, Ordering::Relaxed);
                    if number >= first + models {
                        break;
                    }
                    let outcome = random_outcome(seed, number);
                    let Ok(mut outcomes) = outcomes.lock() else {
                        break;
                    };
                    outcomes.push(outcome);
                    if outcomes.len() % 500 == 0 {
                        let bad = outcomes.iter().filter(|one| one.is_bad()).count();
                        let seconds = start.elapsed().as_secs_f64();
                        eprintln!("{} models, {bad} bad, {seconds:.0} s", outcomes.len());
                    }
                }
            });
        }
    });
    let mut outcomes: Vec<Outcome> = outcomes.into_inner().unwrap_or_default();
    outcomes.sort_by_key(|one| one.number);
    println!("{}", offenders(&outcomes, PRINTED, ENTRIES));
    println!(
        "seed {seed}, models {first}..{}, {:.0} s",
        first + models,
        start.elapsed().as_secs_f64()
    );
    print!("{}", table(&outcomes));
}
