//! Reference derivatives without differences: elements with Gauss quadrature in dual numbers, with an independent
//! solver.

#![allow(dead_code)] // each test target uses its part

use nalgebra::{DMatrix, DVector};
use tfe::runtime::dual::Dual;
use tfe::runtime::scheme::{SchemeTable, Tables as _};
use tfe::runtime::{Element, First, Form, Model};

/// Enough iterations for steps that contract by a factor of four; derivatives converge as fast as values.
const SWEEPS: usize = 40;

/// Enough iterations for Newton's method from the initial values of an element, with one more for the derivatives.
const NEWTON: usize = 8;

/// Coordinates and momenta as dual numbers, each with a derivative.
#[derive(Clone)]
pub struct Phase {
    pub q: Vec<Dual>,
    pub p: Vec<Dual>,
}

impl Phase {
    /// An initial state, whose derivative is one column of a matrix ordered (p, q), or zero.
    pub fn along(q: &[f64], p: &[f64], column: Option<usize>) -> Self {
        let n = q.len();
        let part = |values: &[f64], offset: usize| {
            let slope = |a| f64::from(column == Some(offset + a));
            let values = values.iter().enumerate();
            values.map(|(a, x)| Dual::new(*x, slope(a))).collect()
        };
        Self {
            q: part(q, n),
            p: part(p, 0),
        }
    }
}

/// A number with derivative zero.
pub fn number(value: f64) -> Dual {
    Dual::new(value, 0.0)
}

/// A vector as the array that kernels of N coordinates take.
pub fn array<const N: usize>(values: &[Dual]) -> [Dual; N] {
    values.try_into().expect("as many as there are coordinates")
}

/// start + h Σ weight · rate
pub fn moved(start: &[Dual], h: Dual, weights: &[f64], rates: &[Vec<Dual>]) -> Vec<Dual> {
    let mut sum = start.to_vec();
    for (weight, rate) in weights.iter().zip(rates) {
        let weight = h * number(*weight);
        for (sum, rate) in sum.iter_mut().zip(rate) {
            *sum += *rate * weight;
        }
    }
    sum
}

/// x − A⁻¹ r, where r is a vector of dual numbers.
fn corrected(x: &[Dual], matrix: DMatrix<f64>, residual: &[Dual]) -> Vec<Dual> {
    let factors = matrix.full_piv_lu();
    let part = |of: fn(&Dual) -> f64| {
        let right = DVector::from_iterator(residual.len(), residual.iter().map(of));
        factors.solve(&right).expect("a regular matrix")
    };
    let (values, slopes) = (part(|r| r.value), part(|r| r.slope));
    let change = values.iter().zip(&slopes).map(|(v, s)| Dual::new(*v, *s));
    x.iter().zip(change).map(|(x, d)| *x - d).collect()
}

/// Solves a system of equations by Newton's method. Derivatives by the unknowns are slopes of dual numbers, too; those
/// by the data are subtracted first.
pub fn root(mut x: Vec<Dual>, residual: impl Fn(&[Dual]) -> Vec<Dual>) -> Vec<Dual> {
    for _ in 0..NEWTON {
        let still: Vec<Dual> = x.iter().map(|x| number(x.value)).collect();
        let data = residual(&still);
        let mut matrix = DMatrix::zeros(x.len(), x.len());
        for column in 0..x.len() {
            let mut one = still.clone();
            one[column].slope = 1.0;
            for (row, r) in residual(&one).iter().enumerate() {
                matrix[(row, column)] = r.slope - data[row].slope;
            }
        }
        let now = residual(&x);
        x = corrected(&x, matrix, &now);
    }
    x
}

