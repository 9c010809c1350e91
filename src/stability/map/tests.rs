use super::*;

fn plan() -> MapPlan {
    StabilityMap::over(0.0..4.0, -1.0..1.0).resolution(4, 2)
}

fn sum(x: f64, y: f64) -> Result<f64, String> {
    Ok(x + 10.0 * y)
}

#[test]
fn cells_are_at_their_centres() {
    let map = plan().run(sum).unwrap();
    assert_eq!((map.columns(), map.rows()), (4, 2));
    assert_eq!(
        (map.x(0), map.x(3), map.y(0), map.y(1)),
        (0.5, 3.5, -0.5, 0.5)
    );
    for j in 0..2 {
        for i in 0..4 {
            assert_eq!(map.value(i, j), Some(map.x(i) + 10.0 * map.y(j)));
        }
    }
    assert_eq!((map.value(4, 0), map.value(0, 2)), (None, None));
    assert_eq!(map.radius_at(1.99, -0.01), map.value(1, 0));
    assert_eq!(map.radius_at(4.0, 1.0), map.value(3, 1));
    assert_eq!(map.radius_at(4.1, 0.0), None);
    assert_eq!(map.radius_at(f64::NAN, 0.0), None);
    assert_eq!(map.largest(), Some(8.5));
}

#[test]
fn unstable_is_above_the_limit() {
    let map = plan().run(sum).unwrap();
    assert_eq!(map.fraction_unstable(), Some(0.5));
    let map = plan().limit(7.0).run(sum).unwrap();
    assert_eq!(map.fraction_unstable(), Some(0.25));
    let never = plan().limit(f64::NAN).run(sum).unwrap_err();
    assert!(matches!(never, MapError::Limit), "{never}");
    let even = plan().run(|_, _| Ok::<_, String>(1.0 + 1e-9)).unwrap();
    assert_eq!(even.fraction_unstable(), Some(0.0));
}

#[test]
fn failures_are_counted_and_have_no_value() {
    let map = plan()
        .run(|x, y| match x {
            x if y < 0.0 && x > 3.0 => Ok(f64::NAN),
            x if y > 0.0 && x < 2.0 => Err("bad"),
            x => Ok(x),
        })
        .unwrap();
    assert_eq!(map.failed(), 3);
    assert_eq!(map.value(3, 0), None);
    let first = map.first_failure().unwrap();
    assert_eq!(
        (first.column, first.row, first.x, first.y),
        (3, 0, 3.5, -0.5)
    );
    assert!(matches!(first.error, PointError::NotFinite { value } if value.is_nan()));
    // The five remaining points are x = 0.5, 1.5, 2.5 in one row and x = 2.5, 3.5 in the other.
    assert_eq!(map.fraction_unstable(), Some(0.8));

    let none = plan().run(|_, _| Err::<f64, _>("all bad")).unwrap();
    assert_eq!(none.failed(), 8);
    assert_eq!((none.fraction_unstable(), none.largest()), (None, None));
    let first = none.first_failure().unwrap();
    assert_eq!(first.error, PointError::Failed("all bad"));
    assert_eq!(first.to_string(), "at (0.5, -0.5): all bad");
}

#[test]
fn csv_has_empty_fields_for_failures() {
    let map = StabilityMap::over(0.0..2.0, 0.0..1.0)
        .resolution(2, 1)
        .run(|x, _| if x < 1.0 { Err(()) } else { Ok(0.1) })
        .unwrap();
    let path = std::env::temp_dir().join(format!("tfe-stability-map-{}.csv", std::process::id()));
    map.save(&path).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::remove_file(&path).unwrap();
    assert_eq!(text, "x,y,value\n0.5,0.5,\n1.5,0.5,0.1\n");
}

#[test]
fn errors() {
    for (columns, rows) in [(0, 5), (5, 0), (usize::MAX, 2), (1 << 20, 1 << 20)] {
        let map = plan().resolution(columns, rows).run(sum);
        assert!(matches!(map, Err(MapError::Resolution { .. })));
    }
    let reversed = Range {
        start: 1.0,
        end: 0.0,
    };
    for range in [reversed, 0.0..f64::NAN, 0.0..f64::INFINITY, 1.0..1.0] {
        let map = StabilityMap::over(0.0..1.0, range)
            .labels("a", "q")
            .run(sum);
        assert!(matches!(map, Err(MapError::Range { label, .. }) if label == "q"));
    }
    let map = plan().run(sum).unwrap();
    let error = map.save("map.pdf").unwrap_err();
    assert!(matches!(error, MapError::UnknownEnding { .. }));
    assert!(error.to_string().contains(".csv"));
    assert!(matches!(
        map.save("no/such/folder/map.csv"),
        Err(MapError::Io { .. })
    ));
}

#[cfg(feature = "charts")]
mod pictures {
    use super::*;
    use crate::charts::ChartError;

    #[test]
    fn colours_begin_at_the_limit() {
        let map = plan()
            .limit(2.0)
            .labels("a", "q")
            .run(|x, _| Ok::<_, String>(x))
            .unwrap();
        // Stable, stable, then between the ends of a logarithmic scale from 2 to 3.5.
        let csv = map.heat_map().to_csv().unwrap();
        assert!(csv.contains("3.5,0.5,3.5"));
        let svg = map.heat_map().to_svg().unwrap();
        assert!(svg.contains("spectral radius"));
        assert!(map.classes().to_svg().unwrap().contains("unstable"));
    }

    #[test]
    fn any_map_with_a_value_has_a_picture() {
        let constant = [0.0, 1.0, -3.0, 1e300, f64::MAX, 5e-324];
        for value in constant {
            for limit in [1.0, 0.0, -5.0, f64::INFINITY] {
                let map = plan()
                    .limit(limit)
                    .run(|_, _| Ok::<_, String>(value))
                    .unwrap();
                assert!(map.heat_map().to_svg().is_ok(), "{value} over {limit}");
                assert!(map.classes().to_svg().is_ok());
            }
        }
        let none = plan().run(|_, _| Err::<f64, _>("bad")).unwrap();
        assert!(matches!(
            none.save("map.svg"),
            Err(MapError::Chart(ChartError::NoData))
        ));
    }
}
