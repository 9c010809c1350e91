//! Axes: scales, ranges, ticks.

use super::error::ChartError;
use std::ops::Range;

/// The scale of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Scale {
    /// Linear: equal differences have equal lengths.
    #[default]
    Linear,
    /// Logarithmic: equal ratios have equal lengths; numbers that are not positive cannot be shown.
    Logarithmic,
}

impl Scale {
    /// Whether a value can be shown on this scale.
    fn holds(self, value: f64) -> bool {
        value.is_finite() && (self == Self::Linear || value > 0.0)
    }
}

/// An axis: its label with the unit, its scale, its range.
///
/// A label alone makes a linear axis whose range fits the data.
///
/// ```
/// use tfe::charts::{Axis, Scale};
///
/// let time = Axis::from("t (s)");
/// let error = Axis::new("error (rad)").scale(Scale::Logarithmic).range(1e-14..1.0);
/// # let _ = (time, error);
/// ```
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Axis {
    label: String,
    scale: Scale,
    range: Option<Range<f64>>,
}

impl Axis {
    /// A linear axis with this label.
    pub fn new(label: impl Into<String>) -> Self {
        Self {
            label: label.into(),
            ..Self::default()
        }
    }

    /// Sets the scale.
    #[must_use]
    pub fn scale(mut self, scale: Scale) -> Self {
        self.scale = scale;
        self
    }

    /// Sets the range from `range.start` to `range.end`, ascending, and positive on a logarithmic axis. What lies
    /// outside is cut off.
    #[must_use]
    pub fn range(mut self, range: Range<f64>) -> Self {
        self.range = Some(range);
        self
    }

    /// The axis over its own range, or over the values that it can show, extended by the fraction `margin` at each end.
    pub(super) fn extent(
        &self,
        values: impl Iterator<Item = f64>,
        margin: f64,
    ) -> Result<Extent, ChartError> {
        let (start, end) = match &self.range {
            Some(range) => self.checked(range)?,
            None => self.fitted(values, margin)?,
        };
        Ok(Extent {
            label: self.label.clone(),
            scale: self.scale,
            start,
            end,
        })
    }

    /// Checks that an axis without a range of its own can begin at this value.
    pub(super) fn check_start(&self, start: f64) -> Result<(), ChartError> {
        match self.range {
            None if self.scale == Scale::Logarithmic && start <= 0.0 => Err(self.not_positive()),
            _ => Ok(()),
        }
    }

    /// Whether a value can be shown on this axis, inside or outside its range.
    pub(super) fn holds(&self, value: f64) -> bool {
        self.scale.holds(value)
    }

    fn not_positive(&self) -> ChartError {
        ChartError::NotPositive {
            axis: self.label.clone(),
        }
    }

    fn checked(&self, range: &Range<f64>) -> Result<(f64, f64), ChartError> {
        let (start, end) = (range.start, range.end);
        if !(start.is_finite() && end.is_finite() && start < end) {
            return Err(ChartError::Range {
                axis: self.label.clone(),
                start,
                end,
            });
        }
        if self.scale == Scale::Logarithmic && start <= 0.0 {
            return Err(self.not_positive());
        }
        Ok((start, end))
    }

    fn fitted(
        &self,
        values: impl Iterator<Item = f64>,
        margin: f64,
    ) -> Result<(f64, f64), ChartError> {
        let mut any = false;
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for value in values.filter(|value| value.is_finite()) {
            any = true;
            if self.holds(value) {
                (low, high) = (low.min(value), high.max(value));
            }
        }
        match self.scale {
            _ if !any => Err(ChartError::NoData),
            _ if low > high => Err(self.not_positive()),
            Scale::Linear => Ok(widened_linear(low, high, margin)),
            Scale::Logarithmic => Ok(widened_logarithmic(low, high, margin)),
        }
    }
}

impl<T: Into<String>> From<T> for Axis {
    fn from(label: T) -> Self {
        Self::new(label)
    }
}

/// The smallest positive number, so that ranges of the smallest numbers are not empty.
const MIN: f64 = f64::from_bits(1);

