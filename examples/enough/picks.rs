//! What is chosen for an accuracy, compared with the best choice found by trial.

use crate::Scene;
use crate::scenes::short;
use crate::truth::Truth;
use std::error::Error;
use std::hint::black_box;
use std::time::{Duration, Instant};
use tfe::accuracy::Picked;
use tfe::charts::{Axis, Chart, ChartError, Scale, Section, Style};
use tfe::prelude::*;

/// The results for one accuracy.
pub struct Pick {
    asked: f64,
    /// The run that was chosen, or why there is none.
    outcome: Result<Run, String>,
}

struct Run {
    error: f64,
    estimate: f64,
    element: Element,
    step: f64,
    runs: usize,
    seconds: f64,
    /// The time of the chosen run alone, without the search, if its steps are equal.
    alone: Option<f64>,
    /// The time of the fastest combination found by trial, if there is any.
    best: Option<f64>,
}

/// Asks for each accuracy, and tries elements, steps and tolerances of the scene.
pub fn measure<M: Model<N>, const N: usize>(
    model: &M,
    truth: &Truth<N>,
    problem: WorkPrecision<'_, M, State<N>>,
) -> Result<Vec<Pick>, Box<dyn Error>> {
    let (nodes, digits): (&[usize], &[i32]) = if cfg!(debug_assertions) {
        (&[5, 9], &[4, 8])
    } else {
        (&[3, 4, 5, 7, 9, 12], &[4, 5, 6, 7, 8, 9, 10, 11])
    };
    let tried = problem
        .elements(nodes.iter().map(|nodes| Element::mixed(*nodes)))
        .tolerances((3..13).map(|digits| 10_f64.powi(-digits)))
        .repeat_for(Duration::from_millis(3))
        .run()?;
    // Both are timed as they would be used: by a simulation that records the end only.
    let simulation = Simulation::new(model).record_every(usize::MAX);
    let span = 0.0..truth.end;
    let mut picks = Vec::new();
    for digits in digits {
        let asked = 10_f64.powi(-digits);
        let accurate = simulation.clone().accuracy(asked);
        let best = tried.fastest(asked).map(|point| {
            let by_hand = simulation.clone().element(point.element).step(point.step);
            let by_hand = by_hand.tolerance(point.tolerance);
            least_seconds(|| by_hand.run(truth.start, span.clone()).is_ok())
        });
        let outcome = accurate.run(truth.start, span.clone());
        let alone = |picked: &Picked| {
            let run = simulation.clone().element(picked.element);
            let run = run.step(picked.step).tolerance(picked.tolerance);
            let run = run.solver(picked.solve);
            least_seconds(|| run.run(truth.start, span.clone()).is_ok())
        };
        let outcome = outcome
            .map_err(|error| error.to_string())
            .map(|motion| Run {
                alone: motion.picked().filter(|picked| !picked.varies()).map(alone),
                error: truth.error(motion.last()),
                estimate: motion.error_estimate(),
                element: motion
                    .picked()
                    .map_or(Element::mixed(2), |picked| picked.element),
                step: motion.picked().map_or(f64::NAN, |picked| picked.step),
                runs: motion.picked().map_or(0, |picked| picked.attempts.len()),
                seconds: least_seconds(|| accurate.run(truth.start, span.clone()).is_ok()),
                best,
            });
        // The estimate is at least half of the error. Without optimisation the reference has few steps and is less
        // accurate.
        if let Ok(run) = &outcome
            && !cfg!(debug_assertions)
        {
            assert!(
                run.error <= 2.0 * asked,
                "{:.1e} for {asked:.0e}",
                run.error
            );
        }
        picks.push(Pick { asked, outcome });
    }
    Ok(picks)
}

/// The smallest of several times.
fn least_seconds(mut go: impl FnMut() -> bool) -> f64 {
    let begin = Instant::now();
    let mut least = f64::INFINITY;
    for k in 0.. {
        if k >= 5 && begin.elapsed() > Duration::from_millis(30) {
            break;
        }
        let clock = Instant::now();
        black_box(go());
        least = least.min(clock.elapsed().as_secs_f64());
    }
    least
}

impl Run {
    fn ratio(&self) -> Option<f64> {
        Some(self.seconds / self.best?)
    }

    fn ratio_alone(&self) -> Option<f64> {
        Some(self.alone? / self.best?)
    }
}

