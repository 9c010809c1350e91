//! The changes of stability: the roots of the functions, and the classification of the parts between them.

use super::IntervalError;
use super::search::{Failure, SHORTEST, SPLIT, Sample, Search};
use crate::stability::chebyshev::bracketed_root;
use std::ops::Range;
use std::rc::Rc;

/// Where the spectral radius exceeds one by less than this, the method is not called unstable.
const MIN_EXCESS: f64 = 1e-10;
/// Roots closer than this, relative to their position, are merged.
const SAME_ROOT: f64 = 1e-12;

/// Two changes closer than this, relative to their position, are an artefact of rounding.
const SLIVER: f64 = 64.0 * f64::EPSILON;

/// A point where stability may change.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Candidate {
    at: f64,
    /// True for a root of a function, which is accurate; otherwise a function only touches zero or is unresolved there.
    is_root: bool,
}

/// The result for a range.
pub(super) struct Verdict {
    pub(super) unstable_at_start: bool,
    pub(super) changes: Vec<f64>,
}

/// Why the refinement of a root stopped.
enum Stop {
    /// The function grows inside the bracket: it changes its sign at a pole.
    Pole,
    Failed(Failure),
}

impl Search<'_> {
    /// Classifies the parts between all candidates, and collects the points where the class changes.
    pub(super) fn verdict(&mut self, range: &Range<f64>) -> Result<Verdict, Failure> {
        let candidates = self.candidates()?;
        let (Some(first), Some(last)) = (self.samples.first(), self.samples.last()) else {
            return Ok(Verdict {
                unstable_at_start: false,
                changes: Vec::new(),
            });
        };
        let inner = candidates.iter().map(|candidate| candidate.at);
        let ends: Vec<f64> = ([first.at].into_iter().chain(inner).chain([last.at])).collect();
        let mut classified = Vec::new();
        for part in ends.windows(2) {
            if part[1] - part[0] > SAME_ROOT * part[0].abs().max(part[1].abs()) {
                classified.extend(self.classified(part[0]..part[1])?);
            }
        }
        let mut changes = Vec::new();
        for pair in classified.windows(2) {
            let [(left, left_unstable), (right, right_unstable)] = pair else {
                continue;
            };
            if left_unstable == right_unstable {
                continue;
            }
            let is_between = |c: &&Candidate| c.is_root && left.at < c.at && c.at < right.at;
            changes.push(match candidates.iter().find(is_between) {
                Some(root) => root.at,
                None => self.bisect(left, right, *left_unstable)?,
            });
        }
        let unstable_at_start = classified.first().is_some_and(|&(_, unstable)| unstable);
        // The samples are needed again for the largest radius.
        let samples = classified.into_iter().map(|(sample, _)| sample);
        self.samples.extend(samples);
        self.samples.sort_by(|a, b| a.at.total_cmp(&b.at));
        self.samples.dedup_by(|a, b| a.at == b.at);
        changes.retain(|&at| range.start < at && at < range.end);
        Ok(Verdict {
            unstable_at_start,
            changes: without_slivers(changes),
        })
    }

    /// Samples of a part between two candidates, in ascending order, each with whether it is unstable.
    fn classified(&mut self, part: Range<f64>) -> Result<Vec<(Sample, bool)>, Failure> {
        /// Interior points of a part, which decide by majority: one of them may hit a tangency.
        const INTERIOR: [f64; 3] = [0.3, 0.5, 0.75];
        /// Samples closer than this to a candidate, relative to the part, are ignored.
        const MARGIN: f64 = 1e-3;
        let Range { start, end } = part;
        let width = end - start;
        let mut interior = Vec::with_capacity(INTERIOR.len());
        for at in INTERIOR.map(|fraction| start + fraction * width) {
            let next = self.samples.partition_point(|sample| sample.at < at);
            let scale = Rc::clone(&self.samples[next.min(self.samples.len() - 1)].scale);
            if at != 0.0 {
                interior.push(self.sample(at, &scale)?);
            }
        }
        let verdicts: Vec<bool> = (interior.iter())
            .filter_map(|sample| self.is_unstable(sample, MIN_EXCESS))
            .collect();
        let inside = start + MARGIN * width..end - MARGIN * width;
        let mut classified: Vec<(Sample, bool)> = (self.samples.iter())
            .filter(|sample| inside.contains(&sample.at))
            .filter_map(|sample| Some((sample.clone(), self.is_unstable(sample, MIN_EXCESS)?)))
            .collect();
        if !verdicts.is_empty() {
            let unstable = verdicts.iter().filter(|&&unstable| unstable).count();
            let majority = 2 * unstable > verdicts.len();
            classified.extend(interior.into_iter().map(|sample| (sample, majority)));
        }
        classified.sort_by(|a, b| a.0.at.total_cmp(&b.0.at));
        Ok(classified)
    }

    /// Finds by bisection where the class changes between two samples, where no function changes its sign.
    fn bisect(
        &mut self,
        left: &Sample,
        right: &Sample,
        left_unstable: bool,
    ) -> Result<f64, Failure> {
        let (mut low, mut high) = (left.at, right.at);
        loop {
            let middle = f64::midpoint(low, high);
            if !(low < middle && middle < high && high - low > 2.0 * f64::EPSILON * middle.abs()) {
                return Ok(middle);
            }
            let sample = self.sample(middle, &left.scale)?;
            if self.is_unstable(&sample, 0.0).unwrap_or(false) == left_unstable {
                low = middle;
            } else {
                high = middle;
            }
        }
    }

    /// All roots and touching points, ascending and distinct.
    fn candidates(&mut self) -> Result<Vec<Candidate>, Failure> {
        let count = self
            .samples
            .first()
            .map_or(0, |sample| sample.functions.len());
        let mut candidates: Vec<Candidate> = self
            .touches
            .iter()
            .map(|&at| Candidate { at, is_root: false })
            .collect();
        for function in 0..count {
            for (start, end) in self.brackets(function) {
                candidates.push(if start.0 < 0.0 && end.0 > 0.0 {
                    // Not refined: at zero the matrix may not exist.
                    Candidate {
                        at: 0.0,
                        is_root: true,
                    }
                } else {
                    self.polish(function, start, end)?
                });
            }
        }
        candidates.sort_by(|a, b| a.at.total_cmp(&b.at));
        candidates.dedup_by(|later, earlier| {
            let is_same = later.at - earlier.at <= SAME_ROOT * later.at.abs();
            if is_same && later.is_root && !earlier.is_root {
                *earlier = *later;
            }
            is_same
        });
        Ok(candidates)
    }

    /// Successive samples between which a function changes its sign; values within rounding error are ignored.
    fn brackets(&self, function: usize) -> Vec<((f64, f64), (f64, f64))> {
        let is_trusted = |sample: &Sample| {
            let value = sample.functions[function].abs();
            value > 0.0 && value > self.noise_of(sample, function)
        };
        let mut brackets = Vec::new();
        let mut last: Option<&Sample> = None;
        for sample in &self.samples {
            let value = sample.functions[function];
            match last {
                Some(before)
                    if (before.functions[function] > 0.0) == (value > 0.0) && value != 0.0 =>
                {
                    last = Some(sample);
                }
                _ if !is_trusted(sample) => {}
                Some(before) => {
                    brackets.push(((before.at, before.functions[function]), (sample.at, value)));
                    last = Some(sample);
                }
                None => last = Some(sample),
            }
        }
        brackets
    }

    /// The root of a function in a bracket, or the pole at which it changes its sign.
    fn polish(
        &mut self,
        function: usize,
        start: (f64, f64),
        end: (f64, f64),
    ) -> Result<Candidate, Failure> {
        let value_at = |search: &mut Self, at: f64| -> Result<f64, Failure> {
            let matrix = search.matrix_at(at)?;
            let (functions, _) = search
                .measure
                .of(&matrix)
                .ok_or(IntervalError::Eigenvalues { at })?;
            Ok(functions[function])
        };
        let most = 10.0 * start.1.abs().max(end.1.abs());
        let root = bracketed_root(
            |at| {
                let value = value_at(self, at).map_err(Stop::Failed)?;
                if value.abs() > most {
                    Err(Stop::Pole)
                } else {
                    Ok(value)
                }
            },
            start,
            end,
        );
        match root {
            Ok(at) => return Ok(Candidate { at, is_root: true }),
            Err(Stop::Failed(error)) => return Err(error),
            Err(Stop::Pole) => {}
        }
        // Not to full precision: at the pole itself there is no matrix.
        let (mut low, mut high) = (start.0, end.0);
        while high - low > SHORTEST * low.abs().max(high.abs()) {
            let middle = low + SPLIT * (high - low);
            if (value_at(self, middle)? > 0.0) == (start.1 > 0.0) {
                low = middle;
            } else {
                high = middle;
            }
        }
        Ok(Candidate {
            at: f64::midpoint(low, high),
            is_root: false,
        })
    }
}

/// The ascending changes without pairs that are only a few ulps apart.
///
/// Such pairs come from rounding: from double eigenvalues of free coordinates, and from values near a pole. Since a
/// true spectral radius exceeds one by about the width of its interval, nothing is lost.
fn without_slivers(changes: Vec<f64>) -> Vec<f64> {
    let mut kept: Vec<f64> = Vec::with_capacity(changes.len());
    for at in changes {
        match kept.last() {
            Some(last) if at - last <= SLIVER * at.abs().max(last.abs()) => {
                kept.pop();
            }
            _ => kept.push(at),
        }
    }
    kept
}
