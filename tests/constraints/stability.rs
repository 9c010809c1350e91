//! Stability of constrained motions, from the transition matrix of one step.

use crate::models::{QuaternionTop, RodPendulum};
use crate::runs::run;
use nalgebra::DMatrix;
use tfe::prelude::*;

/// A linear oscillator with frequency² ω².
#[dynamics(coordinates(x), lagrangian = (dot(x)^2 - omega2*x^2)/2)]
struct Oscillator {
    omega2: f64,
}

/// Hanging at rest, the rod has the same element matrix as the oscillator for three nodes and more. With two nodes, the
/// reaction acts as two impulses at the ends, ½ h m g each, and the swing is that of leapfrog: trace 2 − h² g/l.
#[test]
fn the_hanging_rod() {
    let rod = RodPendulum {
        m: 0.8,
        l: 1.3,
        g: 9.81,
    };
    let down = rod.state([0.0, -rod.l], [0.0, 0.0]);
    let swing = Oscillator {
        omega2: rod.g / rod.l,
    };
    let zero = State { q: [0.0], p: [0.0] };
    for nodes in 2..=5 {
        let element = Element::mixed(nodes);
        for h in [0.05, 0.2, 0.5] {
            let a = stability::on_constraints(&rod, element, &down, 0.0, h)
                .unwrap_or_else(|error| panic!("{element}: {error}"));
            assert_eq!(a.shape(), (2, 2));
            let expected = if nodes == 2 {
                2.0 - h * h * swing.omega2
            } else {
                stability::transition_matrix(&swing, element, &zero, 0.0, h)
                    .expect("an oscillator")
                    .trace()
            };
            assert!(
                (a.trace() - expected).abs() < 1e-12,
                "{element}, h = {h}: trace {}, expected {expected}",
                a.trace()
            );
            assert!((a.determinant() - 1.0).abs() < 1e-12, "{element}, h = {h}");
        }
    }
}

/// An equilibrium is known up to rounding errors, so that coordinates and velocities may have any sign: the basis at
/// the end must not change with these signs.
#[test]
fn a_little_beside_the_equilibrium() {
    let rod = RodPendulum {
        m: 0.8,
        l: 1.3,
        g: 9.81,
    };
    let swing = Oscillator {
        omega2: rod.g / rod.l,
    };
    let zero = State { q: [0.0], p: [0.0] };
    let element = Element::mixed(5);
    for x in [1e-12, -1e-12] {
        let beside = rod.state([x, -rod.l], [0.0, 0.0]);
        for h in [0.2, 0.8] {
            let a = stability::on_constraints(&rod, element, &beside, 0.0, h)
                .unwrap_or_else(|error| panic!("x = {x}, h = {h}: {error}"));
            let oscillator = stability::transition_matrix(&swing, element, &zero, 0.0, h);
            let expected = oscillator.expect("an oscillator").trace();
            // The matrix changes by some 1e-12 with x.
            assert!(
                (a.trace() - expected).abs() < 1e-10,
                "x = {x}, h = {h}: trace {}, expected {expected}",
                a.trace()
            );
            assert!(
                (a.determinant() - 1.0).abs() < 1e-10,
                "x = {x}, h = {h}: determinant {}",
                a.determinant()
            );
        }
    }
}

/// An empty span gives the identity on the two motions that the rod allows.
#[test]
fn nothing_moves_in_an_empty_span() {
    let rod = RodPendulum {
        m: 0.8,
        l: 1.3,
        g: 9.81,
    };
    let down = rod.state([0.0, -rod.l], [0.0, 0.0]);
    let simulation = Simulation::new(&rod).element(Mixed::<3>).step(0.1);
    let still = simulation.run_linearised(down, 1.0..1.0);
    let still = still.expect("an empty span");
    let multipliers = still.multipliers().expect("the identity");
    assert_eq!(multipliers.len(), 2);
    assert!(multipliers.iter().all(|one| one.modulus() == 1.0));
    assert_eq!(still.on_constraints().map(<[_]>::len), Some(0));
}

