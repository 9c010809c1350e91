//! Mechanisms: rods, wires, joints, blades and wheels, each declared by its Lagrangian and its constraints.
//!
//! ```sh
//! cargo run --release --example mechanisms             # pictures and a page in target/mechanisms
//! cargo run --release --example mechanisms -- folder
//! ```
//!
//! The table shows for each run how well the constraints hold: the largest |φ| (positions) and |A v + a| (velocities)
//! over all nodes; the largest relative change of the energy; the error of the coordinates at the end and what they are
//! compared with; and the time of the run. Each module holds the scenes of one kind, with their models, runs,
//! comparisons and pictures.

mod bodies;
mod car_axis;
mod chain;
mod linkages;
mod nonholonomic;
mod pendulums;
mod rolling;
mod runs;
mod stroboscope;

use runs::{HEADER, Scene};
use std::error::Error;
use std::fs;
use std::path::PathBuf;
use std::time::Instant;
use tfe::charts::{Page, Section};

type Outcome = Result<Scene, Box<dyn Error>>;
type Run = fn() -> Outcome;

const SCENES: [(&str, Run); 12] = [
    ("pendulum", pendulums::pendulum),
    ("bead", pendulums::bead),
    ("chain", chain::scene),
    ("top", bodies::top),
    ("disk", rolling::disk),
    ("coin", rolling::coin),
    ("knife_edge", nonholonomic::knife_edge),
    ("sleigh", nonholonomic::sleigh),
    ("slider_crank", linkages::slider_crank),
    ("parallelogram", linkages::parallelogram),
    ("spatial_four_bar", linkages::spatial_four_bar),
    ("car_axis", car_axis::scene),
];

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args_os().nth(1);
    let folder = folder.map_or_else(|| PathBuf::from("target/mechanisms"), PathBuf::from);
    fs::create_dir_all(&folder)?;
    let clock = Instant::now();
    let mut rows = Vec::new();
    let mut sections = Vec::new();
    println!("{}", runs::line(HEADER));
    for (name, scene) in SCENES {
        let scene = scene().map_err(|error| format!("{name}: {error}"))?;
        for row in scene.rows {
            println!("{}", runs::line(row.each_ref().map(String::as_str)));
            rows.push(row);
        }
        for (picture, svg) in scene.pictures {
            fs::write(folder.join(format!("{picture}.svg")), svg)?;
        }
        sections.push(scene.section);
    }
    let summary = Section::new("All runs")
        .paragraph(
            "The largest violation of the constraints at the nodes, for positions (φ) and for velocities (A v + a); the largest change \
             of the energy, relative to that at the start; the error of the coordinates at the end, and what they are compared with; the time of \
             the run, on one processor.",
        )
        .table(HEADER, rows);
    let page = Page::new("Mechanisms with finite elements in time").section(summary);
    let path = folder.join("mechanisms.html");
    sections.into_iter().fold(page, Page::section).save(&path)?;
    let seconds = clock.elapsed().as_secs_f64();
    println!("\n{seconds:.1} s   {}", path.display());
    Ok(())
}
