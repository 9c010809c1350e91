//! Central differences, where a derivative cannot be had otherwise.

/// Weights of values at ±1, ±2 and ±3 distances: of sixth order.
pub(crate) const SIXTH: [f64; 3] = [45.0 / 60.0, -9.0 / 60.0, 1.0 / 60.0];

/// Weights of values at ±1 … ±4 distances: of eighth order.
const EIGHTH: [f64; 4] = [4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0];

/// What a difference of eighth order moves of whatever moves most, as a part of its size: roundings of 1e-15 leave some 1e-12 of a derivative, and what higher derivatives leave is less.
pub(crate) const PART: f64 = 4e-3;

/// How near two orders of a derivative have to be for no shorter distance to be tried.
pub(crate) const WELL_KNOWN: f64 = 1e-9;

/// The distances that are tried, in parts of the first.
pub(crate) const NEARER: [f64; 3] = [1.0, 0.25, 0.0625];

/// A derivative at zero by differences of sixth order over a distance.
pub(crate) fn derivative(distance: f64, mut f: impl FnMut(f64) -> f64) -> f64 {
    let differences = (1..).zip(SIXTH).map(|(k, weight)| {
        let s = f64::from(k) * distance;
        weight * (f(s) - f(-s))
    });
    differences.sum::<f64>() / distance
}

/// Where a function is evaluated, and what the value there counts in the derivative of eighth order and in that of sixth.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub(crate) shift: f64,
    pub(crate) eighth: f64,
    pub(crate) sixth: f64,
}

/// The places of differences over a distance.
pub(crate) fn places(distance: f64) -> impl Iterator<Item = Place> {
    let sixth = SIXTH.into_iter().chain([0.0]);
    (1..)
        .zip(EIGHTH)
        .zip(sixth)
        .flat_map(move |((k, eighth), sixth)| {
            [1.0, -1.0].map(|sign| Place {
                shift: sign * f64::from(k) * distance,
                eighth: sign * eighth / distance,
                sixth: sign * sixth / distance,
            })
        })
}
