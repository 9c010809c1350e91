use super::*;
use crate::charts::Scale;
use roxmltree::{Document, Node};

fn waves() -> Chart {
    Chart::new("a < b & \"c\"").x("t (s)").y("x (m)").line(
        "cosine",
        (0..=100).map(|k| (0.1 * f64::from(k), (0.1 * f64::from(k)).cos())),
    )
}

/// The points of the lines in this colour, in tenths of a pixel.
fn lines(svg: &str, Colour(r, g, b): Colour) -> Vec<Vec<Point>> {
    let stroke = format!("#{r:02X}{g:02X}{b:02X}");
    let document = Document::parse(svg).unwrap();
    let points = |node: Node<'_, '_>| {
        let point = |text: &str| {
            let (x, y) = text.split_once(',').unwrap();
            (x.parse().unwrap(), y.parse().unwrap())
        };
        let text = node.attribute("points").unwrap().to_owned();
        text.split_whitespace().map(point).collect()
    };
    document
        .descendants()
        .filter(|node| node.has_tag_name(("http://www.w3.org/2000/svg", "polyline")))
        .filter(|node| node.attribute("stroke") == Some(&stroke))
        .map(points)
        .collect()
}

fn texts(svg: &str) -> Vec<String> {
    let document = Document::parse(svg).unwrap();
    document
        .descendants()
        .filter(|node| node.tag_name().name() == "text")
        .map(|node| node.text().unwrap().trim().to_owned())
        .collect()
}

/// Left, top, right and bottom of the frame: its border is the only black line of five points.
fn frame(svg: &str) -> [f64; 4] {
    let borders = lines(svg, Colour::BLACK);
    let border = borders.iter().find(|line| line.len() == 5).unwrap();
    let by = |part: fn(&Point) -> f64, fold: fn(f64, f64) -> f64| {
        border.iter().map(part).reduce(fold).unwrap()
    };
    [
        by(|p| p.0, f64::min),
        by(|p| p.1, f64::min),
        by(|p| p.0, f64::max),
        by(|p| p.1, f64::max),
    ]
}

#[test]
fn text_is_escaped_and_complete() {
    let svg = waves().to_svg().unwrap();
    let texts = texts(&svg);
    for expected in ["a < b & \"c\"", "t (s)", "x (m)", "cosine", "0.5", "10"] {
        assert!(
            texts.iter().any(|text| text == expected),
            "{expected}: {texts:?}"
        );
    }
    let root = Document::parse(&svg).unwrap();
    let root = root.root_element();
    assert_eq!(root.attribute("width"), Some("720"));
    assert_eq!(root.attribute("viewBox"), Some("0 0 7200 4400"));
    // Several charts fit into one page.
    assert!(!svg.contains("id="));
    let odd = waves().x("bell \u{7}, zero \0, none \u{FFFE}");
    let odd = odd.y("\u{FFFF}").to_svg().unwrap();
    assert!(Document::parse(&odd).is_ok());
}

#[test]
fn curves_are_cut_at_the_frame() {
    let svg = waves()
        .x(Axis::new("t").range(1.0..9.0))
        .y(Axis::new("x").range(-0.5..0.5))
        .to_svg()
        .unwrap();
    let [left, top, right, bottom] = frame(&svg);
    let curves = lines(&svg, Colour::of_series(0));
    // The cosine crosses the band at π/2, 3π/2 and 5π/2; the last line is the key of the legend.
    assert_eq!(curves.len(), 4);
    for (x, y) in curves[..3].iter().flatten() {
        assert!((left..=right).contains(x) && (top..=bottom).contains(y));
    }
    for curve in &curves[..3] {
        let (from, to) = (curve[0].1, curve[curve.len() - 1].1);
        assert!((from == top && to == bottom) || (from == bottom && to == top));
    }
    assert!(curves[3][0].0 > right, "the legend stands beside the frame");
}

/// The extents of the labels below the frame, at 7 pixels per character, in tenths of a pixel.
fn labels_below(svg: &str) -> Vec<(f64, f64)> {
    let [.., bottom] = frame(svg);
    let document = Document::parse(svg).unwrap();
    let number = |node: Node<'_, '_>, name: &str| -> f64 {
        let text = node.attribute(name).unwrap();
        text.parse().unwrap()
    };
    document
        .descendants()
        .filter(|node| node.tag_name().name() == "text")
        .filter(|node| (number(*node, "y") - bottom - 90.0).abs() <= 1.0)
        .map(|node| {
            let (middle, length) = (
                number(node, "x"),
                node.text().unwrap().trim().chars().count(),
            );
            let half = 35.0 * length as f64;
            (middle - half, middle + half)
        })
        .collect()
}

