//! A stability atlas: how finite elements in time treat oscillators, tops, chains and periodic orbits. The charts are
//! on one page of HTML that needs no other file.
//!
//! ```sh
//! cargo run --release --example stability_atlas            # target/stability_atlas.html
//! cargo run --release --example stability_atlas -- my.html
//! ```
//!
//! A line is printed for each scene, with the time it took and its main result. Each module is a scene: its model, the
//! computations, its charts and tables. A scene that fails ends the program with its error.

mod chain;
mod duffing;
mod elastic;
mod energy;
mod ince_strutt;
mod linear_cost;
mod maps;
mod oscillator;
mod radius;
mod top;
mod work;

use std::error::Error;
use std::fs;
use std::io::{self, Write};
use std::path::PathBuf;
use std::time::Instant;
use tfe::charts::{Page, Section};

/// A section of the page, and a line with its main result.
struct Scene {
    section: Section,
    key: String,
}

type Outcome = Result<Scene, Box<dyn Error>>;
type Run = fn() -> Outcome;

/// One after the other: scenes that measure times must have the machine for themselves.
const SCENES: [(&str, Run); 10] = [
    ("radius", radius::scene),
    ("energy", energy::scene),
    ("top", top::scene),
    ("chain", chain::scene),
    ("elastic", elastic::scene),
    ("ince_strutt", ince_strutt::scene),
    ("duffing", duffing::scene),
    ("maps", maps::scene),
    ("work", work::scene),
    ("linear_cost", linear_cost::scene),
];

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args_os().nth(1);
    let path = path.map_or_else(
        || PathBuf::from("target/stability_atlas.html"),
        PathBuf::from,
    );
    let start = Instant::now();
    let mut page = Page::new("Stability atlas of finite elements in time");
    for (name, scene) in SCENES {
        print!("{name:<12} ");
        io::stdout().flush()?;
        let clock = Instant::now();
        let Scene { section, key } = scene().map_err(|error| format!("{name}: {error}"))?;
        println!("{:>6.1} s   {key}", clock.elapsed().as_secs_f64());
        page = page.section(section);
    }
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder)?;
    }
    page.save(&path)?;
    let seconds = start.elapsed().as_secs_f64();
    println!("{:<12} {seconds:>6.1} s   {}", "all", path.display());
    Ok(())
}

/// `count` equally spaced numbers from `start` to `end`.
fn grid(start: f64, end: f64, count: usize) -> impl Iterator<Item = f64> + Clone {
    let last = count.saturating_sub(1).max(1) as f64;
    (0..count).map(move |k| start + (end - start) * k as f64 / last)
}
