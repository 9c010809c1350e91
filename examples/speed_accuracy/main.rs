//! Speed and accuracy: which element reaches a given error in the least time, in eight scenes.
//!
//! ```sh
//! cargo run --release --example speed_accuracy             # pictures, tables and a page in target/speed_accuracy
//! cargo run --release --example speed_accuracy -- folder
//! ```
//!
//! All families with 2 to 5, 7, 9 and 12 nodes run each scene with many step sizes. Errors are those at the end of the
//! run, compared with values that are known to more digits, or where there are none with a finer run, which is checked
//! against another one. The table shows for each scene and error the element, step size and tolerance that reach it in
//! the least time, and the energy error of that run. Each module holds the scenes of one kind.

mod overview;
mod runs;
mod scenes;
mod table;

use runs::{Scene, TARGETS};
use scenes::lattice::lattice;
use scenes::oscillators::{double_pendulum, henon_heiles, pendulum, van_der_pol};
use scenes::planets::{kepler, solar_system};
use scenes::stiff::elastic_pendulum;
use std::error::Error;
use std::fs;
use std::path::PathBuf;
use std::time::Instant;
use table::HEADER;
use tfe::charts::{Page, Section};
use tfe::work_precision::WorkPrecisionError;

type Run = fn() -> Result<Scene, WorkPrecisionError>;

/// One after the other, since they measure times.
const SCENES: [(&str, Run); 8] = [
    ("pendulum", || Scene::measure("Pendulum", pendulum())),
    ("kepler", || Scene::measure("Kepler, e = 0.6", kepler())),
    ("henon_heiles", || {
        Scene::measure("Hénon–Heiles", henon_heiles())
    }),
    ("double_pendulum", || {
        Scene::measure("Double pendulum", double_pendulum())
    }),
    ("solar_system", || {
        Scene::measure("Outer solar system", solar_system())
    }),
    ("lattice", || {
        Scene::measure("FPUT lattice, N = 32", lattice())
    }),
    ("van_der_pol", || {
        Scene::measure("Van der Pol", van_der_pol())
    }),
    ("elastic_pendulum", || {
        Scene::measure("Elastic pendulum, k = 10⁶", elastic_pendulum())
    }),
];

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args_os().nth(1);
    let folder = folder.map_or_else(|| PathBuf::from("target/speed_accuracy"), PathBuf::from);
    fs::create_dir_all(&folder)?;
    let clock = Instant::now();
    let (mut rows, mut sections, mut scenes) = (Vec::new(), Vec::new(), Vec::new());
    println!("{}", table::line(HEADER));
    for (name, scene) in SCENES {
        let scene = scene().map_err(|error| format!("{name}: {error}"))?;
        let [loosest, ..] = TARGETS;
        if scene.measured.fastest(loosest).is_none() {
            return Err(format!("{name}: no element reaches an error of {loosest:e}").into());
        }
        for row in table::rows(&scene) {
            println!("{}", table::line(row.each_ref().map(String::as_str)));
            rows.push(row);
        }
        sections.extend(scene.save(&folder, name)?);
        scenes.push(scene);
    }
    let overview = overview::overview(&scenes);
    fs::write(folder.join("overview.svg"), &overview)?;
    let summary = Section::new("The fastest elements")
        .paragraph(
            "The least time in which any element with any step size and tolerance reaches an error at the end of the run, relative to the \
             largest state, the larger one of coordinates and momenta; the time is that of the steps alone, on one processor. “—” means that \
             none does, or that the reference is not known well enough.",
        )
        .figure(overview, "All scenes")
        .table(HEADER, rows);
    let page = Page::new("Speed and accuracy of finite elements in time").section(summary);
    let path = folder.join("speed_accuracy.html");
    sections.into_iter().fold(page, Page::section).save(&path)?;
    let seconds = clock.elapsed().as_secs_f64();
    println!("\n{seconds:.1} s   {}", path.display());
    Ok(())
}
