//! Results of model comparisons as text, tables and files.

use super::ladder::{Choice, Ladder, Rung, RungPoint};
#[cfg(feature = "charts")]
use crate::charts::{Chart, ChartError, Section};
use crate::work_precision::SaveError;
use crate::work_precision::output::{Report, number, quoted};
use std::fmt;
use std::path::Path;

#[cfg(feature = "charts")]
mod pictures;

/// The columns of the table of all runs.
const HEADER: &str = "rung,element,step,error,distance,model_error,seconds,repetitions,steps,iterations,evaluations,on_front,failure\n";

impl Ladder {
    /// Writes a file: a chart (cost against error, both logarithmic) as `.svg`, all numbers as `.csv`, or chart and
    /// table of choices as a page `.html`.
    ///
    /// # Errors
    /// [`SaveError::UnknownEnding`] for another ending, [`SaveError::Io`] if the file cannot be written,
    /// [`SaveError::NoCharts`] for pictures without the feature `charts`, [`SaveError::Chart`] if there is nothing to
    /// draw.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), SaveError> {
        self.save_as(path.as_ref())
    }

    /// All runs as CSV: a header, then one line for each run; runs that failed have their error in the last column.
    /// Numbers read back exactly; a value that is not finite, or was not measured, is an empty field.
    pub fn to_csv(&self) -> String {
        let mut text = String::from(HEADER);
        for rung in &self.rungs {
            let front = rung.front(self.cost);
            for point in &rung.points {
                text += &line(rung, point, &front);
            }
        }
        text
    }

    /// The choice for an accuracy: rung, element, step, error, time; or why there is none.
    fn row(&self, accuracy: f64) -> [String; 6] {
        let asked = format!("{:e}", rounded(accuracy));
        match self.cheapest(accuracy) {
            Some(one) => [
                asked,
                one.rung.clone(),
                one.element.to_string(),
                shortened(one.step),
                format!("{:.1e}", one.error),
                time(one.seconds),
            ],
            None => {
                let why = if self.is_known(accuracy) {
                    "none is so accurate"
                } else {
                    "not known"
                };
                let dash = || "—".to_owned();
                [asked, why.to_owned(), dash(), dash(), dash(), dash()]
            }
        }
    }
}

impl fmt::Display for Ladder {
    /// Writes a line for each accuracy, then the errors of the models and of the reference.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut rows = vec![HEADINGS.map(str::to_owned)];
        rows.extend(self.accuracies.iter().map(|accuracy| self.row(*accuracy)));
        let mut widths = [0; HEADINGS.len()];
        for row in &rows {
            for (width, cell) in widths.iter_mut().zip(row) {
                *width = cell.chars().count().max(*width);
            }
        }
        for row in &rows {
            let cells = row.iter().zip(widths);
            let cells: Vec<String> = cells
                .map(|(cell, width)| format!("{cell:<width$}"))
                .collect();
            writeln!(f, "{}", cells.join("  ").trim_end())?;
        }
        for rung in &self.rungs {
            if let Some(error) = rung.model_error {
                writeln!(f, "error of the model `{}`: {error:.1e}", rung.name)?;
            }
        }
        write!(f, "reference: {}", self.reference)
    }
}

const HEADINGS: [&str; 6] = ["accuracy", "rung", "element", "step", "error", "time"];

/// Seconds, in a unit in which they are a short number.
fn time(seconds: f64) -> String {
    if seconds >= 1.0 {
        format!("{seconds:.2} s")
    } else if seconds >= 1e-3 {
        format!("{:.2} ms", 1e3 * seconds)
    } else {
        format!("{:.2} µs", 1e6 * seconds)
    }
}

/// Rounds to four digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

/// Four digits, in the shorter notation.
fn shortened(value: f64) -> String {
    let rounded = rounded(value);
    if (1e-4..1e5).contains(&rounded) {
        rounded.to_string()
    } else {
        format!("{rounded:e}")
    }
}

fn line(rung: &Rung, point: &RungPoint, front: &[&Choice]) -> String {
    let mut fields = vec![
        quoted(&rung.name),
        point.element.to_string(),
        number(point.step),
    ];
    match &point.outcome {
        Ok(choice) => {
            let on_front = front.iter().any(|other| std::ptr::eq(*other, choice));
            fields.extend([
                number(choice.error),
                number(choice.distance),
                rung.model_error.map_or_else(String::new, number),
                number(choice.seconds),
                choice.repetitions.to_string(),
                choice.statistics.steps.to_string(),
                choice.statistics.iterations.to_string(),
                choice.evaluations.to_string(),
                on_front.to_string(),
                String::new(),
            ]);
        }
        Err(kind) => {
            let empty = HEADER.split(',').count() - fields.len() - 1;
            fields.extend(vec![String::new(); empty]);
            fields.push(quoted(&kind.to_string()));
        }
    }
    fields.join(",") + "\n"
}

impl Report for Ladder {
    #[cfg(feature = "charts")]
    fn title(&self) -> &str {
        &self.title
    }

    fn csv(&self) -> String {
        self.to_csv()
    }

    #[cfg(feature = "charts")]
    fn picture(&self) -> Chart {
        self.chart()
    }

    #[cfg(feature = "charts")]
    fn part(&self) -> Result<Section, ChartError> {
        self.section()
    }
}
