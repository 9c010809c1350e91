//! Stiff modes in nonlinear models: within an unstable interval (bubble) of the primal element the motion grows,
//! whereas it remains bounded with the mixed element of as many nodes.

use tfe::prelude::*;
use tfe::stability::unstable_intervals;

/// Three stiff springs of frequency ω in a row, coupled by soft quartic ones: a_i is the position of a spring, b_i its
/// extension (both scaled by √½).
#[dynamics(
    coordinates(a[3], b[3]),
    lagrangian = sum(i in 0..3, (dot(a[i])^2 + dot(b[i])^2)/2 - omega^2/2*b[i]^2)
               - ((a[0] - b[0])^4 + sum(i in 0..2, (a[i+1] - b[i+1] - a[i] - b[i])^4) + (a[2] + b[2])^4)/4,
)]
struct Chain {
    omega: f64,
}

const CHAIN: Chain = Chain { omega: 50.0 };

/// The phase ωh of the stiff modes in one step, for three nodes: within √10 … √12.
const IN_THE_BUBBLE: f64 = 3.3;

/// A mass on a spring that swings: r from the suspension, θ from the downward vertical; mass and natural length are
/// one.
#[dynamics(
    coordinates(r, theta),
    lagrangian = (dot(r)^2 + r^2*dot(theta)^2)/2 + g*r*cos(theta) - k/2*(r - 1)^2,
)]
pub(crate) struct ElasticPendulum {
    pub(crate) g: f64,
    pub(crate) k: f64,
}

/// g/k is a power of two, so that the equilibrium is exact to the last bit.
const PENDULUM: ElasticPendulum = ElasticPendulum { g: 1.0, k: 2048.0 };

/// The largest energy error of a run; infinite if it failed.
fn energy_error<M: Model<N>, const N: usize>(
    model: &M,
    element: Element,
    start: State<N>,
    h: f64,
) -> f64 {
    let motion = Simulation::new(model)
        .element(element)
        .step(h)
        // The element as it is: otherwise, steps in which the energy jumps would be cut.
        .solver(Solve::Trusting)
        .run(start, 0.0..200.0 * h);
    motion.map_or(f64::INFINITY, |motion| motion.energy_error())
}

#[test]
fn the_chain_at_rest_is_unstable_in_the_bubble_of_its_springs() {
    // Without the quartic part there are three equal oscillators and three free masses.
    let rest = CHAIN.state([0.0; 6], [0.0; 6]);
    let far = 5.0 / CHAIN.omega;
    let found = unstable_intervals(&CHAIN, Primal::<3>, &rest, 0.0..far).expect("smooth");
    assert_eq!(found.len(), 1, "{found:#?}");
    let (start, end) = (found[0].start * CHAIN.omega, found[0].end * CHAIN.omega);
    // Three equal oscillators become unstable at once: det(A + 1) has triple zeros there. Since they are those of
    // multiples of one matrix, they are known as accurately as simple ones.
    assert!((start - 10.0_f64.sqrt()).abs() < 1e-10 && (end - 12.0_f64.sqrt()).abs() < 1e-10);
    // The reference is from stability_bubbles.json.
    assert!((found[0].radius - 1.129817690854696).abs() < 1e-12);
    // The free masses have double eigenvalues, which rounding errors split: this must not be reported as an interval.
    let none = unstable_intervals(&CHAIN, Mixed::<3>, &rest, 0.0..far).expect("smooth");
    assert!(none.is_empty(), "{none:?}");
}

#[test]
fn the_chain_grows_in_the_bubble_and_not_with_mixed() {
    let start = CHAIN.state(
        [1.0, 0.0, 0.0, 1.0 / CHAIN.omega, 0.0, 0.0],
        [1.0, 0.0, 0.0, 1.0, 0.0, 0.0],
    );
    let h = IN_THE_BUBBLE / CHAIN.omega;
    let error = |element| energy_error(&CHAIN, element, start, h);
    let (primal, mixed, reduced) = (
        error(Element::primal(3)),
        error(Element::mixed(3)),
        error(Element::primal(3).reduced()),
    );
    assert!(primal > 1e3, "{primal}");
    assert!(mixed < 0.01 && reduced < 0.01, "{mixed}, {reduced}");
}

#[test]
fn the_elastic_pendulum_hanging_has_the_bubble_of_its_spring() {
    // r = 1 + g/k in equilibrium; the spring oscillates at √k, the pendulum at √(g/r).
    let rest = PENDULUM.state([1.0 + PENDULUM.g / PENDULUM.k, 0.0], [0.0; 2]);
    let omega = PENDULUM.k.sqrt();
    let found =
        unstable_intervals(&PENDULUM, Primal::<3>, &rest, 0.0..10.0 / omega).expect("smooth");
    assert_eq!(found.len(), 2, "{found:#?}");
    let ends = [found[0].start, found[0].end, found[1].start].map(|end| end * omega);
    for (end, square) in ends.into_iter().zip([10.0_f64, 12.0, 60.0]) {
        assert!((end - square.sqrt()).abs() < 1e-10, "{end} for √{square}");
    }
    let none = unstable_intervals(&PENDULUM, Mixed::<3>, &rest, 0.0..10.0 / omega).expect("smooth");
    assert!(none.is_empty(), "{none:?}");
}

#[test]
fn the_elastic_pendulum_grows_in_the_bubble_and_not_with_mixed() {
    let start = PENDULUM.state([1.0, 0.5], [0.0; 2]);
    let h = IN_THE_BUBBLE / PENDULUM.k.sqrt();
    let error = |element| energy_error(&PENDULUM, element, start, h);
    let (primal, mixed, reduced) = (
        error(Element::primal(3)),
        error(Element::mixed(3)),
        error(Element::primal(3).reduced()),
    );
    assert!(primal > 1e3, "{primal}");
    assert!(mixed < 0.01 && reduced < 0.01, "{mixed}, {reduced}");
}

#[test]
fn an_equilibrium_that_is_one_to_round_off_only() {
    let pendulum = ElasticPendulum { g: 1.0, k: 2500.0 };
    let rest = pendulum.state([1.0 + 1.0 / 2500.0, 0.0], [0.0, 0.0]);
    for h in [0.03, 0.06, 0.09, 0.12] {
        let matrix = stability::transition_matrix(&pendulum, Primal::<3>, &rest, 0.0, h);
        assert!(matrix.is_ok(), "h = {h}: {matrix:?}");
    }
    let found = unstable_intervals(&pendulum, Primal::<3>, &rest, 0.0..0.1).expect("smooth");
    assert_eq!(found.len(), 1, "{found:?}");
    assert!((found[0].start * 50.0 - 10.0_f64.sqrt()).abs() < 1e-9);
}
