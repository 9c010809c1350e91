//! Drawing primitives on top of plotters, and the SVG document around them.

use super::clip::Point;
use super::colours::Colour;
use super::error::ChartError;
use plotters::coord::Shift;
use plotters::prelude::{
    Circle, Color, DrawingArea, FontTransform, IntoDrawingArea, IntoFont, PathElement, Polygon,
    RGBColor, Rectangle, SVGBackend, ShapeStyle, Text, TextStyle,
};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use std::error::Error;

/// Units of plotters per pixel. Its coordinates are integers, and curves rounded to whole pixels would have visible
/// steps.
const FINE: f64 = 10.0;
/// The number by which plotters divides font sizes.
const FONT: f64 = 1.24;
/// The usual font size, in pixels.
pub(super) const TEXT: f64 = 12.0;
/// The width of a character of the usual size, in pixels; an overestimate.
pub(super) const CHARACTER: f64 = 7.0;

/// The width of a text in usual characters.
pub(super) fn characters(text: &str) -> usize {
    text.chars().map(characters_of).sum()
}

/// Two for East Asian scripts and pictographs, otherwise one.
pub(super) fn characters_of(c: char) -> usize {
    match c {
        '\u{1100}'..='\u{115F}'
        | '\u{2E80}'..='\u{A4CF}'
        | '\u{AC00}'..='\u{D7A3}'
        | '\u{F900}'..='\u{FAFF}'
        | '\u{FE30}'..='\u{FE6F}'
        | '\u{FF00}'..='\u{FF60}'
        | '\u{FFE0}'..='\u{FFE6}'
        | '\u{1F300}'..='\u{1FAFF}'
        | '\u{20000}'..='\u{3FFFD}' => 2,
        _ => 1,
    }
}

/// The limits of the sides of a picture, in pixels.
const SIDES: (u32, u32) = (240, 8000);

/// The sides of a picture, within the limits.
pub(super) fn sides(width: u32, height: u32) -> (u32, u32) {
    (
        width.clamp(SIDES.0, SIDES.1),
        height.clamp(SIDES.0, SIDES.1),
    )
}

/// An SVG picture: a white background, then `below` (SVG elements), then the drawing.
pub(super) fn picture(
    (width, height): (u32, u32),
    below: &str,
    draw: impl FnOnce(&Canvas<'_>) -> Result<(), ChartError>,
) -> Result<String, ChartError> {
    let fine = FINE as u32;
    let mut text = String::new();
    {
        let backend = SVGBackend::with_string(&mut text, (width * fine, height * fine));
        let canvas = Canvas {
            area: backend.into_drawing_area(),
        };
        draw(&canvas)?;
        canvas.area.present().map_err(failed)?;
    }
    // Replaces the opening tag of plotters, whose size is in tenths of a pixel.
    let body = text.find('>').map_or("", |end| &text[end + 1..]);
    let (w, h) = (width * fine, height * fine);
    Ok(format!(
        "<svg width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {w} {h}\" xmlns=\"http://www.w3.org/2000/svg\">\n\
         <rect width=\"{w}\" height=\"{h}\" fill=\"#ffffff\"/>\n{below}{body}"
    ))
}

/// An SVG element with a PNG image in a rectangle of the picture, without interpolation.
pub(super) fn image(png: &[u8], frame: &Frame) -> String {
    use base64::Engine;
    let data = base64::engine::general_purpose::STANDARD.encode(png);
    let [x, y, width, height] =
        [frame.left, frame.top, frame.width(), frame.height()].map(|length| FINE * length);
    format!(
        "<image x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" preserveAspectRatio=\"none\" \
         style=\"image-rendering:pixelated\" href=\"data:image/png;base64,{data}\"/>\n"
    )
}

/// A rectangle of the picture, in pixels, y downward.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub(super) left: f64,
    pub(super) top: f64,
    pub(super) right: f64,
    pub(super) bottom: f64,
}

impl Frame {
    pub(super) fn width(&self) -> f64 {
        self.right - self.left
    }

    pub(super) fn height(&self) -> f64 {
        self.bottom - self.top
    }

    /// The point at given fractions of the frame, from its lower left corner.
    pub(super) fn at(&self, (x, y): Point) -> Point {
        (
            self.left + x * self.width(),
            self.bottom - y * self.height(),
        )
    }

    /// The upper left and the lower right corner.
    pub(super) fn corners(&self) -> (Point, Point) {
        ((self.left, self.top), (self.right, self.bottom))
    }
}

/// The position of a text relative to its point.
#[derive(Clone, Copy, Debug)]
pub(super) enum Anchor {
    /// The left end is at the point, vertically centred.
    Left,
    /// The right end is at the point, vertically centred.
    Right,
    /// The centre of the top is at the point.
    Top,
    /// Centred at the point, written upward.
    Upwards,
}

/// The shape of a marker.
#[derive(Clone, Copy, Debug)]
pub(super) enum Shape {
    Circle,
    Square,
    Triangle,
    Diamond,
}

impl Shape {
    /// The shape for the k-th series; it changes when the colours repeat.
    pub(super) fn of_series(k: usize) -> Self {
        match (k + k / 8) % 4 {
            0 => Self::Circle,
            1 => Self::Square,
            2 => Self::Triangle,
            _ => Self::Diamond,
        }
    }
}

/// The drawing area; all lengths in pixels.
pub(super) struct Canvas<'a> {
    area: DrawingArea<SVGBackend<'a>, Shift>,
}