/// The rate and the force of a model of fixed size at one point with its momentum; the search for the velocity starts
/// at `rate`.
pub fn flow<M: Model<N>, const N: usize>(
    model: &M,
    time: Dual,
    (q, p): (&[Dual], &[Dual]),
    rate: &mut Vec<Dual>,
) -> Vec<Dual> {
    let (q, mut first) = (array::<N>(q), First::zero());
    match M::FORM {
        Form::Hamiltonian => {
            model.first(time, &q, &array(p), &mut first);
            *rate = first.z.to_vec();
        }
        // Newton's method for L_v(q, v) = p, with the mass matrix in ordinary numbers.
        Form::Lagrangian => {
            model.first(time, &q, &array(rate), &mut first);
            let left: Vec<Dual> = first.z.iter().zip(p).map(|(z, p)| *z - *p).collect();
            let (mut plain, mut mass) = (First::ZERO, [[0.0; N]; N]);
            let (at, v) = (q.map(|x| x.value), array::<N>(rate).map(|x| x.value));
            model.first_and_mass(time.value, &at, &v, &mut plain, &mut mass);
            *rate = corrected(rate, DMatrix::from_fn(N, N, |i, j| mass[i][j]), &left);
            model.first(time, &q, &array(rate), &mut first);
        }
    }
    let force = first.force.iter().zip(&first.q);
    force
        .map(|(force, q)| match M::FORM {
            Form::Hamiltonian => *force - *q,
            Form::Lagrangian => *q + *force,
        })
        .collect()
}

/// The velocity that belongs to a momentum.
pub fn velocity<M: Model<N>, const N: usize>(model: &M, time: Dual, at: &Phase) -> Vec<Dual> {
    let mut rate = vec![number(0.0); N];
    for _ in 0..NEWTON {
        flow(model, time, (&at.q, &at.p), &mut rate);
    }
    rate
}

/// The end of one element with Gauss points from the time `t` on; for `flow` see [`flow`].
pub fn element_end(
    element: Element,
    start: &Phase,
    (t, h): (Dual, Dual),
    flow: impl Fn(Dual, (&[Dual], &[Dual]), &mut Vec<Dual>) -> Vec<Dual>,
) -> Phase {
    let table = SchemeTable::new(element).expect("an element");
    let scheme = table.view();
    let points = scheme.points();
    let zero = vec![number(0.0); start.q.len()];
    let (mut rates, mut forces) = (vec![zero.clone(); points], vec![zero; points]);
    for _ in 0..SWEEPS {
        let before = (rates.clone(), forces.clone());
        for l in 0..points {
            let row = &scheme.position[l * points..(l + 1) * points];
            let time = t + number(scheme.nodes[l]) * h;
            let q = moved(&start.q, h, row, &rates);
            let p = moved(&start.p, h, row, &forces);
            forces[l] = flow(time, (&q, &p), &mut rates[l]);
        }
        if before.0 == rates && before.1 == forces {
            break;
        }
    }
    Phase {
        q: moved(&start.q, h, scheme.weights, &rates),
        p: moved(&start.p, h, scheme.weights, &forces),
    }
}

/// Compares derivatives with those of runs in dual numbers.
pub struct Beside<'a> {
    /// The state at the start.
    pub start: (&'a [f64], &'a [f64]),
    /// Returns the end of a run from a start, with the derivative by the parameter of this index, if given.
    pub end: &'a dyn Fn(&Phase, Option<usize>) -> Phase,
    off: f64,
    size: f64,
}

impl<'a> Beside<'a> {
    /// Without any comparison yet.
    pub fn new(
        start: (&'a [f64], &'a [f64]),
        end: &'a dyn Fn(&Phase, Option<usize>) -> Phase,
    ) -> Self {
        Self {
            start,
            end,
            off: 0.0,
            size: 0.0,
        }
    }

    /// The largest difference divided by the largest derivative.
    pub fn off(&self) -> f64 {
        assert!(self.size > 0.0, "nothing was compared");
        self.off / self.size
    }

    /// Compares the derivatives of the end by a parameter.
    pub fn by_parameter(&mut self, index: usize, q: &[f64], p: &[f64]) {
        let start = Phase::along(self.start.0, self.start.1, None);
        let end = (self.end)(&start, Some(index));
        self.see(q, p, &end);
    }

    /// Compares the derivatives of the end along a column of the matrix by the initial state, ordered (p, q).
    pub fn by_start(&mut self, column: usize, q: &[f64], p: &[f64]) {
        let start = Phase::along(self.start.0, self.start.1, Some(column));
        let end = (self.end)(&start, None);
        self.see(q, p, &end);
    }

    fn see(&mut self, q: &[f64], p: &[f64], expected: &Phase) {
        let found = q.iter().chain(p);
        let expected = expected.q.iter().chain(&expected.p);
        assert_eq!(found.clone().count(), expected.clone().count());
        for (found, expected) in found.zip(expected) {
            assert!(found.is_finite() && expected.slope.is_finite());
            self.off = self.off.max((found - expected.slope).abs());
            self.size = self.size.max(expected.slope.abs());
        }
    }
}
