//! Figure 1 of the paper: the spectral radius of one element of the undamped oscillator over ρ = ωh.

use crate::oscillator::{transition, unstable};
use crate::{Outcome, Scene, grid};
use std::error::Error;
use tfe::charts::{Axis, Chart, Scale, Section, Style};
use tfe::prelude::*;
use tfe::stability::{IntervalError, TransitionError, UnstableInterval, spectral_radius};

const END: f64 = 30.0;
const NODES: std::ops::RangeInclusive<usize> = 2..=6;

type Points = Vec<(f64, f64)>;
type OfNodes = fn(usize) -> Element;

pub fn scene() -> Outcome {
    let full = Family::of("full quadrature", Element::primal)?;
    let lobatto = Family::of("Lobatto quadrature", |n| Element::primal(n).lobatto())?;
    let (rows, worst) = compare(&full);
    let (deviation, most) = unit_circle()?;
    assert!(
        worst < 1e-9,
        "an end of an interval has an error of {worst:e}"
    );
    let section = Section::new("Spectral radius of the oscillator")
        .paragraph(
            "One element of length h advances the state (p, q) of an undamped oscillator by ρ \
             = ωh. Its amplitude is multiplied by the spectral radius of the transition matrix: \
             one is right, more is an instability of the method, less is numerical damping. At \
             ρ = 2π an element is a period long.",
        )
        .figure(
            full.radii()?,
            "Primal elements with full quadrature, Figure 1 of the paper: they fail in bubbles \
             near every half period (ρ = π, 2π, …), and for good beyond a limit. With more \
             nodes the bubbles shrink and the limit moves out.",
        )
        .figure(
            full.growth()?,
            "The same growth on a logarithmic scale. Near ρ = π, five nodes have a growth of 4·10⁻⁴ \
             in an interval of length 0.0009, and six nodes 10⁻⁵ in one of 0.00002. A grid would miss \
             these; root finding does not.",
        )
        .table(
            [
                "nodes",
                "unstable from",
                "to",
                "closed form",
                "error",
                "largest radius",
                "at ρ",
            ],
            rows,
        )
        .figure(
            lobatto.radii()?,
            "Primal elements with Lobatto quadrature; two nodes are the leapfrog method with \
             its limit ρ = 2. The forces cost less, but every limit is lower and every bubble wider \
             than with full quadrature.",
        )
        .table(
            [
                "nodes",
                "limit, full",
                "limit, Lobatto",
                "widest bubble, full",
                "widest bubble, Lobatto",
            ],
            full.beside(&lobatto),
        )
        .figure(
            deviation,
            format!(
                "Primal with reduced quadrature (the same matrix as Mixed), Mixed and \
                 EnergyConserving have radius one for every step. The rest is rounding: at \
                 most {most:.1e} for 2 to 6 nodes up to ρ = {END}."
            ),
        )
        .figure(
            radau()?,
            "Radau elements damp oscillations that they do not resolve, and hardly those that they resolve: with \
             six nodes up to five radians per element, with two barely one.",
        );
    let key = format!(
        "ends of bubbles agree with closed forms to {worst:.1e}; |radius − 1| of mixed elements ≤ \
         {most:.1e}"
    );
    Ok(Scene { section, key })
}

type WithIntervals = (Element, Vec<UnstableInterval>);

/// Elements of one family with 2 to 6 nodes, and their unstable intervals.
struct Family {
    name: &'static str,
    elements: Vec<WithIntervals>,
}

impl Family {
    fn of(name: &'static str, element: OfNodes) -> Result<Self, IntervalError<TransitionError>> {
        let with_intervals = |n| Ok((element(n), unstable(element(n), END)?));
        let elements = NODES.map(with_intervals).collect::<Result<_, _>>()?;
        Ok(Self { name, elements })
    }

