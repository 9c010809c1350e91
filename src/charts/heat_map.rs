//! Heat maps: a value or a class for every cell of a rectangle.

mod image;

use super::axis::Axis;
use super::axis::Extent;
use super::canvas::{self, Anchor, CHARACTER, Canvas, Frame, TEXT, characters, picture, sides};
use super::clip::Point;
use super::colours::Colour;
use super::error::ChartError;
use super::file::{csv_field, csv_number, ending, write};
use super::plot::{KEY, Key, Plot, Room, Side, and_more, draw_ticks, longest, shortened};
use std::fmt::Write;
use std::path::Path;

/// A class of cells, such as “stable”.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Class {
    /// The name of the class, for the legend.
    pub name: String,
    /// The colour of the class.
    pub colour: Colour,
}

impl Class {
    /// A class with this name and colour.
    pub fn new(name: impl Into<String>, colour: Colour) -> Self {
        Self {
            name: name.into(),
            colour,
        }
    }
}

/// The contents of the cells.
#[derive(Clone, Debug)]
enum Cells {
    Values(Vec<Option<f64>>),
    Classes(Vec<Option<u8>>, Vec<Class>),
}

#[derive(Clone, Debug)]
struct Curve {
    name: String,
    points: Vec<Point>,
}

/// A map: a rectangle of cells over two axes, each with a value, shown by a colour scale, or with a class.
///
/// Column 0 is at the left, row 0 at the bottom; cells are equally wide along their axes, also on logarithmic ones.
/// The cells are one image inside the SVG with one byte for each cell, so that a map of a million cells is a file of
/// at most about a megabyte.
///
/// ```
/// use tfe::charts::{Axis, HeatMap};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let centre = |k: usize| -2.0 + 4.0 * (k as f64 + 0.5) / 100.0;
/// let map = HeatMap::new("Saddle", (100, 100), |i, j| Some(centre(i).powi(2) - centre(j).powi(2)))
///     .x(Axis::new("x (m)").range(-2.0..2.0))
///     .y(Axis::new("y (m)").range(-2.0..2.0))
///     .values("height (m)")
///     .curve("x = y", [(-2.0, -2.0), (2.0, 2.0)]);
/// assert!(map.to_svg()?.len() < 20_000);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct HeatMap {
    title: String,
    columns: usize,
    rows: usize,
    cells: Cells,
    x: Axis,
    y: Axis,
    values: Axis,
    curves: Vec<Curve>,
    size: (u32, u32),
}

/// The largest number of cells, 16384²; such a picture fits into memory.
const MAX_CELLS: usize = 1 << 28;
/// The distance of the colour bar from the frame, and its width, in pixels.
const BAR: (f64, f64) = (16.0, 16.0);
/// The height of a line of the legend above the frame, in pixels.
const LINE: f64 = 22.0;
/// The largest left margin of the legend, however wide the row labels are, and its right margin, in pixels.
const STRIP: (f64, f64) = (100.0, 20.0);
/// The width of a legend entry without its name: the key and the gaps, in pixels.
const AROUND_NAME: f64 = KEY + 20.0;

