//! The fastest of our settings, and of those of the peers, that reaches an error.

use crate::table::{milliseconds, verdict};

const REPETITIONS: usize = 7;

/// A setting: its name, and a function that runs it and returns its seconds and its error.
pub struct Way<'w> {
    pub name: String,
    pub run: Box<dyn Fn() -> Option<(f64, f64)> + 'w>,
}

/// The settings that were measured.
pub struct Ways<'w>(Vec<(Way<'w>, Option<(f64, f64)>)>);

impl<'w> Ways<'w> {
    /// Runs each setting twice, so that neither side is charged for the first run.
    pub fn look_at(ways: Vec<Way<'w>>) -> Self {
        let look = |way: &Way<'_>| {
            let (one, other) = ((way.run)()?, (way.run)()?);
            Some((one.0.min(other.0), other.1))
        };
        let looked = ways.into_iter().map(|way| {
            let look = look(&way);
            (way, look)
        });
        Self(looked.collect())
    }

    /// The name of the fastest setting that reaches an error, and its seconds, the smallest of several runs.
    fn fastest(&self, target: f64) -> Option<(&str, f64)> {
        let looked = self.0.iter();
        let mut found: Vec<(f64, &Way<'_>)> = looked
            .filter_map(|(way, look)| {
                look.filter(|(_, error)| *error <= target)
                    .map(|look| (look.0, way))
            })
            .collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        let least = |way: &Way<'_>| {
            let runs = (0..REPETITIONS).filter_map(|_| (way.run)());
            runs.map(|run| run.0).fold(f64::INFINITY, f64::min)
        };
        let tried = found
            .iter()
            .take(4)
            .map(|(_, way)| (way.name.as_str(), least(way)));
        tried.min_by(|a, b| a.1.total_cmp(&b.1))
    }
}

/// The row for an error of `what` with our settings and theirs; `aim` is the ratio of times, ours to theirs, that we
/// aim at.
pub fn row(what: &str, target: f64, [ours, peers]: [&Ways<'_>; 2], aim: f64) -> [String; 7] {
    let dash = || "—".to_owned();
    let (one, other) = (ours.fastest(target), peers.fastest(target));
    let ratio = match (one, other) {
        (Some((_, ours)), Some((_, theirs))) => verdict(ours / theirs, aim),
        _ => dash(),
    };
    let told = |found: Option<(&str, f64)>| {
        found.map_or_else(
            || (dash(), dash()),
            |(name, seconds)| (name.to_owned(), milliseconds(seconds)),
        )
    };
    let ((own, time), (peer, its)) = (told(one), told(other));
    [
        what.to_owned(),
        format!("{target:.0e}"),
        own,
        time,
        peer,
        its,
        ratio,
    ]
}

/// A line of the printed table.
pub fn line(row: &[impl AsRef<str>; 7]) -> String {
    let [a, b, c, d, e, f, g] = row.each_ref().map(AsRef::as_ref);
    format!("{a:<24} {b:>5}  {c:<40} {d:>12}  {e:<48} {f:>12}  {g}")
}