#[test]
fn long_labels_stand_apart_and_inside_the_picture() {
    let linear = |range| Axis::new("").range(range);
    let logarithmic = |range| linear(range).scale(Scale::Logarithmic);
    let axes = [
        linear(1e9..1e9 + 1e-3),
        linear(-1e9..-1e9 + 1e-3),
        linear(0.5..0.5 + 1e-11),
        linear(-1.0..1.0),
        logarithmic(0.011..9.0),
        logarithmic(1.1e-12..9e-11),
        logarithmic(1e5..1e5 + 1e-6),
    ];
    for axis in axes {
        for width in [240, 400, 720] {
            let chart = Chart::new("").x(axis.clone()).line("", [(1.0, 1.0)]);
            let svg = chart.size(width, 440).to_svg().unwrap();
            let labels = labels_below(&svg);
            // A small picture may have room for only one.
            let least = if width == 720 { 2 } else { 1 };
            assert!(labels.len() >= least, "{axis:?}, {width}");
            for pair in labels.windows(2) {
                assert!(pair[0].1 <= pair[1].0, "{axis:?}, {width}: {labels:?}");
            }
            // Positions are rounded to tenths of a pixel.
            let (first, last) = (labels[0].0, labels[labels.len() - 1].1);
            let side = 10.0 * f64::from(width);
            assert!(
                first >= -1.0 && last <= side + 1.0,
                "{axis:?}, {width}: {labels:?}"
            );
        }
    }
}

#[test]
fn long_titles_and_labels_end_inside_the_picture() {
    let long = |start: &str| format!("{start} {}", "of everything ".repeat(30));
    let usual = waves().to_svg().unwrap();
    for (width, height) in [(240, 240), (720, 440), (1200, 300)] {
        let chart = Chart::new(long("title")).x(long("across")).y(long("up"));
        let chart = chart.line("", [(0.0, 0.0), (1.0, 1.0)]).size(width, height);
        let svg = chart.to_svg().unwrap();
        let document = Document::parse(&svg).unwrap();
        let mut cut = 0;
        for node in document.descendants() {
            let Some(text) = node.text().filter(|_| node.tag_name().name() == "text") else {
                continue;
            };
            let number = |name: &str| -> f64 { node.attribute(name).unwrap().parse().unwrap() };
            // 7 pixels for each of 12 characters.
            let length = number("font-size") * 7.0 / 12.0 * text.trim().chars().count() as f64;
            let is_upwards = node.attribute("transform").is_some();
            let (at, side) = if is_upwards {
                (number("y"), height)
            } else {
                (number("x"), width)
            };
            let (before, behind) = match node.attribute("text-anchor") {
                Some("start") => (0.0, length),
                Some("end") => (length, 0.0),
                _ => (0.5 * length, 0.5 * length),
            };
            assert!(at - before >= 0.0, "{text} of {width}");
            assert!(at + behind <= 10.0 * f64::from(side), "{text} of {width}");
            cut += usize::from(text.trim().ends_with('…'));
        }
        assert_eq!(cut, 3, "{width}");
    }
    // A short title has its usual size; a longer one is smaller, but complete.
    let size = |svg: &str, title: &str| -> f64 {
        let document = Document::parse(svg).unwrap();
        let mut nodes = document.descendants();
        let node = nodes.find(|node| node.text().is_some_and(|text| text.trim() == title));
        node.unwrap()
            .attribute("font-size")
            .unwrap()
            .parse()
            .unwrap()
    };
    assert!((size(&usual, "a < b & \"c\"") - 160.0).abs() < 1e-9);
    let title = "w".repeat(76);
    let longer = Chart::new(title.as_str()).line("", [(0.0, 0.0), (1.0, 1.0)]);
    let smaller = size(&longer.to_svg().unwrap(), &title);
    assert!((120.0..159.0).contains(&smaller), "{smaller}");
}

