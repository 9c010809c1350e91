//! Clips curves to the frame.

/// A point of a picture, or a fraction of a frame.
pub(super) type Point = (f64, f64);

/// The parts of a curve inside the rectangle from `low` to `high`; `None` is a gap in the curve.
///
/// A curve that leaves and returns gives two parts, cut at the border. A part has at least two points.
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

/// Whether a point lies in the rectangle or on its border.
pub(super) fn contains((x, y): Point, low: Point, high: Point) -> bool {
    (low.0..=high.0).contains(&x) && (low.1..=high.1).contains(&y)
}

/// The part of a segment inside the rectangle: clipped at the vertical borders, then at the horizontal ones.
fn inside(from: Point, to: Point, low: Point, high: Point) -> Option<(Point, Point)> {
    let (from, to) = between(from, to, low.0, high.0)?;
    let turned = |(x, y): Point| (y, x);
    let (from, to) = between(turned(from), turned(to), low.1, high.1)?;
    Some((turned(from), turned(to)))
}

/// The part of a segment with x from `low` to `high`. Ends inside are unchanged, so that parts can be joined.
fn between(from: Point, to: Point, low: f64, high: f64) -> Option<(Point, Point)> {
    if from.0.max(to.0) < low || from.0.min(to.0) > high {
        return None;
    }
    let cut = |end: Point, other: Point| match end.0.clamp(low, high) {
        x if x == end.0 => end,
        x => (x, height_at(x, end, other)),
    };
    // The second cut starts from the first, which is close to the rectangle however far away the ends are.
    let from = cut(from, to);
    Some((from, cut(to, from)))
}

/// The y of the line through two points at an x between them, computed from the nearer one: the other y may be so large
/// that it has no significant digits here.
fn height_at(x: f64, a: Point, b: Point) -> f64 {
    let (near, far) = if (x - a.0).abs() <= (x - b.0).abs() {
        (a, b)
    } else {
        (b, a)
    };
    let part = |scale: f64| (scale * x - scale * near.0) / (scale * far.0 - scale * near.0);
    // Large numbers are halved, since their difference may overflow.
    let part = if (far.0 - near.0).is_finite() {
        part(1.0)
    } else {
        part(0.5)
    };
    // Exactly the same y on horizontal lines.
    near.1 + (part * far.1 - part * near.1)
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

    #[test]
    fn ends_far_away_change_no_slope() {
        // It rises by a tenth, however far the curve extends; in both directions.
        for far in [1e3, 1e9, 1e30, 1e300] {
            for points in [
                [(0.0, 1.0), (far, 1.0 + 0.1 * far)],
                [(far, 1.0 + 0.1 * far), (0.0, 1.0)],
            ] {
                let part = parts(points.map(Some), (0.0, 0.0), (4.0, 2.0)).remove(0);
                let highest = part[0].1.max(part[1].1);
                // 1 + 0.1 · 4, up to rounding errors of the coordinates.
                assert!((highest - 1.4).abs() < 1e-14, "{far}: {part:?}");
            }
        }
        // Across, from the lowest finite number to the largest.
        for far in [1e30, f64::MAX] {
            check(
                &[Some((-far, 1.0)), Some((far, 1.0))],
                &[&[(0.0, 1.0), (4.0, 1.0)]],
            );
            check(
                &[Some((-far, -far)), Some((far, far))],
                &[&[(0.0, 0.0), (2.0, 2.0)]],
            );
        }
    }
}
