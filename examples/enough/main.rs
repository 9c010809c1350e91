//! “Enough and no more”: how large the error of a run is, and which element and step an accuracy needs, in eight
//! scenes.
//!
//! ```sh
//! cargo run --release --example enough             # tables, charts and a page in target/enough
//! cargo run --release --example enough -- folder
//! ```
//!
//! The scenes are those of `speed_accuracy`. The page has five parts:
//!
//! * estimated errors compared with true ones, for elements of all families and many step sizes;
//! * for accuracies from 1e-4 to 1e-11, what `Simulation::accuracy` chooses, the true error, and its time, including
//!   all runs of the search, relative to that of the best element, step and tolerance found by trying all of them;
//! * a chaotic motion, and how long it can be computed;
//! * how much is gained by each property that `structure()` finds;
//! * ladders of models: which of several simplified models is just accurate enough.

mod chaos;
mod estimates;
mod findings;
mod ladders;
mod picks;
#[path = "../speed_accuracy/scenes/mod.rs"]
#[allow(dead_code, reason = "the other example uses all of it")]
mod scenes;
mod truth;

use scenes::lattice::{LATTICE, lattice, lattice_start};
use scenes::oscillators::{
    DOUBLE_PENDULUM, DOUBLE_PENDULUM_START, HENON_HEILES_START, HenonHeiles, PENDULUM,
    PENDULUM_START, VAN_DER_POL, VAN_DER_POL_START, double_pendulum, henon_heiles, pendulum,
    van_der_pol,
};
use scenes::planets::{
    KEPLER_START, Kepler, SOLAR_SYSTEM, kepler, solar_system, solar_system_start,
};
use scenes::stiff::{ELASTIC, ELASTIC_START, elastic_pendulum};
use std::error::Error;
use std::fs;
use std::path::PathBuf;
use tfe::charts::Page;
use tfe::prelude::*;
use truth::Truth;

/// A scene with all of its results.
struct Scene {
    title: &'static str,
    estimates: Vec<estimates::Point>,
    picks: Vec<picks::Pick>,
}

impl Scene {
    fn new<M: Model<N>, const N: usize>(
        title: &'static str,
        model: &M,
        (start, end): (State<N>, f64),
        problem: WorkPrecision<'_, M, State<N>>,
    ) -> Result<Self, Box<dyn Error>> {
        let truth = Truth::of(model, start, end)?;
        let scene = Self {
            title,
            estimates: estimates::measure(model, &truth),
            picks: picks::measure(model, &truth, problem)?,
        };
        println!("{}", estimates::line(&scene));
        scene
            .picks
            .iter()
            .for_each(|pick| println!("{}", pick.line(title)));
        Ok(scene)
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args_os().nth(1);
    let folder = folder.map_or_else(|| PathBuf::from("target/enough"), PathBuf::from);
    fs::create_dir_all(&folder)?;
    let scenes = [
        {
            let start = PENDULUM.state(PENDULUM_START.q, PENDULUM_START.v);
            Scene::new(
                "Pendulum",
                &PENDULUM,
                (start, PENDULUM_START.end),
                pendulum(),
            )?
        },
        {
            let (q, p) = (KEPLER_START.q, KEPLER_START.v);
            let start = (State { q, p }, KEPLER_START.end);
            Scene::new("Kepler, e = 0.6", &Kepler {}, start, kepler())?
        },
        {
            let (q, p) = (HENON_HEILES_START.q, HENON_HEILES_START.v);
            let start = (State { q, p }, HENON_HEILES_START.end);
            Scene::new("Hénon–Heiles", &HenonHeiles {}, start, henon_heiles())?
        },
        {
            let start = DOUBLE_PENDULUM.state(DOUBLE_PENDULUM_START.q, DOUBLE_PENDULUM_START.v);
            let start = (start, DOUBLE_PENDULUM_START.end);
            Scene::new(
                "Double pendulum",
                &DOUBLE_PENDULUM,
                start,
                double_pendulum(),
            )?
        },
        {
            let scene = solar_system_start();
            let start = (SOLAR_SYSTEM.state(scene.q, scene.v), scene.end);
            Scene::new("Outer solar system", &SOLAR_SYSTEM, start, solar_system())?
        },
        {
            let scene = lattice_start();
            let start = (LATTICE.state(scene.q, scene.v), scene.end);
            Scene::new("FPUT lattice, N = 32", &LATTICE, start, lattice())?
        },
        {
            let start = VAN_DER_POL.state(VAN_DER_POL_START.q, VAN_DER_POL_START.v);
            let start = (start, VAN_DER_POL_START.end);
            Scene::new("Van der Pol", &VAN_DER_POL, start, van_der_pol())?
        },
        {
            let start = ELASTIC.state(ELASTIC_START.q, ELASTIC_START.v);
            let start = (start, ELASTIC_START.end);
            Scene::new(
                "Elastic pendulum, k = 10⁶",
                &ELASTIC,
                start,
                elastic_pendulum(),
            )?
        },
    ];
    let estimates = estimates::section(&scenes)?;
    let picks = picks::section(&scenes)?;
    let chaos = chaos::section()?;
    let findings = findings::section()?;
    let path = folder.join("enough.html");
    let page = Page::new("Enough and no more")
        .section(estimates)
        .section(picks)
        .section(chaos)
        .section(findings);
    let page = ladders::sections()?.into_iter().fold(page, Page::section);
    page.save(&path)?;
    println!("\n{}", path.display());
    Ok(())
}