/// The steps at which an element becomes unstable are those of the oscillator: zero eigenvalues of directions that are
/// no motions do not count.
#[test]
fn unstable_steps_of_the_hanging_rod() {
    let rod = RodPendulum {
        m: 0.8,
        l: 9.81,
        g: 9.81,
    };
    let down = rod.state([0.0, -rod.l], [0.0, 0.0]);
    let gaps = |element: Element| {
        stability::unstable_intervals(&rod, element, &down, 0.0..9.0).expect("a smooth model")
    };
    let primal = gaps(Primal::<3>.into());
    assert_eq!(primal.len(), 2, "{primal:?}");
    assert!((primal[0].start - 10.0_f64.sqrt()).abs() < 1e-10);
    assert!((primal[0].end - 12.0_f64.sqrt()).abs() < 1e-10);
    assert!((primal[1].start - 60.0_f64.sqrt()).abs() < 1e-10);
    assert!(gaps(Mixed::<3>.into()).is_empty());
    // With two nodes the reaction acts as impulses: the limit of leapfrog.
    let two = gaps(Mixed::<2>.into());
    assert!(
        two.len() == 1 && (two[0].start - 2.0).abs() < 1e-10,
        "{two:?}"
    );
}

/// A thin disk of radius r that rolls on a plane: contact point, heading, lean, roll angle. The contact point moves
/// along the heading at r dψ/dt.
#[dynamics(
    coordinates(x, y, phi, theta, psi),
    let cx = x - r*sin(theta)*sin(phi),
    let cy = y + r*sin(theta)*cos(phi),
    let cz = r*cos(theta),
    lagrangian = m/2*(dot(cx)^2 + dot(cy)^2 + dot(cz)^2) + m*r^2/8*(dot(theta)^2 + (dot(phi)*cos(theta))^2)
        + m*r^2/4*(dot(psi) - dot(phi)*sin(theta))^2 - m*g*cz,
    constraint(roll_x) = dot(x) - r*dot(psi)*cos(phi),
    constraint(roll_y) = dot(y) - r*dot(psi)*sin(phi),
)]
struct Disk {
    m: f64,
    r: f64,
    g: f64,
}

impl Disk {
    /// The transition matrix of one step of straight rolling, at the speed with this square, on the tangent space of
    /// the constraints.
    fn rolling(&self, speed2: f64, element: Element, h: f64) -> DMatrix<f64> {
        let v = speed2.sqrt();
        let start = self.state([0.0; 5], [v, 0.0, 0.0, 0.0, v / self.r]);
        let a = stability::on_constraints(self, element, &start, 0.0, h)
            .unwrap_or_else(|error| panic!("v² = {speed2}: {error}"));
        assert_eq!(a.shape(), (8, 8));
        a
    }
}

/// The root of a function that changes its sign between two arguments.
fn bisect(mut low: f64, mut high: f64, f: impl Fn(f64) -> f64) -> f64 {
    let sign = f(low).signum();
    assert!(f(high).signum() != sign, "no change of sign");
    for _ in 0..50 {
        let middle = f64::midpoint(low, high);
        if f(middle).signum() == sign {
            low = middle;
        } else {
            high = middle;
        }
    }
    f64::midpoint(low, high)
}

/// A thin uniform disk: straight rolling is stable for v² > g r/3.
///
/// Of the eight multipliers, six are 1: those of four shifts (position, heading, roll), and of the neighbouring
/// motions, rolling straight and in circles. The two of the lean, μ and 1/μ, are real if the disk falls: the trace is
/// 6 + μ + 1/μ, and passes through 8 at the limit. The six ones belong to long Jordan chains (a change of the yaw rate
/// moves y with t²), so that the spectral radius itself is accurate to a few digits only; the trace is a smooth
/// function.
#[test]
fn the_rolling_disk() {
    let disk = Disk {
        m: 0.8,
        r: 0.4,
        g: 9.81,
    };
    let limit = disk.g * disk.r / 3.0;
    for (element, h) in [
        (Element::mixed(3), 0.02),
        (Element::mixed(4), 0.1),
        (Element::primal(4).reduced(), 0.1),
    ] {
        let found = bisect(0.5 * limit, 2.0 * limit, |speed2| {
            disk.rolling(speed2, element, h).trace() - 8.0
        });
        assert!(
            (found / limit - 1.0).abs() < 1e-6,
            "{element}, h = {h}: v² = {found}, expected {limit}, {:e}",
            found / limit - 1.0
        );
        let radius =
            |factor: f64| stability::spectral_radius(&disk.rolling(factor * limit, element, h));
        // 10 % below the limit, the growth is about h √(0.1 g/r); above, the deviation from 1 is the scatter of the
        // defective eigenvalues, ε^(1/4).
        assert!(
            radius(0.9) > 1.0 + h,
            "{element}: radius {} below the limit",
            radius(0.9)
        );
        assert!(
            radius(1.1) < 1.0 + 1e-3,
            "{element}: radius {} above the limit",
            radius(1.1)
        );
    }
}

