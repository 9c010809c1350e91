//! The table.

use crate::case::{Case, Kernel, Pair};
use crate::count::Instructions;

/// Whether nanoseconds are measured.
#[derive(Clone, Copy, Debug)]
pub enum Times {
    /// Measured and printed.
    Measured,
    /// Dashes in their columns.
    Omitted,
}

/// The lines above the numbers.
pub fn head() {
    println!(
        "{:<24} {:<6}  {:^31}  {:^19}  {:^20}  {:^20}",
        "",
        "",
        "operations, generated",
        "instructions a call",
        "ns a call, f64",
        "ns a call, Lanes<4>"
    );
    print!("{:<24} {:<6}", "model", "kernel");
    print!(
        "  {:>5} {:>5} {:>5} {:>7} {:>5}",
        "+−", "×", "÷", "sin/cos", "other"
    );
    print!("  {:>6} {:>6} {:>5}", "gen", "hand", "ratio");
    println!(
        "  {:>7} {:>6} {:>5}  {:>7} {:>6} {:>5}",
        "gen", "hand", "ratio", "gen", "hand", "ratio"
    );
}

/// The line of a kernel.
pub fn line(case: &dyn Case, kernel: Kernel, instructions: Option<Instructions>, times: Times) {
    let operations = case.operations(kernel);
    print!("{:<24} {kernel:<6}", case.name());
    print!(
        "  {:>5} {:>5} {:>5} {:>7} {:>5}",
        operations.additions,
        operations.multiplications,
        operations.divisions,
        operations.sines,
        operations.functions
    );
    match instructions {
        Some(Instructions { generated, hand }) => {
            let ratio = generated as f64 / hand as f64;
            print!("  {generated:>6} {hand:>6} {ratio:>5.2}");
        }
        None => print!("  {:>6} {:>6} {:>5}", "—", "—", "—"),
    }
    match times {
        Times::Measured => {
            for Pair { generated, hand } in [case.nanoseconds(kernel), case.lanes(kernel)] {
                print!("  {generated:>7.1} {hand:>6.1} {:>5.2}", generated / hand);
            }
        }
        Times::Omitted => print!("  {0:>7} {0:>6} {0:>5}  {0:>7} {0:>6} {0:>5}", "—"),
    }
    println!();
}
