//! Cells as PNG images with a palette: one byte per cell.

use crate::charts::axis::Extent;
use crate::charts::colours::Colour;
use crate::charts::error::ChartError;

/// The number of levels of the colour scale; one more index marks cells without a value.
const LEVELS: usize = 255;

/// The colours of the levels, and of cells without a value.
pub(super) fn levels() -> Vec<Colour> {
    let fraction = |k: usize| k as f64 / (LEVELS - 1) as f64;
    let mut colours: Vec<_> = (0..LEVELS)
        .map(|k| Colour::of_fraction(fraction(k)))
        .collect();
    colours.push(Colour::GREY);
    colours
}

/// The level of a value.
pub(super) fn level_of(value: Option<f64>, extent: &Extent) -> u8 {
    let Some(value) = value.filter(|value| value.is_finite()) else {
        return LEVELS as u8;
    };
    // On a logarithmic scale, values that are not positive get the lowest level.
    let fraction = extent.fraction(value).unwrap_or(0.0).clamp(0.0, 1.0);
    (fraction * (LEVELS - 1) as f64).round() as u8
}

/// The image of the colour scale, with the largest value at the top.
pub(super) fn scale() -> Result<Vec<u8>, ChartError> {
    let pixels: Vec<u8> = (0..LEVELS as u8).rev().collect();
    encode((1, LEVELS), &levels(), &pixels)
}

/// A PNG image of (columns, rows) pixels, row by row from the top; each pixel is an index into the palette of at most
/// 256 colours.
pub(super) fn encode(
    (columns, rows): (usize, usize),
    palette: &[Colour],
    pixels: &[u8],
) -> Result<Vec<u8>, ChartError> {
    let too_many = |_| ChartError::TooManyCells { columns, rows };
    let width = u32::try_from(columns).map_err(too_many)?;
    let height = u32::try_from(rows).map_err(too_many)?;
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_palette(palette_bytes(palette));
    encoder.set_compression(png::Compression::Balanced);
    // Filters by differences of indices would not help, but long runs of equal indices compress well.
    encoder.set_filter(png::Filter::NoFilter);
    let failed = |error: png::EncodingError| ChartError::Drawing {
        source: Box::new(error),
    };
    let mut writer = encoder.write_header().map_err(failed)?;
    writer.write_image_data(pixels).map_err(failed)?;
    writer.finish().map_err(failed)?;
    Ok(file)
}

fn palette_bytes(palette: &[Colour]) -> Vec<u8> {
    palette.iter().flat_map(|c| [c.0, c.1, c.2]).collect()
}
