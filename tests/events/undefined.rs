//! Events whose functions are no numbers: they cannot happen, and a warning says so.

use super::*;
use tfe::Warning;

#[dynamics(
    coordinates(x),
    lagrangian = dot(x)^2/2,
    output(root) = sqrt(1 - x) - 2,
    output(shifted) = x - level,
    output(ratio) = sin(x)/x - 0.5,
    event(wall) = x - 2,
)]
struct Free {
    level: f64,
}

/// The events that a warning says are undefined, with their times.
fn undefined(warnings: &[Warning]) -> Vec<(&str, f64)> {
    let undefined = warnings.iter().filter_map(|warning| match warning {
        Warning::EventUndefined { event, time } => Some((&**event, *time)),
        _ => None,
    });
    undefined.collect()
}

/// x = t: the root has no value from t = 1 on, and an event at a level that is NaN never happens. They had no warning.
#[test]
fn events_that_are_no_numbers_are_told() {
    let model = Free { level: f64::NAN };
    let start = model.state([0.0], [1.0]);
    let run = Simulation::new(&model)
        .element(Mixed::<4>)
        .step(0.25)
        .on("root", Crossing::Either, |_| Act::Record)
        .on("shifted", Crossing::Either, |_| Act::Record);
    let run = run.on_function(
        "log",
        Crossing::Either,
        |_, q, _| (q[0] - 5.0).ln(),
        |_| Act::Record,
    );
    let motion = run.run(start, 0.0..3.0).expect("a run");
    assert_eq!(motion.events().len(), 0);
    let found = undefined(motion.warnings());
    let [("root", root), ("shifted", shifted), ("log", log)] = found[..] else {
        panic!("{:?}", motion.warnings());
    };
    // In the first element that ends without a value, at one of its samples.
    assert!((1.0..=1.25).contains(&root), "{root}");
    assert_eq!((shifted, log), (0.0, 0.0));
    let told = motion.warnings()[0].to_string();
    assert!(
        told.contains("event `root` is not a number (NaN) at t = 1"),
        "{told}"
    );
    let mut steps = run.steps(start, 0.0);
    assert!(steps.by_ref().take(8).all(|node| node.is_ok()));
    assert_eq!(undefined(&steps.warnings()).len(), 3);
}

/// A single point without a value, as sin(x)/x at zero, and what lies beyond an event that ends the run, are no reason.
#[test]
fn events_with_values_have_no_warning() {
    let model = Free { level: 1.5 };
    let start = model.state([0.0], [1.0]);
    let run = Simulation::new(&model).element(Mixed::<4>).step(0.25);
    let run = run
        .on("ratio", Crossing::Falling, |_| Act::Record)
        .on("shifted", Crossing::Rising, |_| Act::Stop)
        .on_function(
            "beyond",
            Crossing::Either,
            |_, q, _| (1.5 - q[0]).sqrt() + 1.0,
            |_| Act::Record,
        );
    let motion = run.run(start, 0.0..3.0).expect("a run");
    assert_eq!(motion.warnings(), []);
    let last = motion.last().t;
    assert!((last - 1.5).abs() <= 1e-12, "{last}");
}
