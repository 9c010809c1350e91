//! What the scenes share: measured runs, rows of the table, samples of a motion.

use std::error::Error;
use std::time::Instant;
use tfe::AtError;
use tfe::charts::Section;
use tfe::prelude::*;

pub const HEADER: [&str; 10] = [
    "scene",
    "element",
    "step",
    "steps",
    "|φ|",
    "|A v + a|",
    "energy",
    "error",
    "against",
    "time",
];
const WIDTHS: [usize; 10] = [22, 21, 6, 6, 8, 9, 8, 8, 24, 9];

/// The cells of a row as a line with aligned columns, for the terminal.
pub fn line(cells: [&str; 10]) -> String {
    let padded = cells
        .iter()
        .zip(WIDTHS)
        .map(|(cell, width)| format!("{cell:<width$}"));
    padded.collect::<Vec<_>>().join(" ").trim_end().to_owned()
}

/// A part of the page with the rows of its runs, and its pictures with the names of their files.
pub struct Scene {
    pub rows: Vec<[String; 10]>,
    pub section: Section,
    pub pictures: Vec<(&'static str, String)>,
}

impl Scene {
    pub fn new(heading: &str, text: &str) -> Self {
        Self {
            rows: Vec::new(),
            section: Section::new(heading).paragraph(text),
            pictures: Vec::new(),
        }
    }

    pub fn row(mut self, row: [String; 10]) -> Self {
        self.rows.push(row);
        self
    }

    pub fn paragraph(mut self, text: impl Into<String>) -> Self {
        self.section = self.section.paragraph(text);
        self
    }

    pub fn picture(mut self, file: &'static str, svg: String, caption: impl Into<String>) -> Self {
        self.section = self.section.figure(svg.clone(), caption);
        self.pictures.push((file, svg));
        self
    }
}

/// A motion, and how it was computed.
pub struct Run<const N: usize> {
    pub motion: Motion<N>,
    element: Element,
    step: f64,
    /// Wall-clock time of the run.
    pub seconds: f64,
}

impl<const N: usize> Run<N> {
    /// Runs from the coordinates and velocities `start` at time 0 to `end`.
    pub fn of<M: Model<N>>(
        model: &M,
        element: impl Into<Element>,
        step: f64,
        start: State<N>,
        end: f64,
    ) -> Result<Self, Box<dyn Error>> {
        let element = element.into();
        let simulation = Simulation::new(model).element(element).step(step);
        let clock = Instant::now();
        let motion = simulation
            .run(start, 0.0..end)
            .map_err(|error| error.to_string())?;
        Ok(Self {
            motion,
            element,
            step,
            seconds: clock.elapsed().as_secs_f64(),
        })
    }

    /// max |q − reference| at the end, over the coordinates for which there is a reference value.
    pub fn error(&self, reference: &[f64]) -> f64 {
        distance(&self.motion.last().q, reference)
    }

    /// The row of the table.
    ///
    /// # Panics
    /// If a constraint is violated, or if the motion differs from the one it is compared with.
    pub fn row(&self, scene: &str, conserved: Energy, error: f64, against: &str) -> [String; 10] {
        let residual = self.motion.constraint_residual();
        // Elements of order two are included for comparison only: their error may be large.
        let allowed = if self.element.order() > 2 { 1e-5 } else { 1e-3 };
        assert!(
            residual.position < 1e-12 && error < allowed,
            "{scene}: |φ| = {:e}, error {error:e}",
            residual.position
        );
        let energy = match conserved {
            Energy::Conserved => format!("{:.1e}", self.motion.energy_error()),
            Energy::Driven => "—".to_owned(),
        };
        [
            scene.to_owned(),
            self.element.to_string(),
            self.step.to_string(),
            (self.motion.states().len() - 1).to_string(),
            power(residual.position),
            power(residual.velocity),
            energy,
            format!("{error:.1e}"),
            against.to_owned(),
            format!("{:.1} ms", 1e3 * self.seconds),
        ]
    }

    /// The coordinates at `count` equally spaced times, including the start and the end.
    pub fn samples(&self, count: usize) -> Result<Vec<[f64; N]>, AtError> {
        self.samples_until(self.motion.last().t, count)
    }

    /// The same for a part of the motion, from its start to a given time.
    pub fn samples_until(&self, end: f64, count: usize) -> Result<Vec<[f64; N]>, AtError> {
        let last = count.saturating_sub(1).max(1);
        let time = |k: usize| {
            if k == last {
                end
            } else {
                end * k as f64 / last as f64
            }
        };
        let nodes = (0..=last).map(|k| self.motion.at(time(k)).map(|node| node.q));
        nodes.collect()
    }

    /// The time of the first node whose coordinates satisfy a condition.
    pub fn first(&self, condition: impl Fn(&[f64; N]) -> bool) -> Option<f64> {
        let mut nodes = self.motion.states().iter();
        nodes.find(|node| condition(&node.q)).map(|node| node.t)
    }
}

/// The size of a residual; exactly zero for models without holonomic constraints.
fn power(residual: f64) -> String {
    if residual == 0.0 {
        "0".to_owned()
    } else {
        format!("{residual:.0e}")
    }
}

/// What the energy of the exact motion does.
#[derive(Clone, Copy)]
pub enum Energy {
    /// It is constant.
    Conserved,
    /// It changes, because something drives the mechanism.
    Driven,
}

/// max |a − b| over the entries that both have. NaN if one of them is (`total_cmp` treats it as the largest number), or
/// if there are none.
pub fn distance(a: &[f64], b: &[f64]) -> f64 {
    let apart = a.iter().zip(b).map(|(a, b)| (a - b).abs());
    apart.max_by(f64::total_cmp).unwrap_or(f64::NAN)
}
