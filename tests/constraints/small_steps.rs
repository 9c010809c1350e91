//! Steps down to the resolution of positions: an iteration that has reached the roundings of its constraints is done.

use tfe::prelude::*;

#[dynamics(
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y,
    constraint(rod) = x^2 + y^2 - l^2,
)]
struct Rod {
    m: f64,
    g: f64,
    l: f64,
}

#[dynamics(
    coordinates(a, b, x),
    lagrangian = j/2*dot(a)^2 + k/2*dot(b)^2 + m/2*dot(x)^2 - g*sin(a),
    constraint(cx) = cos(a) + 2*cos(b) - x,
    constraint(cy) = sin(a) - 2*sin(b),
)]
struct SliderCrank {
    j: f64,
    k: f64,
    m: f64,
    g: f64,
}

const STEPS: [f64; 9] = [1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9];

/// Runs with three to eight nodes; before, eight nodes stalled below 1e-5 and took more than a hundred iterations a step where they did not.
fn runs<M, const N: usize>(model: &M, start: State<N>)
where
    M: tfe::runtime::Model<N>
        + tfe::runtime::length::Declared<N, Length = tfe::runtime::length::FixedLength>,
{
    for nodes in 3..=8 {
        for step in STEPS {
            let simulation: Simulation<'_, M, N> = Simulation::new(model);
            let run = simulation.element(Element::mixed(nodes)).step(step);
            let motion = run.run(start, 0.0..40.0 * step);
            let motion = motion.unwrap_or_else(|error| panic!("{nodes} {step:e}: {error}"));
            let iterations = motion.statistics().newton_iterations;
            assert!(iterations <= 16 * 40, "{nodes} {step:e}: {iterations}");
            let energies = motion.energies();
            let off = energies[40] - energies[0];
            // Of order 2(n − 1) where it is not rounding.
            let most = 1e-13 + (2.0 * step).powi(2 * nodes as i32 - 2);
            assert!(
                off.abs() < most,
                "{nodes} {step:e}: energy off by {off:.1e}"
            );
        }
    }
}

#[test]
fn a_rod_takes_steps_of_any_size() {
    let rod = Rod {
        m: 1.0,
        g: 9.81,
        l: 1.0,
    };
    runs(&rod, rod.state([0.6, -0.8], [0.4, 0.3]));
}

#[test]
fn a_slider_crank_takes_steps_of_any_size() {
    let crank = SliderCrank {
        j: 0.5,
        k: 0.2,
        m: 1.0,
        g: 3.0,
    };
    let (a, va) = (0.7_f64, 1.3);
    let b = (a.sin() / 2.0).asin();
    let vb = va * a.cos() / (2.0 * b.cos());
    let vx = -a.sin() * va - 2.0 * b.sin() * vb;
    runs(
        &crank,
        crank.state([a, b, a.cos() + 2.0 * b.cos()], [va, vb, vx]),
    );
}
