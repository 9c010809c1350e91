//! Tables of inputs: values at given times and their interpolation.

use crate::numbers::Short;

/// How an input is interpolated between the times of a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// The input keeps each value until the next time (zero-order hold).
    Hold,
    /// Linear interpolation.
    Linear,
    /// A cubic spline with continuous second derivatives and the not-a-knot condition: its first two pieces are one
    /// cubic, and so are its last two. Three values give a parabola, two a line.
    Spline,
}

/// A piecewise cubic polynomial.
#[derive(Debug)]
pub(super) struct Table {
    times: Vec<f64>,
    values: Vec<f64>,
    /// The coefficients of s, s² and s³ for each piece, where s is the time since its start.
    pieces: Vec<[f64; 3]>,
}

impl Table {
    pub(super) fn new(
        times: &[f64],
        values: &[f64],
        interpolation: Interpolation,
    ) -> Result<Self, String> {
        if times.is_empty() || times.len() != values.len() {
            return Err(format!(
                "there must be as many values as times, and at least one, but there are {} times and {} values",
                times.len(),
                values.len()
            ));
        }
        for (kind, numbers) in [("time", times), ("value", values)] {
            if let Some(at) = numbers.iter().position(|number| !number.is_finite()) {
                let number = Short(numbers[at]);
                return Err(format!("its {kind} [{at}] is {number}, but must be finite"));
            }
        }
        if let Some(at) = times.windows(2).position(|pair| !(pair[0] < pair[1])) {
            let (first, second) = (Short(times[at]), Short(times[at + 1]));
            return Err(format!(
                "the times must increase, but its time [{}] is {second} after {first}",
                at + 1
            ));
        }
        let pieces = match interpolation {
            Interpolation::Hold => vec![[0.0; 3]; times.len() - 1],
            Interpolation::Linear => slopes(times, values)
                .map(|slope| [slope, 0.0, 0.0])
                .collect(),
            Interpolation::Spline => spline(times, values),
        };
        Ok(Self {
            times: times.to_vec(),
            values: values.to_vec(),
            pieces,
        })
    }

    /// The times of the values.
    pub(super) fn times(&self) -> &[f64] {
        &self.times
    }

    /// The value at a time; at a time of the table, exactly the given value.
    pub(super) fn at(&self, t: f64) -> f64 {
        if t.is_nan() {
            return t;
        }
        let Some(piece) = self.times.partition_point(|time| *time <= t).checked_sub(1) else {
            return self.values[0];
        };
        let Some([a, b, c]) = self.pieces.get(piece) else {
            return self.values[piece];
        };
        let s = t - self.times[piece];
        self.values[piece] + s * (a + s * (b + s * c))
    }

    /// The derivative of a given order, with 0 the value: that of the piece that contains the time, extrapolated beyond
    /// its ends. Zero for held values.
    pub(super) fn derivative(&self, order: u32, t: f64) -> f64 {
        if order == 0 || t.is_nan() {
            return self.at(t);
        }
        let piece = self.times.partition_point(|time| *time <= t).checked_sub(1);
        let inside = piece.and_then(|piece| Some((self.times[piece], self.pieces.get(piece)?)));
        let Some((begin, [a, b, c])) = inside else {
            return 0.0;
        };
        let s = t - begin;
        match order {
            1 => a + s * (2.0 * b + s * (3.0 * c)),
            2 => 2.0 * b + s * (6.0 * c),
            3 => 6.0 * c,
            _ => 0.0,
        }
    }
}

/// The slopes of the chords between successive values.
fn slopes<'a>(times: &'a [f64], values: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
    let pairs = times.windows(2).zip(values.windows(2));
    pairs.map(|(t, f)| (f[1] - f[0]) / (t[1] - t[0]))
}

/// The pieces of a spline, from its second derivatives at the times.
fn spline(times: &[f64], values: &[f64]) -> Vec<[f64; 3]> {
    let chords: Vec<f64> = slopes(times, values).collect();
    let steps: Vec<f64> = times.windows(2).map(|t| t[1] - t[0]).collect();
    let bends = bends(&steps, &chords);
    (steps.iter().zip(&chords).enumerate())
        .map(|(k, (h, chord))| {
            let (start, end) = (bends[k], bends[k + 1]);
            let slope = chord - h * (2.0 * start + end) / 6.0;
            [slope, 0.5 * start, (end - start) / (6.0 * h)]
        })
        .collect()
}

