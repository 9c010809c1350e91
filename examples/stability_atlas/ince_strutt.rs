//! The stability chart of Mathieu's equation (Ince–Strutt diagram): a million points, and its boundaries by root
//! finding.

use crate::{Outcome, Scene, grid};
use nalgebra::DMatrix;
use rayon::prelude::*;
use std::f64::consts::PI;
use std::time::Instant;
use tfe::RunError;
use tfe::charts::{Axis, HeatMap, Section};
use tfe::prelude::*;
use tfe::stability::{IntervalError, StabilityMap, unstable_intervals_of};

/// y'' + (a − 2q cos 2t) y = 0
#[dynamics(coordinates(y), lagrangian = dot(y)^2/2 - (a - 2*q*cos(2*t))*y^2/2)]
struct Mathieu {
    a: f64,
    q: f64,
}

/// A million points if the program is optimised.
const SIDE: usize = if cfg!(debug_assertions) { 100 } else { 1000 };
const ELEMENTS: usize = 12;

/// Characteristic values for several q, from eigenvalue problems with 45 digits: a₀, b₁, a₁, b₂, a₂, b₃, a₃, b₄, a₄.
const REFERENCE: [(f64, [f64; 9]); 3] = [
    (
        0.5,
        [
            -0.1217655449410827,
            0.4706543549338391,
            1.4667668425160558,
            3.979189215751357,
            4.10090059556048,
            9.013719838920393,
            9.017606927797509,
            16.008310459709477,
            16.008364622723008,
        ],
    ),
    (
        1.0,
        [
            -0.4551386041074135,
            -0.11024881699209517,
            1.8591080725143634,
            3.917024772998471,
            4.371300982735086,
            9.047739259809376,
            9.078368847203102,
            16.032970081405793,
            16.033832340359513,
        ],
    ),
    (
        5.0,
        [
            -5.800046020851508,
            -5.790080598637771,
            1.858187541547751,
            2.0994604454866654,
            7.449109739529177,
            9.2363277136937,
            11.5488320363434,
            16.648219937169777,
            17.096581684366047,
        ],
    ),
];
const NAMES: [&str; 9] = ["a₀", "b₁", "a₁", "b₂", "a₂", "b₃", "a₃", "b₄", "a₄"];

type Failure = IntervalError<RunError<1>>;

pub fn scene() -> Outcome {
    let clock = Instant::now();
    let map = StabilityMap::over(-2.0..20.0, 0.0..10.0)
        .resolution(SIDE, SIDE)
        .progress()
        .floquet(|a, q| Mathieu { a, q }, PI, Mixed::<4>, ELEMENTS)?;
    let seconds = clock.elapsed().as_secs_f64();
    if let Some(failure) = map.first_failure() {
        return Err(failure.to_string().into());
    }
    let curves = curves()?;
    let growth = |i, j| map.value(i, j).map(|radius| radius.max(1.0).ln());
    let mut picture = HeatMap::new(
        "Ince–Strutt chart of y'' + (a − 2q cos 2t) y = 0",
        (SIDE, SIDE),
        growth,
    )
    .size(860, 620)
    .x(Axis::new("a").range(-2.0..20.0))
    .y(Axis::new("q").range(0.0..10.0))
    .values("ln |largest multiplier| over π");
    for (name, points) in [("aₙ(q)", &curves.a), ("bₙ(q)", &curves.b)] {
        picture = picture.curve(name, points.iter().copied());
    }
    let (rows, worst) = table()?;
    // Rounding errors of the multipliers, amplified by 10⁵ at a tongue as narrow as b₄ to a₄ at q = ½.
    assert!(worst < 1e-6, "a boundary has an error of {worst:e}");
    let rate = (SIDE * SIDE) as f64 / seconds;
    let section = Section::new("The chart of Ince and Strutt")
        .paragraph(
            "A pendulum with an oscillating support, a column under a pulsating load, a ship in waves: \
             small motions obey Mathieu's equation. It is unstable in tongues that start from a \
             = n², q = 0; their sides are the characteristic values aₙ and bₙ.",
        )
        .figure(
            picture.to_svg()?,
            format!(
                "Growth over one period of the coefficient, zero where stable (dark). {SIDE} × {SIDE} \
                 points in {seconds:.1} s, {:.2} million per second: Mixed::<4>, {ELEMENTS} \
                 elements per period. The curves are the values of a where the same multipliers pass ±1, for {} \
                 values of q.",
                rate / 1e6,
                curves.count
            ),
        )
        .table(
            [
                "q",
                "value",
                "boundary found",
                "characteristic value",
                "error",
            ],
            rows,
        )
        .paragraph(format!(
            "Boundaries by unstable_intervals_of over a, with Mixed::<8> and 16 elements per \
             period: the largest error is {worst:.1e}."
        ));
    let key = format!(
        "{SIDE}² points in {seconds:.1} s ({:.2} million/s); boundaries to {worst:.1e}",
        rate / 1e6
    );
    Ok(Scene { section, key })
}

