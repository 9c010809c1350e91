//! Generated kernels beside hand-written ones: operations, instructions and nanoseconds a call.
//!
//! `cargo bench --bench kernels` prints the table; `cargo bench --bench kernels -- pendulum heavy-top` only these models. Instructions are
//! counted where valgrind is installed; it counts a filling instruction (`rep stos`) once for each byte or word, so what clears memory looks
//! dearer there than in nanoseconds. Before anything is measured, both kernels are compared at several states.

mod by_hand;
mod case;
mod count;
mod error;
mod models;
mod table;

use case::{Case, Kernel, Of, Writer};
use error::Error;
use models::{
    DoublePendulum, DoublePendulumAngles, Fput, FreeBody, HeavyTop, HenonHeiles, Pendulum, Planets,
    TriplePendulum, TriplePendulumAngles,
};
use std::process::ExitCode;

/// All models, with numbers of ordinary size for all parameters: no product is exact, none is much larger than another.
fn cases() -> [Box<dyn Case>; 10] {
    let (m1, m2, m3, l1, l2, l3, g) = (1.3, 0.7, 0.9, 1.1, 0.8, 0.6, 9.81);
    let pendulum = Pendulum { m: m1, l: l1, g };
    let double = DoublePendulum { m1, m2, l1, l2, g };
    let double_angles = DoublePendulumAngles { m1, m2, l1, l2, g };
    let triple = TriplePendulum {
        m1,
        m2,
        m3,
        l1,
        l2,
        l3,
        g,
    };
    let triple_angles = TriplePendulumAngles {
        m1,
        m2,
        m3,
        l1,
        l2,
        l3,
        g,
    };
    let top = HeavyTop {
        a: 1.4,
        c: 0.6,
        m: m1,
        g,
        l: l1,
    };
    let body = FreeBody {
        a: 0.9,
        b: 1.7,
        c: 2.3,
    };
    let planets = Planets {
        g: 0.8,
        m: [1.9, 0.7, 1.1, 0.6, 1.3, 0.9],
    };
    let lattice = Fput { a: 0.25 };
    let heiles = HenonHeiles { lambda: 0.9 };
    [
        Box::new(Of::new("pendulum", Pendulum::structure(), pendulum)),
        Box::new(Of::new(
            "double-pendulum",
            DoublePendulum::structure(),
            double,
        )),
        Box::new(Of::new(
            "double-pendulum-angles",
            DoublePendulumAngles::structure(),
            double_angles,
        )),
        Box::new(Of::new(
            "triple-pendulum",
            TriplePendulum::structure(),
            triple,
        )),
        Box::new(Of::new(
            "triple-pendulum-angles",
            TriplePendulumAngles::structure(),
            triple_angles,
        )),
        Box::new(Of::new("henon-heiles", HenonHeiles::structure(), heiles)),
        Box::new(Of::new("heavy-top", HeavyTop::structure(), top)),
        Box::new(Of::new("free-body", FreeBody::structure(), body)),
        Box::new(Of::new("planets", Planets::structure(), planets)),
        Box::new(Of::new("fput-32", Fput::structure(), lattice)),
    ]
}

/// Which of them, by the argument that says so.
fn find<T>(
    all: impl IntoIterator<Item = T>,
    argument: &str,
    name: impl Fn(&T) -> String,
) -> Result<T, Error> {
    all.into_iter()
        .find(|one| name(one) == argument)
        .ok_or_else(|| Error::Usage(argument.to_owned()))
}

fn run(arguments: &[&str]) -> Result<(), Error> {
    if let ["--count", case, kernel, writer, times] = arguments {
        let case = find(cases(), case, |case| case.name().to_owned())?;
        let kernel = find(Kernel::ALL, kernel, Kernel::to_string)?;
        let writer = find(Writer::ALL, writer, Writer::to_string)?;
        let times = times
            .parse()
            .map_err(|_| Error::Usage((*times).to_owned()))?;
        case.repeat(kernel, writer, times);
        return Ok(());
    }
    let mut chosen = Vec::from(cases());
    for argument in arguments {
        find(&chosen, argument, |case| case.name().to_owned())?;
    }
    chosen.retain(|case| arguments.is_empty() || arguments.contains(&case.name()));
    for case in &chosen {
        case.check()?;
    }
    let counted = count::available();
    table::head();
    for case in &chosen {
        for kernel in Kernel::ALL {
            let instructions = match counted {
                true => Some(count::instructions(&**case, kernel)?),
                false => None,
            };
            table::line(&**case, kernel, instructions);
        }
    }
    Ok(())
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    // Cargo adds `--bench`.
    let arguments: Vec<&str> = arguments
        .iter()
        .map(String::as_str)
        .filter(|argument| *argument != "--bench")
        .collect();
    match run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