/// A nonempty range around [low, high], within the finite numbers.
fn widened_linear(low: f64, high: f64, margin: f64) -> (f64, f64) {
    let size = low.abs().max(high.abs());
    // Numbers that differ by rounding only count as equal.
    let room = if high - low <= 1e-12 * size {
        if size == 0.0 {
            1.0
        } else {
            (0.1 * size).max(MIN)
        }
    } else {
        margin * high - margin * low
    };
    ((low - room).max(f64::MIN), (high + room).min(f64::MAX))
}

fn widened_logarithmic(low: f64, high: f64, margin: f64) -> (f64, f64) {
    let decades = high.log10() - low.log10();
    let room = if decades < 1e-12 {
        0.5
    } else {
        margin * decades
    };
    let factor = 10_f64.powf(room);
    ((low / factor).max(MIN), (high * factor).min(f64::MAX))
}

/// A tick mark on an axis.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tick {
    /// The position as a fraction of the axis.
    pub(super) place: f64,
    /// The label; minor ticks have none.
    pub(super) label: Option<String>,
}

/// An axis with a definite range.
#[derive(Clone, Debug)]
pub(super) struct Extent {
    pub(super) label: String,
    scale: Scale,
    start: f64,
    end: f64,
}

impl Extent {
    /// The position of a value: 0 at the start of the axis, 1 at its end; `None` if it cannot be shown.
    pub(super) fn fraction(&self, value: f64) -> Option<f64> {
        Some(self.fraction_at(self.position(value)?))
    }

    /// The position of a value as a finite number, also far outside the axis, where the fraction would overflow; equal
    /// differences have equal lengths. `None` if the value cannot be shown.
    pub(super) fn position(&self, value: f64) -> Option<f64> {
        self.scale.holds(value).then(|| match self.scale {
            Scale::Linear => value,
            Scale::Logarithmic => self.decades_to(value),
        })
    }

    /// The positions of the start and of the end.
    pub(super) fn ends(&self) -> (f64, f64) {
        match self.scale {
            Scale::Linear => (self.start, self.end),
            Scale::Logarithmic => (0.0, self.decades_to(self.end)),
        }
    }

    /// The decades from the start to a positive value, by their ratio: logarithms of nearly equal numbers may be equal.
    fn decades_to(&self, value: f64) -> f64 {
        let ratio = value / self.start;
        if ratio.is_normal() {
            ratio.log10()
        } else {
            value.log10() - self.start.log10()
        }
    }

    /// The fraction of the axis at a position.
    pub(super) fn fraction_at(&self, position: f64) -> f64 {
        let (start, end) = self.ends();
        let part = |scale: f64| (scale * position - scale * start) / (scale * end - scale * start);
        // Large numbers are halved, since their difference may overflow.
        if start.abs().max(end.abs()) > 1e300 {
            part(0.5)
        } else {
            part(1.0)
        }
    }

    /// The value at a fraction of the axis.
    pub(super) fn value(&self, fraction: f64) -> f64 {
        match self.scale {
            Scale::Linear => self.start * (1.0 - fraction) + self.end * fraction,
            Scale::Logarithmic => match self.end / self.start {
                ratio if ratio.is_finite() => self.start * ratio.powf(fraction),
                _ => self.start.powf(1.0 - fraction) * self.end.powf(fraction),
            },
        }
    }

    /// About as many labelled ticks as asked for, at least two, unless no two round numbers are this close together.
    pub(super) fn ticks(&self, wanted: usize) -> Vec<Tick> {
        match self.scale {
            Scale::Linear => self.linear_ticks(wanted),
            Scale::Logarithmic => self.logarithmic_ticks(wanted),
        }
    }

    fn tick(&self, value: f64, label: Option<String>) -> Option<Tick> {
        // Ticks at the ends are kept even if rounding moves them outside.
        let place = self
            .fraction(value)
            .filter(|place| (-1e-9..=1.0 + 1e-9).contains(place))?;
        Some(Tick {
            place: place.clamp(0.0, 1.0),
            label,
        })
    }

    fn linear_ticks(&self, wanted: usize) -> Vec<Tick> {
        let wanted = wanted.max(2);
        // Steps are rounded up by a factor of up to 2.5, so that few may leave one tick or none; five leave two.
        let parts = (wanted..5).find(|&parts| self.round_ticks(parts).len() >= 2);
        self.round_ticks(parts.unwrap_or(wanted.max(5)))
    }

