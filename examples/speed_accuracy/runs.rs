//! What all scenes share: the elements, the charts, the table.

use std::error::Error;
use std::path::Path;
use std::time::Duration;
use tfe::charts::Section;
use tfe::prelude::*;
use tfe::work_precision::{Measurements, WorkPrecisionError};

/// The columns of the table.
pub const HEADER: [&str; 6] = [
    "scene",
    "error",
    "time",
    "fastest element",
    "step",
    "energy",
];
/// The errors to be reached.
const TARGETS: [f64; 4] = [1e-4, 1e-6, 1e-8, 1e-10];
const NODES: [usize; 6] = [2, 3, 4, 5, 6, 8];

/// A scene that was measured.
pub struct Scene {
    title: &'static str,
    measured: Measurements,
}

impl Scene {
    /// Runs the scene with all elements.
    pub fn measure<M: Model<N>, const N: usize>(
        title: &'static str,
        problem: WorkPrecision<'_, M, N>,
    ) -> Result<Self, WorkPrecisionError> {
        let problem = problem.elements(elements());
        let measured = problem.repeat_for(Duration::from_millis(25)).run()?;
        Ok(Self { title, measured })
    }

    /// The fastest run for every target.
    pub fn rows(&self) -> [[String; 6]; 4] {
        TARGETS.map(|target| {
            let title = self.title.to_owned();
            let found = self.measured.fastest(target);
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
                    ]
                }
                Some((point, one)) => [
                    title,
                    format!("{target:.0e}"),
                    format!("{:.3} ms", 1e3 * one.seconds),
                    point.element.to_string(),
                    point.step.to_string(),
                    format!("{:.1e}", one.energy_error),
                ],
            }
        })
    }

    /// Writes all figures and two charts into the folder; the sections of the page hold the same charts.
    pub fn save(&self, folder: &Path, name: &str) -> Result<[Section; 2], Box<dyn Error>> {
        let of = |what: &str| format!("{}: {what}", self.title);
        let mixed = |curve: &tfe::work_precision::Curve| {
            let element = curve.element();
            element == Element::mixed(element.nodes())
        };
        let by_nodes = self.measured.only(mixed).title(of("mixed, 2 to 8 nodes"));
        let by_family = self.measured.only(|curve| curve.element().nodes() == 4);
        let by_family = by_family.title(of("all families, 4 nodes"));
        self.measured.save(folder.join(format!("{name}.csv")))?;
        by_nodes.save(folder.join(format!("{name}_nodes.svg")))?;
        by_family.save(folder.join(format!("{name}_families.svg")))?;
        Ok([by_nodes.section()?, by_family.section()?])
    }
}

/// Every family with every number of nodes.
fn elements() -> Vec<Element> {
    let of = |nodes| {
        [
            Element::primal(nodes),
            Element::primal(nodes).reduced(),
            Element::primal(nodes).lobatto(),
            Element::mixed(nodes),
            Element::three_field(nodes),
            Element::energy_conserving(nodes),
            Element::radau(nodes),
        ]
    };
    NODES.into_iter().flat_map(of).collect()
}

/// A line of the printed table.
pub fn line(row: [&str; 6]) -> String {
    let [scene, error, time, element, step, energy] = row;
    format!("{scene:<26} {error:>6} {time:>12}   {element:<26} {step:>8} {energy:>9}")
}
