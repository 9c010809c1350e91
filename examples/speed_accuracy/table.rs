//! The table of the fastest elements.

use crate::runs::{Scene, TARGETS};
use crate::scenes::short;

/// The columns of the table.
pub const HEADER: [&str; 7] = [
    "scene",
    "error",
    "time",
    "fastest element",
    "step",
    "tolerance",
    "energy",
];

/// The fastest run for each error to be reached.
pub fn rows(scene: &Scene) -> [[String; 7]; 4] {
    TARGETS.map(|target| {
        let title = scene.title.to_owned();
        let found = scene.measured.fastest(target);
        let found = found.and_then(|point| Some((point, point.measured()?)));
        match found {
            None => {
                let none = || "—".to_owned();
                [
                    title,
                    format!("{target:.0e}"),
                    none(),
                    none(),
                    none(),
                    none(),
                    none(),
                ]
            }
            Some((point, one)) => [
                title,
                format!("{target:.0e}"),
                format!("{:.3} ms", 1e3 * one.seconds),
                point.element.to_string(),
                short(point.step),
                format!("{:.0e}", point.tolerance),
                format!("{:.1e}", one.energy_error),
            ],
        }
    })
}

/// A line of the printed table.
pub fn line(row: [&str; 7]) -> String {
    let [scene, error, time, element, step, tolerance, energy] = row;
    format!(
        "{scene:<26} {error:>6} {time:>12}   {element:<26} {step:>8} {tolerance:>9} {energy:>9}"
    )
}
