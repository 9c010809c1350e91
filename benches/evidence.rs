//! The cost of the checks by which a run detects its own errors: instructions per step with them, and without
//! (`Solve::Trusting`).
//!
//! Needs valgrind, under which this program runs itself: `cargo bench --bench evidence`.

#[allow(dead_code, reason = "the example uses all of it")]
#[path = "../examples/speed_accuracy/scenes/mod.rs"]
mod scenes;

use scenes::Start;
use scenes::lattice::{LATTICE, lattice_start};
use scenes::oscillators::{
    DOUBLE_PENDULUM, DOUBLE_PENDULUM_START, HENON_HEILES_START, HenonHeiles, PENDULUM,
    PENDULUM_START, VAN_DER_POL, VAN_DER_POL_START,
};
use scenes::planets::{KEPLER_START, Kepler, SOLAR_SYSTEM, solar_system_start};
use scenes::stiff::{ELASTIC, ELASTIC_START};
use std::error::Error;
use std::process::Command;
use tfe::prelude::*;
use tfe::runtime::length::{Declared, FixedLength};
use tfe::{Model, Solve};

/// The scenes and their steps, with which an element of four nodes has an error of about 1e-6.
const SCENES: [(&str, f64); 8] = [
    ("pendulum", 0.2),
    ("Hénon–Heiles", 0.2),
    ("double pendulum", 0.04),
    ("van der Pol", 0.1),
    ("Kepler", 0.03),
    ("solar system", 80.0),
    ("lattice", 0.2),
    ("elastic pendulum", 0.0005),
];

/// Runs a number of steps of a scene.
fn run(scene: &str, h: f64, solve: Solve, steps: u32) -> Result<(), Box<dyn Error>> {
    fn go<M, const N: usize>(
        model: &M,
        start: State<N>,
        (h, solve, steps): (f64, Solve, u32),
    ) -> Result<(), Box<dyn Error>>
    where
        M: Model<N> + Declared<N, Length = FixedLength>,
    {
        let span = 0.0..h * f64::from(steps);
        let simulation: Simulation<'_, M, N> = Simulation::new(model);
        let simulation = simulation.step(h).solver(solve);
        let motion = simulation
            .run(start, span)
            .map_err(|error| error.to_string())?;
        if motion.warnings().is_empty() {
            Ok(())
        } else {
            Err(format!("{:?}", motion.warnings()).into())
        }
    }
    let how = (h, solve, steps);
    match scene {
        "pendulum" => {
            let Start { q, v, .. } = PENDULUM_START;
            go(&PENDULUM, PENDULUM.state(q, v), how)
        }
        "Hénon–Heiles" => {
            let Start { q, v: p, .. } = HENON_HEILES_START;
            go(&HenonHeiles {}, State { q, p }, how)
        }
        "double pendulum" => {
            let Start { q, v, .. } = DOUBLE_PENDULUM_START;
            go(&DOUBLE_PENDULUM, DOUBLE_PENDULUM.state(q, v), how)
        }
        "van der Pol" => {
            let Start { q, v, .. } = VAN_DER_POL_START;
            go(&VAN_DER_POL, VAN_DER_POL.state(q, v), how)
        }
        "Kepler" => {
            let Start { q, v: p, .. } = KEPLER_START;
            go(&Kepler {}, State { q, p }, how)
        }
        "solar system" => {
            let Start { q, v, .. } = solar_system_start();
            go(&SOLAR_SYSTEM, SOLAR_SYSTEM.state(q, v), how)
        }
        "lattice" => {
            let Start { q, v, .. } = lattice_start();
            go(&LATTICE, LATTICE.state(q, v), how)
        }
        "elastic pendulum" => {
            let Start { q, v, .. } = ELASTIC_START;
            go(&ELASTIC, ELASTIC.state(q, v), how)
        }
        _ => Err(format!("no scene `{scene}`").into()),
    }
}

/// Instructions per step.
fn count(scene: &str, solve: &str) -> Result<f64, Box<dyn Error>> {
    const FEW: u32 = 50;
    const MORE: u32 = 2000;
    let total = |steps: u32| -> Result<f64, Box<dyn Error>> {
        let output = Command::new("valgrind")
            .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
            .arg(std::env::current_exe()?)
            .args(["--count", scene, solve, &steps.to_string()])
            .output()?;
        let text = String::from_utf8_lossy(&output.stderr);
        let collected = |line: &str| line.split_once("Collected :")?.1.trim().parse().ok();
        match text.lines().find_map(collected) {
            Some(total) if output.status.success() => Ok(total),
            _ if text.contains("unhandled instruction") => {
                Err("valgrind lacks an instruction".into())
            }
            _ => Err(text.into_owned().into()),
        }
    };
    Ok((total(FEW + MORE)? - total(FEW)?) / f64::from(MORE))
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [word, scene, solve, steps] = &arguments[..]
        && word == "--count"
    {
        let solve = if solve == "trusting" {
            Solve::Trusting
        } else {
            Solve::Auto
        };
        let step = SCENES.iter().find(|(name, _)| name == scene);
        return run(
            scene,
            step.map_or(f64::NAN, |(_, h)| *h),
            solve,
            steps.parse()?,
        );
    }
    println!("Instructions per step of `Mixed::<4>`, all nodes recorded.");
    println!(
        "{:18} {:>8} {:>10} {:>10} {:>7}",
        "scene", "step", "trusting", "evidence", "more"
    );
    for (scene, h) in SCENES {
        match (count(scene, "trusting"), count(scene, "auto")) {
            (Ok(without), Ok(with)) => {
                let more = 100.0 * (with / without - 1.0);
                println!("{scene:18} {h:8} {without:10.0} {with:10.0} {more:6.2}%");
            }
            (Err(error), _) | (_, Err(error)) => println!("{scene:18} {h:8} {error}"),
        }
    }
    Ok(())
}
