//! The common parts of pictures with two axes: title, frame, ticks, labels and legend.

use super::axis::{Extent, Tick};
use super::canvas::{Anchor, CHARACTER, Canvas, Frame, Shape, TEXT, characters, characters_of};
use super::clip::{self, Point};
use super::colours::Colour;
use super::error::ChartError;

/// The length of a labelled tick, in pixels.
const TICK: f64 = 5.0;
/// The font size of the title.
const TITLE: f64 = 16.0;
/// The least distance of a title or a label from the side of the picture, in pixels.
const BESIDE_TEXT: f64 = 4.0;

/// Two axes around a frame.
pub(super) struct Plot {
    pub(super) frame: Frame,
    pub(super) x: Extent,
    pub(super) y: Extent,
    x_ticks: Vec<Tick>,
    y_ticks: Vec<Tick>,
    /// The size of the picture, in pixels.
    sides: (f64, f64),
}

/// The space that a picture needs around its frame, in pixels.
pub(super) struct Room {
    /// The size of the picture.
    pub(super) sides: (u32, u32),
    /// Above the frame, in addition to the title.
    pub(super) above: f64,
    /// To the right of the frame.
    pub(super) right: f64,
}

impl Room {
    /// The y of the top and of the bottom of the frame, in pixels.
    pub(super) fn top_and_bottom(&self, title: &str) -> (f64, f64) {
        let top = if title.is_empty() { 14.0 } else { 42.0 } + self.above;
        let bottom = f64::from(self.sides.1) - 52.0;
        (top, bottom.max(top + 40.0))
    }
}

impl Plot {
    /// Axes that fill the picture except for their labels and the space for other parts.
    pub(super) fn new(x: Extent, y: Extent, title: &str, room: &Room) -> Self {
        let width = f64::from(room.sides.0);
        let (top, bottom) = room.top_and_bottom(title);
        // Ticks about 50 pixels apart.
        let y_ticks = y.ticks(((bottom - top) / 50.0) as usize);
        let left = 40.0 + CHARACTER * longest(&y_ticks) as f64;
        let sides = |beside: f64| {
            let left = left.max(beside);
            (left, (width - room.right.max(beside)).max(left + 40.0))
        };
        let (left, right) = sides(0.0);
        // Half of a label at the end of an axis extends beyond the frame.
        let beside = 0.5 * CHARACTER * longest(&ticks_across(&x, right - left)) as f64;
        let (left, right) = sides(beside);
        let x_ticks = ticks_across(&x, right - left);
        Self {
            frame: Frame {
                left,
                top,
                right,
                bottom,
            },
            x,
            y,
            x_ticks,
            y_ticks,
            sides: (width, f64::from(room.sides.1)),
        }
    }

    /// The parts of a curve inside the frame, in pixels. Points that cannot be shown are gaps.
    pub(super) fn lines(&self, points: &[Point]) -> Vec<Vec<Point>> {
        let (low, high) = self.corners();
        let positions = points.iter().map(|point| self.position(*point));
        clip::parts(positions, low, high)
            .into_iter()
            .map(|part| part.into_iter().map(|at| self.pixel(at)).collect())
            .collect()
    }

    /// The points inside the frame, in pixels.
    pub(super) fn markers(&self, points: &[Point]) -> Vec<Point> {
        let (low, high) = self.corners();
        let positions = points.iter().filter_map(|point| self.position(*point));
        positions
            .filter(|at| clip::contains(*at, low, high))
            .map(|at| self.pixel(at))
            .collect()
    }

    /// The points inside the frame, in pixels, to which no line leads because their neighbours cannot be shown.
    pub(super) fn alone(&self, points: &[Point]) -> Vec<Point> {
        let (low, high) = self.corners();
        let positions: Vec<_> = points.iter().map(|point| self.position(*point)).collect();
        let is_gap = |k: usize| positions.get(k).is_none_or(Option::is_none);
        (0..positions.len())
            .filter(|k| is_gap(k.wrapping_sub(1)) && is_gap(k + 1))
            .filter_map(|k| positions[k])
            .filter(|at| clip::contains(*at, low, high))
            .map(|at| self.pixel(at))
            .collect()
    }

    /// The position of a point on the axes, also outside the frame; `None` if it cannot be shown.
    fn position(&self, (x, y): Point) -> Option<Point> {
        Some((self.x.position(x)?, self.y.position(y)?))
    }

    /// The positions of the lower left and of the upper right corner of the frame.
    fn corners(&self) -> (Point, Point) {
        let (x, y) = (self.x.ends(), self.y.ends());
        ((x.0, y.0), (x.1, y.1))
    }

    /// The pixel at a position inside the frame.
    fn pixel(&self, (x, y): Point) -> Point {
        let fractions = (self.x.fraction_at(x), self.y.fraction_at(y));
        self.frame.at(fractions)
    }

