//! The cost of a control loop: a million steps of `hold` with an input set before each step, compared with `steps()`
//! with the feedback in the declaration, with an input given as a function of time, and with a constant input. Printed
//! are the nanoseconds per step, the time of `hold` divided by that of each way, and the angle at the end, as a check.

use std::error::Error;
use std::hint::black_box;
use std::time::Instant;
use tfe::prelude::*;

#[dynamics(
    coordinates(x, theta),
    lagrangian = dot(x)^2/2 + l*dot(x)*dot(theta)*cos(theta)/2 + l^2*dot(theta)^2/2 - g*l*cos(theta),
    input(u),
    force(x) = u,
    output(tip) = x + l*sin(theta),
)]
struct Cart {
    l: f64,
    g: f64,
}

/// The same model with the feedback in the declaration.
#[dynamics(
    coordinates(x, theta),
    lagrangian = dot(x)^2/2 + l*dot(x)*dot(theta)*cos(theta)/2 + l^2*dot(theta)^2/2 - g*l*cos(theta),
    force(x) = 2*x + 3*dot(x) + 60*theta + 12*dot(theta) + sin(0.3*t),
    output(tip) = x + l*sin(theta),
)]
struct Stiffened {
    l: f64,
    g: f64,
}

const STEPS: usize = 1_000_000;
const STEP: f64 = 0.005;
const ROUNDS: usize = 3;

/// The smallest time per step in nanoseconds, and the angle at the end.
fn least(
    mut run: impl FnMut() -> Result<f64, Box<dyn Error>>,
) -> Result<(f64, f64), Box<dyn Error>> {
    let (mut best, mut angle) = (f64::INFINITY, f64::NAN);
    for _ in 0..ROUNDS {
        let start = Instant::now();
        angle = black_box(run()?);
        best = best.min(start.elapsed().as_secs_f64() * 1e9 / STEPS as f64);
    }
    Ok((best, angle))
}

fn main() -> Result<(), Box<dyn Error>> {
    let (l, g) = (0.5, 9.81);
    let (cart, stiffened) = (Cart { l, g }, Stiffened { l, g });
    let start = cart.state([0.0, 0.05], [0.0; 2]);
    let held = least(|| {
        let mut run = Simulation::new(&cart).step(STEP).hold(start, 0.0)?;
        for _ in 0..STEPS {
            let node = run.node();
            let feedback = 2.0 * node.q[0] + 3.0 * node.v[0] + 60.0 * node.q[1] + 12.0 * node.v[1];
            // An excitation, so that the angle does not decay to zero.
            let u = feedback + (0.3 * node.t).sin();
            run.set("u", u);
            run.advance()?;
        }
        Ok(run.node().q[1])
    })?;
    let declared = least(|| {
        let mut steps = Simulation::new(&stiffened).step(STEP).steps(start, 0.0);
        let last = steps.nth(STEPS - 1).ok_or("an endless run")??;
        Ok(last.q[1])
    })?;
    // Hanging downwards: the motion remains bounded without feedback.
    let below = cart.state([0.0, 3.1], [0.0; 2]);
    let driven = least(|| {
        let run = Simulation::new(&cart)
            .step(STEP)
            .input("u", |t| 0.01 * t.sin());
        let last = run.steps(below, 0.0).nth(STEPS - 1);
        Ok(last.ok_or("an endless run")??.q[1])
    })?;
    let free = least(|| {
        let run = Simulation::new(&cart).step(STEP).input("u", |_| 0.0);
        let last = run.steps(below, 0.0).nth(STEPS - 1);
        Ok(last.ok_or("an endless run")??.q[1])
    })?;
    println!("{STEPS} steps of a cart and pole    ns per step    `hold` / this   angle at the end");
    for (name, (time, angle)) in [
        ("`hold`, an input set before each", held),
        ("`steps()`, feedback declared", declared),
        ("`steps()`, input a function of t", driven),
        ("`steps()`, input constant", free),
    ] {
        let ratio = held.0 / time;
        println!("{name:38} {time:9.0}   {ratio:14.2}   {angle:16.3e}");
    }
    Ok(())
}
