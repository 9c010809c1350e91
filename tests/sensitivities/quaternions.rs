//! Bodies described by unit quaternions: the mass matrix is singular, and constraints determine the velocity of a
//! momentum.

use crate::Top;
use crate::differences::difference;
use tfe::prelude::*;
use tfe::sensitivity::Loss;

/// A top without friction, with a time-dependent velocity constraint: the rate about the first axis is prescribed.
#[dynamics(
    coordinates(e[4]),
    let w = body_rate(e),
    lagrangian = (i1*w[0]^2 + i2*w[1]^2 + i3*w[2]^2)/2 - mgd*(e[0]^2 - e[1]^2 - e[2]^2 + e[3]^2),
    constraint(unit) = (inner(e, e) - 1)/2,
    constraint(steered) = w[0] - b*sin(t),
    output(w1) = w[0],
    output(w2) = w[1],
)]
#[derive(Clone, Copy)]
struct Steered {
    i1: f64,
    i2: f64,
    i3: f64,
    mgd: f64,
    b: f64,
}

/// A unit quaternion, and the rates for given body rates.
fn start(w: [f64; 3]) -> ([f64; 4], [f64; 4]) {
    let e = [0.9_f64, 0.3, -0.2, 0.4];
    let length = e.iter().map(|e| e * e).sum::<f64>().sqrt();
    let e = e.map(|e| e / length);
    let rate = [
        -e[1] * w[0] - e[2] * w[1] - e[3] * w[2],
        e[0] * w[0] - e[3] * w[1] + e[2] * w[2],
        e[3] * w[0] + e[0] * w[1] - e[1] * w[2],
        -e[2] * w[0] + e[1] * w[1] + e[0] * w[2],
    ];
    (e, rate.map(|rate| 0.5 * rate))
}

const SPAN: std::ops::Range<f64> = 0.0..1.0;

/// The compared values of a run: velocities at the end and inside, outputs, an integral.
fn looks<M: tfe::Model<4>>(run: &Simulation<'_, M, 4>, model: &M, start: State<4>) -> [f64; 11] {
    let motion = run.run(start, SPAN).expect("a run");
    let (last, inside) = (motion.last().v, motion.at(0.513).expect("inside").v);
    let output = |name: &str| motion.outputs().column(name).expect("an output")[20];
    let integral = motion.integral(model, "w1").expect("an integral")[20];
    let mut all = [0.0; 11];
    all[..4].copy_from_slice(&last);
    all[4..8].copy_from_slice(&inside);
    all[8..].copy_from_slice(&[output("w1"), output("w2"), integral]);
    all
}

fn check<M: tfe::Model<4> + Copy + Send + Sync>(model: M, parameter: &str, start: State<4>) {
    let index = model.find_parameter(parameter).expect("a parameter");
    for element in [Element::mixed(3), Element::mixed(6)] {
        let wanted = difference(
            |value| {
                let other = model.with_parameter(index, value).expect("another");
                let run = Simulation::new(&other).element(element).step(0.05);
                looks(&run, &other, start)
            },
            model.parameter(index),
        );
        let run = Simulation::new(&model).element(element).step(0.05);
        let slopes = run.run_sensitive(start, SPAN).expect("derivatives");
        let by = slopes.by(parameter);
        let (last, inside) = (by.last().v, by.at(0.513).expect("inside").v);
        let output = |name: &str| by.output(name).expect("an output")[20];
        let loss = |loss: Loss<4>| {
            let (_, gradient) = run.gradient(start, SPAN, &loss).expect("a gradient");
            gradient.by(parameter)
        };
        let found = [
            last[0],
            last[1],
            last[2],
            loss(Loss::of_end(|_, _, v| v[3])),
            inside[0],
            inside[1],
            inside[2],
            inside[3],
            output("w1"),
            loss(Loss::output_at_end("w2")),
            loss(Loss::integral("w1")),
        ];
        for (k, (found, wanted)) in found.iter().zip(&wanted).enumerate() {
            // Differences of eighth order have errors of about 1e-12.
            let off = (found - wanted).abs();
            assert!(off < 1e-10, "{element}, {k}: {found} beside {wanted}");
        }
    }
}

#[test]
fn velocities_outputs_and_losses_of_unit_quaternions() {
    let (i1, i2, i3, mgd) = (1.0, 1.3, 0.5, 1.0);
    let top = Top {
        i1,
        i2,
        i3,
        mgd,
        c: 0.0,
    };
    let (e, rate) = start([0.3, -0.5, 4.0]);
    check(top, "mgd", top.state(e, rate));
    let b = 0.4;
    let steered = Steered { i1, i2, i3, mgd, b };
    let (e, rate) = start([0.0, -0.5, 4.0]);
    check(steered, "mgd", steered.state(e, rate));
    check(steered, "b", steered.state(e, rate));
}
