//! Speed and accuracy compared with other crates: the scenes of the example `speed_accuracy` with our elements and with
//! other integrators, in one program and by one clock. The printed tables and the page say which side reaches an error
//! in less time, and by how much.
//!
//! ```sh
//! cargo run --release -p tfe-peers             # pictures, tables and a page in target/speed_accuracy
//! cargo run --release -p tfe-peers -- folder
//! cargo run --release -p tfe-peers -- folder stiff         # the stiff scenes alone
//! cargo run --release -p tfe-peers -- folder derivatives   # derivatives by parameters alone
//! ```

mod contest;
mod derivatives;
mod ensembles;
mod equations;
mod long;
#[path = "../../examples/speed_accuracy/overview.rs"]
mod overview;
mod run;
#[path = "../../examples/speed_accuracy/runs.rs"]
mod runs;
#[path = "../../examples/speed_accuracy/scenes/mod.rs"]
mod scenes;
mod stiff;
mod system;
mod table;
mod ways;

use contest::{Field, contest};
use runs::Scene;
use scenes::lattice::{LATTICE, lattice, lattice_start};
use scenes::oscillators as one;
use scenes::planets::{KEPLER_START, Kepler, SOLAR_SYSTEM};
use scenes::planets::{kepler, solar_system, solar_system_start};
use scenes::stiff::{ELASTIC, ELASTIC_START, elastic_pendulum};
use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;
use tfe::State;
use tfe::charts::{Page, Section};
use tfe::work_precision::WorkPrecisionError;

type Run = fn() -> Result<Scene, WorkPrecisionError>;