/// The ends of the unstable intervals of a, ascending: a₀, b₁, a₁, b₂, … All of them are above −2q.
fn boundaries(q: f64, element: Element, end: f64) -> Result<Vec<f64>, Failure> {
    let intervals = unstable_intervals_of(
        |a| monodromy(&Mathieu { a, q }, element),
        -2.0 * q - 0.5..end,
    )?;
    let ends = intervals
        .iter()
        .flat_map(|interval| [interval.start, interval.end]);
    // The first interval begins at the start of the range, which is no boundary.
    Ok(ends.skip(1).filter(|a| *a < end).collect())
}

/// The transition matrix over the period π.
fn monodromy(model: &Mathieu, element: Element) -> Result<DMatrix<f64>, RunError<1>> {
    let period = Simulation::new(model).element(element).step(PI / 16.0);
    let rest = model.state([0.0], [0.0]);
    Ok(period.run_linearised(rest, 0.0..PI)?.product())
}

/// The boundaries as curves (a, q), with gaps between them.
struct Curves {
    a: Vec<(f64, f64)>,
    b: Vec<(f64, f64)>,
    count: usize,
}

fn curves() -> Result<Curves, Failure> {
    let places: Vec<f64> = grid(0.2, 10.0, 40).collect();
    let found: Result<Vec<_>, _> = places
        .par_iter()
        .map(|&q| boundaries(q, Mixed::<5>.into(), 21.5))
        .collect();
    let found = found?;
    let mut curves = Curves {
        a: Vec::new(),
        b: Vec::new(),
        count: places.len(),
    };
    for (k, name) in NAMES.iter().enumerate() {
        let curve = if name.starts_with('a') {
            &mut curves.a
        } else {
            &mut curves.b
        };
        // Every tongue starts at a = n².
        let order = k.div_ceil(2) as f64;
        curve.push((order * order, 0.0));
        let points = places
            .iter()
            .zip(&found)
            .filter_map(|(q, ends)| Some((*ends.get(k)?, *q)));
        curve.extend(points);
        curve.push((f64::NAN, f64::NAN));
    }
    Ok(curves)
}

/// All boundaries compared with their characteristic values, and the largest error.
fn table() -> Result<(Vec<[String; 5]>, f64), Failure> {
    let (mut rows, mut worst) = (Vec::new(), 0.0_f64);
    for (q, values) in REFERENCE {
        let found = boundaries(q, Mixed::<8>.into(), 18.0)?;
        for (k, expected) in values.iter().enumerate() {
            let found = found.get(k).copied().unwrap_or(f64::NAN);
            let error = (found - expected).abs();
            worst = if worst.is_nan() || error <= worst {
                worst
            } else {
                error
            };
            rows.push([
                q.to_string(),
                NAMES[k].to_owned(),
                format!("{found:.12}"),
                format!("{expected:.12}"),
                format!("{error:.0e}"),
            ]);
        }
    }
    Ok((rows, worst))
}
