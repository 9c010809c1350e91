use super::*;
use crate::charts::Scale;
use roxmltree::Document;

/// Size, palette and indices of an image.
fn decoded(png: &[u8]) -> ((u32, u32), Vec<u8>, Vec<u8>) {
    let mut decoder = png::Decoder::new(std::io::Cursor::new(png));
    decoder.set_transformations(png::Transformations::IDENTITY);
    let mut reader = decoder.read_info().unwrap();
    let palette = reader.info().palette.clone().unwrap().into_owned();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let frame = reader.next_frame(&mut pixels).unwrap();
    ((frame.width, frame.height), palette, pixels)
}

fn ramp() -> HeatMap {
    HeatMap::new("Ramp", (3, 2), |i, j| Some((i + 3 * j) as f64))
        .x(Axis::new("x").range(0.0..3.0))
        .y(Axis::new("y").range(10.0..12.0))
        .values("value")
}

#[test]
fn the_image_has_a_pixel_for_each_cell_the_last_row_on_top() {
    let (size, palette, pixels) = decoded(&ramp().to_png().unwrap());
    assert_eq!(size, (3, 2));
    // 0 … 5 over 254 levels.
    assert_eq!(pixels, [152, 203, 254, 0, 51, 102]);
    assert_eq!(palette[..3], [68, 1, 84]);
    assert_eq!(palette[3 * 254..3 * 255], [253, 231, 37]);
}

#[test]
fn cells_without_a_value_are_grey() {
    let map = HeatMap::new("", (3, 1), |i, _| [None, Some(f64::NAN), Some(1.0)][i]);
    let (_, palette, pixels) = decoded(&map.to_png().unwrap());
    assert_eq!(pixels[..2], [255, 255]);
    assert_eq!(palette[3 * 255..], [178, 178, 178]);
    assert!(map.to_svg().unwrap().contains("no value"));
    assert!(!ramp().to_svg().unwrap().contains("no value"));
}

#[test]
fn values_outside_the_range_have_the_colours_of_its_ends() {
    let values = [-5.0, 0.0, 1.0, 10.0, 100.0, 1e9];
    let map = HeatMap::new("", (6, 1), |i, _| Some(values[i]));
    let logarithmic = Axis::new("").scale(Scale::Logarithmic).range(1.0..100.0);
    let (_, _, pixels) = decoded(&map.values(logarithmic).to_png().unwrap());
    assert_eq!(pixels, [0, 0, 0, 127, 254, 254]);
}

#[test]
fn the_picture_is_xml_with_the_image_in_the_frame() {
    let svg = ramp()
        .curve("edge", [(-1.0, 11.0), (4.0, 11.0)])
        .to_svg()
        .unwrap();
    let document = Document::parse(&svg).unwrap();
    let images: Vec<_> = document
        .descendants()
        .filter(|node| node.tag_name().name() == "image")
        .collect();
    assert_eq!(images.len(), 2, "cells and colour bar");
    let number = |name: &str| -> f64 { images[0].attribute(name).unwrap().parse().unwrap() };
    let (x, y) = (number("x"), number("y"));
    // The curve extends from side to side, at half height.
    let expected = format!(
        "{:.0},{:.0} {:.0},{:.0} ",
        x,
        y + 0.5 * number("height"),
        x + number("width"),
        y + 0.5 * number("height")
    );
    assert!(svg.contains(&format!("points=\"{expected}\"")));
    for text in ["Ramp", "edge", "value"] {
        assert!(
            document
                .descendants()
                .any(|node| node.text().is_some_and(|t| t.trim() == text))
        );
    }
}

#[test]
fn classes_have_their_colours() {
    let classes = vec![
        Class::new("stable", Colour(1, 2, 3)),
        Class::new("a < b", Colour(4, 5, 6)),
    ];
    let map = HeatMap::classes("", (4, 1), classes, |i, _| {
        [Some(1), Some(0), None, Some(2)][i]
    });
    let (_, palette, pixels) = decoded(&map.to_png().unwrap());
    assert_eq!(pixels, [1, 0, 2, 2]);
    assert_eq!(palette, [1, 2, 3, 4, 5, 6, 178, 178, 178]);
    assert_eq!(
        map.to_csv().unwrap(),
        "x,y,value\n0.5,0.5,a < b\n1.5,0.5,stable\n2.5,0.5,\n3.5,0.5,\n"
    );
    let svg = map.to_svg().unwrap();
    assert!(Document::parse(&svg).is_ok() && svg.contains("a &lt; b"));
}

