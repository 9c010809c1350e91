//! Models of run-time length: the same programs at any length, equal to the models written out, and what lengths must obey.

use tfe_symbolic::compile::declare;
use tfe_symbolic::derive::derivation::Derivation;
use tfe_symbolic::model::declared::{Declared, Requirement};
use tfe_symbolic::program::Request;
use tfe_symbolic::program::interpret::{Environment, Results, interpret};
use tfe_symbolic::syntax::context::{Context, Field, FieldKind};

const ALL: Request = Request {
    value: true,
    first: true,
    mass: true,
    second: true,
    observables: true,
    constraint_values: false,
    constraint_rows: false,
    constraint_second: false,
};

/// The fields that the text uses, of these: lengths n and w, numbers k and a, lists m and c.
fn context(text: &str) -> Context {
    let kinds = [
        ("n", FieldKind::Length),
        ("w", FieldKind::Length),
        ("first", FieldKind::Length),
        ("k", FieldKind::Scalar),
        ("a", FieldKind::Scalar),
        ("m", FieldKind::Vector),
        ("c", FieldKind::Vector),
    ];
    let words: Vec<&str> = text.split(|c: char| !c.is_alphanumeric()).collect();
    let used = kinds
        .into_iter()
        .filter(|(name, _)| words.contains(name))
        .map(|(name, kind)| Field {
            name: name.to_owned(),
            kind,
        });
    Context {
        struct_name: "Model".to_owned(),
        fields: used.collect(),
        const_parameters: Vec::new(),
    }
}

#[track_caller]
fn declared(text: &str) -> Declared {
    declare(text, &context(text)).unwrap_or_else(|problems| panic!("{text}\n{problems:?}"))
}

fn environment(dof: usize, n: usize, w: usize) -> Environment {
    let list = |scale: f64| {
        (0..dof)
            .map(|i| 1.0 + scale * i as f64)
            .collect::<Vec<f64>>()
    };
    Environment {
        time: 0.4,
        q: (0..dof).map(|i| (1.7 * i as f64 + 0.3).sin()).collect(),
        z: (0..dof).map(|i| (0.9 * i as f64 - 0.2).cos()).collect(),
        parameters: [("k", 0.7), ("a", 0.25)]
            .map(|(name, value)| (name.to_owned(), value))
            .into(),
        arrays: [("m", list(0.1)), ("c", list(0.3))]
            .map(|(name, values)| (name.to_owned(), values))
            .into(),
        sizes: [("n", n as i64), ("w", w as i64)]
            .map(|(name, size)| (name.to_owned(), size))
            .into(),
        ..Environment::default()
    }
}

/// A family with n and w sites against the same model written out.
#[track_caller]
fn check(n: usize, w: usize, family: &str, written: &str) {
    let (family, written) = (declared(family), declared(written));
    assert!(family.is_of_run_time_length() && !written.is_of_run_time_length());
    let dof = written.dof.as_constant().expect("a literal length") as usize;
    let run = |declared: &Declared| {
        let program = Derivation::of(declared).program(ALL);
        interpret(&program, &environment(dof, n, w)).unwrap_or_else(|e| panic!("{e}\n{program}"))
    };
    let numbers = |r: &Results| {
        let blocks = [&r.zz, &r.zq, &r.qq, &r.force_z, &r.force_q].map(|block| block.concat());
        [
            vec![r.value],
            r.z.clone(),
            r.q.clone(),
            r.force.clone(),
            blocks.concat(),
        ]
        .concat()
    };
    let (family, written) = (numbers(&run(&family)), numbers(&run(&written)));
    assert_eq!(family.len(), written.len());
    for (at, (x, y)) in family.iter().zip(&written).enumerate() {
        // Sums of some ten terms of size one in another order.
        assert!((x - y).abs() < 1e-13 * 1f64.max(y.abs()), "{at}: {x} {y}");
    }
}

fn joined(range: std::ops::Range<usize>, term: impl Fn(usize) -> String) -> String {
    range.map(term).collect::<Vec<_>>().join(" + ")
}