/// The mass has no effect on rolling, neither if momenta are small compared with coordinates nor if they are large.
#[test]
fn disks_of_any_mass_roll_alike() {
    let trace = |m: f64| {
        let disk = Disk { m, r: 0.4, g: 9.81 };
        disk.rolling(2.0, Element::mixed(4), 0.1).trace()
    };
    let expected = trace(1.0);
    for m in [1e-12, 1e-6, 1e3] {
        let error = (trace(m) - expected).abs();
        // The rounding errors of an element and of two bases.
        assert!(error < 1e-8, "m = {m}: {error:e}");
    }
}

/// The matrix of the map e → e ∘ g.
fn followed_by([a, b, c, d]: [f64; 4]) -> DMatrix<f64> {
    DMatrix::from_row_slice(
        4,
        4,
        &[
            a, -b, -c, -d, //
            b, a, d, -c, //
            c, -d, a, b, //
            d, c, -b, a,
        ],
    )
}

/// The transition matrix of one step of the sleeping top at the spin with this square, seen from the body: the rotation
/// g during the step is a symmetry of the model (p and q rotate alike), and is undone after it.
fn sleeping(spin2: f64, element: Element, h: f64) -> DMatrix<f64> {
    let top = QuaternionTop::TABLE;
    let start = top.moving([1.0, 0.0, 0.0, 0.0], [0.0, 0.0, spin2.sqrt()]);
    let turn = run(&top, element, h, start, h).last().q;
    let a = stability::transition_matrix(&top, element, &start, 0.0, h)
        .unwrap_or_else(|error| panic!("ω² = {spin2}: {error}"));
    let back = followed_by(turn).transpose();
    let mut undo = DMatrix::zeros(8, 8);
    undo.view_mut((0, 0), (4, 4)).copy_from(&back);
    undo.view_mut((4, 4), (4, 4)).copy_from(&back);
    undo * a
}

/// The limit of stability ω² = 4 J₁ mgd / J₃² = 16, found from the nonlinear model in quaternions.
#[test]
fn the_sleeping_top() {
    let limit = 16.0;
    for (element, h) in [(Element::mixed(5), 0.05), (Element::primal(5), 0.05)] {
        // Below the limit, the growth is h √(mgd/J₁ (1 − ω²/16)); pairs of equal multipliers scatter by √ε = 1.5e-8. At
        // a growth of 1e-6 the spin is 4e-10 from the limit.
        let found = bisect(0.8 * limit, 1.25 * limit, |spin2| {
            stability::spectral_radius(&sleeping(spin2, element, h)) - (1.0 + 1e-6)
        });
        assert!(
            (found / limit - 1.0).abs() < 1e-6,
            "{element}: ω² = {found}, {:e}",
            found / limit - 1.0
        );
        let growth = stability::spectral_radius(&sleeping(0.75 * limit, element, h)).ln() / h;
        assert!((growth - 0.5).abs() < 1e-6, "{element}: growth {growth}");
    }
    let top = QuaternionTop::TABLE;
    let upright = top.moving([1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 5.0]);
    let a = stability::on_constraints(&top, Mixed::<4>, &upright, 0.0, 0.1).expect("one step");
    assert_eq!(a.shape(), (6, 6));
    assert!(a.determinant().abs() > 0.5, "no direction is lost");
}