/// Characters as wide as high: 60 of them are wider than the picture, and 40 in a legend are wider than a third of it.
#[test]
fn wide_characters_take_their_room() {
    let names = ["振".repeat(60), "動".repeat(40)];
    let chart = Chart::new(names[0].as_str()).line(names[1].as_str(), [(0.0, 0.0), (1.0, 1.0)]);
    let svg = chart.to_svg().unwrap();
    let document = Document::parse(&svg).unwrap();
    let mut cut = 0;
    for node in document.descendants() {
        let Some(text) = node.text().filter(|_| node.tag_name().name() == "text") else {
            continue;
        };
        let text = text.trim();
        if !text.ends_with('…') {
            continue;
        }
        let number = |name: &str| -> f64 { node.attribute(name).unwrap().parse().unwrap() };
        let end = number("x") + number("font-size") * text.chars().count() as f64;
        assert!(end <= 7200.0, "{text}: {end}");
        assert!(text.chars().count() > 10, "{text}");
        cut += 1;
    }
    assert_eq!(cut, 2);
}

#[test]
fn curves_that_end_far_away_keep_their_slope() {
    let unit = || Axis::new("").range(0.0..1.0);
    let svg = Chart::new("")
        .x(unit())
        .y(unit())
        .line("", [(0.0, 0.0), (1e9, 2e9)])
        .to_svg()
        .unwrap();
    let [left, top, right, bottom] = frame(&svg);
    let curve = &lines(&svg, Colour::of_series(0))[0];
    assert_eq!(curve[0], (left, bottom));
    // The curve leaves at the top, half way to the right; each of three numbers is rounded to tenths of a pixel.
    assert!((curve[1].0 - f64::midpoint(left, right)).abs() <= 1.0);
    assert_eq!(curve[1].1, top);
}

#[test]
fn numbers_without_a_place_are_gaps() {
    let points = [
        (1.0, 1.0),
        (2.0, 2.0),
        (3.0, f64::NAN),
        (4.0, 1.0),
        (5.0, 2.0),
        (f64::INFINITY, 1.0),
        (7.0, 0.0),
        (8.0, 1.0),
        (9.0, 2.0),
    ];
    let linear = Chart::new("").line("", points);
    let of = |chart: Chart| lines(&chart.to_svg().unwrap(), Colour::of_series(0));
    let lengths: Vec<_> = of(linear.clone()).iter().map(Vec::len).collect();
    assert_eq!(lengths, [2, 2, 3]);
    let logarithmic = linear.y(Axis::new("y").scale(Scale::Logarithmic));
    let lengths: Vec<_> = of(logarithmic).iter().map(Vec::len).collect();
    assert_eq!(lengths, [2, 2, 2]);
}

#[test]
fn points_without_neighbours_are_dots() {
    let dots = |style, points: &[Point]| {
        let chart = Chart::new("").series("", style, points.iter().copied());
        let svg = chart.to_svg().unwrap();
        svg.matches("<circle").count()
    };
    let gaps = [
        (1.0, 1.0),
        (2.0, f64::NAN),
        (3.0, 1.0),
        (4.0, 2.0),
        (5.0, f64::NAN),
        (6.0, 2.0),
    ];
    assert_eq!(dots(Style::Line, &gaps), 2);
    assert_eq!(dots(Style::Line, &gaps[2..4]), 0);
    for style in [Style::Line, Style::LineWithMarkers, Style::Reference] {
        assert_eq!(dots(style, &gaps[..1]), 1, "{style:?}");
    }
    // A motion at rest: a line without length is not visible.
    for style in [Style::Line, Style::Reference] {
        assert_eq!(dots(style, &[(1.0, 1.0); 3]), 1, "{style:?}");
    }
    assert_eq!(dots(Style::LineWithMarkers, &[(1.0, 1.0); 3]), 3);
}

#[test]
fn points_without_a_place_do_not_stretch_the_other_axis() {
    let logarithmic = || Axis::new("").scale(Scale::Logarithmic);
    let chart = |far| Chart::new("").line("", [(1.0, 1.0), (2.0, 2.0), far]);
    for svg in [
        chart((1e6, 0.0)).y(logarithmic()).to_svg().unwrap(),
        chart((-1.0, 1e6)).x(logarithmic()).to_svg().unwrap(),
    ] {
        let [left, top, right, bottom] = frame(&svg);
        let curve = &lines(&svg, Colour::of_series(0))[0];
        // The whole size except for margins of 0.03 and 0.05 at each end.
        assert!(curve[1].0 - curve[0].0 > 0.9 * (right - left));
        assert!(curve[0].1 - curve[1].1 > 0.9 * (bottom - top));
    }
}

