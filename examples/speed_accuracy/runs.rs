//! What all scenes share: the elements, the errors to be reached, the charts.

use std::error::Error;
use std::path::Path;
use std::time::Duration;
use tfe::charts::Section;
use tfe::prelude::*;
use tfe::work_precision::{Curve, Measurements, PhasePoint, Subject, WorkPrecisionError};

/// The errors to be reached.
pub const TARGETS: [f64; 4] = [1e-4, 1e-6, 1e-8, 1e-10];
const NODES: &[usize] = if cfg!(debug_assertions) {
    &[2, 4, 9]
} else {
    &[2, 3, 4, 5, 7, 9, 12]
};

/// A scene with its measurements.
pub struct Scene {
    pub title: &'static str,
    pub measured: Measurements,
}

impl Scene {
    /// Runs the scene with all elements.
    pub fn measure<M: Subject<S>, S: PhasePoint>(
        title: &'static str,
        problem: WorkPrecision<'_, M, S>,
    ) -> Result<Self, WorkPrecisionError> {
        // Without optimisation, times are not meaningful: one short run is enough.
        let (every, time) = if cfg!(debug_assertions) {
            (4, 0)
        } else {
            (1, 10)
        };
        let measured = problem
            .elements(elements())
            .tolerances((3..13).step_by(every).map(|digits| 10_f64.powi(-digits)))
            .tolerances([0.05 * f64::EPSILON])
            .repeat_for(Duration::from_millis(time))
            .run()?;
        Ok(Self { title, measured })
    }

    /// Writes all results as CSV and the charts into the folder, and returns sections of the page with the same charts.
    pub fn save(&self, folder: &Path, name: &str) -> Result<Vec<Section>, Box<dyn Error>> {
        let of = |what: &str| format!("{}: {what}", self.title);
        let mixed = |curve: &Curve| curve.element() == Element::mixed(curve.element().nodes());
        let ours = self.measured.clone().without_peers();
        let mut charts = vec![
            ("nodes", ours.only(mixed).title(of("mixed, 2 to 12 nodes"))),
            (
                "families",
                ours.only(|curve| curve.element().nodes() == 4)
                    .title(of("all families, 4 nodes")),
            ),
        ];
        if !self.measured.peers().is_empty() {
            let fastest = TARGETS.map(|target| Some(self.measured.fastest(target)?.element));
            let beside = self
                .measured
                .only(|curve| fastest.contains(&Some(curve.element())));
            charts.insert(
                0,
                ("peers", beside.title(of("our fastest and other crates"))),
            );
        }
        self.measured.save(folder.join(format!("{name}.csv")))?;
        let mut sections = Vec::new();
        for (what, chart) in charts {
            chart.save(folder.join(format!("{name}_{what}.svg")))?;
            sections.push(chart.section()?);
        }
        Ok(sections)
    }
}

/// All families with all numbers of nodes.
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
    NODES.iter().copied().flat_map(of).collect()
}