    /// Ticks at multiples of a round number, which is at least the axis divided by `wanted`.
    fn round_ticks(&self, wanted: usize) -> Vec<Tick> {
        let step = round_step(self.end / wanted as f64 - self.start / wanted as f64);
        let first = (self.start / step - 1e-9).ceil();
        (0..=2 * wanted)
            .map(|k| (first + k as f64) * step)
            .filter_map(|value| {
                let largest = self.start.abs().max(self.end.abs());
                self.tick(value, Some(number(value, step, largest)))
            })
            .collect()
    }

    fn logarithmic_ticks(&self, wanted: usize) -> Vec<Tick> {
        let (start, end) = (self.start.log10(), self.end.log10());
        let (first, last) = ((start - 1e-9).ceil() as i32, (end + 1e-9).floor() as i32);
        // Up to half a decade, a logarithmic axis looks linear.
        if end - start < 0.7 {
            return self.linear_ticks(wanted);
        }
        let decades = (last - first + 1).max(0);
        let every = (decades as usize).div_ceil(wanted.max(2)).max(1) as i32;
        let multiples = last.div_euclid(every) - (first - 1).div_euclid(every);
        // With three powers, every second one may be only the middle one.
        let base = if multiples < 2 { first } else { 0 };
        let is_plain = (-2..=4).contains(&first) && (-2..=4).contains(&last);
        // Labels at 2 and 5 if there is room between the powers, or if they are needed.
        let few = decades < 2 || (decades < 3 && end - start <= wanted as f64);
        let mut ticks = Vec::new();
        for exponent in first - 1..=last {
            for mantissa in 1..10 {
                let value = parse(mantissa, exponent);
                let labelled = match mantissa {
                    1 => (exponent - base).rem_euclid(every) == 0,
                    2 | 5 => few,
                    _ => false,
                };
                let is_clear = if mantissa == 1 {
                    decades <= 24
                } else {
                    decades <= 8
                };
                if !(labelled || is_clear) {
                    continue;
                }
                let label = labelled.then(|| power(mantissa, exponent, is_plain));
                ticks.extend(self.tick(value, label));
            }
        }
        ticks
    }
}

/// The `f64` closest to a decimal number.
fn parse(mantissa: i32, exponent: i32) -> f64 {
    format!("{mantissa}e{exponent}").parse().unwrap_or(f64::NAN)
}

/// The least 1, 2 or 5 times a power of ten that is not below `step`.
fn round_step(step: f64) -> f64 {
    let exponent = step.log10().floor() as i32;
    [1, 2, 5]
        .into_iter()
        .map(|mantissa| parse(mantissa, exponent))
        .chain([parse(1, exponent.saturating_add(1))])
        .find(|&round| round >= step * (1.0 - 1e-9))
        .filter(|round| *round > 0.0 && round.is_finite())
        .unwrap_or(step)
}

/// A label on an axis whose ticks are `step` apart and at most `largest`, with as many decimals as distinguish them.
fn number(value: f64, step: f64, largest: f64) -> String {
    let value = if value.abs() < 1e-9 * step {
        0.0
    } else {
        value
    };
    let digit = step.log10().floor() as i32;
    if (1e-4..1e6).contains(&largest) {
        // Without a step the number of decimals is undefined; all digits of an integer could be too many.
        let decimals = digit.checked_neg().map(usize::try_from);
        let decimals = decimals.and_then(Result::ok).unwrap_or(0);
        return minus(&format!("{value:.decimals$}"));
    }
    if value == 0.0 {
        return "0".to_owned();
    }
    let exponent = value.abs().log10().floor() as i32;
    let digits = usize::try_from(exponent.saturating_sub(digit))
        .unwrap_or(0)
        .min(16);
    let text = format!("{value:.digits$e}");
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    format!("{}·10{}", minus(mantissa), superscript(exponent))
}

fn power(mantissa: i32, exponent: i32, is_plain: bool) -> String {
    if is_plain {
        return format!("{}", parse(mantissa, exponent));
    }
    let power = superscript(&exponent.to_string());
    match mantissa {
        1 => format!("10{power}"),
        _ => format!("{mantissa}·10{power}"),
    }
}

/// Replaces the hyphen by the typographic minus sign.
fn minus(text: &str) -> String {
    text.replace('-', "−")
}

