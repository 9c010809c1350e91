//! All scenes in one picture: a panel for each, with the fastest runs of each family.

use crate::runs::Scene;
use std::fmt::Write;
use tfe::charts::Colour;
use tfe::prelude::Element;
use tfe::work_precision::Point;

const COLUMNS: usize = 4;
/// The size of a panel with its labels, and of the frame inside, in pixels.
const PANEL: (f64, f64) = (290.0, 262.0);
const FRAME: (f64, f64) = (222.0, 190.0);
/// The space to the left of a frame and above it.
const MARGIN: (f64, f64) = (52.0, 30.0);
/// The errors shown, as powers of ten.
const ERRORS: (f64, f64) = (-12.0, -1.0);
const GREY: &str = "#8a8a8a";
const INK: &str = "#222222";

/// A family: its name, a function that makes an element with a number of nodes, the width of its line, and its colour.
/// The curves of families that are equally fast coincide; the later ones are thinner, so that both are visible.
type Family = (&'static str, fn(usize) -> Element, f64, usize);

const FAMILIES: [Family; 7] = [
    ("primal", |n| Element::primal(n), 2.0, 0),
    ("primal, Lobatto", |n| Element::primal(n).lobatto(), 2.0, 2),
    ("energy-conserving", Element::energy_conserving, 2.0, 5),
    ("primal, reduced", |n| Element::primal(n).reduced(), 5.0, 1),
    ("mixed", Element::mixed, 3.2, 3),
    ("three-field", Element::three_field, 1.4, 4),
    ("Radau", Element::radau, 2.0, 7),
];

/// (log₁₀ milliseconds, log₁₀ error)
type Curve = Vec<(f64, f64)>;

fn place(seconds: f64, error: f64) -> (f64, f64) {
    ((1e3 * seconds).log10(), error.max(1e-16).log10())
}

/// The least time for each error with each family, and then with any other integrator.
fn curves(scene: &Scene) -> (Vec<Curve>, Curve) {
    let known = |point: &&Point| Some(place(point.measured()?.seconds, point.error()?));
    let families = FAMILIES.map(|(_, element, ..)| {
        let of_family = scene.measured.only(|curve| {
            let one = curve.element();
            one == element(one.nodes())
        });
        of_family.front().iter().filter_map(known).collect()
    });
    let peers = scene.measured.front_of_peers();
    let peers = peers.into_iter().map(|(cost, error)| place(cost, error));
    (families.into(), peers.collect())
}

/// The whole picture as SVG.
pub fn overview(scenes: &[Scene]) -> String {
    let rows = scenes.len().div_ceil(COLUMNS);
    let (width, height) = (PANEL.0 * COLUMNS as f64, PANEL.1 * rows as f64 + 64.0);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" \
         font-family=\"sans-serif\" font-size=\"12\" fill=\"{INK}\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    );
    let mut with_peers = false;
    for (k, scene) in scenes.iter().enumerate() {
        let corner = (
            PANEL.0 * (k % COLUMNS) as f64 + MARGIN.0,
            PANEL.1 * (k / COLUMNS) as f64 + MARGIN.1,
        );
        let (families, peers) = curves(scene);
        with_peers |= !peers.is_empty();
        panel(&mut svg, scene.title, corner, &families, &peers);
    }
    legend(&mut svg, PANEL.1 * rows as f64 + 18.0, with_peers);
    svg + "</svg>\n"
}

/// Draws a frame with its axes and curves. Writing into a string cannot fail.
fn panel(
    svg: &mut String,
    title: &str,
    (left, top): (f64, f64),
    families: &[Curve],
    peers: &Curve,
) {
    let seen = |(_, error): &&(f64, f64)| (ERRORS.0..=ERRORS.1).contains(error);
    let times = || {
        families
            .iter()
            .chain([peers])
            .flatten()
            .filter(seen)
            .map(|point| point.0)
    };
    let first = times().fold(f64::INFINITY, f64::min) - 0.1;
    let last = times().fold(f64::NEG_INFINITY, f64::max) + 0.1;
    if !(first < last) {
        return;
    }
    let x = |log: f64| left + (log - first) / (last - first) * FRAME.0;
    let y = |log: f64| top + (ERRORS.1 - log) / (ERRORS.1 - ERRORS.0) * FRAME.1;
    let (right, bottom) = (left + FRAME.0, top + FRAME.1);
    let _ = writeln!(
        svg,
        "<text x=\"{left}\" y=\"{}\" font-weight=\"bold\" font-size=\"13\">{title}</text>",
        top - 9.0
    );
    for power in [-2, -4, -6, -8, -10, -12] {
        let y = y(f64::from(power));
        let _ = writeln!(
            svg,
            "<path d=\"M{left} {y:.1}H{right}\" stroke=\"#e4e4e4\"/><text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
            left - 6.0,
            y + 4.0,
            ten_to(power)
        );
    }
    for (multiple, power) in marks(first, last) {
        let x = x(logarithm(multiple, power));
        let _ = writeln!(
            svg,
            "<path d=\"M{x:.1} {top}V{bottom}\" stroke=\"#e4e4e4\"/><text x=\"{x:.1}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
            bottom + 16.0,
            milliseconds(multiple, power)
        );
    }
    let _ = writeln!(
        svg,
        "<rect x=\"{left}\" y=\"{top}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"{GREY}\"/>",
        FRAME.0, FRAME.1
    );
    let path = |curve: &Curve| {
        let points = curve
            .iter()
            .filter(seen)
            .map(|point| (x(point.0), y(point.1)));
        let points: Vec<String> = points.map(|(x, y)| format!("{x:.1} {y:.1}")).collect();
        points.join("L")
    };
    for (k, curve) in families
        .iter()
        .enumerate()
        .filter(|(_, curve)| curve.iter().any(|point| seen(&point)))
    {
        let (_, _, width, colour) = FAMILIES[k];
        let Colour(r, g, b) = Colour::of_series(colour);
        let _ = writeln!(
            svg,
            "<path d=\"M{}\" fill=\"none\" stroke=\"rgb({r},{g},{b})\" stroke-width=\"{width}\" stroke-linejoin=\"round\"/>",
            path(curve)
        );
    }
    if peers.iter().any(|point| seen(&point)) {
        let _ = writeln!(
            svg,
            "<path d=\"M{}\" fill=\"none\" stroke=\"{INK}\" stroke-width=\"1.8\" stroke-dasharray=\"5 3\"/>",
            path(peers)
        );
    }
}

/// Multiples of powers of ten between two logarithms, for the labels of an axis: as many as there is room for, and at
/// least two.
fn marks(first: f64, last: f64) -> Vec<(i32, i32)> {
    let of = |multiples: &[i32]| -> Vec<(i32, i32)> {
        (first.floor() as i32..=last.floor() as i32)
            .flat_map(|power| multiples.iter().map(move |multiple| (*multiple, power)))
            .filter(|(multiple, power)| (first..=last).contains(&logarithm(*multiple, *power)))
            .collect()
    };
    if last - first <= 1.2 {
        return of(&[1, 2, 5]);
    }
    match of(&[1]) {
        powers if powers.len() >= 2 => powers,
        // Half a decade apart: labels at 2 and 5 would overlap.
        _ => of(&[1, 3]),
    }
}

/// The logarithm of a multiple of a power of ten.
fn logarithm(multiple: i32, power: i32) -> f64 {
    f64::from(multiple).log10() + f64::from(power)
}

fn legend(svg: &mut String, top: f64, with_peers: bool) {
    let mut entries: Vec<(String, String, &str)> = FAMILIES
        .iter()
        .map(|(name, _, _, colour)| {
            let Colour(r, g, b) = Colour::of_series(*colour);
            ((*name).to_owned(), format!("rgb({r},{g},{b})"), "none")
        })
        .collect();
    if with_peers {
        entries.push(("best of other crates".to_owned(), INK.to_owned(), "5 3"));
    }
    let mut x = MARGIN.0;
    for (name, colour, dashes) in entries {
        let _ = writeln!(
            svg,
            "<path d=\"M{x} {top}h26\" stroke=\"{colour}\" stroke-width=\"2.4\" stroke-dasharray=\"{dashes}\"/>\
             <text x=\"{}\" y=\"{}\">{name}</text>",
            x + 32.0,
            top + 4.0
        );
        // The approximate width of a letter of this size.
        x += 56.0 + 6.6 * name.chars().count() as f64;
    }
    let _ = writeln!(
        svg,
        "<text x=\"{}\" y=\"{}\" fill=\"#555555\">relative error at the end against the least time of a run that reaches it, \
         on one processor; lower left is better</text>",
        MARGIN.0,
        top + 28.0
    );
}

/// A power of ten, as text.
fn ten_to(power: i32) -> String {
    let raised = |digit: char| match digit {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '0' => '⁰',
        other => char::from_u32(0x2070 + other.to_digit(10).unwrap_or(0)).unwrap_or(other),
    };
    let text: String = power.to_string().chars().map(raised).collect();
    format!("10{text}")
}

/// A multiple of a power of ten of milliseconds, as text.
fn milliseconds(multiple: i32, power: i32) -> String {
    let of = |power| f64::from(multiple) * 10_f64.powi(power);
    match power {
        ..=-1 => format!("{:.3} µs", of(power + 3)),
        0..=2 => format!("{} ms", of(power)),
        _ => format!("{} s", of(power - 3)),
    }
    .replace(".000", "")
}