    /// The spectral radius ρ(A), with points concentrated where it departs from one.
    fn radii(&self) -> Result<String, Box<dyn Error>> {
        let mut chart = Chart::new(format!("Primal, {}: spectral radius", self.name))
            .x(Axis::new("ρ = ωh").range(0.0..20.0))
            .y(Axis::new("spectral radius").range(0.9..3.0));
        for (element, intervals) in &self.elements {
            let mut points = vec![(0.0, 1.0)];
            for interval in intervals {
                let inside = inside(*element, interval)?;
                points.extend(inside.iter().map(|(rho, growth)| (*rho, 1.0 + growth)));
            }
            if intervals.last().is_none_or(|last| last.end < END) {
                points.push((END, 1.0));
            }
            chart = chart.line(format!("{} nodes", element.nodes()), points);
        }
        Ok(chart.to_svg()?)
    }

    /// ρ(A) − 1 inside the unstable intervals, with gaps between them.
    fn growth(&self) -> Result<String, Box<dyn Error>> {
        let mut chart = Chart::new(format!("Primal, {}: growth per element", self.name))
            .x(Axis::new("ρ = ωh").range(0.0..20.0))
            .y(Axis::new("spectral radius − 1")
                .scale(Scale::Logarithmic)
                .range(1e-6..10.0));
        for (element, intervals) in &self.elements {
            let mut points = Vec::new();
            for interval in intervals {
                points.extend(inside(*element, interval)?);
                points.push((f64::NAN, f64::NAN));
            }
            chart = chart.line(format!("{} nodes", element.nodes()), points);
        }
        Ok(chart.to_svg()?)
    }

    /// The limits and the widest bubbles of two families.
    fn beside(&self, other: &Self) -> Vec<Vec<String>> {
        let limit = |intervals: &[UnstableInterval]| {
            let last = intervals.last().filter(|last| last.end == END);
            last.map_or_else(|| format!("> {END}"), |last| format!("{:.6}", last.start))
        };
        let widest = |intervals: &[UnstableInterval]| {
            let bubbles = intervals.iter().filter(|bubble| bubble.end < END);
            let widths = bubbles.map(|bubble| bubble.end - bubble.start);
            widths
                .reduce(f64::max)
                .map_or_else(|| "none".to_owned(), |width| format!("{width:.6}"))
        };
        let pairs = self.elements.iter().zip(&other.elements);
        let row = |((element, full), (_, lobatto)): (&WithIntervals, &WithIntervals)| {
            vec![
                element.nodes().to_string(),
                limit(full),
                limit(lobatto),
                widest(full),
                widest(lobatto),
            ]
        };
        pairs.map(row).collect()
    }
}

/// The radius at points concentrated at the ends of an interval, where it rises as a square root.
fn inside(element: Element, interval: &UnstableInterval) -> Result<Points, TransitionError> {
    let (start, end) = (interval.start, interval.end);
    let at = |k: i32| {
        // As close as 10⁻¹¹ of the length to the ends.
        let exponent = f64::from(k) / 10.0;
        (start + end) / 2.0 + (end - start) / 2.0 * exponent.tanh()
    };
    let point = |rho: f64| Ok((rho, spectral_radius(&transition(element, rho)?) - 1.0));
    (-130..=130).map(at).map(point).collect()
}

/// |ρ(A) − 1| of the elements that are stable for every step size, and its maximum.
fn unit_circle() -> Result<(String, f64), Box<dyn Error>> {
    let families: [(&str, OfNodes); 3] = [
        ("primal, reduced", |n| Element::primal(n).reduced()),
        ("mixed", Element::mixed),
        ("energy-conserving", Element::energy_conserving),
    ];
    let mut chart = Chart::new("Reduced primal, mixed, energy-conserving: radius 1")
        .x(Axis::new("ρ = ωh").range(0.0..END))
        .y(Axis::new("|spectral radius − 1| / ε").range(0.0..60.0));
    let mut most: f64 = 0.0;
    for (name, element) in families {
        // The worst over all numbers of nodes.
        let mut points: Points = grid(0.05, END, 300).map(|rho| (rho, 0.0)).collect();
        for (rho, deviation) in &mut points {
            for nodes in NODES {
                let radius = spectral_radius(&transition(element(nodes), *rho)?);
                let off = (radius - 1.0).abs();
                assert!(off < 1e-12, "{name}, ρ = {rho}: {radius}");
                *deviation = deviation.max(off / f64::EPSILON);
            }
            most = most.max(*deviation * f64::EPSILON);
        }
        chart = chart.series(name, Style::Markers, points);
    }
    Ok((chart.to_svg()?, most))
}

