//! For how long a chaotic motion can be computed.

use std::error::Error;
use tfe::charts::{Axis, Chart, Scale, Section, Style};
use tfe::prelude::*;

/// Two equal point masses on massless rods of one metre; angles are measured from the downward vertical.
#[dynamics(
    coordinates(a, b),
    lagrangian = dot(a)^2 + dot(b)^2/2 + dot(a)*dot(b)*cos(a - b) + 9.81*(2*cos(a) + cos(b)),
)]
struct DoublePendulum;

/// Both links nearly upright. From there, errors grow by a factor of e in about a third of a second.
pub fn section() -> Result<Section, Box<dyn Error>> {
    let start = DoublePendulum.state([3.0, 3.1], [0.0, 0.0]);
    let mut chart = Chart::new("A double pendulum from nearly upright: estimated error")
        .x(Axis::new("time (s)"))
        .y(Axis::new("estimated error").scale(Scale::Logarithmic));
    for element in [Element::mixed(4), Element::mixed(6), Element::mixed(9)] {
        let simulation = Simulation::new(&DoublePendulum).element(element).step(0.02);
        let motion = simulation.run_estimated(start, 0.0..20.0)?;
        let name = format!("{element}, step 0.02");
        chart = chart.series(name, Style::Line, motion.error_estimates());
    }
    let mut rows = Vec::new();
    for (asked, end) in [(1e-6, 8.0), (1e-6, 40.0), (1e-10, 8.0), (1e-10, 40.0)] {
        let outcome = Simulation::new(&DoublePendulum)
            .accuracy(asked)
            .run(start, 0.0..end);
        let said = match &outcome {
            Ok(motion) => format!("met: {:.1e}", motion.error_estimate()),
            Err(error) => error.to_string(),
        };
        println!("double pendulum, {asked:.0e} over {end} s: {said}");
        // Over 40 s even rounding errors grow by a factor of e¹²⁰.
        assert!(end < 40.0 || outcome.is_err(), "{asked:.0e}: {said}");
        rows.push([format!("{asked:.0e}"), format!("{end} s"), said]);
    }
    Ok(Section::new("Where it is refused")
        .paragraph(
            "The errors of a chaotic motion grow exponentially, and rounding errors do too. An accuracy that cannot be met is refused; the error says up to which time it is met.",
        )
        .figure(chart.to_svg()?, "Growth of errors")
        .table(["accuracy", "span", "answer"], rows))
}