#[test]
fn a_straight_line_stays_straight_on_both_scales() {
    // x⁴ on logarithmic axes. The resolution is a tenth of a pixel, so each coordinate is rounded by up to half of it.
    let chart = Chart::new("")
        .x(Axis::new("x").scale(Scale::Logarithmic))
        .y(Axis::new("y").scale(Scale::Logarithmic))
        .line(
            "",
            (0..=6).map(|k| (f64::from(k).exp2(), f64::from(4 * k).exp2())),
        );
    let curve = lines(&chart.to_svg().unwrap(), Colour::of_series(0)).remove(0);
    let (from, to) = (curve[0], curve[6]);
    for (k, point) in curve.iter().enumerate() {
        let s = k as f64 / 6.0;
        assert!((point.0 - from.0 - s * (to.0 - from.0)).abs() <= 1.5);
        assert!((point.1 - from.1 - s * (to.1 - from.1)).abs() <= 1.5);
    }
}

#[test]
fn markers_and_dashes() {
    let svg = Chart::new("")
        .series("dots", Style::Markers, [(0.0, 0.0), (1.0, 1.0), (9.0, 9.0)])
        .series("level", Style::Reference, [(0.0, 0.5), (1.0, 0.5)])
        .x(Axis::new("x").range(-1.0..2.0))
        .y(Axis::new("y").range(-1.0..2.0))
        .to_svg()
        .unwrap();
    // Two inside the frame and one in the legend.
    assert_eq!(svg.matches("<circle").count(), 3);
    assert!(lines(&svg, Colour::of_series(0)).is_empty());
    assert!(lines(&svg, Colour::DARK_GREY).len() > 10);
}

#[test]
fn long_legends_are_cut() {
    let mut chart = Chart::new("");
    for k in 0..100 {
        chart = chart.line(
            format!("{k}{}", "w".repeat(200)),
            [(0.0, 0.0), (1.0, f64::from(k))],
        );
    }
    let texts = texts(&chart.to_svg().unwrap());
    assert!(
        texts
            .iter()
            .any(|text| text.starts_with("… and") && text.ends_with("more"))
    );
    assert!(texts.iter().all(|text| text.chars().count() < 40));
    let small = chart.size(1, 1).to_svg().unwrap();
    assert!(small.starts_with("<svg width=\"240\" height=\"240\""));
}

#[test]
fn the_number_of_entries_left_out_stands_inside_the_picture() {
    let mut chart = Chart::new("");
    for k in 0..100 {
        chart = chart.line((k % 10).to_string(), [(0.0, 0.0), (1.0, 1.0)]);
    }
    let svg = chart.to_svg().unwrap();
    let document = Document::parse(&svg).unwrap();
    let rest = document
        .descendants()
        .filter(|node| node.tag_name().name() == "text")
        .find(|node| node.text().unwrap().trim().starts_with('…'))
        .unwrap();
    let left: f64 = rest.attribute("x").unwrap().parse().unwrap();
    // At 7 pixels per character.
    let length = rest.text().unwrap().trim().chars().count();
    assert!(left + 70.0 * length as f64 <= 7200.0, "{left}, {length}");
}

#[test]
fn csv_holds_every_number() {
    let points = vec![(0.1, 1.0 / 3.0), (-1e-300, f64::MAX), (2.0, f64::NAN)];
    let text = Chart::new("").line("a, \"b\"", points.clone()).to_csv();
    let mut rows = text.lines();
    assert_eq!(rows.next(), Some("series,x,y"));
    for (row, (x, y)) in rows.by_ref().zip(&points) {
        let fields = row.strip_prefix("\"a, \"\"b\"\"\",").unwrap();
        let (a, b) = fields.split_once(',').unwrap();
        assert_eq!(a.parse(), Ok(*x));
        if y.is_nan() {
            assert_eq!(b, "");
        } else {
            assert_eq!(b.parse(), Ok(*y));
        }
    }
    assert_eq!(rows.next(), None);
}

#[test]
fn errors() {
    assert!(matches!(Chart::new("").to_svg(), Err(ChartError::NoData)));
    let nothing = Chart::new("").line("", [(f64::NAN, 1.0)]);
    assert!(matches!(nothing.to_svg(), Err(ChartError::NoData)));
    let below = Chart::new("")
        .y(Axis::new("error").scale(Scale::Logarithmic))
        .line("", [(0.0, -1.0), (1.0, 0.0)]);
    let error = below.to_svg().unwrap_err();
    assert!(matches!(&error, ChartError::NotPositive { axis } if axis == "error"));
    assert!(matches!(
        waves().save("chart.pdf"),
        Err(ChartError::UnknownEnding { .. })
    ));
    let error = waves().save("no/such/folder/chart.svg").unwrap_err();
    assert!(error.to_string().contains("chart.svg"));
    assert!(matches!(error, ChartError::Io { .. }));
}
