//! Close encounters: an error of the energy that is small beside the kinetic energy there is large beside the energy of
//! the motion that follows.

use super::larger;
use std::f64::consts::PI;
use tfe::prelude::*;

#[dynamics(coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 + 1/hypot(x, y))]
struct Comet;

/// The place on an orbit of semi-major axis one, at a time since the apocentre, by Kepler's equation.
fn place(eccentricity: f64, time: f64) -> [f64; 2] {
    let mean = time - PI;
    // E − e sin E grows with E.
    let (mut low, mut high) = (-PI, PI);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if middle - eccentricity * middle.sin() < mean {
            low = middle;
        } else {
            high = middle;
        }
    }
    let minor = (1.0 - eccentricity * eccentricity).sqrt();
    [low.cos() - eccentricity, minor * low.sin()]
}

/// Orbits from the apocentre past the pericentre, in steps that are too long there by up to a thousand times: what ends
/// elsewhere is told, and what ends at its place is not.
#[test]
fn orbits_that_lose_their_energy_are_told() {
    let elements = [
        Element::mixed(2),
        Element::mixed(4),
        Element::mixed(6),
        Element::mixed(9),
        Element::primal(3),
        Element::radau(3),
    ];
    let (mut wrong, mut right) = (0, 0);
    for eccentricity in [0.8_f64, 0.9, 0.95, 0.98, 0.99, 0.995] {
        let speed = ((1.0 - eccentricity) / (1.0 + eccentricity)).sqrt();
        let start = Comet.state([-1.0 - eccentricity, 0.0], [0.0, -speed]);
        let expected = place(eccentricity, 6.0);
        for element in elements {
            for k in 0..10 {
                let h = 0.2 * 0.7_f64.powi(k);
                let run = Simulation::new(&Comet).element(element).step(h);
                let Ok(motion) = run.run(start, 0.0..6.0) else {
                    continue;
                };
                let off = |i: usize| (motion.last().q[i] - expected[i]).abs();
                let (off, told) = (larger(off(0), off(1)), motion.warnings());
                let case = format!("{eccentricity}, {element}, h = {h:.4}: off by {off:.1e}");
                if !(off <= 0.5) {
                    wrong += 1;
                    assert!(!told.is_empty(), "{case}");
                } else if off <= 1e-3 {
                    right += 1;
                    assert!(told.is_empty(), "{case}: {told:?}");
                }
            }
        }
    }
    assert!(wrong > 20 && right > 20, "{wrong} wrong, {right} right");
}
