//! Instructions per call: this program runs itself under valgrind with two numbers of repetitions, and takes the
//! difference.

use crate::case::{Case, Kernel, Writer};
use crate::error::Error;
use std::process::{Command, Stdio};

/// The instructions per call of both kernels.
#[derive(Clone, Copy, Debug)]
pub struct Instructions {
    /// Of the generated kernel.
    pub generated: u64,
    /// Of the hand-written kernel.
    pub hand: u64,
}

/// Whether valgrind is installed.
pub fn available() -> bool {
    Command::new("valgrind")
        .arg("--version")
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success())
}

/// The instructions of both kernels, without those of the loop and of the call, which are measured with an empty
/// function.
pub fn instructions(case: &dyn Case, kernel: Kernel) -> Result<Instructions, Error> {
    let nothing = a_call(case, kernel, Writer::Nothing)?;
    let of = |writer| Ok(a_call(case, kernel, writer)?.saturating_sub(nothing));
    Ok(Instructions {
        generated: of(Writer::Generated)?,
        hand: of(Writer::Hand)?,
    })
}

fn a_call(case: &dyn Case, kernel: Kernel, writer: Writer) -> Result<u64, Error> {
    // A few calls first, so that the loader has found all functions, and then a round number of calls more.
    const FEW: u32 = 16;
    const MORE: u32 = 1000;
    let few = total(case, kernel, writer, FEW)?;
    let many = total(case, kernel, writer, FEW + MORE)?;
    Ok(many.saturating_sub(few).div_ceil(u64::from(MORE)))
}

/// The instructions of the whole program.
fn total(case: &dyn Case, kernel: Kernel, writer: Writer, times: u32) -> Result<u64, Error> {
    let program = std::env::current_exe().map_err(Error::Count)?;
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
        .arg(program)
        .args(["--count", case.name()])
        .args([kernel.to_string(), writer.to_string(), times.to_string()])
        .output()
        .map_err(Error::Count)?;
    let text = String::from_utf8_lossy(&output.stderr);
    let collected = |line: &str| line.split_once("Collected :")?.1.trim().parse().ok();
    match text.lines().find_map(collected) {
        Some(total) if output.status.success() => Ok(total),
        _ => Err(Error::NoTotal(text.into_owned())),
    }
}