#[test]
fn a_chain_of_run_time_length() {
    let looped = "coordinates(q[n]), lagrangian = sum(i in 0..n, m[i]/2*dot(q[i])^2) \
        - sum(i in 0..n-1, k/2*(q[i+1]-q[i])^2 + a/3*(q[i+1]-q[i])^3) - k*q[0]^2 - k*q[n-1]^4, \
        force(q[i]) = -c[i]*dot(q[i]), force(q[n-1]) = sin(t)";
    for n in [2, 3, 7] {
        let mass = joined(0..n, |i| format!("m[{i}]/2*dot(q[{i}])^2"));
        let spring = joined(0..n - 1, |i| {
            let j = i + 1;
            format!("k/2*(q[{j}]-q[{i}])^2 + a/3*(q[{j}]-q[{i}])^3")
        });
        let forces: Vec<String> = (0..n)
            .map(|i| format!("force(q[{i}]) = -c[{i}]*dot(q[{i}])"))
            .collect();
        let last = n - 1;
        let written = format!(
            "coordinates(q[{n}]), lagrangian = {mass} - ({spring}) - k*q[0]^2 - k*q[{last}]^4, {}, \
             force(q[{last}]) = sin(t)",
            forces.join(", ")
        );
        check(n, 0, looped, &written);
    }
}

/// Sums over ranges that end where they start are zero: what loops would carry to the next turn stays where it is.
#[test]
fn sums_without_terms_are_zero() {
    let chain = "coordinates(q[n]), lagrangian = sum(i in 0..n, m[i]/2*dot(q[i])^2) \
        - sum(i in 0..n-1, k/2*(q[i+1]-q[i])^2 + a/3*(q[i+1]-q[i])^3) - sum(i in 1..n, a*(q[i]-q[i-1])^4) \
        - k*q[0]^2 - k*q[n-1]^4, force(q[i]) = -c[i]*dot(q[i]), force(q[n-1]) = sin(t)";
    let single = "coordinates(q[1]), lagrangian = m[0]/2*dot(q[0])^2 - k*q[0]^2 - k*q[0]^4, \
        force(q[0]) = -c[0]*dot(q[0]), force(q[0]) = sin(t)";
    check(1, 0, chain, single);
    let beam = "coordinates(q[n]), lagrangian = sum(i in 0..n, m[i]/2*dot(q[i])^2) - k*q[0]^4 - k*(q[n-1] - q[0])^2 \
        - sum(i in 0..n-2, a*(q[i+2] - 2*q[i+1] + q[i])^4)";
    let pair = "coordinates(q[2]), lagrangian = m[0]/2*dot(q[0])^2 + m[1]/2*dot(q[1])^2 - k*q[0]^4 - k*(q[1] - q[0])^2";
    check(2, 0, beam, pair);
}

/// What is left after a loop needs a place where its range is empty; that of a loop around may be anywhere.
#[test]
fn empty_ranges_have_places_for_what_they_leave() {
    let places = |text: &str, sum: &str| {
        let requirements = declared(text).requirements;
        let found = requirements
            .into_iter()
            .find_map(|requirement| match requirement {
                Requirement::Turns { ranges, empty, .. } if ranges == sum => Some(empty),
                _ => None,
            });
        let places = found.expect("a sum")?;
        let mut places: Vec<String> = places.iter().map(ToString::to_string).collect();
        places.sort();
        Some(places.join(", "))
    };
    let kinetic = "coordinates(s, q[n]), lagrangian = dot(s)^2/2 + sum(i in 0..n, dot(q[i])^2/2)";
    let beam = format!("{kinetic} - sum(i in 0..n-2, k*(q[i+2] - 2*q[i+1] + q[i])^2)");
    assert_eq!(places(&beam, "i in 0..n-2"), Some("n, n-1".to_owned()));
    assert_eq!(places(&beam, "i in 0..n"), Some(String::new()));
    // In one loop, though each sum has a single place.
    let apart = format!("{kinetic} - sum(i in 0..n-1, k*q[i]^4) - sum(j in 0..n-1, k*q[j+1]^6)");
    assert_eq!(places(&apart, "i in 0..n-1"), Some("n".to_owned()));
    let windows = format!("{kinetic} - sum(i in 0..n-w, sum(j in 0..w, k*(q[i+j+1] - q[i+j])^4))");
    assert_eq!(places(&windows, "j in 0..w"), None);
}

