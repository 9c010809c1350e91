//! Kinetic energies as sums of squares: the velocities of point masses, where an energy is declared by angles.
//!
//! ```text
//! m₁₂ l₁² φ̇₁²/2 + m₂ l₂² φ̇₂²/2 + m₂ l₁ l₂ φ̇₁ φ̇₂ cos(φ₁ − φ₂)  =  m₁ (x₁² + y₁²)/2 + m₂ ((x₁ + x₂)² + (y₁ + y₂)²)/2
//! xᵢ = lᵢ φ̇ᵢ cos φᵢ,  yᵢ = lᵢ φ̇ᵢ sin φᵢ
//! ```
//!
//! For each parameter such as m₂ the energy is a quadratic form in these products, and is written by squares as in Lagrange's reduction. Its
//! derivatives then share the sums, which from the formula by angles nobody sees. What is no such product stays as it is.

use std::collections::BTreeMap;

use crate::expr::constant::Constant;
use crate::expr::function::Function;
use crate::expr::graph::{ExprId, Graph, Node};
use crate::expr::hash::Set;
use crate::expr::input::{Affine, Input};

/// Forms of more products than this are left.
const LARGEST: usize = 24;

/// Factors and their exponents.
type Powers = BTreeMap<ExprId, i32>;

/// The sine or cosine of a coordinate, beside its velocity.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Atom {
    coordinate: Affine,
    function: Function,
}

/// A term of the energy: parameters, and two atoms or the square of a velocity.
struct Term {
    coefficient: Constant,
    parameters: Powers,
    kind: Kind,
}

enum Kind {
    Pair(Atom, Atom),
    Square(Affine),
}

/// A symmetric form, each product once.
type Form = BTreeMap<(Atom, Atom), Constant>;

/// A factor, and the sum to be squared.
type Square = (Constant, Vec<(Atom, Constant)>);

/// The energy by squares; nothing if that is no shorter.
pub(crate) fn by_squares(graph: &mut Graph, energy: ExprId) -> Option<ExprId> {
    if graph.contains_sum(energy) {
        return None;
    }
    let moving = graph.moving(&[energy]);
    let open = graph.expanded_around(energy, |id| !moving.contains(&id))?;
    let (outer, inner) = graph.as_multiple(open);
    let (constant, terms) = graph.as_sum(inner)?;
    let (constant, terms) = (outer * constant, terms.to_vec());
    let (mut rest, mut read) = (Vec::new(), Vec::new());
    for (c, x) in terms {
        match term(graph, &moving, outer * c, x) {
            Some(term) => read.push(term),
            None => rest.push((outer * c, x)),
        }
    }
    let amplitudes = amplitudes(&read);
    let mut sums = false;
    for (parameters, form) in forms(graph, &amplitudes, &read)? {
        let before = form.len();
        let squares = reduced(form)?;
        if squares.len() > before {
            return None;
        }
        for (c, parts) in squares {
            sums |= parts.len() > 1;
            let parts: Vec<_> = parts
                .into_iter()
                .map(|(atom, c)| (c, product(graph, &amplitudes, &atom)))
                .collect();
            let sum = graph.linear(Constant::ZERO, &parts);
            rest.push((
                c,
                graph.product(Constant::ONE, &[(parameters, 1), (sum, 2)]),
            ));
        }
    }
    sums.then(|| graph.linear(constant, &rest))
}

/// Reads a term of two velocities.
fn term(graph: &Graph, moving: &Set<ExprId>, coefficient: Constant, x: ExprId) -> Option<Term> {
    let Node::Product(factors) = graph.node(x) else {
        return None;
    };
    let (mut parameters, mut velocities, mut atoms) = (Powers::new(), Vec::new(), Vec::new());
    for (x, n) in factors {
        match graph.node(*x) {
            _ if !moving.contains(x) => {
                parameters.insert(*x, *n);
            }
            Node::Input(Input::Velocity(index)) if (1..=2).contains(n) => {
                velocities.extend((0..*n).map(|_| index.clone()));
            }
            Node::Call {
                function: function @ (Function::Sin | Function::Cos),
                arguments,
            } if (1..=2).contains(n) => match graph.node(*arguments.first()?) {
                Node::Input(Input::Coordinate(coordinate)) => {
                    let atom = Atom {
                        coordinate: coordinate.clone(),
                        function: *function,
                    };
                    atoms.extend((0..*n).map(|_| atom.clone()));
                }
                _ => return None,
            },
            _ => return None,
        }
    }
    velocities.sort();
    atoms.sort();
    let kind = match (&velocities[..], &atoms[..]) {
        ([a, b], []) if a == b => Kind::Square(a.clone()),
        ([a, b], [x, y]) if x.coordinate == *a && y.coordinate == *b => {
            Kind::Pair(x.clone(), y.clone())
        }
        _ => return None,
    };
    Some(Term {
        coefficient,
        parameters,
        kind,
    })
}

