//! Emitted solvers and the general stepper, compared with steppers written by hand: instructions, nanoseconds and
//! iterations per step, and errors.
//!
//! `cargo bench --bench solvers` prints the table; `cargo bench --bench solvers -- pendulum kepler` only these scenes;
//! `-- --instructions` no times, for a machine that is busy with other things; `-- starts` only the runs from thousands
//! of initial states: lanes written by hand, an ensemble on one core, and emitted solvers one after the other.
//!
//! All of them take the same steps to the same tolerance, from and to memory, with one call per step. In the table,
//! `e/h` is the ratio of emitted to hand-written, `g/e` that of general to emitted. Errors are those of the coordinates
//! at the end, relative to the largest one, compared with a run of `Mixed::<12>` with half the step size. Instructions
//! are counted if valgrind is installed; the steppers written by hand need a processor with AVX2.

#[cfg(target_arch = "x86_64")]
mod by_hand;
mod count;
mod scenes;
mod starts;

use std::time::Duration;

type Failure = Box<dyn std::error::Error>;

/// Which stepper.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Writer {
    Hand,
    Emitted,
    General,
}

impl Writer {
    const ALL: [Self; 3] = [Self::Hand, Self::Emitted, Self::General];

    fn name(self) -> &'static str {
        match self {
            Self::Hand => "hand",
            Self::Emitted => "emitted",
            Self::General => "general",
        }
    }
}

/// The results of a run.
struct Run {
    /// The coordinates at the end.
    end: Vec<f64>,
    iterations: u64,
    /// The iterations of all steps.
    time: Duration,
}

/// A scene: model, initial state, element and step.
struct Scene {
    name: &'static str,
    nodes: u32,
    /// Runs a number of steps; `None` if the processor cannot run the stepper.
    run: Box<dyn Fn(Writer, u32) -> Result<Option<Run>, Failure>>,
    /// The accurate end after a number of steps.
    reference: Box<dyn Fn(u32) -> Result<Vec<f64>, Failure>>,
}

const STEPS: u32 = 1000;
const TURNS: u32 = 30;

/// The figures of one stepper.
#[derive(Clone, Copy, Default)]
struct Figures {
    instructions: Option<u64>,
    nanoseconds: Option<f64>,
    iterations: f64,
    error: f64,
}

fn measure(scene: &Scene, counts: bool, times: bool) -> Result<[Option<Figures>; 3], Failure> {
    let reference = (scene.reference)(STEPS)?;
    let mut figures = [None; 3];
    for (figures, writer) in figures.iter_mut().zip(Writer::ALL) {
        let Some(run) = (scene.run)(writer, STEPS)? else {
            continue;
        };
        let instructions = if counts {
            count::instructions(scene.name, scene.nodes, writer)?
        } else {
            None
        };
        *figures = Some(Figures {
            instructions,
            nanoseconds: None,
            iterations: run.iterations as f64 / f64::from(STEPS),
            error: error(&run.end, &reference),
        });
    }
    // In turn, so that all see the same machine.
    for _ in 0..if times { TURNS } else { 0 } {
        for (figures, writer) in figures.iter_mut().zip(Writer::ALL) {
            if let (Some(figures), Some(run)) = (figures, (scene.run)(writer, STEPS)?) {
                let time = run.time.as_secs_f64() * 1e9 / f64::from(STEPS);
                figures.nanoseconds = Some(figures.nanoseconds.unwrap_or(time).min(time));
            }
        }
    }
    Ok(figures)
}

/// The largest difference divided by the largest coordinate; NaN if there is one.
fn error(end: &[f64], reference: &[f64]) -> f64 {
    let size = reference.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
    let difference = |(x, y): (&f64, &f64)| (x - y).abs();
    end.iter()
        .zip(reference)
        .map(difference)
        .max_by(f64::total_cmp)
        .unwrap_or(f64::NAN)
        / size
}

/// A right-aligned number, or a dash.
fn cell(number: Option<f64>, digits: usize) -> String {
    number.map_or("–".to_owned(), |number| format!("{number:.digits$}"))
}

fn show(scene: &Scene, figures: &[Option<Figures>; 3]) {
    let [hand, emitted, general] = figures.map(Option::unwrap_or_default);
    let instructions = [hand, emitted, general].map(|f| f.instructions.map(|n| n as f64));
    let times = [hand, emitted, general].map(|f| f.nanoseconds);
    let ratio = |x: Option<f64>, y: Option<f64>| Some(x? / y?);
    print!("{:<16} {}", scene.name, scene.nodes);
    for numbers in [instructions, times] {
        let [hand, emitted, general] = numbers;
        print!(
            "  {:>6} {:>6} {:>6}",
            cell(hand, 0),
            cell(emitted, 0),
            cell(general, 0)
        );
        print!(
            " {:>5} {:>5}",
            cell(ratio(emitted, hand), 2),
            cell(ratio(general, emitted), 2)
        );
    }
    println!(
        "  {:>5.2} {:>5.2}  {:.0e} {:.0e}",
        hand.iterations, emitted.iterations, hand.error, emitted.error
    );
}

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let scenes = scenes::all();
    if let [flag, name, nodes, writer, steps] = &arguments[..]
        && flag == "--count"
    {
        let (nodes, steps): (u32, u32) = (nodes.parse()?, steps.parse()?);
        let is_wanted = |scene: &&Scene| scene.name == name && scene.nodes == nodes;
        let scene = scenes.iter().find(is_wanted).ok_or("no such scene")?;
        let writer = Writer::ALL.into_iter().find(|known| known.name() == writer);
        (scene.run)(writer.ok_or("no such writer")?, steps)?;
        return Ok(());
    }
    let counts = count::available();
    let times = !arguments
        .iter()
        .any(|argument| argument == "--instructions");
    let names: Vec<&String> = arguments.iter().filter(|a| !a.starts_with('-')).collect();
    println!(
        "                          instructions per step                nanoseconds per step           iterations     error"
    );
    println!(
        "scene          nodes    hand emitted general  e/h   g/e    hand emitted general  e/h   g/e  hand emitted  hand emitted"
    );
    for scene in &scenes {
        if names.is_empty() || names.iter().any(|name| *name == scene.name) {
            show(scene, &measure(scene, counts, times)?);
        }
    }
    if times && (names.is_empty() || names.iter().any(|name| *name == "starts")) {
        starts::show_all()?;
    }
    Ok(())
}
