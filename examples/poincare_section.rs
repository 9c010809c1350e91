//! Poincaré sections of the Hénon–Heiles potential at three energies: from regular to chaotic motion.
//!
//! ```text
//! H = (px² + py² + x² + y²)/2 + x² y − y³/3 ,     the points (y, py) where x = 0 and px > 0
//! ```
//!
//! M. Hénon and C. Heiles (1964) asked whether a star in an axisymmetric galaxy has a third integral of the motion. At
//! E = 1/12 the points of each orbit lie on curves, as if there were one. At E = 1/6, where the equipotential line
//! opens, nearly all orbits are chaotic and their points fill an area, except in a few islands. The largest Lyapunov
//! exponent in the table expresses this as a number: the rate, per unit of time, at which neighbouring orbits separate,
//! computed from the matrices that map a deviation from one point of the section to the next. It is near zero for
//! regular motion. The last column shows the largest energy error.
//!
//! `cargo run --release --example poincare_section` writes the charts `poincare_section_1.svg` to
//! `poincare_section_3.svg`; give another beginning of their names after `--`.

use std::error::Error;
use tfe::charts::{Axis, Chart, Style};
use tfe::prelude::*;

#[dynamics(
    coordinates(x, y),
    momenta(px, py),
    hamiltonian = (px^2 + py^2 + x^2 + y^2)/2 + x^2*y - y^3/3,
    event(section) = x,
)]
struct HenonHeiles;

/// Initial points on the section: y, py.
const STARTS: [[f64; 2]; 7] = [
    [-0.25, 0.0],
    [-0.1, 0.0],
    [0.05, 0.0],
    [0.25, 0.0],
    [0.35, 0.0],
    [0.1, 0.2],
    [0.0, 0.33],
];

const POINTS: usize = 400;

/// The state on the section with the given energy and px > 0, if the energy is sufficient.
fn start(energy: f64, [y, py]: [f64; 2]) -> Option<State<2>> {
    let rest = 2.0 * energy - py * py - y * y + 2.0 / 3.0 * y.powi(3);
    (rest > 0.0).then(|| State {
        q: [0.0, y],
        p: [rest.sqrt(), py],
    })
}

fn main() -> Result<(), Box<dyn Error>> {
    let simulation = Simulation::new(&HenonHeiles).element(Mixed::<8>).step(0.25);
    let path = std::env::args().nth(1);
    let path = path.unwrap_or_else(|| "poincare_section".to_owned());
    println!("energy   starts   points   largest Lyapunov exponent    energy error");
    let mut chaos = Vec::new();
    for (number, (energy, name)) in [(1.0 / 12.0, "1/12"), (1.0 / 8.0, "1/8"), (1.0 / 6.0, "1/6")]
        .into_iter()
        .enumerate()
    {
        let mut chart = Chart::new(format!("Hénon and Heiles' section, E = {name}"))
            .x(Axis::new("y"))
            .y(Axis::new("py"));
        let (mut fastest, mut worst, mut count) = (0.0, 0.0_f64, 0);
        let starts: Vec<_> = STARTS
            .iter()
            .filter_map(|one| start(energy, *one))
            .collect();
        for (k, start) in starts.iter().enumerate() {
            let section = simulation.section("section", Crossing::Rising, *start, 0.0);
            // A deviation within the section, multiplied by the matrices from point to point.
            let mut direction = nalgebra::DVector::from_vec(vec![0.0, 1.0, 0.0, 0.3]);
            let (mut stretch, mut end) = (0.0, 0.0);
            let mut points = Vec::with_capacity(POINTS);
            for point in section.linearised().take(POINTS) {
                let point = point?;
                let matrix = point.transition().ok_or("the section is linearised")?;
                direction = matrix * direction;
                stretch += direction.norm().ln();
                direction /= direction.norm();
                let ([x, y], [px, py]) = (point.q, point.p);
                let now = (px * px + py * py + x * x + y * y) / 2.0 + x * x * y - y.powi(3) / 3.0;
                let off = (now - energy).abs();
                assert!(
                    off < 1e-10,
                    "E = {name}: the energy has an error of {off:e}"
                );
                worst = worst.max(off);
                end = point.t;
                points.push((y, py));
            }
            assert_eq!(points.len(), POINTS, "E = {name}, start {}", k + 1);
            count += points.len();
            let exponent: f64 = stretch / end;
            assert!(exponent.is_finite(), "E = {name}, start {}", k + 1);
            fastest = exponent.max(fastest);
            chart = chart.series(format!("start {}", k + 1), Style::Markers, points);
        }
        println!(
            "{energy:6.4}   {:6}   {count:6}   {fastest:25.4}   {worst:13.1e}",
            starts.len()
        );
        chaos.push(fastest);
        chart.save(format!("{path}_{}.svg", number + 1))?;
    }
    assert!(chaos[0] < 0.02 && chaos[2] > 0.05, "{chaos:?}");
    println!("\ncharts: {path}_1.svg to {path}_3.svg");
    Ok(())
}
