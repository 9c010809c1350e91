//! Tests of the monitor of iterations.

use super::*;

/// Rounding errors of larger coordinates do not shrink.
#[test]
fn small_coordinates_settle_while_increments_shrink() {
    let end_of = |sequence: &[f64]| {
        let mut monitor = Monitor::new(1e-17);
        let ends = |own: &f64| matches!(monitor.settle(*own), Ok(Verdict::Converged));
        sequence.iter().position(ends)
    };
    assert_eq!(end_of(&[1e-6, 1e-9, 1e-12, 1e-15, 1e-18]), Some(3));
    assert_eq!(end_of(&[1e-6, 1e-9, 0.95e-9]), Some(2));
    assert_eq!(end_of(&[0.0]), Some(0));
    assert_eq!(end_of(&[1e-6, f64::NAN, f64::NAN]), None);
}

/// The cheap way out decides as the power itself does.
#[test]
fn hopeless_is_what_the_rate_never_brings_to_the_target() {
    for remaining in [0, 1, 7, 8, 9, 40, 100] {
        for tenths in 0..=25 {
            let rate = f64::from(tenths) / 20.0;
            for exponent in -60..=10 {
                let last = 1.7 * 2.0_f64.powi(exponent);
                let mut monitor = Monitor::new(1e-13);
                (monitor.last, monitor.rate) = (last, rate);
                let target = 1e-13;
                let by_power = last > target && last * integer_power(rate, remaining) > target;
                assert_eq!(
                    monitor.is_hopeless(remaining as u32),
                    by_power,
                    "{last} · {rate}^{remaining}"
                );
            }
        }
    }
}