fn superscript(digits: &str) -> String {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    digits
        .chars()
        .map(|c| match c.to_digit(10) {
            Some(digit) => DIGITS[digit as usize],
            None => '⁻',
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(scale: Scale, range: Range<f64>, wanted: usize) -> Vec<String> {
        let axis = Axis::new("x").scale(scale).range(range);
        let ticks = axis.extent(std::iter::empty(), 0.0).unwrap().ticks(wanted);
        assert!(ticks.iter().all(|tick| (0.0..=1.0).contains(&tick.place)));
        ticks.into_iter().filter_map(|tick| tick.label).collect()
    }

    #[test]
    fn linear_ticks_are_round() {
        assert_eq!(
            labels(Scale::Linear, 0.0..10.0, 5),
            ["0", "2", "4", "6", "8", "10"]
        );
        assert_eq!(
            labels(Scale::Linear, -0.3..0.25, 6),
            ["−0.3", "−0.2", "−0.1", "0.0", "0.1", "0.2"]
        );
        assert_eq!(
            labels(Scale::Linear, 0.0..3e-7, 3),
            ["0", "1·10⁻⁷", "2·10⁻⁷", "3·10⁻⁷"]
        );
        assert_eq!(
            labels(Scale::Linear, 1e8..3e8, 2),
            ["1·10⁸", "2·10⁸", "3·10⁸"]
        );
    }

    #[test]
    fn logarithmic_ticks_are_powers_of_ten() {
        assert_eq!(
            labels(Scale::Logarithmic, 1e-14..1.0, 8),
            [
                "10⁻¹⁴",
                "10⁻¹²",
                "10⁻¹⁰",
                "10⁻⁸",
                "10⁻⁶",
                "10⁻⁴",
                "10⁻²",
                "10⁰"
            ]
        );
        assert_eq!(
            labels(Scale::Logarithmic, 0.01..10.0, 6),
            ["0.01", "0.1", "1", "10"]
        );
        assert_eq!(
            labels(Scale::Logarithmic, 0.002..0.3, 6),
            ["0.002", "0.005", "0.01", "0.02", "0.05", "0.1", "0.2"]
        );
        assert_eq!(
            labels(Scale::Logarithmic, 2.0..4.0, 4),
            ["2.0", "2.5", "3.0", "3.5", "4.0"]
        );
    }

    #[test]
    fn few_ticks_are_two_at_least() {
        assert_eq!(labels(Scale::Linear, 0.5..4.6, 2), ["2", "4"]);
        assert_eq!(labels(Scale::Linear, 0.1..1.3, 2), ["0.5", "1.0"]);
        assert_eq!(labels(Scale::Logarithmic, 0.05..50.0, 2), ["0.1", "10"]);
        assert_eq!(labels(Scale::Logarithmic, 1e-8..1e-4, 2), ["10⁻⁸", "10⁻⁵"]);
        for wanted in 2..8 {
            for k in 0..200 {
                let (start, end) = (0.37 * f64::from(k), 0.41 * f64::from(k) + 1.0);
                let linear = labels(Scale::Linear, start..end, wanted);
                assert!(linear.len() >= 2, "{start}..{end}: {linear:?}");
                let (start, end) = (10_f64.powf(start - 40.0), 10_f64.powf(end - 40.0));
                let logarithmic = labels(Scale::Logarithmic, start..end, wanted);
                assert!(
                    logarithmic.len() >= 2,
                    "{start:e}..{end:e}: {logarithmic:?}"
                );
            }
        }
    }

    #[test]
    fn extreme_ranges_have_finite_ticks() {
        for range in [
            f64::MIN..f64::MAX,
            1.0..1.0 + f64::EPSILON,
            0.0..f64::MIN_POSITIVE,
            0.0..5e-324,
            1e300..1.1e300,
        ] {
            let axis = Axis::new("x").range(range);
            let extent = axis.extent(std::iter::empty(), 0.0).unwrap();
            for scale in [Scale::Linear, Scale::Logarithmic] {
                let extent = Extent {
                    scale,
                    start: if scale == Scale::Linear {
                        extent.start
                    } else {
                        5e-324
                    },
                    ..extent.clone()
                };
                assert!(extent.ticks(6).len() <= 100);
            }
            assert!(extent.fraction(f64::NAN).is_none());
            assert_eq!(extent.fraction(extent.end), Some(1.0));
        }
    }

    #[test]
    fn ranges_that_fit() {
        let axis = Axis::new("x");
        let extent = axis.extent([f64::NAN, 1.0, 3.0].into_iter(), 0.5).unwrap();
        assert_eq!((extent.start, extent.end), (0.0, 4.0));
        let one = axis.extent([5.0].into_iter(), 0.0).unwrap();
        assert_eq!((one.start, one.end), (4.5, 5.5));
        let logarithmic = axis.clone().scale(Scale::Logarithmic);
        let extent = logarithmic
            .extent([0.0, -1.0, 1.0, 100.0].into_iter(), 0.5)
            .unwrap();
        assert!((extent.start - 0.1).abs() < 1e-15 && (extent.end - 1e3).abs() < 1e-11);
        assert_eq!(extent.fraction(-1.0), None);
        assert!((extent.value(0.5) - 10.0).abs() < 1e-13);
    }

    #[test]
    fn ranges_of_the_smallest_numbers_are_ascending_and_hold_them() {
        let least = f64::from_bits(1);
        for values in [[least, least], [least, 3.0 * least], [1e-310, 1e-305]] {
            for scale in [Scale::Linear, Scale::Logarithmic] {
                let axis = Axis::new("x").scale(scale);
                for margin in [0.0, 0.05] {
                    let extent = axis.extent(values.into_iter(), margin).unwrap();
                    assert!(extent.start < extent.end, "{extent:?}");
                    assert!(extent.start <= values[0] && values[1] <= extent.end);
                }
            }
        }
    }

    #[test]
    fn narrow_logarithmic_axes_keep_their_digits() {
        let axis = Axis::new("x").scale(Scale::Logarithmic);
        for start in [1e-300_f64, 3e-5, 1e5, 1e300] {
            for width in [f64::EPSILON, 1e-13, 1e-9, 1e-3] {
                let range = start..start * (1.0 + 2.0 * width);
                let extent = axis.clone().range(range.clone());
                let extent = extent.extent(std::iter::empty(), 0.0).unwrap();
                // The deviation from a linear axis is half the relative width; the middle is rounded to an ulp.
                let slack = width + f64::EPSILON / width;
                let middle = start * (1.0 + width);
                let fraction = extent.fraction(middle).unwrap();
                assert!((fraction - 0.5).abs() <= slack, "{range:?}: {fraction}");
                let value = extent.value(0.5);
                let difference = (value / middle - 1.0).abs();
                assert!(
                    difference <= width * width + 4.0 * f64::EPSILON,
                    "{range:?}: {value:e}"
                );
                assert_eq!(extent.fraction(start), Some(0.0));
                assert_eq!(extent.fraction(range.end), Some(1.0));
            }
        }
        let wide = axis.range(1e-300..1e300);
        let wide = wide.extent(std::iter::empty(), 0.0).unwrap();
        assert!((wide.fraction(1.0).unwrap() - 0.5).abs() < 1e-15);
        assert!((wide.value(0.5) - 1.0).abs() < 1e-13);
    }

    #[test]
    fn ranges_that_do_not() {
        let axis = Axis::new("x");
        let none = std::iter::empty;
        assert!(matches!(axis.extent(none(), 0.0), Err(ChartError::NoData)));
        let reversed = Range {
            start: 1.0,
            end: 0.0,
        };
        for range in [reversed, 0.0..0.0, f64::NAN..1.0, 0.0..f64::INFINITY] {
            assert!(matches!(
                axis.clone().range(range).extent(none(), 0.0),
                Err(ChartError::Range { .. })
            ));
        }
        let far = axis.clone().range(Range {
            start: 1e300,
            end: -1e-200,
        });
        let error = far.extent(none(), 0.0).unwrap_err().to_string();
        assert!(error.contains("from 1e300 to -1e-200:"), "{error}");
        let logarithmic = axis.scale(Scale::Logarithmic);
        assert!(matches!(
            logarithmic.extent([-1.0, 0.0].into_iter(), 0.0),
            Err(ChartError::NotPositive { .. })
        ));
        assert!(matches!(
            logarithmic.range(0.0..1.0).extent(none(), 0.0),
            Err(ChartError::NotPositive { .. })
        ));
    }
}
