//! Line charts.

use super::axis::Axis;
use super::canvas::{Anchor, CHARACTER, Canvas, Shape, TEXT, characters, picture, sides};
use super::clip::Point;
use super::colours::Colour;
use super::error::ChartError;
use super::file::{csv_field, csv_number, ending, write};
use super::plot::{KEY, Key, Plot, Room, and_more, shortened};
use std::path::Path;

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Style {
    /// A line through the points.
    #[default]
    Line,
    /// A line, and a marker at every point.
    LineWithMarkers,
    /// A marker at every point.
    Markers,
    /// A grey dashed line, for a reference with which others are compared.
    Reference,
}

#[derive(Clone, Debug)]
struct Series {
    name: String,
    style: Style,
    points: Vec<Point>,
}

/// A line chart: curves in a frame with two axes.
///
/// A point with a coordinate that is not finite, or not positive on a logarithmic axis, makes a gap in its curve; a
/// single point between two gaps is a dot. What lies outside a range is cut off at the frame. The legend is beside the
/// frame. The colours can be told apart with colour blindness, the markers without colours.
///
/// ```
/// use tfe::charts::{Axis, Chart, Style};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let times: Vec<f64> = (0..=100).map(|k| 0.1 * f64::from(k)).collect();
/// let chart = Chart::new("Two oscillators")
///     .x("t (s)")
///     .y(Axis::new("x (m)").range(-1.5..1.5))
///     .line("undamped", times.iter().map(|t| (*t, t.cos())))
///     .line("damped", times.iter().map(|t| (*t, (-0.2 * t).exp() * t.cos())))
///     .series("rest", Style::Reference, [(0.0, 0.0), (10.0, 0.0)]);
/// # let folder = std::env::temp_dir().join(format!("tfe-chart-{}", std::process::id()));
/// # std::fs::create_dir_all(&folder)?;
/// # let (svg, csv) = (folder.join("oscillators.svg"), folder.join("oscillators.csv"));
/// # /*
/// chart.save("oscillators.svg")?;
/// chart.save("oscillators.csv")?; // the points: series, x, y
/// # */
/// # chart.save(&svg)?;
/// # chart.save(&csv)?;
/// # assert!(std::fs::read_to_string(&csv)?.starts_with("series,x,y\nundamped,0.0,1.0\n"));
/// # std::fs::remove_dir_all(&folder)?;
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Chart {
    title: String,
    x: Axis,
    y: Axis,
    series: Vec<Series>,
    size: (u32, u32),
}