/// The scenes, one after the other because times are measured, with the ratio of times, ours to theirs, that we aim at.
const SCENES: [(&str, f64, Run); 8] = [
    ("pendulum", 0.5, || {
        let state = |q, v| one::PENDULUM.state(q, v);
        let problem = contest::<_, _, 1, 2>(
            one::pendulum(),
            &one::PENDULUM,
            &one::PENDULUM_START,
            Field::All,
            state,
        );
        Scene::measure("Pendulum", problem)
    }),
    ("kepler", 0.5, || {
        let state = |q, p| State { q, p };
        let problem = contest::<_, _, 2, 4>(kepler(), &Kepler {}, &KEPLER_START, Field::All, state);
        Scene::measure("Kepler, e = 0.6", problem)
    }),
    ("henon_heiles", 0.5, || {
        let state = |q, p| State { q, p };
        let problem = contest::<_, _, 2, 4>(
            one::henon_heiles(),
            &one::HenonHeiles {},
            &one::HENON_HEILES_START,
            Field::All,
            state,
        );
        Scene::measure("Hénon–Heiles", problem)
    }),
    ("double_pendulum", 0.5, || {
        let state = |q, v| one::DOUBLE_PENDULUM.state(q, v);
        let problem = contest::<_, _, 2, 4>(
            one::double_pendulum(),
            &one::DOUBLE_PENDULUM,
            &one::DOUBLE_PENDULUM_START,
            Field::All,
            state,
        );
        Scene::measure("Double pendulum", problem)
    }),
    ("solar_system", 0.2, || {
        let state = |q, v| SOLAR_SYSTEM.state(q, v);
        let start = solar_system_start();
        let problem =
            contest::<_, _, 18, 36>(solar_system(), &SOLAR_SYSTEM, &start, Field::All, state);
        Scene::measure("Outer solar system", problem)
    }),
    ("lattice", 0.5, || {
        let state = |q, v| LATTICE.state(q, v);
        let problem =
            contest::<_, _, 32, 64>(lattice(), &LATTICE, &lattice_start(), Field::All, state);
        Scene::measure("FPUT lattice, N = 32", problem)
    }),
    ("van_der_pol", 0.5, || {
        let state = |q, v| one::VAN_DER_POL.state(q, v);
        let problem = contest::<_, _, 1, 2>(
            one::van_der_pol(),
            &one::VAN_DER_POL,
            &one::VAN_DER_POL_START,
            Field::All,
            state,
        );
        Scene::measure("Van der Pol", problem)
    }),
    ("elastic_pendulum", 0.5, || {
        let state = |q, v| ELASTIC.state(q, v);
        let problem = contest::<_, _, 2, 4>(
            elastic_pendulum(),
            &ELASTIC,
            &ELASTIC_START,
            Field::All,
            state,
        );
        Scene::measure("Elastic pendulum, k = 10⁶", problem)
    }),
];

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args_os().nth(1);
    let folder = folder.map_or_else(|| PathBuf::from("target/speed_accuracy"), PathBuf::from);
    fs::create_dir_all(&folder)?;
    match std::env::args_os().nth(2) {
        Some(part) if part == "stiff" => return stiff_section(&folder).map(drop),
        Some(part) if part == "derivatives" => return derivatives_section(&folder).map(drop),
        _ => {}
    }
    let clock = Instant::now();
    let (mut rows, mut sections, mut scenes) = (Vec::new(), Vec::new(), Vec::new());
    println!("{}", table::line(&table::HEADER));
    for (name, aim, scene) in SCENES {
        let scene = scene().map_err(|error| format!("{name}: {error}"))?;
        for row in table::rows(&scene, aim) {
            println!("{}", table::line(&row));
            rows.push(row);
        }
        sections.extend(scene.save(&folder, name)?);
        scenes.push(scene);
    }
    let stiff = stiff_section(&folder)?;
    println!("\n{}", ways::line(&long::HEADER));
    let lattices = long::table()?;
    for row in &lattices {
        println!("{}", ways::line(row));
    }
    fs::write(folder.join("long.csv"), table::csv(long::HEADER, &lattices))?;
    let lattices = Section::new("A long lattice")
        .paragraph(long::EXPLANATION)
        .table(long::HEADER, lattices);
    println!("\n{}", ensembles::line(&ensembles::HEADER));
    let crowds = ensembles::table()?;
    for row in &crowds {
        println!("{}", ensembles::line(row));
    }
    fs::write(
        folder.join("ensembles.csv"),
        table::csv(ensembles::HEADER, &crowds),
    )?;
    let ensembles = Section::new("Thousands of starts")
        .paragraph(ensembles::explanation())
        .table(ensembles::HEADER, crowds);
    let derivatives = derivatives_section(&folder)?;
    let overview = overview::overview(&scenes);
    fs::write(folder.join("overview.svg"), &overview)?;
    fs::write(folder.join("peers.csv"), table::csv(table::HEADER, &rows))?;
    let summary = Section::new("Our elements compared with other crates")
        .paragraph(table::EXPLANATION)
        .figure(overview, "All scenes")
        .table(table::HEADER, rows);
    let page = Page::new("Speed and accuracy of finite elements in time")
        .section(summary)
        .section(stiff)
        .section(lattices)
        .section(ensembles)
        .section(derivatives);
    let path = folder.join("speed_accuracy.html");
    sections.into_iter().fold(page, Page::section).save(&path)?;
    let seconds = clock.elapsed().as_secs_f64();
    println!("\n{seconds:.1} s   {}", path.display());
    Ok(())
}

fn derivatives_section(folder: &Path) -> Result<Section, Box<dyn Error>> {
    println!("\n{}", ways::line(&derivatives::HEADER));
    let rows = derivatives::table()?;
    for row in &rows {
        println!("{}", ways::line(row));
    }
    fs::write(
        folder.join("derivatives.csv"),
        table::csv(derivatives::HEADER, &rows),
    )?;
    Ok(Section::new("Derivatives by parameters")
        .paragraph(derivatives::EXPLANATION)
        .table(derivatives::HEADER, rows))
}

fn stiff_section(folder: &Path) -> Result<Section, Box<dyn Error>> {
    println!("\nstiff\n{}", table::line(&table::HEADER));
    let stiff = stiff::table()?;
    for row in &stiff {
        println!("{}", table::line(row));
    }
    fs::write(folder.join("stiff.csv"), table::csv(table::HEADER, &stiff))?;
    Ok(Section::new("Stiff scenes")
        .paragraph(stiff::EXPLANATION)
        .table(table::HEADER, stiff))
}
