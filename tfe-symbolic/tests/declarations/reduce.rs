//! The smallest part of a declaration that still fails.

use super::Declaration;
use super::mutation::{joined, tokens};

/// After so many attempts the smallest declaration so far is returned.
const MAX_ATTEMPTS: usize = 3000;

/// Leaves out tokens and fields as long as the declaration fails.
pub fn reduced(declaration: &Declaration, fails: impl Fn(&Declaration) -> bool) -> Declaration {
    let mut attempts = 0;
    let mut fails = |candidate: &Declaration| {
        attempts += 1;
        attempts <= MAX_ATTEMPTS && fails(candidate)
    };
    let mut smallest = declaration.clone();
    loop {
        let before = smallest.clone();
        let mut words = tokens(&smallest.arguments);
        let mut length = words.len().div_ceil(2);
        while length > 0 {
            let mut start = 0;
            while start < words.len() {
                let mut fewer = words.clone();
                fewer.drain(start..(start + length).min(words.len()));
                let candidate = Declaration {
                    arguments: joined(&fewer),
                    ..smallest.clone()
                };
                if fails(&candidate) {
                    (words, smallest) = (fewer, candidate);
                } else {
                    start += length;
                }
            }
            length /= 2;
        }
        for at in (0..smallest.context.fields.len()).rev() {
            let mut candidate = smallest.clone();
            candidate.context.fields.remove(at);
            if fails(&candidate) {
                smallest = candidate;
            }
        }
        if smallest == before {
            return smallest;
        }
    }
}
