//! Curves cut at the frame.

/// A point of a picture, or a fraction of a frame.
pub(super) type Point = (f64, f64);

/// The parts of a curve inside the rectangle from `low` to `high`; `None` is a gap in it.
///
/// A curve that leaves and comes back is two parts, cut where it crosses the border. A part has at least two points.
pub(super) fn parts(
    points: impl IntoIterator<Item = Option<Point>>,
    low: Point,
    high: Point,
) -> Vec<Vec<Point>> {
    let mut parts: Vec<Vec<Point>> = Vec::new();
    let mut previous = None;
    for point in points {
        if let (Some(from), Some(to)) = (previous, point)
            && let Some((start, end)) = inside(from, to, low, high)
        {
            match parts.last_mut() {
                Some(part) if part.last() == Some(&start) => part.push(end),
                _ => parts.push(vec![start, end]),
            }
        }
        previous = point;
    }
    parts
}

/// Whether a point lies in the rectangle, its border included.
pub(super) fn contains((x, y): Point, low: Point, high: Point) -> bool {
    (low.0..=high.0).contains(&x) && (low.1..=high.1).contains(&y)
}

/// The part of a segment inside the rectangle [Liang & Barsky]: with p(s) = from + s (to − from), the s of all four inequalities.
fn inside(from: Point, to: Point, low: Point, high: Point) -> Option<(Point, Point)> {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let (mut start, mut end) = (0.0_f64, 1.0_f64);
    // Each inequality is step · s ≤ room.
    for (step, room) in [
        (-dx, from.0 - low.0),
        (dx, high.0 - from.0),
        (-dy, from.1 - low.1),
        (dy, high.1 - from.1),
    ] {
        if step == 0.0 {
            if room < 0.0 {
                return None;
            }
        } else if step < 0.0 {
            start = start.max(room / step);
        } else {
            end = end.min(room / step);
        }
    }
    // The ends themselves where they are inside: no rounding, so that parts can be joined.
    let at = |s: f64| match s {
        0.0 => from,
        1.0 => to,
        s => (from.0 + s * dx, from.1 + s * dy),
    };
    (start <= end).then(|| (at(start), at(end)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(points: &[Option<Point>], expected: &[&[Point]]) {
        let found = parts(points.iter().copied(), (0.0, 0.0), (4.0, 2.0));
        assert_eq!(found, expected);
    }

    #[test]
    fn curves_inside_are_whole() {
        check(
            &[Some((0.0, 0.0)), Some((1.0, 2.0)), Some((4.0, 1.0))],
            &[&[(0.0, 0.0), (1.0, 2.0), (4.0, 1.0)]],
        );
    }

    #[test]
    fn gaps_divide() {
        check(
            &[
                Some((0.0, 0.0)),
                Some((1.0, 1.0)),
                None,
                Some((2.0, 1.0)),
                None,
                Some((3.0, 1.0)),
                Some((3.0, 2.0)),
            ],
            &[&[(0.0, 0.0), (1.0, 1.0)], &[(3.0, 1.0), (3.0, 2.0)]],
        );
    }

    #[test]
    fn curves_are_cut_where_they_cross_the_border() {
        // Up through the upper border at x = 1, down again at x = 3.
        check(
            &[Some((0.0, 1.0)), Some((2.0, 3.0)), Some((4.0, 1.0))],
            &[&[(0.0, 1.0), (1.0, 2.0)], &[(3.0, 2.0), (4.0, 1.0)]],
        );
        // Past the rectangle, and through it from outside to outside.
        check(&[Some((-1.0, 3.0)), Some((5.0, 3.0))], &[]);
        check(
            &[Some((-1.0, 1.0)), Some((5.0, 1.0))],
            &[&[(0.0, 1.0), (4.0, 1.0)]],
        );
        check(&[Some((-1.0, 1.0)), Some((1.0, 5.0))], &[]);
    }
}
