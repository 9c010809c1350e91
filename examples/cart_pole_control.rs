//! An inverted pendulum on a cart, stabilised by sampled feedback: how long may the sampling time be?
//!
//! ```text
//! L = ½ (M + m) ẋ² + m l ẋ θ̇ cos θ + ½ m l² θ̇² − m g l cos θ ,     force on x: u
//! ```
//!
//! θ is measured from the upright position. The gains of the feedback u = k·(x, ẋ, θ, θ̇) place the four poles of the
//! linearised closed loop at −3, in continuous time. A digital controller measures the state at sampling times only,
//! and holds u constant in between (zero-order hold): the longer the sampling time, the later u reacts. At 4 s an
//! impulse hits the cart. For sampling times from 5 ms to 200 ms, the table shows how long the pendulum takes to
//! return, and the largest force; with 200 ms it falls over. The simulation makes ten steps in each sampling time.
//!
//! `cargo run --release --example cart_pole_control` writes the chart `cart_pole_control.svg`; give another file name
//! after `--`.

use std::error::Error;
use tfe::RunErrorKind;
use tfe::charts::{Axis, Chart, Style};
use tfe::prelude::*;

/// A cart with an inverted pendulum.
#[dynamics(
    coordinates(x, theta),
    lagrangian = (cart + m)/2*dot(x)^2 + m*l*dot(x)*dot(theta)*cos(theta) + m*l^2/2*dot(theta)^2 - m*g*l*cos(theta),
    input(u),
    force(x) = u,
    output(force) = u,
    output(tip) = x + l*sin(theta),
)]
struct CartPole {
    cart: f64, // kg
    m: f64,    // kg
    l: f64,    // m
    g: f64,    // m/s²
}

const CART: CartPole = CartPole {
    cart: 1.0,
    m: 0.2,
    l: 0.6,
    g: 9.81,
};

/// The four poles of the linearised closed loop.
const ROOT: f64 = 3.0;

/// Steps in each sampling time.
const STEPS: usize = 10;

const PUSH: f64 = 4.0; // s
const END: f64 = 12.0; // s

/// The gains of x, ẋ, θ, θ̇ in u. The linearised model is M ẍ = u − m g θ and l θ̈ = g θ − ẍ. With y = x + l θ, for
/// which θ = ÿ/g, it is a single equation of fourth order in y.
fn gains(model: &CartPole) -> [f64; 4] {
    let CartPole { cart, m, l, g } = *model;
    // y⁗ = g (g (M + m) θ − u)/(M l) = −(c₀ y + c₁ ẏ + c₂ ÿ + c₃ y⃛), with the coefficients of (s + r)⁴.
    let [c0, c1, c2, c3] = [
        ROOT.powi(4),
        4.0 * ROOT.powi(3),
        6.0 * ROOT.powi(2),
        4.0 * ROOT,
    ];
    let scale = cart * l / g;
    [
        scale * c0,
        scale * c1,
        (cart + m) * g + scale * (c0 * l + c2 * g),
        scale * (c1 * l + c3 * g),
    ]
}

/// The rows of one run: time, position of the tip, force.
type Rows = Vec<[f64; 3]>;

/// The motion with one sample every `sample` seconds, as long as the pendulum does not fall.
fn controlled(sample: f64) -> Result<Rows, RunErrorKind> {
    let gains = gains(&CART);
    let start = CART.state([0.0, 0.2], [0.0, 0.0]);
    let mut run = Simulation::new(&CART)
        .element(Mixed::<4>)
        .step(sample / STEPS as f64)
        .impulse(PUSH, [1.0, 0.0])
        .hold(start, 0.0)?;
    let mut rows = Rows::new();
    while run.node().t < END && run.node().q[1].abs() < 1.5 {
        let node = run.node();
        let state = [node.q[0], node.v[0], node.q[1], node.v[1]];
        let u: f64 = gains
            .iter()
            .zip(state)
            .map(|(gain, value)| gain * value)
            .sum();
        run.set("u", u);
        for _ in 0..STEPS {
            run.advance()?;
            let node = run.node();
            let output = |name| node.output(name).unwrap_or(f64::NAN);
            rows.push([node.t, output("tip"), output("force")]);
        }
    }
    Ok(rows)
}

fn main() -> Result<(), Box<dyn Error>> {
    println!("sample (ms)   back within 1 cm after the push (s)   largest force (N)");
    let mut shown = Vec::new();
    for sample in [0.005, 0.02, 0.05, 0.1, 0.15, 0.2] {
        let rows = controlled(sample)?;
        let forces = rows.iter().map(|[_, _, u]| u.abs());
        let largest = forces.max_by(f64::total_cmp).unwrap_or(f64::NAN);
        let fell = rows.last().is_none_or(|[t, ..]| *t < END);
        let away = rows.iter().rev().find(|[_, tip, _]| tip.abs() > 0.01);
        let back = match away {
            _ if fell => "falls".to_owned(),
            Some([t, ..]) if *t < END - 0.5 => format!("{:.2}", t - PUSH),
            _ => "swings on".to_owned(),
        };
        println!("{:11.0}   {back:>35}   {largest:17.1}", 1e3 * sample);
        // An independent simulation with a Runge–Kutta method gives 2.7 to 3.3 s.
        let returned = away.map_or(0.0, |[t, ..]| t - PUSH);
        assert_eq!(fell, sample > 0.15, "samples every {sample} s");
        assert!(fell || (2.5..3.5).contains(&returned), "{returned} s");
        if [0.005, 0.1, 0.15].contains(&sample) {
            shown.push((sample, rows));
        }
    }
    let mut chart = Chart::new("An upright pendulum on a cart, pushed at 4 s")
        .x(Axis::new("t (s)"))
        .y(Axis::new("position of the tip (m)"));
    for (sample, rows) in &shown {
        let points = rows.iter().map(|[t, tip, _]| (*t, *tip));
        let points: Vec<_> = points.collect();
        chart = chart.series(
            format!("sampling time {:.0} ms", 1e3 * sample),
            Style::Line,
            points,
        );
    }
    let path = std::env::args().nth(1);
    let path = path.unwrap_or_else(|| "cart_pole_control.svg".to_owned());
    chart.save(&path)?;
    println!("chart of the position of the tip: {path}");
    Ok(())
}
