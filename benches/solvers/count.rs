//! Instructions per step: this program runs itself under valgrind with two numbers of steps, and takes the difference.

use crate::{Failure, Writer};
use std::process::{Command, Stdio};

/// Whether valgrind is installed.
pub fn available() -> bool {
    Command::new("valgrind")
        .arg("--version")
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success())
}

/// The instructions per step; `None` if valgrind stops at an instruction that it does not know, as old versions do.
pub fn instructions(scene: &str, nodes: u32, writer: Writer) -> Result<Option<u64>, Failure> {
    const FEW: u32 = 50;
    const MORE: u32 = 500;
    let few = total(scene, nodes, writer, FEW)?;
    let many = total(scene, nodes, writer, FEW + MORE)?;
    let (Some(few), Some(many)) = (few, many) else {
        return Ok(None);
    };
    Ok(Some(many.saturating_sub(few).div_ceil(u64::from(MORE))))
}

/// The instructions of the whole program.
fn total(scene: &str, nodes: u32, writer: Writer, steps: u32) -> Result<Option<u64>, Failure> {
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
        .arg(std::env::current_exe()?)
        .args([
            "--count",
            scene,
            &nodes.to_string(),
            writer.name(),
            &steps.to_string(),
        ])
        .output()?;
    let text = String::from_utf8_lossy(&output.stderr);
    let collected = |line: &str| line.split_once("Collected :")?.1.trim().parse().ok();
    if text.contains("unhandled instruction") {
        return Ok(None);
    }
    match text.lines().find_map(collected) {
        Some(total) if output.status.success() => Ok(Some(total)),
        _ => Err(format!("valgrind counted nothing: {text}").into()),
    }
}