impl Canvas<'_> {
    pub(super) fn line(
        &self,
        points: &[Point],
        colour: Colour,
        width: f64,
    ) -> Result<(), ChartError> {
        let points: Vec<_> = points.iter().copied().map(fine).collect();
        let path = PathElement::new(points, stroke(colour, width));
        self.area.draw(&path).map_err(failed)
    }

    /// A dashed line; dashes and gaps have the length `dash` in pixels and continue around corners.
    pub(super) fn dashes(
        &self,
        points: &[Point],
        colour: Colour,
        width: f64,
        dash: f64,
    ) -> Result<(), ChartError> {
        dashes(points, dash)
            .iter()
            .try_for_each(|part| self.line(part, colour, width))
    }

    pub(super) fn rectangle(&self, frame: &Frame, fill: Colour) -> Result<(), ChartError> {
        let (low, high) = frame.corners();
        let rectangle = Rectangle::new([fine(low), fine(high)], filled(fill));
        self.area.draw(&rectangle).map_err(failed)
    }

    pub(super) fn border(&self, frame: &Frame, colour: Colour) -> Result<(), ChartError> {
        // The rectangle of plotters has a border one unit wide.
        let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.0)];
        self.line(&corners.map(|corner| frame.at(corner)), colour, 1.0)
    }

    pub(super) fn marker(&self, at: Point, shape: Shape, colour: Colour) -> Result<(), ChartError> {
        const RADIUS: f64 = 3.2;
        let polygon = |corners: &[Point]| {
            let points: Vec<_> = corners
                .iter()
                .map(|(x, y)| fine((at.0 + RADIUS * x, at.1 + RADIUS * y)))
                .collect();
            self.area
                .draw(&Polygon::new(points, filled(colour)))
                .map_err(failed)
        };
        match shape {
            Shape::Circle => {
                let circle = Circle::new(fine(at), (FINE * RADIUS) as i32, filled(colour));
                self.area.draw(&circle).map_err(failed)
            }
            // The shapes have about the same area.
            Shape::Square => polygon(&[(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)]),
            Shape::Triangle => polygon(&[(0.0, -1.25), (1.15, 0.8), (-1.15, 0.8)]),
            Shape::Diamond => polygon(&[(0.0, -1.3), (1.3, 0.0), (0.0, 1.3), (-1.3, 0.0)]),
        }
    }

    pub(super) fn text(
        &self,
        text: &str,
        at: Point,
        anchor: Anchor,
        size: f64,
    ) -> Result<(), ChartError> {
        // Control characters and two other characters are not allowed in XML, and line breaks become spaces.
        let is_allowed = |c: char| !c.is_control() && !matches!(c, '\u{FFFE}' | '\u{FFFF}');
        let text: String = text
            .chars()
            .map(|c| if is_allowed(c) { c } else { ' ' })
            .collect();
        if text.trim().is_empty() {
            return Ok(());
        }
        let (horizontal, vertical) = match anchor {
            Anchor::Left => (HPos::Left, VPos::Center),
            Anchor::Right => (HPos::Right, VPos::Center),
            Anchor::Top => (HPos::Center, VPos::Top),
            Anchor::Upwards => (HPos::Center, VPos::Center),
        };
        let font = ("sans-serif", size * FONT * FINE).into_font();
        let font = match anchor {
            Anchor::Upwards => font.transform(FontTransform::Rotate270),
            _ => font,
        };
        let style = TextStyle::from(font).pos(Pos::new(horizontal, vertical));
        self.area
            .draw(&Text::new(text, fine(at), style))
            .map_err(failed)
    }
}

/// The dashes along a line.
fn dashes(points: &[Point], dash: f64) -> Vec<Vec<Point>> {
    let mut dashes = Vec::new();
    let mut dash_now: Vec<Point> = points.first().copied().into_iter().collect();
    let (mut left, mut is_drawn) = (dash, true);
    for pair in points.windows(2) {
        let (dx, dy) = (pair[1].0 - pair[0].0, pair[1].1 - pair[0].1);
        let length = dx.hypot(dy);
        let mut done = 0.0;
        while length - done > left {
            done += left;
            let at = (
                pair[0].0 + dx * done / length,
                pair[0].1 + dy * done / length,
            );
            if is_drawn {
                dash_now.push(at);
                dashes.push(std::mem::take(&mut dash_now));
            } else {
                dash_now = vec![at];
            }
            (left, is_drawn) = (dash, !is_drawn);
        }
        left -= length - done;
        if is_drawn {
            dash_now.push(pair[1]);
        }
    }
    if is_drawn && dash_now.len() > 1 {
        dashes.push(dash_now);
    }
    dashes
}

fn fine((x, y): Point) -> (i32, i32) {
    ((FINE * x).round() as i32, (FINE * y).round() as i32)
}

fn rgb(Colour(red, green, blue): Colour) -> RGBColor {
    RGBColor(red, green, blue)
}

fn filled(colour: Colour) -> ShapeStyle {
    rgb(colour).filled()
}

fn stroke(colour: Colour, width: f64) -> ShapeStyle {
    rgb(colour).stroke_width((FINE * width).round() as u32)
}

fn failed<E: Error + Send + Sync + 'static>(error: E) -> ChartError {
    ChartError::Drawing {
        source: Box::new(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dashes_go_around_corners() {
        let corner = [(0.0, 0.0), (5.0, 0.0), (5.0, 5.0)];
        let expected = [vec![(0.0, 0.0), (3.0, 0.0)], vec![(5.0, 1.0), (5.0, 4.0)]];
        assert_eq!(dashes(&corner, 3.0), expected);
        assert!(dashes(&[], 3.0).is_empty());
        assert!(dashes(&[(1.0, 1.0)], 3.0).is_empty());
    }
}
