//! Stiff scenes: in two of them, accuracy does not require the short steps that the stability of an explicit method
//! would.

use crate::contest::{Field, contest};
use crate::run::{Problem, de};
use crate::scenes::Start;
use crate::scenes::oscillators::VanDerPol;
use crate::scenes::stiff::ElasticPendulum;
use crate::table::{milliseconds, rows_of, verdict};
use std::error::Error;
use std::time::{Duration, Instant};
use tfe::accuracy::Estimated;
use tfe::prelude::*;
use tfe::work_precision::Measurements;

const TARGETS: [f64; 4] = [1e-2, 1e-4, 1e-6, 1e-8];

/// The accuracies asked for.
const CHOSEN: [f64; 4] = [1e-4, 1e-6, 1e-8, 1e-10];

/// Position and velocity of van der Pol's oscillator at the end, from the test set for initial value problems
/// (`vdpol`).
const END: ([f64; 1], [f64; 1]) = ([1.706_167_732_170_483], [-0.892_809_701_024_797_5e-3]);

/// The text above the table of the page.
pub const EXPLANATION: &str = "Van der Pol's oscillator with μ = 1000 from (2, 0) to t = 2000, and the pendulum on a \
     spring of k = 10⁸ from rest at 1.5 radians to t = 10.00016, where the spring's momentum is largest; peers for stiff equations \
     only. For van der Pol's oscillator there are four rows for each error: equal steps; a mesh refined towards both jumps, whose times were found \
     beforehand by a peer, which a user could not know; `accuracy` given only the error, with the time of all its runs \
     together; and its last run alone, with the element, the steps and the tolerance that it chose. The ratio is our time to theirs.";

type Row = [String; 10];

/// Runs to the end.
type Chosen<'r> = &'r dyn Fn() -> Result<Node<1>, tfe::RunError<1>>;

const MODEL: VanDerPol = VanDerPol { mu: 1000.0 };

const START: Start<1> = Start {
    q: [2.0],
    v: [0.0],
    end: 2000.0,
};

/// The time at which x leaves its branch, between two given times, to a thousandth of the width of the jump.
fn jump(mut before: f64, mut after: f64) -> Result<f64, Box<dyn Error>> {
    let at = |end: f64| -> Result<f64, Box<dyn Error>> {
        let problem = Problem::<_, 1, 2>::new(&MODEL, &Start { end, ..START });
        Ok(de::radau5(&problem, 1e-10)?.y[0])
    };
    let side = at(before)?.signum();
    while after - before > 1e-6 {
        let middle = 0.5 * (before + after);
        if at(middle)?.signum() == side {
            before = middle;
        } else {
            after = middle;
        }
    }
    Ok(after)
}

/// The nodes of segments whose lengths halve towards each jump from both sides, down to the width of a jump.
fn segments(jumps: &[f64]) -> Vec<f64> {
    /// The length of the shortest segment, a fraction of 1/μ: so close to the jump the motion is smooth again.
    const MIN: f64 = 1e-4;
    let mut nodes = vec![0.0, START.end];
    for (k, jump) in jumps.iter().enumerate() {
        let before = if k == 0 {
            0.0
        } else {
            0.5 * (jumps[k - 1] + jump)
        };
        let after = jumps
            .get(k + 1)
            .map_or(START.end, |next| 0.5 * (next + jump));
        for (sign, length) in [(-1.0, jump - before), (1.0, after - jump)] {
            let mut distance = length;
            while distance > MIN {
                nodes.push(jump + sign * distance);
                distance *= 0.5;
            }
        }
        nodes.push(*jump);
    }
    nodes.sort_by(f64::total_cmp);
    nodes.dedup_by(|a, b| (*a - *b).abs() < 0.1 * MIN);
    nodes
}

/// The end state with a number of elements in each segment, and the time it took.
fn in_segments(
    element: Element,
    nodes: &[f64],
    each: usize,
    tolerance: f64,
) -> Result<(State<1>, Duration), Box<dyn Error>> {
    let mut state = MODEL.state(START.q, START.v);
    let clock = Instant::now();
    for pair in nodes.windows(2) {
        let simulation = Simulation::new(&MODEL)
            .element(element)
            .step((pair[1] - pair[0]) / each as f64);
        let simulation = simulation.tolerance(tolerance).record_every(usize::MAX);
        let motion = simulation.run(state, pair[0]..pair[1])?;
        let last = motion.last();
        (state.q, state.p) = (last.q, last.p);
    }
    Ok((state, clock.elapsed()))
}

