//! Kernels that report their progress in strides: entries already reported are neither read nor written again, and the
//! forces are those of the kernel without strides.

use tfe::dynamics;
use tfe::family::{self, Gradient, Model as _, STRIDE, Sweep};

#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, dot(q[i])^2/2) - sum(i in 0..n-1, (q[i+1]-q[i])^2/2 + a/3*(q[i+1]-q[i])^3),
)]
struct Chain {
    n: usize,
    a: f64,
}

/// Second-neighbour interactions, with the first two sites and the last one attached to the ground, and a mass for each
/// site.
#[dynamics(
    coordinates(q[n]), momenta(p[n]),
    hamiltonian = sum(i in 0..n, p[i]^2/(2*m[i])) + sum(i in 2..n-1, exp(q[i] - q[i-2]) + q[i+1]^4/4),
)]
struct Far {
    n: usize,
    m: Vec<f64>,
}

/// [`Chain`] with indices that begin below zero, which generated loops count from zero; its last five sites, wherever
/// they begin; and two outputs at sites with sums that depend on the site.
#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in -2..n-2, dot(q[i+2])^2/2) - sum(i in -1..n-2, (q[i+2]-q[i+1])^2/2 + a/3*(q[i+2]-q[i+1])^3),
    output(weights) = sum(i in n-5..n, (i - n + 6)*a),
    output(next_spread[i in 0..n-1]) = sqrt(sum(j in 0..n, (q[i+1] - q[j])^2)),
    output(own_spread[i in 0..n]) = sqrt(sum(j in 0..n, (q[i] - q[j])^2)),
)]
struct Below {
    n: usize,
    a: f64,
}

/// Overwrites the entries that have been reported.
struct Spoiler {
    q: Vec<f64>,
    z: Vec<f64>,
    by_q: Vec<f64>,
    taken: Vec<f64>,
    words: usize,
}

impl Spoiler {
    fn take(&mut self, below: usize) {
        for a in self.taken.len()..below {
            self.taken.push(self.by_q[a]);
            (self.q[a], self.z[a], self.by_q[a]) = (f64::NAN, f64::NAN, f64::NAN);
        }
    }
}

impl Sweep<f64> for Spoiler {
    fn slices(&mut self) -> (&[f64], &[f64], Gradient<'_, f64>) {
        let first = Gradient {
            z: &mut [],
            q: &mut self.by_q,
            force: &mut [],
        };
        (&self.q, &self.z, first)
    }

    fn passed(&mut self, below: usize) {
        self.words += 1;
        self.take(below);
    }
}

/// The number of reports of the kernel.
#[track_caller]
fn words<M: family::Model>(model: &M) -> usize {
    let n = model.len();
    let q: Vec<f64> = (0..n).map(|i| (0.3 * i as f64).sin()).collect();
    let z: Vec<f64> = (0..n).map(|i| (0.7 * i as f64).cos()).collect();
    // A kernel that assigns all entries does not depend on their former values.
    let by_q = vec![if M::ASSIGNS { 7.0 } else { 0.0 }; n];
    let mut expected = by_q.clone();
    let first = Gradient {
        z: &mut [],
        q: &mut expected,
        force: &mut [],
    };
    model.forces_inline(0.0, &q, &z, first);
    let (taken, words) = (Vec::new(), 0);
    let mut spoiler = Spoiler {
        q,
        z,
        by_q,
        taken,
        words,
    };
    model.forces_in_strides(0.0, &mut spoiler);
    spoiler.take(n);
    assert_eq!(spoiler.taken, expected);
    spoiler.words
}

#[test]
fn what_was_passed_is_done() {
    for (n, expected) in [
        (1, 0),
        (2, 0),
        (STRIDE, 0),
        (STRIDE + 2, 1),
        (5 * STRIDE, 4),
    ] {
        let a = 0.25;
        assert_eq!(words(&Chain { n, a }), expected, "{n} sites");
    }
    const { assert!(Chain::ASSIGNS && !Far::ASSIGNS) };
    for n in [4, 3 * STRIDE] {
        let m = (0..n).map(|i| 1.0 + i as f64).collect();
        println!("{n}: {}", words(&Far { n, m }));
    }
}

/// The results of the engine's transformations of a sum: the interpreter supports negative indices, generated loops do
/// not.
#[test]
fn sums_that_begin_below_zero_have_all_their_turns() {
    let a = 0.25;
    for n in [2, 3, 17, STRIDE + 2] {
        let q: Vec<f64> = (0..n).map(|i| (0.3 * i as f64).sin()).collect();
        let v: Vec<f64> = (0..n).map(|i| (0.7 * i as f64).cos()).collect();
        let (chain, below) = (Chain { n, a }, Below { n, a });
        let energies = [
            chain.energy_function(0.0, &q, &v),
            below.energy_function(0.0, &q, &v),
        ];
        // Sums of some thousand terms of order one.
        assert!(
            (energies[0] - energies[1]).abs() < 1e-12 * n as f64,
            "{energies:?}"
        );
        let mut forces = [vec![0.0; n], vec![0.0; n]];
        let [one, other] = &mut forces;
        chain.forces_inline(0.0, &q, &v, of_forces(one));
        below.forces_inline(0.0, &q, &v, of_forces(other));
        for (x, y) in forces[0].iter().zip(&forces[1]) {
            assert!((x - y).abs() < 1e-14, "{x} {y}");
        }
    }
}

/// 1 + 2 + 3 + 4 + 5, where the five sites may begin at -3 and at -2, too.
#[test]
fn sums_that_begin_below_zero_at_small_lengths_have_all_their_turns() {
    let a = 0.25;
    for n in [2, 3, 5, 9] {
        let zeros = vec![0.0; n];
        let weights = Below { n, a }.weights(0.0, &zeros, &zeros);
        // Numbers of four bits.
        assert_eq!(weights, Ok(15.0 * a), "{n} sites");
    }
}

/// The sum for the next site would read beyond the last one in a loop over all sites, and is not needed there.
#[test]
fn sums_by_site_stay_in_their_loops() {
    for n in [2, 3, 17] {
        let q: Vec<f64> = (0..n).map(|i| (0.3 * i as f64).sin()).collect();
        let (below, v) = (Below { n, a: 0.25 }, vec![0.0; n]);
        let own = below.own_spread(0.0, &q, &v).expect("all sites");
        let next = below.next_spread(0.0, &q, &v).expect("all but one");
        assert_eq!((own.len(), next.len()), (n, n - 1));
        for (i, length) in own.iter().enumerate() {
            let expected: f64 = q.iter().map(|x| (q[i] - x).powi(2)).sum();
            // Sums of at most seventeen squares below four.
            assert!((length - expected.sqrt()).abs() < 1e-13, "{i} of {n}");
        }
        for (a, b) in next.iter().zip(&own[1..]) {
            assert!((a - b).abs() < 1e-13, "{a} {b}");
        }
    }
}

/// The rates of momenta only.
fn of_forces(by_q: &mut [f64]) -> Gradient<'_, f64> {
    Gradient {
        z: &mut [],
        q: by_q,
        force: &mut [],
    }
}
