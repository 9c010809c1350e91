//! Stroboscopic pictures of a motion: the mechanism at equally spaced times, the older the paler, and the paths of its
//! points, with the same scale on both axes.

use std::fmt::Write;
use tfe::charts::Colour;

pub type Point = (f64, f64);

/// A part of a mechanism.
#[derive(Clone, Debug)]
pub enum Part {
    /// A rod, or any open line.
    Line(Vec<Point>),
    /// A closed line, lightly filled: a disk, a frame.
    Outline(Vec<Point>),
    /// A point mass or a joint.
    Mass(Point),
    /// A point that is fixed to the ground.
    Pivot(Point),
}

impl Part {
    pub fn rod(a: Point, b: Point) -> Self {
        Self::Line(vec![a, b])
    }

    /// A rectangle centred at a point, with its long side at an angle from the horizontal.
    pub fn block((x, y): Point, angle: f64, length: f64, width: f64) -> Self {
        let (sin, cos) = angle.sin_cos();
        let corner = |(along, aside): Point| {
            let (along, aside) = (along * length, aside * width);
            (x + along * cos - aside * sin, y + along * sin + aside * cos)
        };
        let corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)];
        Self::Outline(corners.map(corner).to_vec())
    }

    fn points(&self) -> &[Point] {
        match self {
            Self::Line(points) | Self::Outline(points) => points,
            Self::Mass(point) | Self::Pivot(point) => std::slice::from_ref(point),
        }
    }
}

/// The projection of a point of space: seen from the right, the front and above.
pub fn seen([x, y, z]: [f64; 3]) -> Point {
    let (across, depth) = (
        0.9 * x + 0.435_889_894_354_067_4 * y,
        0.9 * y - 0.435_889_894_354_067_4 * x,
    );
    // An elevation with sine 0.35 and cosine 0.94.
    (across, 0.936_749_691_753_440_6 * z + 0.35 * depth)
}

struct Path {
    name: String,
    points: Vec<Point>,
    is_dashed: bool,
}

/// A picture that is being put together.
pub struct Stroboscope {
    title: String,
    axes: [String; 2],
    ground: Vec<Part>,
    paths: Vec<Path>,
    shots: Vec<Vec<Part>>,
}

/// The space outside the frame, in pixels.
const LEFT: f64 = 62.0;
const RIGHT: f64 = 18.0;
const TOP: f64 = 58.0;
const BOTTOM: f64 = 46.0;
/// The largest size of the frame, in pixels.
const WIDTH: f64 = 680.0;
const HEIGHT: f64 = 520.0;
const SHOTS: Colour = Colour(30, 64, 110);

impl Stroboscope {
    pub fn new(title: &str, x: &str, y: &str) -> Self {
        Self {
            title: title.to_owned(),
            axes: [x.to_owned(), y.to_owned()],
            ground: Vec::new(),
            paths: Vec::new(),
            shots: Vec::new(),
        }
    }

    /// Adds parts that do not move.
    pub fn ground(mut self, parts: impl IntoIterator<Item = Part>) -> Self {
        self.ground.extend(parts);
        self
    }

    /// Adds the path of a point.
    pub fn path(self, name: &str, points: impl IntoIterator<Item = Point>) -> Self {
        self.with_path(name, points, false)
    }

    /// Adds another path, for comparison, as a dashed line.
    pub fn dashed(self, name: &str, points: impl IntoIterator<Item = Point>) -> Self {
        self.with_path(name, points, true)
    }

    fn with_path(
        mut self,
        name: &str,
        points: impl IntoIterator<Item = Point>,
        is_dashed: bool,
    ) -> Self {
        self.paths.push(Path {
            name: name.to_owned(),
            points: points.into_iter().collect(),
            is_dashed,
        });
        self
    }

    /// Adds the mechanism at successive times; the oldest is the palest.
    pub fn shots(mut self, shots: impl IntoIterator<Item = Vec<Part>>) -> Self {
        self.shots.extend(shots);
        self
    }