    /// Draws grid lines at the labelled ticks.
    pub(super) fn draw_grid(&self, canvas: &Canvas<'_>) -> Result<(), ChartError> {
        let line = |from, to| {
            let ends = [self.frame.at(from), self.frame.at(to)];
            canvas.line(&ends, Colour::LIGHT_GREY, 0.8)
        };
        for tick in self.x_ticks.iter().filter(|tick| tick.label.is_some()) {
            line((tick.place, 0.0), (tick.place, 1.0))?;
        }
        for tick in self.y_ticks.iter().filter(|tick| tick.label.is_some()) {
            line((0.0, tick.place), (1.0, tick.place))?;
        }
        Ok(())
    }

    /// Draws the frame, ticks, labels and title on top of the contents.
    pub(super) fn draw_axes(&self, canvas: &Canvas<'_>, title: &str) -> Result<(), ChartError> {
        let frame = &self.frame;
        canvas.border(frame, Colour::BLACK)?;
        for tick in &self.x_ticks {
            let (x, y) = frame.at((tick.place, 0.0));
            canvas.line(&[(x, y), (x, y + length(tick))], Colour::BLACK, 1.0)?;
            let text = tick.label.as_deref().unwrap_or_default();
            canvas.text(text, (x, y + 9.0), Anchor::Top, TEXT)?;
        }
        draw_ticks(canvas, frame.left, frame, &self.y_ticks, Side::Left)?;
        let (width, _) = self.sides;
        let middle = f64::midpoint(frame.left, frame.right);
        let (label, size) = fitted(&self.x.label, TEXT + 1.0, around(middle, width));
        canvas.text(&label, (middle, frame.bottom + 31.0), Anchor::Top, size)?;
        self.draw_upwards(canvas, &self.y.label, 16.0)?;
        let (title, size) = fitted(title, TITLE, width - frame.left - BESIDE_TEXT);
        canvas.text(&title, (frame.left, 22.0), Anchor::Left, size)
    }

    /// Draws the label of a vertical axis, centred at `x` and at half the height of the frame.
    pub(super) fn draw_upwards(
        &self,
        canvas: &Canvas<'_>,
        label: &str,
        x: f64,
    ) -> Result<(), ChartError> {
        let middle = f64::midpoint(self.frame.top, self.frame.bottom);
        let (label, size) = fitted(label, TEXT + 1.0, around(middle, self.sides.1));
        canvas.text(&label, (x, middle), Anchor::Upwards, size)
    }
}

/// The length of the longest text that can be centred at `middle` in a picture with this side.
fn around(middle: f64, side: f64) -> f64 {
    2.0 * (middle.min(side - middle) - BESIDE_TEXT)
}

/// A text that fits into the given number of pixels, and its font size: up to a quarter smaller than usual, then
/// shortened.
fn fitted(text: &str, usual: f64, room: f64) -> (String, f64) {
    let width = CHARACTER / TEXT;
    // A text that fits exactly must not be shortened because of rounding.
    let room = room * (1.0 + 1e-9);
    let size = (room / (width * characters(text) as f64)).clamp(0.75 * usual, usual);
    (shortened(text, (room / (width * size)) as usize), size)
}

/// The ticks along a horizontal axis of this width: about 90 pixels apart, or more if labels are long.
fn ticks_across(x: &Extent, width: f64) -> Vec<Tick> {
    let mut wanted = (width / 90.0) as usize;
    loop {
        let mut ticks = x.ticks(wanted);
        let were_apart = thin(&mut ticks, width);
        if were_apart || wanted <= 1 {
            return ticks;
        }
        wanted -= 1;
    }
}

/// Removes labels that would touch the previous one, from ticks in ascending order; returns whether none did.
fn thin(ticks: &mut [Tick], width: f64) -> bool {
    let mut were_apart = true;
    let mut end = f64::NEG_INFINITY;
    for tick in ticks {
        let Some(label) = &tick.label else {
            continue;
        };
        // With half a character on each side.
        let half = 0.5 * CHARACTER * (label.chars().count() + 1) as f64;
        let middle = tick.place * width;
        if middle - half < end {
            tick.label = None;
            were_apart = false;
        } else {
            end = middle + half;
        }
    }
    were_apart
}

/// The side of its line on which a tick is drawn.
#[derive(Clone, Copy)]
pub(super) enum Side {
    Left,
    Right,
}

