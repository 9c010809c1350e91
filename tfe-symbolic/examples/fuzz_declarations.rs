//! Random declarations through the whole engine: none may panic, none may take longer than a second.
//!
//! ```text
//! cargo run --release -p tfe-symbolic --example fuzz_declarations -- COUNT [FIRST]
//! ```
//!
//! With the path of a file of cases, written as in `tests/corpus`, in the place of `COUNT`, these are tried instead.
//!
//! With `CARGO_PROFILE_RELEASE_OVERFLOW_CHECKS=true` and `CARGO_PROFILE_RELEASE_DEBUG_ASSERTIONS=true` in the environment the engine is
//! checked as it runs in a user's development profile.
//!
//! The declarations depend on their numbers and on the corpus only: `FIRST` continues a run. What exhausts the stack, or never ends, is
//! the last number named.

#[path = "../tests/declarations/mod.rs"]
mod declarations;

use std::collections::BTreeMap;
use std::io::Write as _;
use std::path::Path;
use std::sync::LazyLock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use declarations::caught::caught;
use declarations::pipeline::{Outcome, run};
use declarations::reduce::reduced;
use declarations::{Declaration, corpus};

/// The seed of all runs.
const SEED: u64 = 20_260;
/// Slower declarations are failures.
const LIMIT: Duration = Duration::from_secs(1);
/// What takes longer than this is named while it runs.
const WATCH: Duration = Duration::from_secs(10);
/// How many of the slowest are shown.
const SHOWN: usize = 12;
/// Lines of progress come after so many declarations.
const PROGRESS: u64 = 10_000;

/// The number of the declaration at work.
static CURRENT: AtomicU64 = AtomicU64::new(u64::MAX);

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some(what) = arguments.first() else {
        eprintln!("how many declarations? fuzz_declarations COUNT [FIRST]");
        std::process::exit(2);
    };
    let number = |text: &String| text.replace('_', "").parse::<u64>();
    std::thread::spawn(watch);
    let mut report = Report::default();
    let Ok(count) = number(what) else {
        let cases = corpus::read(Path::new(what));
        for (number, case) in (0..).zip(&cases) {
            report.take(number, case);
        }
        report.finish(report.total.iter().sum());
        return;
    };
    let first = arguments.get(1).and_then(|text| number(text).ok());
    let first = first.unwrap_or(0);
    let corpus = corpus::all();
    println!("{} declarations to mutate", corpus.len());
    for number in first..first + count {
        if count == 1 {
            println!("{}", Declaration::random(SEED, number, &corpus));
        }
        CURRENT.store(number, Ordering::Relaxed);
        report.take(number, &Declaration::random(SEED, number, &corpus));
        if (number + 1).is_multiple_of(PROGRESS) {
            report.progress(number + 1 - first);
        }
    }
    CURRENT.store(u64::MAX, Ordering::Relaxed);
    report.finish(count);
}

/// The time that this thread has been running, without that in which others had the processor; where that is not known, the time of the clock.
fn processor_time() -> Duration {
    static START: LazyLock<Instant> = LazyLock::new(Instant::now);
    let known = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let known = known.and_then(|text| text.split_whitespace().next()?.parse().ok());
    known.map_or_else(|| START.elapsed(), Duration::from_nanos)
}

/// Names the declarations that take long.
fn watch() {
    let mut before = u64::MAX;
    loop {
        std::thread::sleep(WATCH);
        let now = CURRENT.load(Ordering::Relaxed);
        if now == before && now != u64::MAX {
            println!("number {now} takes longer than {WATCH:?}");
        }
        before = now;
    }
}

#[derive(Default)]
struct Report {
    accepted: [u64; 2],
    total: [u64; 2],
    /// The first declaration, reduced, and the number of all, by the place of the panic.
    panics: BTreeMap<String, u64>,
    slow: u64,
    slowest: Vec<(Duration, u64, Declaration)>,
}

impl Report {
    fn take(&mut self, number: u64, declaration: &Declaration) {
        let half = usize::from(number % 2 == 1);
        let start = processor_time();
        let result = caught(|| run(declaration));
        let time = processor_time().saturating_sub(start);
        self.total[half] += 1;
        match result {
            Ok(Outcome::Accepted) => self.accepted[half] += 1,
            Ok(Outcome::Rejected) => {}
            Err(panic) => {
                let times = self.panics.entry(panic.place.clone()).or_default();
                *times += 1;
                if *times == 1 {
                    let smallest = reduced(declaration, |candidate| {
                        let found = caught(|| run(candidate));
                        found.is_err_and(|found| found.place == panic.place)
                    });
                    println!("number {number}: {}\n{smallest}\n", panic.message);
                }
            }
        }
        if time > LIMIT {
            self.slow += 1;
            println!("number {number}: {time:.2?} slow\n{declaration}\n");
        }
        let is_among = self.slowest.last().is_none_or(|(least, ..)| time > *least);
        if is_among || self.slowest.len() < SHOWN {
            self.slowest.push((time, number, declaration.clone()));
            self.slowest
                .sort_by_key(|(time, ..)| std::cmp::Reverse(*time));
            self.slowest.truncate(SHOWN);
        }
    }

    fn progress(&self, done: u64) {
        let share =
            |half: usize| 100.0 * self.accepted[half] as f64 / self.total[half].max(1) as f64;
        let slowest = self
            .slowest
            .first()
            .map_or(Duration::ZERO, |(time, ..)| *time);
        let panics: u64 = self.panics.values().sum();
        println!(
            "{done} declarations, accepted {:.1} % of mutations and {:.1} % of the others, {panics} panics, {} slow, slowest {slowest:.3?}",
            share(0),
            share(1),
            self.slow
        );
        let _ = std::io::stdout().flush();
    }

    fn finish(&self, count: u64) {
        println!("\nthe slowest:");
        for (time, number, declaration) in &self.slowest {
            println!("number {number}: {time:.3?}\n{declaration}\n");
        }
        self.progress(count);
        for (place, times) in &self.panics {
            println!("{times} × panic at {place}");
        }
        if !self.panics.is_empty() || self.slow > 0 {
            std::process::exit(1);
        }
    }
}
