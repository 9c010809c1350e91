//! The errors of charts.

use crate::numbers::Short;
use std::error::Error;
use std::fmt;
use std::io;
use std::path::PathBuf;

/// Why a picture could not be made or written.
#[derive(Debug)]
#[non_exhaustive]
pub enum ChartError {
    /// The file could not be written.
    Io {
        /// The path of the file.
        path: PathBuf,
        /// The error of the file system.
        source: io::Error,
    },
    /// The ending of the file name is not one of the supported formats.
    UnknownEnding {
        /// The path of the file.
        path: PathBuf,
        /// The supported endings.
        known: &'static [&'static str],
    },
    /// There is nothing to draw: no point, or no cell, has finite numbers.
    NoData,
    /// The ends of a range are not finite or not ascending.
    Range {
        /// The label of the axis.
        axis: String,
        /// The start asked for.
        start: f64,
        /// The end asked for.
        end: f64,
    },
    /// A logarithmic axis would begin at or below zero: because of its range, or because no number is positive.
    NotPositive {
        /// The label of the axis.
        axis: String,
    },
    /// The picture would have more cells than one picture can hold.
    TooManyCells {
        /// Cells in a row.
        columns: usize,
        /// Rows.
        rows: usize,
    },
    /// A figure of a page is not an SVG picture.
    NotSvg {
        /// The caption of the figure.
        caption: String,
    },
    /// The drawing library failed.
    Drawing {
        /// Its reason.
        source: Box<dyn Error + Send + Sync>,
    },
}

impl fmt::Display for ChartError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Io { path, source } => write!(f, "cannot write {}: {source}", path.display()),
            Self::UnknownEnding { path, known } => {
                let known = known.join(" or ");
                write!(
                    f,
                    "cannot tell what to write into {}: its name should end in {known}",
                    path.display()
                )
            }
            Self::NoData => f.write_str("there is nothing to draw: no finite numbers were given"),
            Self::Range { axis, start, end } => {
                let (start, end) = (Short(*start), Short(*end));
                write!(
                    f,
                    "the axis “{axis}” cannot go from {start} to {end}: both must be finite, the end above the start"
                )
            }
            Self::NotPositive { axis } => write!(
                f,
                "the axis “{axis}” is logarithmic, but there are no positive numbers on it or its range begins at or below zero"
            ),
            Self::TooManyCells { columns, rows } => {
                write!(
                    f,
                    "a map of {columns} × {rows} cells is too large for a picture: use fewer cells"
                )
            }
            Self::NotSvg { caption } => {
                write!(
                    f,
                    "the figure “{caption}” is not an SVG picture: it must be one `<svg>` element"
                )
            }
            Self::Drawing { source } => write!(f, "the picture could not be drawn: {source}"),
        }
    }
}

impl Error for ChartError {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        match self {
            Self::Io { source, .. } => Some(source),
            Self::Drawing { source } => Some(source.as_ref()),
            _ => None,
        }
    }
}
