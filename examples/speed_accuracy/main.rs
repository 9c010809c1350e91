//! Speed and accuracy: which element reaches an error in the least time, in eight scenes.
//!
//! ```sh
//! cargo run --release --example speed_accuracy             # pictures, tables and a page in target/speed_accuracy
//! cargo run --release --example speed_accuracy -- folder
//! ```
//!
//! Every family with 2 to 6 and 8 nodes runs each scene with several steps; errors are those at the end, against values that are known to
//! more digits where there are any, else against a finer run that is checked against another. Each module holds the scenes of one kind.

mod lattice;
mod oscillators;
mod planets;
mod runs;
mod stiff;

use runs::{HEADER, Scene};
use std::error::Error;
use std::fs;
use std::path::PathBuf;
use std::time::Instant;
use tfe::charts::{Page, Section};

type Outcome = Result<Scene, Box<dyn Error>>;
type Run = fn() -> Outcome;

/// One after the other, because they measure time.
const SCENES: [(&str, Run); 8] = [
    ("pendulum", oscillators::pendulum),
    ("kepler", planets::kepler),
    ("henon_heiles", oscillators::henon_heiles),
    ("double_pendulum", oscillators::double_pendulum),
    ("solar_system", planets::solar_system),
    ("lattice", lattice::scene),
    ("van_der_pol", oscillators::van_der_pol),
    ("elastic_pendulum", stiff::scene),
];

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args_os().nth(1);
    let folder = folder.map_or_else(|| PathBuf::from("target/speed_accuracy"), PathBuf::from);
    fs::create_dir_all(&folder)?;
    let clock = Instant::now();
    let (mut rows, mut sections) = (Vec::new(), Vec::new());
    println!("{}", runs::line(HEADER));
    for (name, scene) in SCENES {
        let scene = scene().map_err(|error| format!("{name}: {error}"))?;
        for row in scene.rows() {
            println!("{}", runs::line(row.each_ref().map(String::as_str)));
            rows.push(row);
        }
        sections.extend(scene.save(&folder, name)?);
    }
    let summary = Section::new("The fastest elements")
        .paragraph(
            "The least time in which any element with any of the steps reaches an error at the end of the run, relative to the \
             largest state, the larger one of coordinates and momenta; the time is of the steps alone, on one processor. “—” where \
             none does, or where the reference is not known that well.",
        )
        .table(HEADER, rows);
    let page = Page::new("Speed and accuracy of finite elements in time").section(summary);
    let path = folder.join("speed_accuracy.html");
    sections.into_iter().fold(page, Page::section).save(&path)?;
    let seconds = clock.elapsed().as_secs_f64();
    println!("\n{seconds:.1} s   {}", path.display());
    Ok(())
}
