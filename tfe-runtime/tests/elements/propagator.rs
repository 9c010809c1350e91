//! Linear models that step by a matrix, against the same steps without.

use tfe_runtime::step::{Control, Stepper};
use tfe_runtime::{
    CoordinateName, Element, Facts, First, Form, Model, Real, Second, State, Statistics,
};

/// Two masses in a row, the first on a spring to the wall, in gravity and with a damper between them.
struct Row;

impl Model<2> for Row {
    const FORM: Form = Form::Lagrangian;
    const FACTS: Facts = Facts {
        time_dependent: false,
        forced: true,
        quadratic_in_z: true,
        constant_mass: true,
        linear: true,
        separable: true,
        smooth: true,
    };

    fn energy_function<R: Real>(&self, _: R, q: &[R; 2], v: &[R; 2]) -> R {
        let stretch = q[1] - q[0];
        R::from_f64(0.5) * (v[0] * v[0] + R::from_f64(2.0) * v[1] * v[1] - q[0] * q[0])
            - R::from_f64(1.5) * stretch * stretch
            - R::from_f64(9.81) * (q[0] + R::from_f64(2.0) * q[1])
    }
    fn first<R: Real>(&self, _: R, q: &[R; 2], v: &[R; 2], first: &mut First<R, 2>) {
        let stretch = R::from_f64(3.0) * (q[1] - q[0]);
        let drag = R::from_f64(0.02) * (v[1] - v[0]);
        first.z = [v[0], R::from_f64(2.0) * v[1]];
        first.q = [
            stretch - q[0] - R::from_f64(9.81),
            -stretch - R::from_f64(19.62),
        ];
        first.force = [drag, -drag];
    }
    fn first_and_mass<R: Real>(
        &self,
        t: R,
        q: &[R; 2],
        v: &[R; 2],
        first: &mut First<R, 2>,
        zz: &mut [[R; 2]; 2],
    ) {
        self.first(t, q, v, first);
        zz[0][0] = R::from_f64(1.0);
        zz[1][1] = R::from_f64(2.0);
    }
    fn second<R: Real>(
        &self,
        t: R,
        q: &[R; 2],
        v: &[R; 2],
        first: &mut First<R, 2>,
        second: &mut Second<R, 2>,
    ) {
        self.first_and_mass(t, q, v, first, &mut second.zz);
        let (k, c) = (R::from_f64(3.0), R::from_f64(0.02));
        second.qq = [[-k - R::from_f64(1.0), k], [k, -k]];
        second.force_z = [[-c, c], [c, -c]];
    }
    fn coordinate_name(index: usize) -> CoordinateName {
        CoordinateName::element("x", index)
    }
}

const START: State<2> = State {
    q: [0.3, -0.2],
    p: [0.1, 0.4],
};

/// Runs so many steps of 0.1, with the inside of every k-th element.
fn run(element: Element, by_matrix: bool, steps: u32) -> (State<2>, State<2>, Statistics) {
    let mut stepper = Stepper::new(&Row, element, Control::default()).unwrap();
    if by_matrix {
        stepper = stepper.ends_only();
    }
    let mut state = START;
    for k in 0..steps {
        stepper
            .advance(0.1 * f64::from(k), 0.1, &mut state, &[])
            .unwrap();
    }
    (
        state,
        stepper.dense(0.0, 1.0).at(0.3),
        *stepper.statistics(),
    )
}

fn difference(a: &State<2>, b: &State<2>) -> f64 {
    let pairs = a.q.iter().chain(&a.p).zip(b.q.iter().chain(&b.p));
    // `f64::max` would drop a NaN, which is the largest here.
    let apart = pairs.map(|(a, b)| (a - b).abs());
    apart.max_by(f64::total_cmp).unwrap_or(f64::NAN)
}

/// A thousand steps differ by roundings only, and the inside of an element too.
#[test]
fn the_matrix_does_what_steps_do() {
    for element in [
        Element::mixed(4),
        Element::primal(3),
        Element::radau(3),
        Element::energy_conserving(3),
    ] {
        let (end, inside, _) = run(element, false, 1000);
        let (fast_end, fast_inside, statistics) = run(element, true, 1000);
        // Values of 70, D exact to a rounding of h: a few 1e-15 a step at most.
        let error = difference(&end, &fast_end);
        assert!(error < 3e-12, "{element}: {error:.1e}");
        let error = difference(&inside, &fast_inside);
        assert!(error < 3e-12, "{element}: {error:.1e}");
        assert_eq!(statistics.steps, 1000);
        // 2N + 1 steps pay for themselves; all others evaluate nothing.
        assert!(statistics.iterations < 60, "{statistics:?}");
    }
}

/// Another length in between, and the transition matrix after a step by the matrix.
#[test]
fn other_lengths_and_transitions() {
    let mut fast = Stepper::new(&Row, Element::mixed(3), Control::default())
        .unwrap()
        .ends_only();
    let mut slow = Stepper::new(&Row, Element::mixed(3), Control::default()).unwrap();
    let (mut a, mut b) = (START, START);
    for k in 0..60 {
        let h = if k % 20 == 19 { 0.05 } else { 0.1 };
        fast.advance(0.0, h, &mut a, &[]).unwrap();
        slow.advance(0.0, h, &mut b, &[]).unwrap();
        let (mut of_fast, mut of_slow) = ([0.0; 16], [0.0; 16]);
        if k % 7 == 0 {
            fast.transition(&mut of_fast).unwrap();
            slow.transition(&mut of_slow).unwrap();
            for (a, b) in of_fast.iter().zip(of_slow) {
                assert!((a - b).abs() < 1e-14);
            }
        }
    }
    assert!(difference(&a, &b) < 1e-13);
}
