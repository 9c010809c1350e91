//! Charts without other programs: line charts, maps over two parameters, and HTML pages. Feature `charts`, on by
//! default.
//!
//! * [`Chart`]: curves over one axis, as SVG or as CSV;
//! * [`HeatMap`]: a value or a class in every cell of a rectangle, as SVG, PNG or CSV;
//! * [`Page`]: one HTML file of text, tables and pictures.
//!
//! ```
//! use tfe::charts::{Axis, Chart, Scale, Style};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let errors = [0.4_f64, 0.2, 0.1, 0.05].map(|h| (h, h.powi(4)));
//! let svg = Chart::new("Order of accuracy")
//!     .x(Axis::new("step (s)").scale(Scale::Logarithmic))
//!     .y(Axis::new("error (rad)").scale(Scale::Logarithmic))
//!     .series("three nodes", Style::LineWithMarkers, errors)
//!     .to_svg()?;
//! assert!(svg.starts_with("<svg") && svg.contains("Order of accuracy"));
//! # Ok(())
//! # }
//! ```
//!
//! The pictures have no `id`s, scripts, style sheets or links, so that several of them can be put into one document.

mod axis;
mod canvas;
mod clip;
mod colours;
mod error;
mod file;
mod heat_map;
mod line_chart;
mod page;
mod plot;

pub use axis::{Axis, Scale};
pub use colours::Colour;
pub use error::ChartError;
pub use heat_map::{Class, HeatMap};
pub use line_chart::{Chart, Style};
pub use page::{Page, Section};