#[test]
fn pairs_and_several_families() {
    let looped = "coordinates(s, x[n], y[w]), momenta(ps, px[n], py[w]), hamiltonian = ps^2/2 + k*s^2*x[0]^2 \
        + sum(i in 0..n, px[i]^2/2/m[i] + sum(j in 0..i, a*m[i]*m[j]/sqrt(1 + (x[i]-x[j])^2))) \
        + sum(i in 0..w, py[i]^2/2 + k/4*y[i]^4*s^2)";
    let (n, w) = (4, 3);
    let pairs = (0..n).flat_map(|i| (0..i).map(move |j| (i, j)));
    let pairs: Vec<String> = pairs
        .map(|(i, j)| format!("a*m[{i}]*m[{j}]/sqrt(1 + (x[{i}]-x[{j}])^2)"))
        .collect();
    let written = format!(
        "coordinates(s, x[{n}], y[{w}]), momenta(ps, px[{n}], py[{w}]), hamiltonian = ps^2/2 + k*s^2*x[0]^2 + {} + {} + {}",
        joined(0..n, |i| format!("px[{i}]^2/2/m[{i}]")),
        pairs.join(" + "),
        joined(0..w, |i| format!("py[{i}]^2/2 + k/4*y[{i}]^4*s^2")),
    );
    check(n, w, looped, &written);
}

/// What neighbours share is kept in a variable: each place is written once.
#[test]
fn a_chain_stores_each_force_once() {
    let text = "coordinates(q[n]), lagrangian = sum(i in 0..n, 1/2*dot(q[i])^2) - sum(i in 0..n-1, k/2*(q[i+1]-q[i])^4)";
    let first = Request {
        first: true,
        ..Request::default()
    };
    let program = Derivation::of(&declared(text)).program(first).to_string();
    assert!(
        !program.contains("+= ") && !program.contains("clear"),
        "{program}"
    );
}

fn told(requirement: &Requirement) -> String {
    match requirement {
        Requirement::Index {
            array,
            text,
            ranges,
            nest,
            ..
        } => format!("{array}[{text}] for {ranges}, {} loops", nest.len()),
        Requirement::FieldLength {
            field,
            text,
            ranges,
            length,
        } => format!("{field}: {length} by [{text}] for {ranges}"),
        Requirement::Turns { ranges, .. } => format!("turns of {ranges}"),
    }
}

/// What can be decided is decided here, what cannot is left to the run time, and nothing else is.
#[test]
fn requirements_of_lengths() {
    let text = "coordinates(q[n], r[w]), lagrangian = sum(i in 0..n, m[i]/2*dot(q[i])^2) + sum(i in 0..w, dot(r[i])^2/2) \
        - sum(i in 0..n-1, k/2*(q[i+1]-q[i])^2) - sum(i in 1..n, sum(j in 0..i, c[i-1]*q[j]*r[j]))";
    let mut all: Vec<String> = declared(text).requirements.iter().map(told).collect();
    all.sort();
    assert_eq!(
        all,
        [
            "c: n-1 by [i-1] for i in 1..n",
            "m: n by [i] for i in 0..n",
            "r[j] for j in 0..i, 2 loops",
            "turns of i in 0..n",
            "turns of i in 0..n-1",
            "turns of i in 0..w",
            "turns of i in 1..n",
        ]
    );
}

/// An element that a field chooses may be any of a vector.
#[test]
fn requirements_of_chosen_elements() {
    for length in ["3", "w"] {
        let text = format!(
            "coordinates(x[{length}]), lagrangian = sum(i in 0..{length}, dot(x[i])^2/2) - c[n]*x[0]^2"
        );
        let all: Vec<String> = declared(&text).requirements.iter().map(told).collect();
        assert!(all.contains(&"c[n] for , 0 loops".to_owned()), "{all:?}");
        assert!(!all.iter().any(|one| one.starts_with("c:")), "{all:?}");
    }
}

