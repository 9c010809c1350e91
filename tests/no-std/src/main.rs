//! A program without `std` and without an allocator: emitted solvers with two and with four nodes step a pendulum and a
//! double pendulum.
//!
//! The exit code says what failed: 0 nothing, 1 a step, 2 or more a check of a result. Without the feature `two-nodes`,
//! one of the two solvers is declared but not used, which must not make the program larger.

#![no_std]
#![no_main]

use tfe_macros::dynamics;

#[dynamics(
    crate = tfe_runtime,
    coordinates(theta),
    lagrangian = dot(theta)^2/2 + k*cos(theta),
    solver(TwoNodes, Mixed::<2>),
    solver(FourNodes, Mixed::<4>),
)]
struct Pendulum {
    k: f64,
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}

#[link(name = "c")]
unsafe extern "C" {}

/// The entry point that the C start-up code calls.
#[unsafe(no_mangle)]
extern "C" fn main(_arguments: i32, _values: *const *const u8) -> i32 {
    let pendulum = Pendulum { k: 1.0 };
    // The reference at t = 10 from q = 2 at rest, with 32 digits; tests/reference/trajectories.json.
    let exact = 0.713_148_180_601_379_4;

    let mut state = pendulum.state([2.0], [0.0]);
    let mut solver = FourNodes::new(&pendulum, 0.05);
    for _ in 0..200 {
        if solver.advance(&mut state).is_err() {
            return 1;
        }
    }
    // The element has order 6: the error with h = 0.05 is a few 1e-10.
    if !((state.q[0] - exact).abs() < 1e-8) {
        return 2;
    }

    #[cfg(feature = "two-nodes")]
    {
        let mut state = pendulum.state([2.0], [0.0]);
        let mut solver = TwoNodes::new(&pendulum, 0.01);
        for _ in 0..1000 {
            if solver.advance(&mut state).is_err() {
                return 1;
            }
        }
        // The element has order 2: the error is a few 1e-5.
        if !((state.q[0] - exact).abs() < 1e-3) {
            return 3;
        }
    }
    0
}