    pub fn to_svg(&self) -> Result<String, std::fmt::Error> {
        let view = View::around(self.points());
        let (width, height) = (view.width + LEFT + RIGHT, view.height + TOP + BOTTOM);
        let mut svg = format!(
            "<svg width=\"{width:.0}\" height=\"{height:.0}\" viewBox=\"0 0 {width:.0} {height:.0}\" \
             xmlns=\"http://www.w3.org/2000/svg\" font-family=\"sans-serif\" font-size=\"12\" stroke-linejoin=\"round\" stroke-linecap=\"round\">\n\
             <rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n"
        );
        self.draw_axes(&mut svg, &view)?;
        for part in &self.ground {
            draw(&mut svg, &view, part, Colour::BLACK, 1.0)?;
        }
        let last = self.shots.len().saturating_sub(1).max(1) as f64;
        for (k, shot) in self.shots.iter().enumerate() {
            let opacity = 0.12 + 0.88 * (k as f64 / last).powi(2);
            for part in shot {
                draw(&mut svg, &view, part, SHOTS, opacity)?;
            }
        }
        for (k, path) in self.paths.iter().enumerate() {
            let dashes = if path.is_dashed {
                " stroke-dasharray=\"5 4\""
            } else {
                ""
            };
            let (line, colour) = (view.line(&path.points), hex(Colour::of_series(k + 1)));
            writeln!(
                svg,
                "<polyline points=\"{line}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.4\"{dashes}/>"
            )?;
        }
        svg += "</svg>\n";
        Ok(svg)
    }

    fn points(&self) -> impl Iterator<Item = Point> {
        let parts = self.ground.iter().chain(self.shots.iter().flatten());
        let parts = parts.flat_map(Part::points);
        let all = parts.chain(self.paths.iter().flat_map(|path| &path.points));
        all.copied().filter(|(x, y)| x.is_finite() && y.is_finite())
    }

    fn draw_axes(&self, svg: &mut String, view: &View) -> std::fmt::Result {
        let (right, bottom) = (LEFT + view.width, TOP + view.height);
        for x in view.ticks(view.x, view.width) {
            let at = view.at((x, 0.0)).0;
            writeln!(
                svg,
                "<path d=\"M{at:.1} {TOP}V{bottom:.1}\" stroke=\"#e4e4e4\"/>"
            )?;
            writeln!(
                svg,
                "<text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
                bottom + 16.0,
                label(x)
            )?;
        }
        for y in view.ticks(view.y, view.height) {
            let at = view.at((0.0, y)).1;
            writeln!(
                svg,
                "<path d=\"M{LEFT} {at:.1}H{right:.1}\" stroke=\"#e4e4e4\"/>"
            )?;
            writeln!(
                svg,
                "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                LEFT - 6.0,
                at + 4.0,
                label(y)
            )?;
        }
        let (width, height) = (view.width, view.height);
        writeln!(
            svg,
            "<rect x=\"{LEFT}\" y=\"{TOP}\" width=\"{width:.1}\" height=\"{height:.1}\" fill=\"none\" stroke=\"#444444\"/>"
        )?;
        let (centre, middle) = (LEFT + width / 2.0, TOP + height / 2.0);
        let [title, x, y] = [&self.title, &self.axes[0], &self.axes[1]].map(|text| escaped(text));
        writeln!(
            svg,
            "<text x=\"{LEFT}\" y=\"20\" font-size=\"15\" font-weight=\"bold\">{title}</text>"
        )?;
        writeln!(
            svg,
            "<text x=\"{centre:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{x}</text>",
            bottom + 36.0
        )?;
        writeln!(
            svg,
            "<text transform=\"translate(16 {middle:.1}) rotate(-90)\" text-anchor=\"middle\">{y}</text>"
        )?;
        // The legend: one line under the title.
        let mut at = LEFT;
        for (k, path) in self
            .paths
            .iter()
            .enumerate()
            .filter(|(_, path)| !path.name.is_empty())
        {
            let colour = hex(Colour::of_series(k + 1));
            let dashes = if path.is_dashed {
                " stroke-dasharray=\"5 4\""
            } else {
                ""
            };
            writeln!(
                svg,
                "<path d=\"M{at:.1} 40h22\" stroke=\"{colour}\" stroke-width=\"2\"{dashes}/>"
            )?;
            writeln!(
                svg,
                "<text x=\"{:.1}\" y=\"44\">{}</text>",
                at + 28.0,
                escaped(&path.name)
            )?;
            at += 46.0 + 6.6 * path.name.chars().count() as f64;
        }
        Ok(())
    }
}

