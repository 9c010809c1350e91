//! A hanging chain of n point masses on massless rods, described in two ways: by angles, with a dense mass matrix, and
//! by Cartesian coordinates with the rods as constraints, with sparse equations. The table shows the time per step of
//! both over the length of the chain.

use std::error::Error;
use std::time::Instant;
use tfe::charts::{Axis, Chart, Scale, Section, Style};
use tfe::family::{self, FamilyState};
use tfe::prelude::*;

/// Angles from the downward vertical; unit masses and lengths.
#[dynamics(
    coordinates(theta[n]),
    lagrangian = sum(i in 0..n, (n - i)/2*dot(theta[i])^2 + g*(n - i)*cos(theta[i]))
        + sum(i in 0..n-1, sum(j in i+1..n, (n - j)*dot(theta[i])*dot(theta[j])*cos(theta[i] - theta[j]))),
)]
struct Angles {
    n: usize,
    g: f64,
}

#[dynamics(
    coordinates(x[n], y[n]),
    lagrangian = sum(i in 0..n, (dot(x[i])^2 + dot(y[i])^2)/2 - g*y[i]),
    constraint(first) = x[0]^2 + y[0]^2 - 1,
    constraint(rod[i in 0..n-1]) = (x[i+1] - x[i])^2 + (y[i+1] - y[i])^2 - 1,
)]
struct Rods {
    n: usize,
    g: f64,
}

const G: f64 = 9.81;
const STEP: f64 = 0.01;
const LENGTHS: [usize; 9] = [2, 4, 8, 16, 32, 64, 128, 256, 512];

/// A bent chain at rest.
fn angle(i: usize, n: usize) -> f64 {
    0.3 + 0.5 * i as f64 / n as f64
}

fn angles(n: usize) -> (Angles, FamilyState) {
    let model = Angles { n, g: G };
    let theta: Vec<f64> = (0..n).map(|i| angle(i, n)).collect();
    let start = model.state(theta, vec![0.0; n]);
    (model, start)
}

fn rods(n: usize) -> (Rods, FamilyState) {
    let model = Rods { n, g: G };
    let theta: Vec<f64> = (0..n).map(|i| angle(i, n)).collect();
    let start = model.state(cartesian(&theta), vec![0.0; 2 * n]);
    (model, start)
}

/// The positions of the masses.
fn cartesian(theta: &[f64]) -> Vec<f64> {
    let sums = |of: fn(f64) -> f64| {
        theta.iter().scan(0.0, move |sum, angle| {
            *sum += of(*angle);
            Some(*sum)
        })
    };
    sums(f64::sin).chain(sums(|angle| -angle.cos())).collect()
}

/// Milliseconds per step of Mixed::<3>; the smallest of a few runs.
fn milliseconds<M: family::Model>(model: &M, start: &FamilyState) -> Result<f64, Box<dyn Error>> {
    let simulation = Simulation::new(model).element(Mixed::<3>).step(STEP);
    let simulation = simulation.record_every(usize::MAX);
    // The equations are ordered once in each run; the difference of the times of two runs of different lengths is that
    // of the steps alone.
    const STEPS: [u32; 2] = if cfg!(debug_assertions) {
        [1, 2]
    } else {
        [2, 12]
    };
    let mut least = [f64::INFINITY; 2];
    let clock = Instant::now();
    for run in 0..30 {
        for (least, steps) in least.iter_mut().zip(STEPS) {
            let clock = Instant::now();
            simulation.run(start.clone(), 0.0..STEP * f64::from(steps))?;
            *least = least.min(clock.elapsed().as_secs_f64());
        }
        if run > 0 && clock.elapsed().as_secs_f64() > 1.0 {
            break;
        }
    }
    Ok(1e3 * (least[1] - least[0]) / f64::from(STEPS[1] - STEPS[0]))
}

/// The exponent: the slope of log(time) over log(n) between the last two lengths.
fn exponent(times: &[f64]) -> f64 {
    let last = times.len() - 1;
    (times[last] / times[last - 1]).log2()
}