/// Both ends of a range may be fields beside the length of the array.
#[test]
fn ranges_between_two_fields() {
    let outside = |index: &str| {
        let text = format!(
            "coordinates(q[n]), lagrangian = sum(i in 0..n, dot(q[i])^2/2) - sum(i in first..w, k*q[{index}]^2)"
        );
        declare(&text, &context(&text)).is_err()
    };
    assert!(!outside("i+1") && !outside("i-1") && !outside("n-i"));
    assert!(outside("n+i") && outside("-i-1"));
}

/// In models of fixed size fields may be indices and ends of ranges, also of arrays of a few elements.
#[test]
fn requirements_of_models_of_fixed_size() {
    let text = "coordinates(x[3]), lagrangian = sum(i in 0..3, dot(x[i])^2/2 - c[i]*x[i]^2) - k*x[n]^2 - sum(i in n..w, c[i]*x[i])";
    let mut all: Vec<String> = declared(text).requirements.iter().map(told).collect();
    all.sort();
    assert_eq!(
        all,
        [
            "c: 3 by [i] for i in 0..3",
            "c: w by [i] for i in n..w",
            "c[i] for i in n..w, 1 loops",
            "x[i] for i in n..w, 1 loops",
            "x[n] for , 0 loops",
        ]
    );
    let outside = |index: &str| {
        let text =
            format!("coordinates(x[3]), lagrangian = sum(i in 0..3, dot(x[i])^2/2) - k*{index}^2");
        declare(&text, &context(&text)).is_err()
    };
    assert!(!outside("x[n]") && !outside("x[n-30]") && !outside("x[n-w]"));
    assert!(outside("x[n+3]") && outside("x[-n-1]") && outside("x[n+w+3]"));
}

/// `q[n]` and `q[-1]` are read nowhere: the sums that they stand in have no terms on those turns.
#[test]
fn indices_are_needed_where_a_sum_has_terms() {
    let family = "coordinates(q[n]), lagrangian = sum(i in 0..n, dot(q[i])^2/2) \
        - sum(i in 0..n, sum(j in i+1..n, k*cos(q[i+1]-q[j])*q[i+1]^2) + sum(j in 0..i, k*sin(q[i-1])*q[j]))";
    for n in [1, 2, 4] {
        let pairs = (0..n).flat_map(|i| (0..i).map(move |j| (j, i)));
        let terms = pairs.map(|(i, j)| {
            let (next, before) = (i + 1, j - 1);
            format!(" - k*cos(q[{next}]-q[{j}])*q[{next}]^2 - k*sin(q[{before}])*q[{i}]")
        });
        let terms: String = terms.collect();
        let kinetic = joined(0..n, |i| format!("dot(q[{i}])^2/2"));
        let written = format!("coordinates(q[{n}]), lagrangian = {kinetic}{terms}");
        check(n, 0, family, &written);
    }
    let mut all: Vec<String> = declared(family).requirements.iter().map(told).collect();
    all.sort();
    assert_eq!(
        all,
        [
            "q[i+1] for i in 0..n, j in i+1..n, 2 loops",
            "q[i-1] for i in 0..n, j in 0..i, 2 loops",
            "turns of i in 0..n",
        ]
    );
}

/// The same where lengths are literal and the sums too long to be written out.
#[test]
fn loops_of_literal_length_read_what_is_there() {
    let run = |bound: usize| {
        let text = format!(
            "coordinates(q[20]), lagrangian = sum(i in 0..20, dot(q[i])^2/2) \
             - sum(i in 0..{bound}, sum(j in i+1..20, k*sin(q[i+1])*q[j]))"
        );
        let program = Derivation::of(&declared(&text)).program(ALL);
        interpret(&program, &environment(20, 0, 0)).unwrap_or_else(|e| panic!("{e}\n{program}"))
    };
    let (whole, shorter) = (run(20), run(19));
    // Up to 190 terms of size one.
    assert!((whole.value - shorter.value).abs() <= 1e-12);
    assert_eq!(whole.q.len(), shorter.q.len());
    for (one, other) in whole.q.iter().zip(&shorter.q) {
        assert!((one - other).abs() <= 1e-12, "{one} {other}");
    }
}

