use super::*;
use crate::expr::input::{Affine, IndexSymbol, LoopVariable};

fn q(graph: &mut Graph, index: i64) -> ExprId {
    graph.input(Input::Coordinate(Affine::constant(index)))
}

fn sine(graph: &mut Graph, x: ExprId) -> ExprId {
    graph.call(Function::Sin, &[x])
}

fn cosine(graph: &mut Graph, x: ExprId) -> ExprId {
    graph.call(Function::Cos, &[x])
}

fn both(graph: &mut Graph, x: ExprId) -> [ExprId; 2] {
    [sine(graph, x), cosine(graph, x)]
}

/// The arguments of the sines and cosines that are left, each once.
fn arguments(graph: &Graph, roots: &[ExprId]) -> Vec<String> {
    let mut found: Vec<String> = graph
        .reachable(roots)
        .into_iter()
        .filter_map(|id| match graph.node(id) {
            Node::Call {
                function: Function::Sin | Function::Cos,
                arguments,
            } => Some(graph.display(arguments[0]).to_string()),
            _ => None,
        })
        .collect();
    found.sort_unstable();
    found.dedup();
    found
}

#[track_caller]
fn check(graph: &mut Graph, roots: Vec<ExprId>, expected: &[&str]) {
    let expanded = expand_angles(graph, roots);
    assert_eq!(arguments(graph, &expanded), expected);
}

#[track_caller]
fn check_unchanged(graph: &mut Graph, roots: Vec<ExprId>) {
    assert_eq!(expand_angles(graph, roots.clone()), roots);
}

#[test]
fn a_difference_follows_from_its_angles() {
    let mut g = Graph::default();
    let (a, b) = (q(&mut g, 0), q(&mut g, 1));
    let difference = g.subtract(a, b);
    let roots = [a, b, difference].map(|x| both(&mut g, x)).concat();
    let expanded = expand_angles(&mut g, roots);
    assert_eq!(
        g.display(expanded[4]).to_string(),
        "(sin(q[0])*cos(q[1])) - (cos(q[0])*sin(q[1]))"
    );
    assert_eq!(
        g.display(expanded[5]).to_string(),
        "(cos(q[0])*cos(q[1])) + (sin(q[0])*sin(q[1]))"
    );
}

#[test]
fn a_difference_alone_stays() {
    let mut g = Graph::default();
    let (a, b) = (q(&mut g, 0), q(&mut g, 1));
    let difference = g.subtract(a, b);
    let roots = both(&mut g, difference).to_vec();
    check_unchanged(&mut g, roots.clone());
    // One angle beside it is not enough either: the other would have to be computed in its place.
    let roots = [roots, both(&mut g, a).to_vec()].concat();
    check_unchanged(&mut g, roots);
}

#[test]
fn lone_cosines_become_pairs_only_where_enough_follows() {
    let mut g = Graph::default();
    let (a, b) = (q(&mut g, 0), q(&mut g, 1));
    let difference = g.subtract(a, b);
    // cos(a), cos(a − b) cost 40; two pairs, two products and a sum would cost 53.
    let roots = [a, difference].map(|x| cosine(&mut g, x)).to_vec();
    check_unchanged(&mut g, roots);
    // cos(a), cos(b), cos(a − b) cost 60.
    let roots = [a, b, difference].map(|x| cosine(&mut g, x)).to_vec();
    let expanded = expand_angles(&mut g, roots.clone());
    assert_eq!(expanded[..2], roots[..2]);
    assert_eq!(
        g.display(expanded[2]).to_string(),
        "(cos(q[0])*cos(q[1])) + (sin(q[0])*sin(q[1]))"
    );
}

#[test]
fn differences_follow_from_differences() {
    // All ten differences of five angles from four of them.
    let mut g = Graph::default();
    let angles = [0, 1, 2, 3, 4].map(|index| q(&mut g, index));
    let mut roots = Vec::new();
    for (at, a) in angles.iter().enumerate() {
        for b in &angles[at + 1..] {
            let difference = g.subtract(*a, *b);
            roots.extend(both(&mut g, difference));
        }
    }
    let expanded = expand_angles(&mut g, roots);
    assert_eq!(arguments(&g, &expanded).len(), 4);
}