pub(crate) fn cost() -> Result<Section, Box<dyn Error>> {
    let difference = same_motion()?;
    println!(
        "chain of links, milliseconds per step\n  {:>4} {:>12} {:>12}",
        "n", "angles", "rods"
    );
    let (mut dense, mut sparse) = (Vec::new(), Vec::new());
    for n in LENGTHS {
        let (model, start) = angles(n);
        dense.push(milliseconds(&model, &start)?);
        let (model, start) = rods(n);
        sparse.push(milliseconds(&model, &start)?);
        let last = dense.len() - 1;
        println!("  {n:>4} {:>12.4} {:>12.4}", dense[last], sparse[last]);
    }
    let (steep, flat) = (exponent(&dense), exponent(&sparse));
    let crossing = (1..LENGTHS.len()).find(|k| dense[*k] > sparse[*k]);
    let crossing = crossing.map_or("none".to_owned(), |k| {
        let ratio = |k: usize| (dense[k] / sparse[k]).ln();
        let part = ratio(k - 1) / (ratio(k - 1) - ratio(k));
        format!(
            "n = {:.0}",
            LENGTHS[k - 1] as f64 * 2.0_f64.powf(part.clamp(0.0, 1.0))
        )
    });
    println!(
        "  growth from 256 to 512 links: n^{steep:.2} by angles, n^{flat:.2} by rods; equal at {crossing}"
    );
    let points = |times: &[f64]| -> Vec<(f64, f64)> {
        LENGTHS
            .iter()
            .zip(times)
            .map(|(n, time)| (*n as f64, *time))
            .collect()
    };
    let cubic = [128.0, 512.0].map(|n: f64| (n, dense[8] * (n / 512.0).powi(3)));
    let linear = [8.0, 512.0].map(|n| (n, sparse[8] * n / 512.0));
    let chart = Chart::new("A step of Mixed::<3> over the number of links")
        .x(Axis::new("links").scale(Scale::Logarithmic))
        .y(Axis::new("time per step (ms)").scale(Scale::Logarithmic))
        .series("angles, dense", Style::LineWithMarkers, points(&dense))
        .series("rods, sparse", Style::LineWithMarkers, points(&sparse))
        .series("n³", Style::Reference, cubic)
        .series("n", Style::Reference, linear);
    let rows = LENGTHS.iter().zip(dense.iter().zip(&sparse));
    let rows = rows
        .map(|(n, (dense, sparse))| [n.to_string(), format!("{dense:.3}"), format!("{sparse:.3}")]);
    Ok(Section::new("A chain of links")
        .paragraph(format!(
            "Angles need no constraints, but all links are coupled, which gives a dense matrix. A rod as a constraint is coupled with its neighbours only. From 256 to 512 links the time of a step grows \
             as n^{steep:.2} with angles and as n^{flat:.2} with rods; both take the same time at {crossing}. The motions of eight links differ by {difference:.1e}."
        ))
        .table(["links", "angles, ms per step", "rods, ms per step"], rows)
        .figure(chart.to_svg()?, "Time per step of both descriptions"))
}

/// The largest distance between the masses of eight links by both descriptions, after two units of time.
fn same_motion() -> Result<f64, Box<dyn Error>> {
    let (model, start) = angles(8);
    let one = Simulation::new(&model).element(Mixed::<6>).step(STEP);
    let one = one.run(start, 0.0..2.0)?;
    let (model, start) = rods(8);
    let other = Simulation::new(&model).element(Mixed::<6>).step(STEP);
    let other = other.run(start, 0.0..2.0)?;
    let places = cartesian(&one.last().q);
    let apart = places
        .iter()
        .zip(&other.last().q)
        .map(|(one, other)| (one - other).abs());
    let apart = apart.max_by(f64::total_cmp).unwrap_or(f64::NAN);
    println!(
        "eight links for two units of time: difference between angles and rods {apart:.1e}, energy errors {:.1e} and {:.1e}",
        one.energy_error(),
        other.energy_error()
    );
    assert!(apart < 1e-9, "{apart:e}");
    Ok(apart)
}