/// Runs given only an accuracy: the time of the whole search and that of the run chosen, for each error to be reached.
///
/// Errors in this table are relative to the state at the end, where the momentum is a millionth of that in the jumps;
/// the accuracy asked of a run is relative to the largest values. Therefore ε, ε/10, ε/100 are asked for until the
/// error in the sense of the table is at most ε; the accuracy asked for is shown in the column of the tolerance.
fn by_accuracy(
    measured: &Measurements,
    (q, p): ([f64; 1], [f64; 1]),
) -> Result<Vec<Row>, Box<dyn Error>> {
    let start = MODEL.state(START.q, START.v);
    let error = |node: &Node<1>| {
        let error_q = (node.q[0] - q[0]).abs() / 2.0;
        let error_p = (node.p[0] / p[0] - 1.0).abs();
        // A NaN counts as the largest.
        if error_q.is_nan() || error_q >= error_p {
            error_q
        } else {
            error_p
        }
    };
    let mut rows = Vec::new();
    for target in CHOSEN {
        let (motion, accuracy) = first_that_meets(target, &error)?;
        let picked = motion.picked().ok_or("picks always")?;
        let nodes = motion.states().iter().map(|node| node.t);
        let ends = Simulation::new(&MODEL).record_every(usize::MAX);
        let again = ends
            .clone()
            .nodes(nodes)
            .element(picked.element)
            .tolerance(picked.tolerance);
        let asked = ends.accuracy(accuracy);
        let search = || {
            asked
                .run(start, 0.0..START.end)
                .map(|motion| *motion.last())
        };
        let alone = || {
            again
                .run(start, 0.0..START.end)
                .map(|motion| *motion.last())
        };
        let runs: [(&str, Chosen<'_>); 2] = [("search", &search), ("picked", &alone)];
        for (name, run) in runs {
            let mut least = Duration::MAX;
            for _ in 0..20 {
                let clock = Instant::now();
                let end = run()?;
                least = least.min(clock.elapsed());
                if error(&end) > target {
                    return Err(
                        format!("{name}: {:.1e} asked, {:.1e} found", target, error(&end)).into(),
                    );
                }
            }
            let mut row: Row = std::array::from_fn(|_| "—".to_owned());
            row[0] = format!("Van der Pol, {name}");
            row[1] = format!("{target:.0e}");
            row[2] = picked.element.to_string();
            row[3] = format!("{}", motion.states().len() - 1);
            row[4] = format!("asked {accuracy:.0e}");
            row[5] = milliseconds(least.as_secs_f64());
            beside_peer(&mut row, measured, target, least.as_secs_f64());
            rows.push(row);
        }
    }
    Ok(rows)
}

/// The motion for the largest of these accuracies whose error is at most `target`.
fn first_that_meets(
    target: f64,
    error: &dyn Fn(&Node<1>) -> f64,
) -> Result<(Estimated<Motion<1>>, f64), Box<dyn Error>> {
    let start = MODEL.state(START.q, START.v);
    for accuracy in [target, 0.1 * target, 0.01 * target] {
        let asked = Simulation::new(&MODEL).accuracy(accuracy);
        let motion = asked.run(start, 0.0..START.end)?;
        if error(motion.last()) <= target {
            return Ok((motion, accuracy));
        }
    }
    Err(format!("no accuracy asked for reaches an error of {target:.0e}").into())
}

/// The fastest peer and the ratio of times, if any peer reaches the error.
fn beside_peer(row: &mut Row, measured: &Measurements, target: f64, seconds: f64) {
    if let Some((peer, point)) = measured.fastest_peer(target)
        && let Some(one) = point.measured()
    {
        row[6] = peer.name().to_owned();
        row[7] = format!("{:.1e}", point.setting);
        row[8] = milliseconds(one.seconds);
        row[9] = verdict(seconds / one.seconds, 1.0);
    }
}

fn van_der_pol() -> Result<Vec<Row>, Box<dyn Error>> {
    const TITLE: &str = "Van der Pol, μ = 1000";
    let (q, v) = END;
    let end = MODEL.state(q, v);
    let state = |q, v| MODEL.state(q, v);
    let ours = WorkPrecision::new(&MODEL, MODEL.state(START.q, START.v), 0.0..START.end)
        .elements([3, 5, 8].map(Element::radau))
        .elements([3, 5].map(Element::mixed))
        .steps([1.0, 0.1, 0.02, 0.005])
        .tolerances([1e-8, 1e-15])
        .reference_end(q, end.p)
        .reference_uncertainty(1e-14);
    let measured = contest::<_, _, 1, 2>(ours, &MODEL, &START, Field::Implicit, state).run()?;
    for curve in measured.curves() {
        for point in curve.points() {
            match &point.outcome {
                Ok(one) => println!(
                    "  equal steps: {} with {}: error {:.1e} in {}",
                    point.element,
                    point.step,
                    one.error(),
                    milliseconds(one.seconds)
                ),
                Err(error) => {
                    println!(
                        "  equal steps: {} with {}: {error}",
                        point.element, point.step
                    );
                }
            }
        }
    }
    let mut rows = rows_of(TITLE, &measured, &TARGETS, 1.0);
    let nodes = segments(&[jump(800.0, 812.0)?, jump(1608.0, 1620.0)?]);
    let mut all = Vec::new();
    for element in [3, 5, 8]
        .map(Element::radau)
        .into_iter()
        .chain([Element::mixed(3)])
    {
        for each in [1, 2, 3, 4, 6, 8, 12, 16, 24, 32] {
            for tolerance in [1e-8, 1e-11, 1e-15] {
                let run = || in_segments(element, &nodes, each, tolerance);
                let Ok((state, mut time)) = run() else {
                    continue;
                };
                for _ in 0..4 {
                    time = time.min(run()?.1);
                }
                // Errors of x are relative to its largest value, 2. For v, the largest value, 2 μ/3 in a jump, would be too large
                // a scale: its errors are relative to its value at the end.
                let error_q = (state.q[0] - q[0]).abs() / 2.0;
                let error_p = (state.p[0] - end.p[0]).abs() / end.p[0].abs();
                all.push((
                    time.as_secs_f64(),
                    error_q.max(error_p),
                    element,
                    each,
                    tolerance,
                ));
            }
        }
    }
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    for target in TARGETS {
        let mut row: Row = std::array::from_fn(|_| "—".to_owned());
        row[0] = format!("{TITLE}, mesh");
        row[1] = format!("{target:.0e}");
        if let Some((seconds, _, element, each, tolerance)) = all.iter().find(|one| one.1 <= target)
        {
            row[2] = element.to_string();
            row[3] = format!("{}", each * (nodes.len() - 1));
            row[4] = format!("{tolerance:.0e}");
            row[5] = milliseconds(*seconds);
            beside_peer(&mut row, &measured, target, *seconds);
        }
        rows.push(row);
    }
    rows.extend(by_accuracy(&measured, (END.0, end.p))?);
    Ok(rows)
}

fn elastic_pendulum() -> Result<Vec<Row>, Box<dyn Error>> {
    const MODEL: ElasticPendulum = ElasticPendulum { g: 9.81, k: 1e8 };
    const START: Start<2> = Start {
        q: [1.0, 1.5],
        v: [0.0, 0.0],
        // Not t = 10: there the momentum of the spring happens to pass through zero, and a method that damps the
        // oscillation of the spring altogether would seem to be accurate. Here it is largest.
        end: 10.000_16,
    };
    let start = MODEL.state(START.q, START.v);
    // Three and six steps per period of the spring, with an element of order 14.
    let fine = |step| {
        let simulation = Simulation::new(&MODEL).element(Mixed::<8>).step(step);
        let motion = simulation
            .record_every(usize::MAX)
            .run(start, 0.0..START.end)?;
        Ok::<_, tfe::RunError<2>>(*motion.last())
    };
    let (end, other) = (fine(2e-4)?, fine(1e-4)?);
    let mut uncertainty = 0.0_f64;
    for a in 0..2 {
        uncertainty = uncertainty.max((end.q[a] - other.q[a]).abs());
        uncertainty = uncertainty.max((end.p[a] - other.p[a]).abs());
    }
    let ours = WorkPrecision::new(&MODEL, start, 0.0..START.end)
        .elements([3, 4, 5, 6, 8].map(Element::radau))
        .elements([3, 4, 5, 6, 8].map(Element::mixed))
        .steps([0.5, 0.25, 0.2, 0.1, 0.05, 0.02, 0.01, 0.002, 5e-4, 2e-4])
        .tolerances([1e-5, 1e-8, 1e-11, 1e-15])
        .reference_end(other.q, other.p)
        .reference_uncertainty(uncertainty);
    let state = |q, v| MODEL.state(q, v);
    let measured = contest::<_, _, 2, 4>(ours, &MODEL, &START, Field::Implicit, state).run()?;
    println!("  elastic pendulum: reference known to {uncertainty:.1e}");
    Ok(rows_of(
        "Elastic pendulum, k = 10⁸",
        &measured,
        &TARGETS,
        1.0,
    ))
}

/// Rows in the form of the other scenes.
pub fn table() -> Result<Vec<Row>, Box<dyn Error>> {
    let mut rows = van_der_pol()?;
    rows.extend(elastic_pendulum()?);
    Ok(rows)
}