/// The parameters that stand beside each atom of a coordinate, in all terms.
fn amplitudes(terms: &[Term]) -> BTreeMap<Affine, Powers> {
    let mut found: BTreeMap<Affine, Powers> = BTreeMap::new();
    let mut note = |coordinate: &Affine, own: Powers| {
        let known = found.remove(coordinate);
        let least = known.map_or_else(|| own.clone(), |known| common(&known, &own));
        found.insert(coordinate.clone(), least);
    };
    for Term {
        parameters, kind, ..
    } in terms
    {
        let halves = || parameters.iter().map(|(x, n)| (*x, n / 2)).collect();
        match kind {
            Kind::Pair(a, b) if a.coordinate == b.coordinate => note(&a.coordinate, halves()),
            Kind::Pair(a, b) => {
                note(&a.coordinate, parameters.clone());
                note(&b.coordinate, parameters.clone());
            }
            Kind::Square(coordinate) => note(coordinate, halves()),
        }
    }
    found
}

fn common(a: &Powers, b: &Powers) -> Powers {
    let least = a.iter().filter_map(|(x, n)| Some((*x, *b.get(x)?.min(n))));
    least.filter(|(_, n)| *n > 0).collect()
}

/// By the parameters that multiply them, sums opened: the quadratic forms.
fn forms(
    graph: &mut Graph,
    amplitudes: &BTreeMap<Affine, Powers>,
    terms: &[Term],
) -> Option<BTreeMap<ExprId, Form>> {
    let mut forms: BTreeMap<ExprId, Form> = BTreeMap::new();
    for term in terms {
        let pairs = match &term.kind {
            Kind::Pair(a, b) => vec![(a.clone(), b.clone())],
            // 1 = sin² + cos²
            Kind::Square(coordinate) => {
                let atom = |function| Atom {
                    coordinate: coordinate.clone(),
                    function,
                };
                let functions = [Function::Sin, Function::Cos].into_iter();
                functions.map(|f| (atom(f), atom(f))).collect()
            }
        };
        let (a, b) = pairs.first()?;
        let mut left = term.parameters.clone();
        for coordinate in [&a.coordinate, &b.coordinate] {
            for (x, n) in amplitudes.get(coordinate)? {
                *left.entry(*x).or_default() -= n;
            }
        }
        let factors: Vec<(ExprId, i32)> = left.into_iter().collect();
        if factors.iter().any(|(_, n)| *n < 0) {
            return None;
        }
        let left = graph.product(Constant::ONE, &factors);
        let left = graph.expanded(left)?;
        let (outer, inner) = graph.as_multiple(left);
        let parts = match graph.as_sum(inner) {
            Some((number, parts)) if number.is_zero() => parts.to_vec(),
            Some(_) => return None,
            None => vec![(Constant::ONE, inner)],
        };
        for (c, parameters) in parts {
            let form = forms.entry(parameters).or_default();
            for pair in &pairs {
                let total = form.entry(pair.clone()).or_insert(Constant::ZERO);
                *total = *total + term.coefficient * outer * c;
            }
        }
    }
    Some(forms)
}