/// The second derivatives of the spline at the times.
fn bends(steps: &[f64], chords: &[f64]) -> Vec<f64> {
    let n = steps.len();
    match n {
        0 => return vec![0.0],
        1 => return vec![0.0; 2],
        2 => return vec![2.0 * (chords[1] - chords[0]) / (steps[0] + steps[1]); 3],
        _ => {}
    }
    // Continuous slopes inside: h₋ f″₋ + 2(h₋ + h) f″ + h f″₊ = 6(c − c₋); the ends are extrapolated, f″₀ = f″₁ −
    // (h₀/h₁)(f″₂ − f″₁).
    let (mut diagonal, mut right) = (vec![0.0; n - 1], vec![0.0; n - 1]);
    let (mut lower, mut upper) = (vec![0.0; n - 1], vec![0.0; n - 1]);
    for k in 0..n - 1 {
        let (before, after) = (steps[k], steps[k + 1]);
        diagonal[k] = 2.0 * (before + after);
        lower[k] = before;
        upper[k] = after;
        right[k] = 6.0 * (chords[k + 1] - chords[k]);
    }
    let first = steps[0] / steps[1];
    diagonal[0] += steps[0] * (1.0 + first);
    upper[0] -= steps[0] * first;
    let last = steps[n - 1] / steps[n - 2];
    diagonal[n - 2] += steps[n - 1] * (1.0 + last);
    lower[n - 2] -= steps[n - 1] * last;
    for k in 1..n - 1 {
        let factor = lower[k] / diagonal[k - 1];
        diagonal[k] -= factor * upper[k - 1];
        right[k] -= factor * right[k - 1];
    }
    let mut bends = vec![0.0; n + 1];
    for k in (0..n - 1).rev() {
        let after = if k + 1 < n - 1 {
            upper[k] * bends[k + 2]
        } else {
            0.0
        };
        bends[k + 1] = (right[k] - after) / diagonal[k];
    }
    bends[0] = bends[1] - first * (bends[2] - bends[1]);
    bends[n] = bends[n - 1] + last * (bends[n - 1] - bends[n - 2]);
    bends
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIMES: [f64; 6] = [-1.0, -0.3, 0.2, 1.0, 1.1, 2.5];

    fn table(interpolation: Interpolation, of: fn(f64) -> f64, count: usize) -> Table {
        let times = &TIMES[..count];
        let values: Vec<f64> = times.iter().map(|t| of(*t)).collect();
        Table::new(times, &values, interpolation).expect("a table")
    }

    /// A polynomial of at most the degree of the interpolation is reproduced.
    #[test]
    fn polynomials_are_reproduced() {
        let cubic = |t: f64| 1.0 + t * (2.0 + t * (-3.0 + t * 0.5));
        let square = |t: f64| 1.0 + t * (2.0 - 3.0 * t);
        let line = |t: f64| 1.0 + 2.0 * t;
        for (of, counts) in [
            (cubic as fn(f64) -> f64, 4..7),
            (square, 3..7),
            (line, 2..7),
        ] {
            for count in counts {
                let table = table(Interpolation::Spline, of, count);
                for k in 0..=40 {
                    let t = TIMES[0] + (TIMES[count - 1] - TIMES[0]) * f64::from(k) / 40.0;
                    assert!((table.at(t) - of(t)).abs() < 2e-14, "{count} values at {t}");
                }
            }
        }
        let lines = table(Interpolation::Linear, line, 6);
        assert!((lines.at(0.77) - line(0.77)).abs() < 1e-15);
    }

    /// The interpolation has order four up to its ends.
    #[test]
    fn splines_have_order_four() {
        let error = |count: u32| {
            let times: Vec<f64> = (0..=count)
                .map(|k| f64::from(k) / f64::from(count))
                .collect();
            let values: Vec<f64> = times.iter().map(|t| (3.0 * t).sin()).collect();
            let table = Table::new(&times, &values, Interpolation::Spline).expect("a table");
            (0..8 * count)
                .map(|k| f64::from(k) / f64::from(8 * count))
                .map(|t| (table.at(t) - (3.0 * t).sin()).abs())
                .fold(0.0, crate::numbers::larger)
        };
        // Because of the extrapolated ends, the order measured with fewer points is a little higher.
        let order = (error(256) / error(512)).log2();
        assert!((order - 4.0).abs() < 0.1, "{order}");
    }

    #[test]
    fn values_are_kept_at_the_ends() {
        for way in [
            Interpolation::Hold,
            Interpolation::Linear,
            Interpolation::Spline,
        ] {
            let table = table(way, |t| t * t, 6);
            assert_eq!((table.at(-7.0), table.at(7.0)), (1.0, 6.25));
            for (k, t) in TIMES.iter().enumerate() {
                assert_eq!(table.at(*t), TIMES[k] * TIMES[k]);
            }
            assert!(table.at(f64::NAN).is_nan());
        }
        let held = table(Interpolation::Hold, |t| t * t, 6);
        assert_eq!(held.at(0.999), 0.2 * 0.2);
    }

    /// At a time of the table, and within rounding of it, each side has its own derivatives.
    #[test]
    fn derivatives_are_those_of_the_own_piece() {
        let held = table(Interpolation::Hold, |t| t * t, 6);
        let lines = table(Interpolation::Linear, |t| t * t, 6);
        let slopes: Vec<f64> = lines.pieces.iter().map(|piece| piece[0]).collect();
        for (k, t) in TIMES.iter().enumerate() {
            // Constant before the first time and from the last one on.
            let before = k.checked_sub(1).map_or(0.0, |piece| slopes[piece]);
            let after = slopes.get(k).copied().unwrap_or(0.0);
            for (time, slope) in [(t.next_down(), before), (*t, after), (t.next_up(), after)] {
                assert_eq!(lines.derivative(0, time), lines.at(time));
                assert_eq!(lines.derivative(1, time), slope, "{time}");
                assert_eq!(lines.derivative(2, time), 0.0);
                assert!((1..4).all(|order| held.derivative(order, time) == 0.0));
            }
        }
        let cubic = table(
            Interpolation::Spline,
            |t| 1.0 + t * (2.0 + t * (-3.0 + t * 0.5)),
            6,
        );
        for t in [-0.9, 0.2, 0.7, 2.4] {
            let expected = [2.0 + t * (-6.0 + 1.5 * t), -6.0 + 3.0 * t, 3.0, 0.0];
            for (order, expected) in (1..).zip(expected) {
                let found = cubic.derivative(order, t);
                assert!((found - expected).abs() < 1e-10, "{order}: {found}");
            }
        }
        assert!(held.derivative(1, f64::NAN).is_nan());
    }

    #[test]
    fn what_is_no_table_is_refused() {
        let new = |times: &[f64], values: &[f64]| {
            Table::new(times, values, Interpolation::Linear).is_err()
        };
        assert!(new(&[], &[]) && new(&[0.0], &[0.0, 1.0]));
        assert!(new(&[0.0, 0.0], &[0.0, 1.0]) && new(&[0.0, f64::NAN], &[0.0, 1.0]));
        assert!(new(&[0.0, 1.0], &[0.0, f64::INFINITY]));
        assert!(!new(&[3.0], &[1.0]));
        // The reason names the numbers.
        let told = |times: &[f64], values: &[f64]| {
            let table = Table::new(times, values, Interpolation::Hold);
            table.expect_err("no table")
        };
        assert!(told(&[0.0, 2.5, 2.5], &[1.0; 3]).contains("its time [2] is 2.5 after 2.5"));
        assert!(told(&[0.0, 1.0], &[1.0, f64::NAN]).contains("its value [1] is NaN"));
        assert!(told(&[0.0], &[1.0, 2.0]).contains("1 times and 2 values"));
    }
}
