//! Colours that can be distinguished with colour blindness.

/// A colour: red, green, blue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Colour(pub u8, pub u8, pub u8);

impl Colour {
    /// Black.
    pub const BLACK: Self = Self(0, 0, 0);
    /// White.
    pub const WHITE: Self = Self(255, 255, 255);
    /// The grey of cells without a value.
    pub const GREY: Self = Self(178, 178, 178);
    /// The colour of reference lines.
    pub(super) const DARK_GREY: Self = Self(105, 105, 105);
    /// The colour of the grid.
    pub(super) const LIGHT_GREY: Self = Self(228, 228, 228);

    /// The k-th of eight colours, then from the first again. They are those of Okabe and Ito, which can be told apart
    /// with colour blindness, with a wine red in place of their yellow, which is hardly visible on white.
    pub fn of_series(k: usize) -> Self {
        const PALETTE: [Colour; 8] = [
            Colour(0, 114, 178),
            Colour(213, 94, 0),
            Colour(0, 158, 115),
            Colour(204, 121, 167),
            Colour(230, 159, 0),
            Colour(86, 180, 233),
            Colour(0, 0, 0),
            Colour(136, 34, 85),
        ];
        PALETTE[k % PALETTE.len()]
    }

    /// A colour from dark blue over green to yellow, uniform in lightness, for a fraction from 0 to 1.
    pub(super) fn of_fraction(fraction: f64) -> Self {
        /// Points on a curve through the colour space with equal steps in lightness, after "viridis" of matplotlib.
        const POINTS: [[f64; 3]; 9] = [
            [68.0, 1.0, 84.0],
            [71.0, 44.0, 122.0],
            [59.0, 81.0, 139.0],
            [44.0, 113.0, 142.0],
            [33.0, 144.0, 141.0],
            [39.0, 173.0, 129.0],
            [92.0, 200.0, 99.0],
            [170.0, 220.0, 50.0],
            [253.0, 231.0, 37.0],
        ];
        let place = fraction.clamp(0.0, 1.0) * (POINTS.len() - 1) as f64;
        // A NaN is cast to zero.
        let below = (place as usize).min(POINTS.len() - 2);
        let part = place - below as f64;
        let mix = |k: usize| {
            let (a, b) = (POINTS[below][k], POINTS[below + 1][k]);
            (a + part * (b - a)).round() as u8
        };
        Self(mix(0), mix(1), mix(2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lightness(colour: Colour) -> f64 {
        let Colour(r, g, b) = colour;
        0.2126 * f64::from(r) + 0.7152 * f64::from(g) + 0.0722 * f64::from(b)
    }

    #[test]
    fn lightness_rises_along_the_scale() {
        let values: Vec<f64> = (0..=64)
            .map(|k| lightness(Colour::of_fraction(f64::from(k) / 64.0)))
            .collect();
        assert!(values.windows(2).all(|pair| pair[0] < pair[1]));
        assert_eq!(Colour::of_fraction(-1.0), Colour::of_fraction(0.0));
        assert_eq!(Colour::of_fraction(7.0), Colour(253, 231, 37));
    }

    #[test]
    fn the_palette_repeats() {
        assert_eq!(Colour::of_series(0), Colour::of_series(8));
        assert_ne!(Colour::of_series(0), Colour::of_series(7));
    }
}