impl Pick {
    fn row(&self, title: &str) -> [String; 9] {
        let asked = format!("{:.0e}", self.asked);
        let title = title.to_owned();
        let Ok(run) = &self.outcome else {
            let none = String::new;
            return [
                title,
                asked,
                "refused".to_owned(),
                none(),
                none(),
                none(),
                none(),
                none(),
                none(),
            ];
        };
        let met = if run.error <= self.asked {
            ""
        } else {
            " (missed)"
        };
        [
            title,
            asked,
            format!("{:.1e}{met}", run.error),
            format!("{:.1e}", run.estimate),
            format!("{}, h = {}", run.element, short(run.step)),
            run.runs.to_string(),
            format!("{:.1}", 1e6 * run.seconds),
            told(run.ratio()),
            told(run.ratio_alone()),
        ]
    }

    /// A line of the printed table.
    pub fn line(&self, title: &str) -> String {
        let [title, asked, error, estimate, way, runs, time, ratio, alone] = self.row(title);
        format!(
            "  {title:<26} {asked:>6}  true {error:>8}  estimated {estimate:>8}  {way:<26} {runs} runs {time:>8} µs  {ratio:>5} × the best, {alone:>5} × without the search"
        )
    }
}

fn told(ratio: Option<f64>) -> String {
    ratio.map_or_else(|| "—".to_owned(), |ratio| format!("{ratio:.2}"))
}

/// The median, and how many numbers are at most two.
fn middle(mut ratios: Vec<f64>) -> (f64, usize) {
    ratios.sort_by(f64::total_cmp);
    let median = ratios.get(ratios.len() / 2).copied().unwrap_or(f64::NAN);
    (median, ratios.iter().filter(|ratio| **ratio <= 2.0).count())
}

/// The table and the charts.
pub fn section(scenes: &[Scene]) -> Result<Section, ChartError> {
    let mut errors = Chart::new("True errors by accuracy asked for")
        .x(Axis::new("accuracy asked for").scale(Scale::Logarithmic))
        .y(Axis::new("true error").scale(Scale::Logarithmic));
    let mut times = Chart::new("Time relative to the best choice found by trial")
        .x(Axis::new("accuracy asked for").scale(Scale::Logarithmic))
        .y(Axis::new("time / best time").scale(Scale::Logarithmic));
    let (mut ratios, mut alone) = (Vec::new(), Vec::new());
    let (mut count, mut met) = (0, 0);
    for scene in scenes {
        let runs = || {
            let picks = scene.picks.iter();
            picks.filter_map(|pick| Some((pick.asked, pick.outcome.as_ref().ok()?)))
        };
        count += scene.picks.len();
        met += runs().filter(|(asked, run)| run.error <= *asked).count();
        ratios.extend(runs().filter_map(|(_, run)| run.ratio()));
        alone.extend(runs().filter_map(|(_, run)| run.ratio_alone()));
        let points = runs().map(|(asked, run)| (asked, run.error));
        errors = errors.series(scene.title, Style::LineWithMarkers, points);
        let points = runs().filter_map(|(asked, run)| Some((asked, run.ratio()?)));
        times = times.series(scene.title, Style::LineWithMarkers, points);
    }
    let ends = [(1e-11, 1e-11), (1e-4, 1e-4)];
    errors = errors.series("asked for", Style::Reference, ends);
    times = times.series("twice", Style::Reference, [(1e-11, 2.0), (1e-4, 2.0)]);
    let (all, all_alone) = (ratios.len(), alone.len());
    let (median, within) = middle(ratios);
    let (median_alone, within_alone) = middle(alone);
    let summary = format!(
        "The accuracy is met in {met} of {count} cases. All runs of the search together take {median:.2} times (median) the time of the best choice found by trial, and at most twice in {within} of \
         {all}; the chosen run alone takes {median_alone:.2} times that time, and at most twice in {within_alone} of {all_alone}."
    );
    println!("\n{summary}\n");
    let rows = scenes
        .iter()
        .flat_map(|scene| scene.picks.iter().map(|pick| pick.row(scene.title)));
    Ok(Section::new("What is chosen for an accuracy")
        .paragraph(summary)
        .figure(errors.to_svg()?, "True errors")
        .figure(times.to_svg()?, "Times")
        .table(
            [
                "scene",
                "accuracy",
                "true error",
                "estimated",
                "chosen",
                "runs",
                "µs",
                "time / best time",
                "without the search",
            ],
            rows,
        ))
}