fn draw(
    svg: &mut String,
    view: &View,
    part: &Part,
    colour: Colour,
    opacity: f64,
) -> std::fmt::Result {
    let colour = hex(colour);
    match part {
        Part::Line(points) => {
            let line = view.line(points);
            writeln!(
                svg,
                "<polyline points=\"{line}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2.2\" opacity=\"{opacity:.2}\"/>"
            )
        }
        Part::Outline(points) => {
            let line = view.line(points);
            writeln!(
                svg,
                "<polygon points=\"{line}\" fill=\"{colour}\" fill-opacity=\"0.08\" stroke=\"{colour}\" stroke-width=\"1.6\" opacity=\"{opacity:.2}\"/>"
            )
        }
        Part::Mass(point) => {
            let (x, y) = view.at(*point);
            writeln!(
                svg,
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4.2\" fill=\"{colour}\" opacity=\"{opacity:.2}\"/>"
            )
        }
        Part::Pivot(point) => {
            let (x, y) = view.at(*point);
            writeln!(
                svg,
                "<path d=\"M{x:.1} {y:.1}l-7 12h14z\" fill=\"#dddddd\" stroke=\"#444444\"/>\n\
                 <circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3\" fill=\"#ffffff\" stroke=\"#444444\"/>"
            )
        }
    }
}

/// The map from coordinates to pixels, with one scale for both axes.
struct View {
    /// The smallest and the largest coordinate within the frame.
    x: (f64, f64),
    y: (f64, f64),
    /// The frame, in pixels.
    width: f64,
    height: f64,
}

impl View {
    fn around(points: impl Iterator<Item = Point>) -> Self {
        let mut low = (f64::INFINITY, f64::INFINITY);
        let mut high = (f64::NEG_INFINITY, f64::NEG_INFINITY);
        for (x, y) in points {
            low = (low.0.min(x), low.1.min(y));
            high = (high.0.max(x), high.1.max(y));
        }
        if !(low.0 <= high.0) {
            (low, high) = ((0.0, 0.0), (1.0, 1.0));
        }
        // A horizontal or vertical line gets some width, and everything gets a margin.
        let size = (high.0 - low.0).max(high.1 - low.1).max(f64::MIN_POSITIVE);
        let widened = |low: f64, high: f64| {
            let (middle, half) = (
                (low + high) / 2.0,
                (high - low).max(0.25 * size) / 2.0 + 0.05 * size,
            );
            (middle - half, middle + half)
        };
        let (x, y) = (widened(low.0, high.0), widened(low.1, high.1));
        let scale = (WIDTH / (x.1 - x.0)).min(HEIGHT / (y.1 - y.0));
        Self {
            x,
            y,
            width: scale * (x.1 - x.0),
            height: scale * (y.1 - y.0),
        }
    }

    fn at(&self, (x, y): Point) -> Point {
        (
            LEFT + self.width * (x - self.x.0) / (self.x.1 - self.x.0),
            TOP + self.height * (self.y.1 - y) / (self.y.1 - self.y.0),
        )
    }

    fn line(&self, points: &[Point]) -> String {
        let places = points.iter().map(|point| self.at(*point));
        let places = places.filter(|(x, y)| x.is_finite() && y.is_finite());
        places
            .map(|(x, y)| format!("{x:.1},{y:.1}"))
            .collect::<Vec<_>>()
            .join(" ")
    }

    /// Round numbers at least 60 pixels apart, with the same spacing on both axes.
    fn ticks(&self, (low, high): (f64, f64), pixels: f64) -> impl Iterator<Item = f64> + use<> {
        let rough = 60.0 * (high - low) / pixels;
        let power = 10.0_f64.powf(rough.log10().floor());
        let steps = [1.0, 2.0, 5.0, 10.0].map(|step| step * power);
        let step = steps
            .into_iter()
            .find(|step| *step >= rough)
            .unwrap_or(rough);
        let (first, last) = ((low / step).ceil() as i64, (high / step).floor() as i64);
        (first..=last).map(move |k| k as f64 * step)
    }
}

/// A number as a label of an axis, without rounding errors in its last digits.
fn label(value: f64) -> String {
    let rounded = (value * 1e6).round() / 1e6;
    // Adding zero avoids "-0".
    format!("{}", rounded + 0.0).replace('-', "−")
}

fn hex(Colour(red, green, blue): Colour) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}
