//! The number of instructions of each case of the record of results (`tests/record`), counted by callgrind (valgrind):
//! the counts are repeatable, whatever else the machine does.
//!
//! ```sh
//! cargo bench --bench record > before.txt
//! cargo bench --bench record -- --against before.txt     # afterwards: ratios, the worst and the median
//! cargo bench --bench record -- ensemble                 # cases whose names contain a word
//! ```

#[path = "../tests/record/cases/mod.rs"]
mod cases;

use cases::Case;
use std::collections::BTreeMap;
use std::error::Error;
use std::hint::black_box;
use std::process::Command;

/// The function that is counted: callgrind starts and stops counting with it.
#[inline(never)]
fn counted_case(case: &Case) -> usize {
    let outcome = black_box((case.run)());
    outcome.numbers.len() + outcome.counts.len()
}

/// The instructions of one case, from running this program under valgrind.
fn instructions(name: &str) -> Result<u64, Box<dyn Error>> {
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
        .args(["--collect-atstart=no", "--toggle-collect=*counted_case*"])
        .arg(std::env::current_exe()?)
        .args(["--case", name])
        .output()?;
    let text = String::from_utf8_lossy(&output.stderr);
    let collected = |line: &str| line.split_once("Collected :")?.1.trim().parse().ok();
    text.lines()
        .find_map(collected)
        .ok_or_else(|| format!("{name}: no total in what valgrind says: {text}").into())
}

/// The table of an earlier run: a number of instructions and a name in each line.
fn table(path: &str) -> Result<BTreeMap<String, u64>, Box<dyn Error>> {
    let text = std::fs::read_to_string(path)?;
    let entry = |line: &str| {
        let (count, name) = line.trim().split_once(' ')?;
        Some((name.trim().to_owned(), count.parse().ok()?))
    };
    Ok(text.lines().filter_map(entry).collect())
}

fn main() -> Result<(), Box<dyn Error>> {
    // Cargo adds an argument of its own.
    let arguments: Vec<String> = std::env::args()
        .skip(1)
        .filter(|word| word != "--bench")
        .collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let cases = cases::all();
    let (before, wanted) = match words[..] {
        ["--case", name] => {
            if let Some(case) = cases.iter().find(|case| case.name == name) {
                // Ensembles run on this thread, the only one that is counted.
                #[cfg(feature = "parallel")]
                rayon::ThreadPoolBuilder::new()
                    .num_threads(1)
                    .use_current_thread()
                    .build_global()?;
                // A first run, not counted, to allocate memory and load functions.
                black_box((case.run)());
                counted_case(case);
            }
            return Ok(());
        }
        ["--against", path] => (Some(table(path)?), ""),
        ["--against", path, word] => (Some(table(path)?), word),
        [word] => (None, word),
        [] => (None, ""),
        _ => return Err("arguments: [--against FILE] [WORD]".into()),
    };
    let mut ratios = Vec::new();
    for case in cases.iter().filter(|case| case.name.contains(wanted)) {
        let count = instructions(&case.name)?;
        match before.as_ref().and_then(|before| before.get(&case.name)) {
            Some(&old) => {
                let ratio = count as f64 / old as f64;
                println!("{count:12} {old:12} {ratio:7.4}  {}", case.name);
                ratios.push((ratio, &case.name));
            }
            None => println!("{count:12} {}", case.name),
        }
    }
    ratios.sort_by(|a, b| a.0.total_cmp(&b.0));
    if let Some((worst, name)) = ratios.last() {
        let median = ratios[ratios.len() / 2].0;
        println!(
            "{} cases: median {median:.4}, worst {worst:.4} ({name})",
            ratios.len()
        );
    }
    Ok(())
}
