//! Generated kernels compared with hand-written ones: operations, instructions and nanoseconds per call.
//!
//! `cargo bench --bench kernels` prints the table; `cargo bench --bench kernels -- pendulum heavy-top` only these
//! models; and `cargo bench --bench kernels -- --instructions` no times, for a machine that is busy with other things.
//! The optimiser was developed on the first ten models; the six after them were declared and written by hand without
//! looking at the generated code.
//!
//! Instructions are counted if valgrind is installed. It counts a fill instruction (`rep stos`) once for each byte or
//! word, so that clearing memory looks more expensive there than in nanoseconds. Before anything is measured, the
//! results of both kernels are compared at several states.

mod by_hand;
mod case;
mod count;
mod error;
mod models;
mod table;

use case::{Case, Kernel, Of, Writer};
use error::Error;
use models::{
    DoublePendulum, DoublePendulumAngles, ElasticArm, Foucault, Fput, FreeBody, HeavyTop,
    HenonHeiles, Pendulum, Planets, Satellite, SpatialArm, SphericalPendulumOnCart,
    SpinningEllipse, TriplePendulum, TriplePendulumAngles,
};
use std::process::ExitCode;
use table::Times;

/// All models: those on which the optimiser was developed, then the others.
fn cases() -> Vec<Box<dyn Case>> {
    developed().into_iter().chain(others()).collect()
}

/// The models on which the optimiser was developed. All parameters are generic numbers of ordinary size: no product is
/// exact, and none is much larger than another.
fn developed() -> [Box<dyn Case>; 10] {
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

/// The other models, also with generic parameters.
fn others() -> [Box<dyn Case>; 6] {
    let g = 9.81;
    let cart = SphericalPendulumOnCart {
        mc: 1.7,
        m: 0.7,
        l: 1.1,
        g,
    };
    let foucault = Foucault {
        m: 1.3,
        l: 2.1,
        g,
        omega: 0.7,
        latitude: 0.85,
    };
    let satellite = Satellite {
        a: 0.9,
        b: 1.7,
        c: 2.3,
        n: 0.6,
    };
    let arm = SpatialArm {
        j1: 0.8,
        m2: 1.3,
        l2: 1.1,
        s2: 0.6,
        i2: 0.2,
        j2: 0.5,
        m3: 0.9,
        s3: 0.7,
        i3: 0.15,
        j3: 0.4,
        g,
    };
    let elastic = ElasticArm {
        m1: 1.3,
        l1: 1.1,
        s1: 0.6,
        i1: 0.5,
        m2: 0.9,
        s2: 0.7,
        i2: 0.4,
        j1: 0.3,
        j2: 0.2,
        k1: 17.0,
        k2: 12.0,
        g,
    };
    let ellipse = SpinningEllipse {
        m: 1.3,
        a: 1.1,
        b: 0.8,
        omega: 1.9,
        g,
    };
    [
        Box::new(Of::new(
            "spherical-on-cart",
            SphericalPendulumOnCart::structure(),
            cart,
        )),
        Box::new(Of::new("foucault", Foucault::structure(), foucault)),
        Box::new(Of::new("satellite", Satellite::structure(), satellite)),
        Box::new(Of::new("spatial-arm", SpatialArm::structure(), arm)),
        Box::new(Of::new("elastic-arm", ElasticArm::structure(), elastic)),
        Box::new(Of::new(
            "spinning-ellipse",
            SpinningEllipse::structure(),
            ellipse,
        )),
    ]
}

/// The models named by the arguments.
fn find<T>(
    all: impl IntoIterator<Item = T>,
    argument: &str,
    name: impl Fn(&T) -> String,
) -> Result<T, Error> {
    all.into_iter()
        .find(|one| name(one) == argument)
        .ok_or_else(|| Error::Usage(argument.to_owned()))
}

/// The argument for leaving out times.
const INSTRUCTIONS: &str = "--instructions";

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
    let times = match arguments.contains(&INSTRUCTIONS) {
        true => Times::Omitted,
        false => Times::Measured,
    };
    let names: Vec<&str> = (arguments.iter().copied())
        .filter(|argument| *argument != INSTRUCTIONS)
        .collect();
    let mut chosen = cases();
    for argument in &names {
        find(&chosen, argument, |case| case.name().to_owned())?;
    }
    chosen.retain(|case| names.is_empty() || names.contains(&case.name()));
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
            table::line(&**case, kernel, instructions, times);
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