#[test]
fn classes_that_the_legend_leaves_out_are_counted() {
    let classes = (0..60).map(|k| Class::new(format!("class number {k}"), Colour::WHITE));
    let map = HeatMap::classes("", (1, 1), classes.collect(), |_, _| Some(0));
    // Labels of nineteen characters, left of the map.
    let wide = map.clone().y(Axis::new("").range(1e9..1e9 + 1e-3));
    for (map, width) in [(&map, 240), (&map, 720), (&wide, 240), (&wide, 720)] {
        let svg = map.clone().size(width, 440).to_svg().unwrap();
        let document = Document::parse(&svg).unwrap();
        let texts = document
            .descendants()
            .filter(|node| node.tag_name().name() == "text");
        let (mut shown, mut left_out) = (0_usize, 0_usize);
        for node in texts {
            let text = node.text().unwrap().trim();
            if let Some(count) = text.strip_prefix("… and ") {
                left_out = count.strip_suffix(" more").unwrap().parse().unwrap();
            } else if text.starts_with("class") {
                shown += 1;
            } else {
                continue;
            }
            // Inside the picture, at 7 pixels a character.
            let left: f64 = node.attribute("x").unwrap().parse().unwrap();
            let end = left + 70.0 * text.chars().count() as f64;
            assert!(end <= 10.0 * f64::from(width), "{text} of {width}: {end}");
        }
        assert_eq!(shown + left_out, 60, "{shown} of {width}");
    }
}

#[test]
fn csv_holds_centres_and_values() {
    let text = ramp().to_csv().unwrap();
    let rows: Vec<Vec<f64>> = text
        .lines()
        .skip(1)
        .map(|row| row.split(',').map(|field| field.parse().unwrap()).collect())
        .collect();
    assert_eq!(rows.len(), 6);
    assert_eq!(rows[0], [0.5, 10.5, 0.0]);
    assert_eq!(rows[5], [2.5, 11.5, 5.0]);
}

#[test]
fn a_million_cells_are_a_small_file() {
    let wave = |i: usize, j: usize| Some((0.013 * i as f64).sin() * (0.021 * j as f64).cos());
    let svg = HeatMap::new("", (1000, 1000), wave).to_svg().unwrap();
    // A byte a cell, four thirds of it in base64, before compression.
    assert!(svg.len() < 700_000, "{} bytes", svg.len());
    let classes = vec![
        Class::new("a", Colour::BLACK),
        Class::new("b", Colour::WHITE),
    ];
    let disc = |i: usize, j: usize| Some(usize::from(i * i + j * j > 500_000));
    let svg = HeatMap::classes("", (1000, 1000), classes, disc)
        .to_svg()
        .unwrap();
    assert!(svg.len() < 40_000, "{} bytes", svg.len());
}

#[test]
fn errors() {
    let none = HeatMap::new("", (0, 5), |_, _| Some(1.0));
    assert!(matches!(none.to_svg(), Err(ChartError::NoData)));
    assert!(matches!(none.to_csv(), Err(ChartError::NoData)));
    let huge = HeatMap::new("", (usize::MAX, 2), |_, _| Some(1.0));
    assert!(matches!(
        huge.to_png(),
        Err(ChartError::TooManyCells { rows: 2, .. })
    ));
    assert!(matches!(
        huge.to_csv(),
        Err(ChartError::TooManyCells { .. })
    ));
    let grey = HeatMap::new("", (2, 2), |_, _| None);
    assert!(matches!(grey.to_svg(), Err(ChartError::NoData)));
    let reversed = ramp().x(Axis::new("x").range(std::ops::Range {
        start: 1.0,
        end: 0.0,
    }));
    assert!(matches!(reversed.to_svg(), Err(ChartError::Range { .. })));
    let error = ramp().save("map.jpg").unwrap_err();
    assert!(error.to_string().contains(".svg or .png or .csv"));
}
