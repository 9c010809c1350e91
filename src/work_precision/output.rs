//! Results written to files.

use super::error::SaveError;
use super::measurements::Measurements;
use super::peer::PeerPoint;
use super::point::{Measured, Point};
#[cfg(feature = "charts")]
use crate::charts::{Chart, ChartError, Page, Section};
use std::fs;
use std::path::Path;

#[cfg(feature = "charts")]
mod pictures;

/// The columns of the table.
const HEADER: &str = "element,nodes,points,order,solver,step,tolerance,error_q,error_p,max_error_q,max_error_p,energy_error,\
constraint_position,constraint_velocity,seconds,repetitions,steps,iterations,fixed_point_iterations,newton_iterations,\
residual_evaluations,tangent_evaluations,factorizations,at_reference_floor,on_front,failure\n";

impl Measurements {
    /// Writes a file: a chart (error against cost, both logarithmic) as `.svg`, all numbers as `.csv`, or chart and
    /// table as a page `.html`.
    ///
    /// # Errors
    /// [`SaveError::UnknownEnding`] for another ending, [`SaveError::Io`] if the file cannot be written,
    /// [`SaveError::NoCharts`] for pictures without the feature `charts`, [`SaveError::Chart`] if there is nothing to
    /// draw.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), SaveError> {
        self.save_as(path.as_ref())
    }

    /// All points as CSV: a header, then one line for each run; runs that failed have their error in the last column.
    /// Numbers read back exactly; a value that is not finite, or was not measured, is an empty field. Runs of other
    /// integrators follow, with their name as the element, `peer` as the solver, their setting as the step, and their
    /// evaluations as those of the residual.
    pub fn to_csv(&self) -> String {
        let front = self.front();
        let mut text = String::from(HEADER);
        for point in self.points() {
            let on_front = front.iter().any(|other| std::ptr::eq(*other, point));
            text += &line(point, on_front);
        }
        for peer in &self.peers {
            for point in &peer.points {
                text += &line_of_peer(peer.name(), point);
            }
        }
        text
    }
}

impl Report for Measurements {
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

/// Results that can be written as a table, a chart or a page.
pub(crate) trait Report {
    /// The title of a page.
    #[cfg(feature = "charts")]
    fn title(&self) -> &str;

    /// The table.
    fn csv(&self) -> String;

    /// The chart.
    #[cfg(feature = "charts")]
    fn picture(&self) -> Chart;

    /// The section of a page: chart and table.
    #[cfg(feature = "charts")]
    fn part(&self) -> Result<Section, ChartError>;

    /// Writes the format that the ending of the file name asks for.
    fn save_as(&self, path: &Path) -> Result<(), SaveError> {
        const KNOWN: &[&str] = &[".svg", ".csv", ".html"];
        let ending = path.extension().map(std::ffi::OsStr::to_ascii_lowercase);
        let ending = ending.as_ref().and_then(|ending| ending.to_str());
        match ending {
            Some("csv") => fs::write(path, self.csv()).map_err(|source| SaveError::Io {
                path: path.to_owned(),
                source,
            }),
            #[cfg(feature = "charts")]
            Some("svg") => Ok(self.picture().save(path)?),
            #[cfg(feature = "charts")]
            Some("html" | "htm") => {
                let page = Page::new(self.title()).section(self.part()?);
                Ok(page.save(path)?)
            }
            #[cfg(not(feature = "charts"))]
            Some("svg" | "html" | "htm") => Err(SaveError::NoCharts {
                path: path.to_owned(),
            }),
            _ => Err(SaveError::UnknownEnding {
                path: path.to_owned(),
                known: KNOWN,
            }),
        }
    }
}

/// A line of the table for another integrator; columns that it does not have are empty.
fn line_of_peer(name: &str, point: &PeerPoint) -> String {
    let value = |column: &str| match (column, &point.outcome) {
        ("element", _) => quoted(name),
        ("solver", _) => "peer".to_owned(),
        ("step", _) => number(point.setting),
        ("failure", Err(failure)) => quoted(failure),
        ("error_q", Ok(one)) => number(one.error_q),
        ("error_p", Ok(one)) => number(one.error_p),
        ("seconds", Ok(one)) => number(one.seconds),
        ("repetitions", Ok(one)) => one.repetitions.to_string(),
        ("residual_evaluations", Ok(one)) if one.evaluations > 0 => one.evaluations.to_string(),
        ("at_reference_floor", Ok(one)) => one.at_reference_floor.to_string(),
        _ => String::new(),
    };
    let fields: Vec<String> = HEADER.trim_end().split(',').map(value).collect();
    fields.join(",") + "\n"
}

fn line(point: &Point, on_front: bool) -> String {
    let element = point.element;
    let mut fields = vec![
        element.to_string(),
        element.nodes().to_string(),
        element.points().to_string(),
        element.order().to_string(),
        format!("{:?}", point.solve),
        number(point.step),
        number(point.tolerance),
    ];
    match &point.outcome {
        Ok(measured) => {
            fields.extend(figures(measured));
            fields.extend([
                measured.at_reference_floor.to_string(),
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

fn figures(measured: &Measured) -> Vec<String> {
    let statistics = &measured.statistics;
    let numbers = [
        measured.error_q,
        measured.error_p,
        measured.max_error_q,
        measured.max_error_p,
        measured.energy_error,
        measured.constraint_position,
        measured.constraint_velocity,
        measured.seconds,
    ];
    let counts = [
        u64::from(measured.repetitions),
        statistics.steps,
        statistics.iterations,
        statistics.fixed_point_iterations,
        statistics.newton_iterations,
        statistics.residual_evaluations,
        statistics.tangent_evaluations,
        statistics.factorizations,
    ];
    let mut fields: Vec<_> = numbers.into_iter().map(number).collect();
    fields.extend(counts.iter().map(ToString::to_string));
    fields
}

/// A number in the shortest form that reads back exactly.
pub(crate) fn number(value: f64) -> String {
    if value.is_finite() {
        format!("{value:?}")
    } else {
        String::new()
    }
}

/// A text that may contain commas, quoted.
pub(crate) fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "\"\"").replace('\n', " "))
}