/// The last five of three sites: loops would begin at zero.
#[test]
fn indices_that_begin_below_zero_at_some_lengths() {
    let text = "coordinates(q[n]), lagrangian = sum(i in 0..n, dot(q[i])^2/2) - sum(i in n-5..n, k*q[i]^2)";
    let mut all: Vec<String> = declared(text).requirements.iter().map(told).collect();
    all.sort();
    assert_eq!(
        all,
        [
            "q[i] for i in n-5..n, 1 loops",
            "q[n-5] for , 0 loops",
            "turns of i in 0..n",
        ]
    );
}

/// Messages tell the range as it is declared, and not that of the loop, which counts from zero.
#[test]
fn ranges_that_begin_below_zero_are_told_as_declared() {
    let text = "coordinates(q[n]), lagrangian = sum(i in 0..n, dot(q[i])^2/2) - sum(i in -1..n-2, k*(q[i+2]-q[i+1])^2)";
    let requirements = declared(text).requirements;
    let turns = requirements
        .iter()
        .find_map(|requirement| match requirement {
            Requirement::Turns {
                ranges, start, end, ..
            } if ranges == "i in -1..n-2" => Some((start.to_string(), end.to_string())),
            _ => None,
        });
    assert_eq!(turns, Some(("-1".to_owned(), "n-2".to_owned())));
}

/// Pairs of two bodies in one loop: entries are told one by one, and nothing is read back from them.
#[test]
fn pairs_are_told_entry_by_entry() {
    let pairs = || (1..4).flat_map(|i| (0..i).map(move |j| (i, j)));
    let family = "coordinates(q[n]), lagrangian = sum(i in 0..n, dot(q[i])^2/2) + sum(i in 0..n, sum(j in 0..i, k*cos(q[i]-q[j])))";
    let attraction: Vec<String> = pairs()
        .map(|(i, j)| format!("k*cos(q[{i}]-q[{j}])"))
        .collect();
    let written = format!(
        "coordinates(q[4]), lagrangian = {} + {}",
        joined(0..4, |i| format!("dot(q[{i}])^2/2")),
        attraction.join(" + ")
    );
    check(4, 0, family, &written);
    let program = Derivation::of(&declared(family)).program(ALL).to_string();
    assert!(!program.contains("balance"), "{program}");
}

/// Sums that depend on the index of a loop are computed in that loop, and in no other of the same index that goes further.
#[test]
fn sums_stay_in_their_loops() {
    let family = "coordinates(q[n], r[w]), lagrangian = sum(i in 0..n, dot(q[i])^2/2) + sum(i in 0..w, dot(r[i])^2/2), \
        force(q[i]) = sin(sum(j in 0..n, q[i]*q[j]^2)), force(r[i]) = cos(sum(j in 0..n, r[i]*q[j]))";
    let squares = joined(0..5, |j| format!("q[{j}]^2"));
    let total = joined(0..5, |j| format!("q[{j}]"));
    let forces: Vec<String> = (0..5)
        .map(|i| format!("force(q[{i}]) = sin(q[{i}]*({squares}))"))
        .chain((0..3).map(|i| format!("force(r[{i}]) = cos(r[{i}]*({total}))")))
        .collect();
    let written = format!(
        "coordinates(q[5], r[3]), lagrangian = {} + {}, {}",
        joined(0..5, |i| format!("dot(q[{i}])^2/2")),
        joined(0..3, |i| format!("dot(r[{i}])^2/2")),
        forces.join(", ")
    );
    check(5, 3, family, &written);
}

/// Of the third force the sum is empty, and begins beyond where it ends: nothing is carried from its first place to its last.
#[test]
fn ranges_that_forces_move_may_be_empty() {
    let family = "coordinates(x[3], q[n]), lagrangian = sum(i in 0..3, dot(x[i])^2/2) + sum(i in 0..n, dot(q[i])^2/2), \
        force(x[i]) = q[2]^2 + sum(j in i..w, (q[j+1] - q[j])^3)";
    let written = format!(
        "coordinates(x[3], q[5]), lagrangian = {} + {}, \
         force(x[0]) = q[2]^2 + (q[1] - q[0])^3, force(x[1]) = q[2]^2, force(x[2]) = q[2]^2",
        joined(0..3, |i| format!("dot(x[{i}])^2/2")),
        joined(0..5, |i| format!("dot(q[{i}])^2/2")),
    );
    check(5, 1, family, &written);
}
