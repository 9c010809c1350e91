//! Runs with events: the element ends where the observable vanishes, and the run continues with the state made by the
//! act.

use super::*;
use crate::duals::{root, velocity};
use tfe::runtime::dual::Dual;

/// Two coupled pendulums, one of which hits a wall; the mass matrix depends on the position.
#[dynamics(
    coordinates(a, b),
    lagrangian = m/2*dot(a)^2 + dot(b)^2/2 + dot(a)*dot(b)*cos(a - b)/2 + g*(cos(a) + cos(b)/2),
    force(b) = -c*dot(b),
    event(wall) = a - w - s*b^2,
)]
struct Hitting {
    m: f64,
    g: f64,
    c: f64,
    w: f64,
    s: f64,
}

/// The position of the wall, from the parameters as a kernel receives them.
fn distance(model: &Hitting, q: &[Dual], parameter: Option<usize>) -> Dual {
    let own = |name: &str, value: f64| {
        let asked = parameter.is_some() && parameter == model.find_parameter(name);
        Dual::new(value, f64::from(asked))
    };
    q[0] - own("w", model.w) - own("s", model.s) * q[1] * q[1]
}

/// The act at the wall: a momentum that depends nonlinearly on the velocity.
fn pushed<R: tfe::runtime::Real>(v: R) -> R {
    R::from_f64(-1.6) * v - R::from_f64(0.1) * v * v
}

fn hitting_end(
    model: &Hitting,
    element: Element,
    start: &Phase,
    (steps, h): (u32, f64),
    parameter: Option<usize>,
) -> (Phase, usize) {
    let step = |at: &Phase, span: (Dual, Dual)| {
        duals::element_end(element, at, span, |t, at, rate| {
            duals::flow(model, t.by_parameter(parameter), at, rate)
        })
    };
    let (mut at, mut events) = (start.clone(), 0);
    for node in 0..steps {
        let begin = number(f64::from(node) * h);
        let end = step(&at, (begin, number(h)));
        let values = [&at, &end].map(|at| distance(model, &at.q, parameter).value);
        if values[0] < 0.0 && values[1] > 0.0 {
            events += 1;
            let guess = h * values[0] / (values[0] - values[1]);
            let length = root(vec![number(guess)], |length| {
                let end = step(&at, (begin, length[0]));
                vec![distance(model, &end.q, parameter)]
            })[0];
            let mut hit = step(&at, (begin, length));
            let time = begin + length;
            let v = velocity(model, time.by_parameter(parameter), &hit);
            hit.p[0] += pushed(v[0]);
            at = step(&hit, (time, number(h) - length));
        } else {
            at = end;
        }
    }
    (at, events)
}

#[test]
fn derivatives_through_impacts_are_those_of_runs_in_dual_numbers() {
    let model = Hitting {
        m: 1.3,
        g: 9.81,
        c: 0.1,
        w: 0.1,
        s: 0.2,
    };
    let start = model.state([-0.8, 0.2], [0.0, 0.3]);
    let (steps, h) = (50, 0.05);
    for element in [Element::mixed(3), Element::mixed(5)] {
        let run = Simulation::new(&model).element(element).step(h).on(
            "wall",
            Crossing::Rising,
            |event| Act::Impulse([pushed(event.v[0]), 0.0]),
        );
        let end = |start: &Phase, parameter: Option<usize>| {
            let (end, events) = hitting_end(&model, element, start, (steps, h), parameter);
            assert_eq!(events, 2);
            end
        };
        let off = off(&run, start, f64::from(steps) * h, &end);
        assert!(off < ROUNDING, "{element}: {off:.1e}");
    }
}
