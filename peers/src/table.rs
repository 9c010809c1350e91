//! The table of the fastest runs that reach an error.

use crate::runs::{Scene, TARGETS};
use crate::scenes::short;
use tfe::work_precision::{Measurements, Peer, PeerPoint, Point};

/// The columns.
pub const HEADER: [&str; 10] = [
    "scene",
    "error",
    "our element",
    "step",
    "tolerance",
    "time",
    "best peer",
    "setting",
    "its time",
    "ratio",
];

/// The text above the table of the page.
pub const EXPLANATION: &str = "For each error, the fastest run whose error at the end, relative to the largest state, is not \
     larger: our fastest, and that of all peers. Nothing is interpolated: both are runs that were made. All runs were made in turn in \
     one program by one clock, on one processor, the peers with equations written by hand, and times do not include the preparation before the first step; \
     the setting is a tolerance or a number of steps. The ratio is our time to theirs. We aim at half of theirs or less, at a fifth for \
     the outer solar system: “misses” says that we miss the aim, “slower” that the peer is faster. A “?” says that a finer setting of the \
     same curve misses the error: the run was accurate by chance.";

/// A row for each error to be reached.
pub fn rows(scene: &Scene, aim: f64) -> Vec<[String; 10]> {
    rows_of(scene.title, &scene.measured, &TARGETS, aim)
}

/// The same for measurements that are not a scene of the example.
pub fn rows_of(
    title: &str,
    measured: &Measurements,
    targets: &[f64],
    aim: f64,
) -> Vec<[String; 10]> {
    let row = |target: &f64| {
        let ours = measured.fastest(*target);
        let ours = ours.and_then(|point| Some((point, point.measured()?)));
        let peer = measured.fastest_peer(*target);
        let peer = peer.and_then(|(peer, point)| Some((peer, point, point.measured()?)));
        let none = || "—".to_owned();
        let mut row: [String; 10] = std::array::from_fn(|_| none());
        row[0] = title.to_owned();
        row[1] = format!("{target:.0e}");
        if let Some((point, one)) = ours {
            row[2] = format!(
                "{}{}",
                point.element,
                chance(is_luck(measured, point, *target))
            );
            row[3] = short(point.step);
            row[4] = format!("{:.0e}", point.tolerance);
            row[5] = milliseconds(one.seconds);
        }
        if let Some((peer, point, one)) = peer {
            row[6] = format!(
                "{}{}",
                peer.name(),
                chance(is_luck_of_peer(peer, point, *target))
            );
            row[7] = if point.setting < 1.0 {
                format!("{:.1e}", point.setting)
            } else {
                format!("{} steps", point.setting)
            };
            row[8] = milliseconds(one.seconds);
        }
        row[9] = match (ours, peer) {
            (Some((_, ours)), Some((_, _, theirs))) => verdict(ours.seconds / theirs.seconds, aim),
            (Some(_), None) => "no peer".to_owned(),
            (None, Some(_)) => "not reached".to_owned(),
            (None, None) => none(),
        };
        row
    };
    targets.iter().map(row).collect()
}

/// Whether a shorter step of the same curve misses the error that this point reaches: it was accurate by chance.
fn is_luck(measured: &Measurements, point: &Point, target: f64) -> bool {
    let same = |other: &&Point| (other.element, other.solve) == (point.element, point.solve);
    let finer = measured.points().filter(same);
    let mut finer = finer.filter(|other| other.step < point.step);
    finer.any(|other| other.error().is_some_and(|error| error > target))
}

/// The same for a peer, whose settings are tolerances or numbers of steps.
fn is_luck_of_peer(peer: &Peer, point: &PeerPoint, target: f64) -> bool {
    let is_finer = |other: &&PeerPoint| {
        if point.setting < 1.0 {
            other.setting < point.setting
        } else {
            other.setting > point.setting
        }
    };
    let measured = peer.points().iter().filter(is_finer);
    let mut errors = measured.filter_map(|other| Some(other.measured()?.error()));
    errors.any(|error| error > target)
}

fn chance(is_luck: bool) -> &'static str {
    if is_luck { " ?" } else { "" }
}

/// A ratio of times, and whether the aim was met.
pub fn verdict(ratio: f64, aim: f64) -> String {
    let word = if ratio <= aim {
        ""
    } else if ratio <= 1.0 {
        " misses"
    } else {
        " slower"
    };
    format!("{ratio:.2}{word}")
}

pub fn milliseconds(seconds: f64) -> String {
    format!("{:.4} ms", 1e3 * seconds)
}

/// A line of the printed table.
pub fn line(row: &[impl AsRef<str>; 10]) -> String {
    let [a, b, c, d, e, f, g, h, i, j] = row.each_ref().map(AsRef::as_ref);
    format!("{a:<26} {b:>5} {c:<26} {d:>6} {e:>9} {f:>10}  {g:<38} {h:>12} {i:>10}  {j}")
}

/// All rows as CSV.
pub fn csv<const C: usize>(header: [&str; C], rows: &[[String; C]]) -> String {
    let quoted = |row: &[String; C]| {
        let fields = row.each_ref().map(|field| format!("\"{field}\""));
        fields.join(",") + "\n"
    };
    header.join(",") + "\n" + &rows.iter().map(quoted).collect::<String>()
}