fn radau() -> Result<String, Box<dyn Error>> {
    let mut chart = Chart::new("Radau: numerical damping of unresolved oscillations")
        .x(Axis::new("ρ = ωh").range(0.0..END))
        .y(Axis::new("spectral radius").range(0.0..1.05));
    for nodes in NODES {
        let point = |rho| {
            Ok((
                rho,
                spectral_radius(&transition(Element::radau(nodes), rho)?),
            ))
        };
        let points: Result<Points, TransitionError> = grid(0.05, END, 600).map(point).collect();
        chart = chart.line(format!("{nodes} nodes"), points?);
    }
    Ok(chart.to_svg()?)
}

/// A closed form for an end of an unstable interval: a zero of a polynomial in ρ² of (T-57).
struct Closed {
    text: &'static str,
    square: f64,
}

impl Closed {
    fn all() -> Vec<Self> {
        let of = |text, square| Self { text, square };
        vec![
            of("√10", 10.0),
            of("√12", 12.0),
            of("√42", 42.0),
            of("√60", 60.0),
            of("√(90 − √6420)", 90.0 - 6420_f64.sqrt()),
            of("√(90 + √6420)", 90.0 + 6420_f64.sqrt()),
            of("√(56 − √2128)", 56.0 - 2128_f64.sqrt()),
            of("√(56 + √2128)", 56.0 + 2128_f64.sqrt()),
            of("√(210 − √28980)", 210.0 - 28980_f64.sqrt()),
            of("√(210 + √28980)", 210.0 + 28980_f64.sqrt()),
        ]
    }

    /// The closed form closest to an end.
    fn nearest(all: &[Self], end: f64) -> Option<(&'static str, f64)> {
        let error = |closed: &Self| (closed.text, (end / closed.square.sqrt() - 1.0).abs());
        let errors = all.iter().map(error);
        errors
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .filter(|(_, error)| *error < 1e-6)
    }
}

/// All intervals found, compared with the closed forms of their ends, and the largest relative error.
fn compare(family: &Family) -> (Vec<Vec<String>>, f64) {
    let all = Closed::all();
    let (mut rows, mut worst) = (Vec::new(), 0.0_f64);
    for (element, intervals) in &family.elements {
        for interval in intervals {
            let is_last = interval.end == END;
            let ends = [interval.start, interval.end];
            let found = ends[..if is_last { 1 } else { 2 }]
                .iter()
                .map(|end| Closed::nearest(&all, *end));
            let found: Vec<_> = found.collect();
            let texts: Vec<_> = found
                .iter()
                .map(|closed| closed.map_or("—", |(text, _)| text))
                .collect();
            let error = found
                .iter()
                .flatten()
                .map(|(_, error)| *error)
                .reduce(f64::max);
            worst = worst.max(error.unwrap_or(0.0));
            // For up to four nodes, all ends have a closed form.
            assert!(
                element.nodes() > 4 || found.iter().all(Option::is_some),
                "{element}: no closed form from {} to {}",
                interval.start,
                interval.end
            );
            let in_bubble = |text: String| if is_last { String::new() } else { text };
            rows.push(vec![
                element.nodes().to_string(),
                format!("{:.12}", interval.start),
                if is_last {
                    "∞".to_owned()
                } else {
                    format!("{:.12}", interval.end)
                },
                texts.join(" … "),
                error.map_or_else(String::new, |error| format!("{error:.0e}")),
                in_bubble(format!("{:.9}", interval.radius)),
                in_bubble(format!("{:.6}", interval.worst)),
            ]);
        }
    }
    (rows, worst)
}