#[test]
fn sums_of_three_and_doubled_angles() {
    let mut g = Graph::default();
    let (a, b, c) = (q(&mut g, 0), q(&mut g, 1), q(&mut g, 2));
    let three = {
        let sum = g.add(a, b);
        g.subtract(sum, c)
    };
    let two = g.integer(2);
    let double = g.multiply(two, a);
    let roots = [a, b, c, three, double].map(|x| both(&mut g, x)).concat();
    check(&mut g, roots, &["q[0]", "q[1]", "q[2]"]);
}

#[test]
fn atoms_that_occur_in_sums_only_may_help() {
    // a + b, a − b, a + c, a − c, b + c, b − c: three pairs instead of six.
    let mut g = Graph::default();
    let (a, b, c) = (q(&mut g, 0), q(&mut g, 1), q(&mut g, 2));
    let mut roots = Vec::new();
    for (x, y) in [(a, b), (a, c), (b, c)] {
        let (sum, difference) = (g.add(x, y), g.subtract(x, y));
        roots.extend([sum, difference].map(|x| both(&mut g, x)).concat());
    }
    check(&mut g, roots, &["q[0]", "q[1]", "q[2]"]);
}

#[test]
fn opposite_angles_keep_their_signs() {
    // Nested, the difference begins with the sum: (b + c) − a.
    let mut g = Graph::default();
    let (a, b, c) = (q(&mut g, 0), q(&mut g, 1), q(&mut g, 2));
    let inner = g.add(b, c);
    let nested = g.subtract(inner, a);
    let mut roots = [a, b, c, inner, nested].map(|x| both(&mut g, x)).concat();
    let minus = g.subtract(a, inner);
    roots.push(sine(&mut g, minus));
    let expanded = expand_angles(&mut g, roots);
    assert_eq!(arguments(&g, &expanded), ["q[0]", "q[1]", "q[2]"]);
    assert_eq!(expanded[10], g.negate(expanded[8]));
}

#[test]
fn numbers_are_angles_known_in_advance() {
    let mut g = Graph::default();
    let x = q(&mut g, 0);
    let shifted: Vec<ExprId> = ["2.0943951023931953", "-2.0943951023931953"]
        .iter()
        .filter_map(|text| Constant::parse(text.trim_start_matches('-')).map(|c| (c, text)))
        .map(|(c, text)| if text.starts_with('-') { -c } else { c })
        .map(|c| g.linear(c, &[(Constant::ONE, x)]))
        .collect();
    let mut roots = both(&mut g, x).to_vec();
    for x in shifted {
        roots.extend(both(&mut g, x));
    }
    check(&mut g, roots, &["q[0]"]);
}

#[test]
fn other_arguments_stay() {
    let mut g = Graph::default();
    let (a, b) = (q(&mut g, 0), q(&mut g, 1));
    let v = g.input(Input::Velocity(Affine::constant(0)));
    let (half, many) = (
        Constant::rational(1, 2).expect("no zero below"),
        Constant::integer(1_000_000_000),
    );
    let product = g.multiply(a, b);
    for odd in [g.scale(half, a), g.scale(many, a), v, product] {
        let sum = g.add(odd, b);
        let roots = [odd, b, sum].map(|x| both(&mut g, x)).concat();
        check_unchanged(&mut g, roots);
    }
}

#[test]
fn what_varies_in_a_loop_stays() {
    let mut g = Graph::default();
    let (i, j) = (LoopVariable(0), LoopVariable(1));
    let [a, b] = [i, j].map(|variable| {
        g.input(Input::Coordinate(Affine::symbol(IndexSymbol::Loop(
            variable,
        ))))
    });
    let difference = g.subtract(a, b);
    let roots = [a, b, difference].map(|x| both(&mut g, x)).concat();
    check_unchanged(&mut g, roots);
}

#[test]
fn many_angles_take_little_time() {
    // 60 angles and their 1770 differences.
    let mut g = Graph::default();
    let angles: Vec<ExprId> = (0..60).map(|index| q(&mut g, index)).collect();
    let mut roots: Vec<ExprId> = angles.iter().flat_map(|x| both(&mut g, *x)).collect();
    for (at, a) in angles.iter().enumerate() {
        for b in &angles[at + 1..] {
            let difference = g.subtract(*a, *b);
            roots.extend(both(&mut g, difference));
        }
    }
    let expanded = expand_angles(&mut g, roots);
    assert_eq!(arguments(&g, &expanded).len(), 60);
}