/// Lagrange's reduction: factors, and the sums to be squared. Nothing where a square is missing.
fn reduced(mut form: Form) -> Option<Vec<Square>> {
    let half = Constant::rational(1, 2)?;
    let mut squares = Vec::new();
    if form.len() > LARGEST {
        return None;
    }
    form.retain(|_, c| !c.is_zero());
    while let Some(((first, _), _)) = form.last_key_value() {
        let pivot = first.clone();
        let diagonal = form.remove(&(pivot.clone(), pivot.clone()))?;
        let inverse = diagonal.reciprocal()?;
        let mut parts = vec![(pivot.clone(), Constant::ONE)];
        let beside = form.keys().filter(|(a, b)| *a == pivot || *b == pivot);
        for key in beside.cloned().collect::<Vec<_>>() {
            let c = form.remove(&key)?;
            let other = if key.0 == pivot { key.1 } else { key.0 };
            parts.push((other, c * half * inverse));
        }
        for (at, (a, c)) in parts.iter().enumerate().skip(1) {
            for (b, d) in &parts[at..] {
                let twice = if a == b {
                    Constant::ONE
                } else {
                    Constant::integer(2)
                };
                let key = (a.min(b).clone(), a.max(b).clone());
                let total = form.entry(key).or_insert(Constant::ZERO);
                *total = *total - diagonal * *c * *d * twice;
            }
        }
        form.retain(|_, c| !c.is_zero());
        squares.push((diagonal, parts));
    }
    Some(squares)
}

/// Amplitude, sine or cosine, velocity.
fn product(graph: &mut Graph, amplitudes: &BTreeMap<Affine, Powers>, atom: &Atom) -> ExprId {
    let angle = graph.input(Input::Coordinate(atom.coordinate.clone()));
    let velocity = graph.input(Input::Velocity(atom.coordinate.clone()));
    let call = graph.call(atom.function, &[angle]);
    let mut factors = vec![(call, 1), (velocity, 1)];
    let amplitude = amplitudes.get(&atom.coordinate).into_iter().flatten();
    factors.extend(amplitude.map(|(x, n)| (*x, *n)));
    graph.product(Constant::ONE, &factors)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compile::declare;
    use crate::syntax::context::{Context, Field, FieldKind};

    /// The energy as it was, and by squares if there are some.
    fn energies(text: &str, fields: &[&str]) -> (Graph, ExprId, Option<ExprId>) {
        let field = |name: &&str| Field {
            name: (*name).to_owned(),
            kind: FieldKind::Scalar,
        };
        let context = Context {
            fields: fields.iter().map(field).collect(),
            ..Context::default()
        };
        let declared = declare(text, &context).expect("a model of the test");
        let (mut graph, energy) = (declared.graph, declared.energy);
        let squares = by_squares(&mut graph, energy);
        (graph, energy, squares)
    }

    const PENDULUM: &str = "coordinates(a, b), lagrangian = (m + n)*l^2/2*dot(a)^2 + n*k^2/2*dot(b)^2 \
        + n*l*k*dot(a)*dot(b)*(cos(a)*cos(b) + sin(a)*sin(b)) + 9.81*(m + n)*l*cos(a)";

    #[test]
    fn velocities_of_masses_are_found() {
        let (mut graph, energy, squares) = energies(PENDULUM, &["m", "n", "l", "k"]);
        let squares = squares.expect("there are squares");
        // Four squares, of one product or two.
        let sums = graph.reachable(&[squares]).into_iter().filter(|x| {
            let node = graph.node(*x);
            matches!(node, Node::Product(factors) if factors.iter().any(|(_, n)| *n == 2))
        });
        assert!(sums.count() >= 2);
        let difference = graph.subtract(squares, energy);
        let difference = graph.expanded(difference).expect("few terms");
        // Beside sin² + cos² = 1 nothing is left.
        let zero = graph.as_constant(difference).is_some_and(Constant::is_zero);
        assert!(zero, "{}", graph.display(difference));
    }

    #[test]
    fn other_energies_are_left() {
        for (energy, fields) in [
            ("dot(a)^2/2 + dot(b)^2/2 - a^2*b", &[][..]),
            ("m*dot(a)*dot(b)*cos(a)*cos(b)", &["m"]),
            ("m/2*(dot(a)^2 + dot(b)^2*sin(a)^2) + cos(a)", &["m"]),
        ] {
            let text = format!("coordinates(a, b), lagrangian = {energy}");
            let (.., squares) = energies(&text, fields);
            assert!(squares.is_none(), "{energy}");
        }
    }
}