impl HeatMap {
    /// The file name endings that [`HeatMap::save`] supports.
    const ENDINGS: &'static [&'static str] = &[".svg", ".png", ".csv"];

    /// A map of values, of the size (columns, rows); the function returns the value in column i and row j. A cell with
    /// `None`, or with a value that is not finite, is grey.
    pub fn new(
        title: impl Into<String>,
        size: (usize, usize),
        value: impl FnMut(usize, usize) -> Option<f64>,
    ) -> Self {
        Self::of(title.into(), size, Cells::Values(filled(size, value)))
    }

    /// A map of classes: its size (columns, rows), the classes, at most 255, and a function for the index of the class
    /// in column i and row j. A cell with `None`, or with an index that is not one of a class, is grey.
    ///
    /// ```
    /// use tfe::charts::{Class, Colour, HeatMap};
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let classes = vec![Class::new("inside", Colour(0, 114, 178)), Class::new("outside", Colour::WHITE)];
    /// let disc = |i, j| Some(usize::from(i * i + j * j > 50 * 50));
    /// let svg = HeatMap::classes("Quarter disc", (60, 60), classes, disc).to_svg()?;
    /// assert!(svg.contains("inside") && svg.contains("outside"));
    /// # Ok(())
    /// # }
    /// ```
    pub fn classes(
        title: impl Into<String>,
        size: (usize, usize),
        mut classes: Vec<Class>,
        mut class: impl FnMut(usize, usize) -> Option<usize>,
    ) -> Self {
        classes.truncate(usize::from(u8::MAX));
        let known = classes.len();
        let index = |i, j| {
            let index = class(i, j).filter(|index| *index < known)?;
            u8::try_from(index).ok()
        };
        let cells = filled(size, index);
        Self::of(title.into(), size, Cells::Classes(cells, classes))
    }

    fn of(title: String, (columns, rows): (usize, usize), cells: Cells) -> Self {
        Self {
            title,
            columns,
            rows,
            cells,
            x: Axis::default(),
            y: Axis::default(),
            values: Axis::default(),
            curves: Vec::new(),
            size: (720, 440),
        }
    }

    /// Sets the horizontal axis, whose range is that of the cells, edge to edge. Without a range, columns are counted
    /// from 0.
    #[must_use]
    pub fn x(mut self, axis: impl Into<Axis>) -> Self {
        self.x = axis.into();
        self
    }

    /// Sets the vertical axis, whose range is that of the cells, edge to edge. Without a range, rows are counted from
    /// 0.
    #[must_use]
    pub fn y(mut self, axis: impl Into<Axis>) -> Self {
        self.y = axis.into();
        self
    }

    /// Sets the axis of the colours: label, scale, range. Values outside the range have the colour of the nearer end;
    /// on a logarithmic axis, values that are not positive have the colour of the smallest. Maps of classes have no
    /// such axis.
    #[must_use]
    pub fn values(mut self, axis: impl Into<Axis>) -> Self {
        self.values = axis.into();
        self
    }

    /// Adds a curve through the points (x, y), drawn over the cells and cut at the frame.
    #[must_use]
    pub fn curve(
        mut self,
        name: impl Into<String>,
        points: impl IntoIterator<Item = (f64, f64)>,
    ) -> Self {
        self.curves.push(Curve {
            name: name.into(),
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

    /// The map as an SVG picture.
    ///
    /// # Errors
    /// [`ChartError::NoData`] if there are no cells, or no finite value to determine the range of the colours;
    /// [`ChartError::TooManyCells`]; [`ChartError::Range`] and [`ChartError::NotPositive`] for an invalid axis.
    pub fn to_svg(&self) -> Result<String, ChartError> {
        let (x, y) = self.extents()?;
        let bar = self.colour_bar()?;
        let strip = self.strip();
        let room = Room {
            sides: self.size,
            above: LINE * strip.len() as f64,
            right: bar.as_ref().map_or(24.0, ColourBar::width),
        };
        let plot = Plot::new(x, y, &self.title, &room);
        let mut below = canvas::image(&self.to_png()?, &plot.frame);
        if let Some(bar) = &bar {
            below += &canvas::image(&image::scale()?, &bar.frame(&plot.frame));
        }
        picture(self.size, &below, |canvas| {
            for (k, curve) in self.curves.iter().enumerate() {
                draw_curve(canvas, &plot, curve, curve_key(k))?;
            }
            plot.draw_axes(canvas, &self.title)?;
            let left = plot.frame.left.min(STRIP.0);
            let top = plot.frame.top - LINE * strip.len() as f64;
            for (k, line) in strip.iter().enumerate() {
                let y = top + LINE * (k as f64 + 0.5) - 4.0;
                for (x, (name, key)) in line {
                    let at = (left + x, y);
                    match key {
                        Some(key) => key.draw_entry(canvas, name, at)?,
                        None => canvas.text(name, at, Anchor::Left, TEXT)?,
                    }
                }
            }
            bar.iter().try_for_each(|bar| bar.draw(canvas, &plot))
        })
    }

    /// The cells as a PNG image with one pixel for each cell, without axes; the last row is at the top.
    ///
    /// # Errors
    /// Those of [`HeatMap::to_svg`] for cells and colours.
    pub fn to_png(&self) -> Result<Vec<u8>, ChartError> {
        self.check_cells()?;
        let (palette, index): (Vec<Colour>, Box<dyn Fn(usize) -> u8 + '_>) = match &self.cells {
            Cells::Values(values) => {
                let extent = self.value_extent(values)?;
                let index = move |k: usize| image::level_of(values[k], &extent);
                (image::levels(), Box::new(index))
            }
            Cells::Classes(indices, classes) => {
                let mut palette: Vec<_> = classes.iter().map(|class| class.colour).collect();
                let missing = palette.len() as u8;
                palette.push(Colour::GREY);
                let index = move |k: usize| indices[k].unwrap_or(missing);
                (palette, Box::new(index))
            }
        };
        // From the top row downward.
        let pixels: Vec<u8> = (0..self.rows)
            .rev()
            .flat_map(|j| (0..self.columns).map(move |i| j * self.columns + i))
            .map(index)
            .collect();
        image::encode((self.columns, self.rows), &palette, &pixels)
    }

    /// The cells as CSV: a header, then x, y and value at the centre of each cell, row by row from the bottom. Without
    /// a value, the field is empty.
    ///
    /// # Errors
    /// Those of [`HeatMap::to_svg`] for cells and axes.
    pub fn to_csv(&self) -> Result<String, ChartError> {
        let (x, y) = self.extents()?;
        let centre = |k: usize, count: usize| (k as f64 + 0.5) / count as f64;
        let xs: Vec<_> = (0..self.columns)
            .map(|i| csv_number(Some(x.value(centre(i, self.columns)))))
            .collect();
        let mut text = String::from("x,y,value\n");
        for j in 0..self.rows {
            let y = csv_number(Some(y.value(centre(j, self.rows))));
            for (i, x) in xs.iter().enumerate() {
                let value = self.field(j * self.columns + i);
                // Writing to a string cannot fail.
                let _ = writeln!(text, "{x},{y},{value}");
            }
        }
        Ok(text)
    }

    fn field(&self, k: usize) -> String {
        match &self.cells {
            Cells::Values(values) => csv_number(values[k]),
            Cells::Classes(indices, classes) => indices[k].map_or_else(String::new, |index| {
                csv_field(&classes[usize::from(index)].name)
            }),
        }
    }

    /// Writes a file: the picture as `.svg`, the cells as pixels in a `.png`, or as numbers (x, y, value) in a `.csv`.
    ///
    /// # Errors
    /// Those of [`HeatMap::to_svg`]; [`ChartError::UnknownEnding`] for another ending; [`ChartError::Io`] if the file
    /// cannot be written.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), ChartError> {
        let path = path.as_ref();
        match ending(path, Self::ENDINGS)? {
            ".png" => write(path, self.to_png()?),
            ".csv" => write(path, self.to_csv()?),
            _ => write(path, self.to_svg()?),
        }
    }

    fn check_cells(&self) -> Result<(), ChartError> {
        let (columns, rows) = (self.columns, self.rows);
        if columns == 0 || rows == 0 {
            return Err(ChartError::NoData);
        }
        if is_too_large((columns, rows)) {
            return Err(ChartError::TooManyCells { columns, rows });
        }
        Ok(())
    }

    fn extents(&self) -> Result<(Extent, Extent), ChartError> {
        self.check_cells()?;
        let extent = |axis: &Axis, count: usize| {
            // Indices of cells begin at zero.
            axis.check_start(0.0)?;
            axis.extent([0.0, count as f64].into_iter(), 0.0)
        };
        let x = extent(&self.x, self.columns)?;
        let y = extent(&self.y, self.rows)?;
        Ok((x, y))
    }

    fn value_extent(&self, values: &[Option<f64>]) -> Result<Extent, ChartError> {
        self.values.extent(values.iter().flatten().copied(), 0.0)
    }

    fn colour_bar(&self) -> Result<Option<ColourBar>, ChartError> {
        let Cells::Values(values) = &self.cells else {
            return Ok(None);
        };
        let extent = self.value_extent(values)?;
        let ticks = extent.ticks((f64::from(self.size.1) / 60.0) as usize);
        Ok(Some(ColourBar { extent, ticks }))
    }

    /// The legend above the frame, line by line. Entries that do not fit are counted.
    fn strip(&self) -> Vec<Vec<Placed>> {
        let width = f64::from(self.size.0) - STRIP.0 - STRIP.1;
        // More lines would leave no room for the map.
        let most = (f64::from(self.size.1) / 4.0 / LINE) as usize;
        let longest = (((width - AROUND_NAME) / CHARACTER) as usize).min(40);
        let entries: Vec<Entry> = self
            .entries()
            .into_iter()
            .filter(|(name, _)| !name.is_empty())
            .map(|(name, key)| (shortened(&name, longest), Some(key)))
            .collect();
        let lines = in_lines(&entries, width);
        if lines.len() <= most {
            return lines;
        }
        // Even with empty names no more entries would fit.
        let room = most * (width / AROUND_NAME).ceil() as usize;
        (0..entries.len().min(room))
            .rev()
            .map(|shown| {
                let mut fewer = entries[..shown].to_vec();
                fewer.push((and_more(entries.len() - shown), None));
                in_lines(&fewer, width)
            })
            .find(|lines| lines.len() <= most)
            .unwrap_or_default()
    }

    /// The entries of the legend: classes, cells without a value, curves.
    fn entries(&self) -> Vec<(String, Key)> {
        let mut entries = Vec::new();
        if let Cells::Classes(_, classes) = &self.cells {
            let entry = |class: &Class| (class.name.clone(), Key::Area(class.colour));
            entries.extend(classes.iter().map(entry));
        }
        if self.has_missing() {
            entries.push(("no value".to_owned(), Key::Area(Colour::GREY)));
        }
        for (k, curve) in self.curves.iter().enumerate() {
            entries.push((curve.name.clone(), curve_key(k)));
        }
        entries
    }

    fn has_missing(&self) -> bool {
        match &self.cells {
            Cells::Values(values) => !values.iter().all(|one| one.is_some_and(f64::is_finite)),
            Cells::Classes(indices, _) => indices.iter().any(Option::is_none),
        }
    }
}

/// The name and the key of a legend entry; the entry that counts omitted ones has no key.
type Entry = (String, Option<Key>);
/// A legend entry with its horizontal position, in pixels.
type Placed = (f64, Entry);

/// Distributes entries over lines of a given width.
fn in_lines(entries: &[Entry], width: f64) -> Vec<Vec<Placed>> {
    let mut lines: Vec<Vec<Placed>> = Vec::new();
    let mut used = f64::INFINITY;
    for entry in entries {
        let own = AROUND_NAME + CHARACTER * characters(&entry.0) as f64;
        if used + own > width {
            lines.push(Vec::new());
            used = 0.0;
        }
        if let Some(line) = lines.last_mut() {
            line.push((used, entry.clone()));
        }
        used += own;
    }
    lines
}

fn is_too_large((columns, rows): (usize, usize)) -> bool {
    columns
        .checked_mul(rows)
        .is_none_or(|cells| cells > MAX_CELLS)
}

/// The cells row by row from the bottom; empty if there are too many, which is reported later.
fn filled<T>(
    size: (usize, usize),
    mut cell: impl FnMut(usize, usize) -> Option<T>,
) -> Vec<Option<T>> {
    if is_too_large(size) {
        return Vec::new();
    }
    let (columns, rows) = size;
    let mut cells = Vec::with_capacity(columns * rows);
    for j in 0..rows {
        cells.extend((0..columns).map(|i| cell(i, j)));
    }
    cells
}

/// Black and colours that are visible on most images, in turn.
fn curve_key(k: usize) -> Key {
    const COLOURS: [Colour; 4] = [
        Colour::BLACK,
        Colour(213, 94, 0),
        Colour(204, 121, 167),
        Colour(0, 114, 178),
    ];
    Key::Outlined(COLOURS[k % COLOURS.len()])
}

fn draw_curve(canvas: &Canvas<'_>, plot: &Plot, curve: &Curve, key: Key) -> Result<(), ChartError> {
    for line in plot.lines(&curve.points) {
        key.draw_line(canvas, &line)?;
    }
    for at in plot.alone(&curve.points) {
        key.draw_dot(canvas, at)?;
    }
    Ok(())
}

/// The colour scale, to the right of the frame.
struct ColourBar {
    extent: Extent,
    ticks: Vec<super::axis::Tick>,
}

impl ColourBar {
    fn width(&self) -> f64 {
        BAR.0 + BAR.1 + 40.0 + CHARACTER * longest(&self.ticks) as f64
    }

    fn frame(&self, map: &Frame) -> Frame {
        Frame {
            left: map.right + BAR.0,
            right: map.right + BAR.0 + BAR.1,
            ..*map
        }
    }

    fn draw(&self, canvas: &Canvas<'_>, plot: &Plot) -> Result<(), ChartError> {
        let frame = self.frame(&plot.frame);
        canvas.border(&frame, Colour::BLACK)?;
        draw_ticks(canvas, frame.right, &frame, &self.ticks, Side::Right)?;
        let x = plot.frame.right + self.width() - 14.0;
        plot.draw_upwards(canvas, &self.extent.label, x)
    }
}

#[cfg(test)]
mod tests;
