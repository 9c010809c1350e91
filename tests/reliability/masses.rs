//! Mechanisms in any units of mass: of micrometres and picograms, and of planets, in SI units.

use super::*;

/// A heavy top on a pin: a unit quaternion and a point, whose masses are singular without the constraints.
#[dynamics(
    coordinates(r[3], e[4]),
    let w = body_rate(e),
    lagrangian = m/2*inner(dot(r), dot(r)) + j/2*(w[0]^2 + w[1]^2 + w[2]^2/2) - m*g*r[2],
    constraint(unit) = inner(e, e) - 1,
    constraint(pin) = r - rotate(e, [0, 0, l])
)]
struct Top {
    m: f64,
    j: f64,
    g: f64,
    l: f64,
}

impl Top {
    fn of(mass: f64) -> Self {
        Self {
            m: mass,
            j: mass,
            g: 9.81,
            l: 0.5,
        }
    }

    /// Leaning by 0.4, with a spin of 20.
    fn start(&self) -> State<7> {
        let (sine, cosine) = 0.2_f64.sin_cos();
        let (lean, up) = (0.5 * 0.4_f64.sin(), 0.5 * 0.4_f64.cos());
        let position = [0.0, -lean, up, cosine, sine, 0.0, 0.0];
        let velocity = [0.0, 0.0, 0.0, 0.0, 0.0, -10.0 * sine, 10.0 * cosine];
        let start = self.consistent_state(position, velocity);
        start.expect("a consistent start").state
    }
}

/// A disk that rolls: contact, height of the centre, heading, lean, roll.
#[dynamics(
    coordinates(x, y, z, heading, lean, roll),
    let spin = dot(roll) + dot(heading)*cos(lean),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2 + dot(z)^2) + m*r^2/8*(dot(lean)^2 + dot(heading)^2*sin(lean)^2)
        + m*r^2/4*spin^2 - m*g*z,
    constraint(rolls) = [dot(x), dot(y)] - r*dot(lean)*[sin(heading)*sin(lean), -cos(heading)*sin(lean)]
        + r*spin*[cos(heading), sin(heading)],
    constraint(touches) = z - r*sin(lean)
)]
struct Disk {
    m: f64,
    g: f64,
    r: f64,
}

/// The coordinates in units of lengths.
fn rolled(mass: f64, length: f64) -> [f64; 6] {
    let disk = Disk {
        m: mass,
        g: 9.81 * length,
        r: length,
    };
    let position = [0.0, 0.0, length * 0.8_f64.sin(), 0.0, 0.8, 0.0];
    let start = disk.consistent_state(position, [0.0, 0.0, 0.0, 2.0, 0.3, 3.0]);
    let start = start.expect("a consistent start").state;
    let simulation = Simulation::new(&disk).element(Mixed::<4>).step(0.01);
    let motion = simulation.run(start, 0.0..1.0);
    let motion = motion.unwrap_or_else(|error| panic!("{mass:e}, {length:e}: {error}"));
    assert!(motion.warnings().is_empty(), "{mass:e}, {length:e}");
    let [x, y, z, heading, lean, roll] = motion.last().q;
    [x / length, y / length, z / length, heading, lean, roll]
}

/// Rows of constraints stood beside momenta that are smaller than the rounding errors of these rows, so that the iteration
/// ended with errors of up to 5e-4 without a warning.
#[test]
fn a_disk_of_a_picogram_rolls_as_one_of_a_kilogram() {
    let expected = rolled(1.0, 1.0);
    let (micro, nano) = ([(1e-12, 1e-6), (1e-15, 1e-6)], [(1e-8, 1e-8), (1e-9, 1e-9)]);
    let others = [(1e-15, 1e-3), (1e-18, 1e-3), (1e20, 1e6), (1e-3, 1e-9)];
    for (mass, length) in micro.into_iter().chain(nano).chain(others) {
        let found = rolled(mass, length);
        let off = (0..6)
            .map(|k| (found[k] - expected[k]).abs())
            .fold(0.0, larger);
        // Rounding errors of a hundred steps.
        assert!(off <= 1e-12, "{mass:e}, {length:e}: {off:e}");
    }
}

/// Energies and velocities of heavy tops were NaN, and comparisons with shorter steps failed.
#[test]
fn tops_of_any_mass_move_alike() {
    let run = |mass: f64| {
        let top = Top::of(mass);
        let simulation = Simulation::new(&top).element(Mixed::<4>).step(0.01);
        let motion = simulation.run(top.start(), 0.0..1.0);
        let motion = motion.unwrap_or_else(|error| panic!("{mass:e}: {error}"));
        assert!(
            motion.warnings().is_empty(),
            "{mass:e}: {:?}",
            motion.warnings()
        );
        // Of the element.
        assert!(motion.energy_error() <= 1e-12, "{mass:e}");
        motion.last().q
    };
    let expected = run(1.0);
    for mass in [1e-24, 1e-20, 1e-12, 1e16, 1e20, 1e28, 1e36] {
        let found = run(mass);
        let off = (0..7)
            .map(|k| (found[k] - expected[k]).abs())
            .fold(0.0, larger);
        assert!(off <= 1e-12, "{mass:e}: {off:e}");
    }
}

/// By the coordinates, and by the momenta in units of the mass.
#[test]
fn steps_of_any_mass_have_their_derivatives() {
    let matrix = |mass: f64| {
        let top = Top::of(mass);
        let simulation = Simulation::new(&top).element(Mixed::<4>).step(0.01);
        let motion = simulation.run_linearised(top.start(), 0.0..0.1);
        let motion = motion.unwrap_or_else(|error| panic!("{mass:e}: {error}"));
        let mut matrix = motion.product();
        for row in 0..7 {
            for column in 0..7 {
                matrix[(row, 7 + column)] /= mass;
                matrix[(7 + row, column)] *= mass;
            }
        }
        matrix
    };
    let expected = matrix(1.0);
    for mass in [1e-20, 1e-12, 1e20] {
        let found = matrix(mass);
        let difference = &found - &expected;
        let off = difference.iter().map(|entry| entry.abs());
        let off = off.fold(0.0, larger) / expected.amax();
        // Rounding errors of ten steps, divided by the step.
        assert!(off <= 1e-10, "{mass:e}: {off:e}");
    }
}