impl Chart {
    /// An empty chart of 720 × 440 pixels with this title, which may be empty.
    pub fn new(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            x: Axis::default(),
            y: Axis::default(),
            series: Vec::new(),
            size: (720, 440),
        }
    }

    /// Sets the horizontal axis: a label, or an [`Axis`].
    #[must_use]
    pub fn x(mut self, axis: impl Into<Axis>) -> Self {
        self.x = axis.into();
        self
    }

    /// Sets the vertical axis: a label, or an [`Axis`].
    #[must_use]
    pub fn y(mut self, axis: impl Into<Axis>) -> Self {
        self.y = axis.into();
        self
    }

    /// Adds a line through the points (x, y), in their order.
    #[must_use]
    pub fn line(
        self,
        name: impl Into<String>,
        points: impl IntoIterator<Item = (f64, f64)>,
    ) -> Self {
        self.series(name, Style::Line, points)
    }

    /// Adds a series of points (x, y) in a style. A series with an empty name is not in the legend.
    #[must_use]
    pub fn series(
        mut self,
        name: impl Into<String>,
        style: Style,
        points: impl IntoIterator<Item = (f64, f64)>,
    ) -> Self {
        self.series.push(Series {
            name: name.into(),
            style,
            points: points.into_iter().collect(),
        });
        self
    }

    /// Sets the width and height of the picture, in pixels, each from 240 to 8000; values outside are replaced by the
    /// nearer end.
    #[must_use]
    pub fn size(mut self, width: u32, height: u32) -> Self {
        self.size = sides(width, height);
        self
    }

    /// The chart as an SVG picture.
    ///
    /// # Errors
    /// [`ChartError::NoData`] if no point is finite; [`ChartError::Range`] and [`ChartError::NotPositive`] for an
    /// invalid axis.
    pub fn to_svg(&self) -> Result<String, ChartError> {
        let points = self.points_to_fit();
        if points.is_empty() {
            return Err(ChartError::NoData);
        }
        let x = self.x.extent(points.iter().map(|point| point.0), 0.03)?;
        let y = self.y.extent(points.iter().map(|point| point.1), 0.05)?;
        let legend = self.legend();
        let mut room = Room {
            sides: self.size,
            above: 0.0,
            right: 0.0,
        };
        let (top, bottom) = room.top_and_bottom(&self.title);
        room.right = legend.width(bottom - top);
        let plot = Plot::new(x, y, &self.title, &room);
        picture(self.size, "", |canvas| {
            plot.draw_grid(canvas)?;
            for (series, key) in self.series.iter().zip(self.keys()) {
                draw_series(canvas, &plot, series, key)?;
            }
            plot.draw_axes(canvas, &self.title)?;
            legend.draw(
                canvas,
                (plot.frame.right, plot.frame.top),
                plot.frame.height(),
            )
        })
    }

    /// Writes a file: the picture as `.svg`, or the points (series, x, y) as `.csv`.
    ///
    /// # Errors
    /// Those of [`Chart::to_svg`]; [`ChartError::UnknownEnding`] for another ending; [`ChartError::Io`] if the file
    /// cannot be written.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), ChartError> {
        let path = path.as_ref();
        match ending(path, &[".svg", ".csv"])? {
            ".csv" => write(path, self.to_csv()),
            _ => write(path, self.to_svg()?),
        }
    }

    /// The points as CSV: a header, then series, x and y of each point. A number that is not finite is an empty field.
    pub fn to_csv(&self) -> String {
        let mut text = String::from("series,x,y\n");
        for series in &self.series {
            let name = csv_field(&series.name);
            for &(x, y) in &series.points {
                let (x, y) = (csv_number(Some(x)), csv_number(Some(y)));
                text.extend([&name, ",", &x, ",", &y, "\n"]);
            }
        }
        text
    }

    /// The points that can be shown on both axes, so that a point missing on one axis does not extend the other. If
    /// there are none, all finite points, so that the axis that cannot show them reports it.
    fn points_to_fit(&self) -> Vec<Point> {
        let all = self.series.iter().flat_map(|series| &series.points);
        let finite = all.filter(|(x, y)| x.is_finite() && y.is_finite());
        let finite: Vec<Point> = finite.copied().collect();
        let drawn = finite
            .iter()
            .filter(|(x, y)| self.x.holds(*x) && self.y.holds(*y));
        let drawn: Vec<Point> = drawn.copied().collect();
        if drawn.is_empty() { finite } else { drawn }
    }

    /// The drawing style of each series. Reference lines do not use up colours.
    fn keys(&self) -> Vec<Key> {
        let mut coloured = 0..;
        let key = |series: &Series| {
            if series.style == Style::Reference {
                return Key::Dashes(Colour::DARK_GREY);
            }
            let k = coloured.next().unwrap_or_default();
            let (colour, shape) = (Colour::of_series(k), Shape::of_series(k));
            match series.style {
                Style::LineWithMarkers => Key::LineWithMarkers(colour, shape),
                Style::Markers => Key::Markers(colour, shape),
                Style::Line | Style::Reference => Key::Line(colour),
            }
        };
        self.series.iter().map(key).collect()
    }

    fn legend(&self) -> Legend {
        // At most about a third of the picture.
        let most = (f64::from(self.size.0) / 3.0 / CHARACTER) as usize;
        let names = self
            .series
            .iter()
            .map(|series| shortened(&series.name, most));
        let entries = names.zip(self.keys());
        Legend {
            entries: entries.filter(|(name, _)| !name.is_empty()).collect(),
        }
    }
}

fn draw_series(
    canvas: &Canvas<'_>,
    plot: &Plot,
    series: &Series,
    key: Key,
) -> Result<(), ChartError> {
    for line in plot.lines(&series.points) {
        key.draw_line(canvas, &line)?;
    }
    for at in plot.alone(&series.points) {
        key.draw_dot(canvas, at)?;
    }
    for at in plot.markers(&series.points) {
        key.draw_marker(canvas, at)?;
    }
    Ok(())
}

/// The names and the styles of the series, beside the frame.
struct Legend {
    entries: Vec<(String, Key)>,
}

impl Legend {
    /// The gap between the frame and the legend, in pixels.
    const GAP: f64 = 14.0;
    const LINE: f64 = 20.0;

    /// The width of the legend beside a frame of a given height.
    fn width(&self, height: f64) -> f64 {
        let long = |text: &str| CHARACTER * characters(text) as f64;
        let entries = self.entries.iter().map(|(name, _)| KEY + long(name));
        let Some(entries) = entries.reduce(f64::max) else {
            return 24.0;
        };
        let rest = match self.entries.len() - self.shown(height) {
            0 => 0.0,
            more => long(&and_more(more)),
        };
        Self::GAP + 14.0 + entries.max(rest)
    }

    /// The number of entries that fit beside a frame of a given height; one less if not all fit.
    fn shown(&self, height: f64) -> usize {
        let most = (height / Self::LINE) as usize;
        if self.entries.len() <= most {
            self.entries.len()
        } else {
            most.saturating_sub(1)
        }
    }

    /// Draws the legend from its upper left corner; entries that do not fit are counted.
    fn draw(&self, canvas: &Canvas<'_>, (left, top): Point, height: f64) -> Result<(), ChartError> {
        let shown = self.shown(height);
        let at = |k: usize| (left + Self::GAP, top + Self::LINE * (k as f64 + 0.5));
        for (k, (name, key)) in self.entries.iter().take(shown).enumerate() {
            key.draw_entry(canvas, name, at(k))?;
        }
        match self.entries.len() - shown {
            0 => Ok(()),
            more => canvas.text(&and_more(more), at(shown), Anchor::Left, TEXT),
        }
    }
}

#[cfg(test)]
mod tests;