/// Draws the ticks along a vertical line at `x` over the height of the frame.
pub(super) fn draw_ticks(
    canvas: &Canvas<'_>,
    x: f64,
    frame: &Frame,
    ticks: &[Tick],
    side: Side,
) -> Result<(), ChartError> {
    let (sign, anchor) = match side {
        Side::Left => (-1.0, Anchor::Right),
        Side::Right => (1.0, Anchor::Left),
    };
    for tick in ticks {
        let (_, y) = frame.at((0.0, tick.place));
        canvas.line(&[(x, y), (x + sign * length(tick), y)], Colour::BLACK, 1.0)?;
        let text = tick.label.as_deref().unwrap_or_default();
        canvas.text(text, (x + sign * 9.0, y), anchor, TEXT)?;
    }
    Ok(())
}

fn length(tick: &Tick) -> f64 {
    if tick.label.is_some() {
        TICK
    } else {
        0.6 * TICK
    }
}

/// The number of characters of the longest label.
pub(super) fn longest(ticks: &[Tick]) -> usize {
    let length = |tick: &Tick| tick.label.as_ref().map_or(0, |label| label.chars().count());
    ticks.iter().map(length).max().unwrap_or(0)
}

/// Shortens a text to a number of usual characters.
pub(super) fn shortened(text: &str, most: usize) -> String {
    if characters(text) <= most {
        return text.to_owned();
    }
    let mut left = most.saturating_sub(1);
    let mut short = String::new();
    for c in text.chars() {
        let Some(rest) = left.checked_sub(characters_of(c)) else {
            break;
        };
        left = rest;
        short.push(c);
    }
    short.push('…');
    short
}

/// The legend entry that counts the entries that do not fit.
pub(super) fn and_more(count: usize) -> String {
    format!("… and {count} more")
}

/// How a series is drawn, in the chart and in the legend.
#[derive(Clone, Copy, Debug)]
pub(super) enum Key {
    Line(Colour),
    LineWithMarkers(Colour, Shape),
    Markers(Colour, Shape),
    Dashes(Colour),
    Area(Colour),
    /// A line on an image, with a light outline.
    Outlined(Colour),
}

/// Whether two points coincide in a picture, which has a resolution of a tenth of a pixel.
fn is_near(a: Point, b: Point) -> bool {
    (a.0 - b.0).abs() < 0.1 && (a.1 - b.1).abs() < 0.1
}

/// The width of a key in the legend, in pixels.
pub(super) const KEY: f64 = 26.0;
/// The width of lines, in pixels.
const STROKE: f64 = 1.8;

impl Key {
    /// Draws a line in this style.
    pub(super) fn draw_line(self, canvas: &Canvas<'_>, line: &[Point]) -> Result<(), ChartError> {
        if let Some(&first) = line.first()
            && line.iter().all(|at| is_near(*at, first))
        {
            // A line without length, as of a motion at rest, would not be visible.
            return self.draw_dot(canvas, first);
        }
        match self {
            Self::Line(colour) | Self::LineWithMarkers(colour, _) => {
                canvas.line(line, colour, STROKE)
            }
            Self::Dashes(colour) => canvas.dashes(line, colour, 1.4, 5.0),
            Self::Outlined(colour) => {
                canvas.line(line, Colour::WHITE, 2.0 * STROKE)?;
                canvas.line(line, colour, STROKE)
            }
            Self::Markers(..) | Self::Area(_) => Ok(()),
        }
    }

    /// Draws an isolated point of a line, if no marker shows it.
    pub(super) fn draw_dot(self, canvas: &Canvas<'_>, at: Point) -> Result<(), ChartError> {
        match self {
            Self::Line(colour) | Self::Dashes(colour) | Self::Outlined(colour) => {
                canvas.marker(at, Shape::Circle, colour)
            }
            Self::LineWithMarkers(..) | Self::Markers(..) | Self::Area(_) => Ok(()),
        }
    }

    /// Draws the marker of this style at a point, if it has one.
    pub(super) fn draw_marker(self, canvas: &Canvas<'_>, at: Point) -> Result<(), ChartError> {
        match self {
            Self::LineWithMarkers(colour, shape) | Self::Markers(colour, shape) => {
                canvas.marker(at, shape, colour)
            }
            _ => Ok(()),
        }
    }

    /// Draws the key of a legend entry and its name, with the left end at a point.
    pub(super) fn draw_entry(
        self,
        canvas: &Canvas<'_>,
        name: &str,
        (x, y): Point,
    ) -> Result<(), ChartError> {
        let mut width = KEY;
        if let Self::Area(colour) = self {
            width = 16.0;
            let swatch = Frame {
                left: x,
                top: y - 6.0,
                right: x + width,
                bottom: y + 6.0,
            };
            canvas.rectangle(&swatch, colour)?;
            canvas.border(&swatch, Colour::DARK_GREY)?;
        }
        self.draw_line(canvas, &[(x, y), (x + KEY, y)])?;
        self.draw_marker(canvas, (x + 0.5 * KEY, y))?;
        canvas.text(name, (x + width + 6.0, y), Anchor::Left, TEXT)
    }
}
