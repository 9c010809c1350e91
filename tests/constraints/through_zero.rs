//! Motions that lead all coordinates through zero at a node, where rounding errors are large relative to them.

use crate::common::distance;
use crate::runs::run;
use tfe::prelude::*;

/// A bead on a straight wire in space.
#[dynamics(
    coordinates(x, y, z),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2 + dot(z)^2),
    constraint(beside) = y - r*x,
    constraint(above) = z - s*x*(1 + b*x),
)]
struct Line {
    m: f64,
    r: f64,
    s: f64,
    b: f64,
}

#[test]
fn beads_pass_the_origin() {
    for (r, s) in [(0.3, -0.7), (1.0 / 3.0, 1e-3), (-2.0, 1.7)] {
        let line = Line {
            m: 1.3,
            r,
            s,
            b: 0.0,
        };
        let start = line.state([-0.5, -0.5 * r, -0.5 * s], [1.0, r, s]);
        for nodes in 3..=7 {
            for step in [0.25, 0.1, 0.05, 1.0 / 64.0] {
                let motion = run(&line, Element::mixed(nodes), step, start, 1.0);
                let off = distance(&motion.last().q, &[0.5, 0.5 * r, 0.5 * s]);
                assert!(off <= 1e-14, "{r} {nodes} {step}: {off:.1e}");
                assert_eq!(motion.statistics().cuts, 0, "{r} {nodes} {step}");
            }
        }
    }
}

/// From a start near the origin that lets a node lie there.
#[test]
fn beads_on_bent_wires_pass_the_origin() {
    let line = Line {
        m: 1.0,
        r: 0.3,
        s: 0.4,
        b: 0.8,
    };
    let origin = line.state([0.0; 3], [1.0, 0.3, 0.4]);
    for nodes in 3..=7 {
        for step in [0.1, 0.05, 0.02] {
            let element = Element::mixed(nodes);
            let back = Simulation::new(&line).element(element).step(step);
            let before = back.run(origin, 0.0..-0.4).expect("a motion back");
            // Elements of this kind are symmetric: the same nodes lead back to the origin.
            let motion = run(&line, element, step, before.last().state(), 0.8);
            let after = run(&line, element, step, origin, 0.4);
            let off = distance(&motion.last().q, &after.last().q);
            assert!(off <= 1e-13, "{nodes} {step}: {off:.1e}");
        }
    }
}
