//! The reference tables: the damped oscillator, and one step of the pendulum.

use crate::common::{
    OscillatorH, OscillatorL, PendulumH, PendulumL, assert_close, numbers, reference, vector,
};
use tfe_runtime::{Element, Model, Rule, State, transition};

fn element(form: &str, nodes: usize) -> Element {
    match form {
        "primal" => Element::primal(nodes),
        "mixed" => Element::mixed(nodes),
        "cpg" => Element::energy_conserving(nodes),
        other => panic!("an element of another form: {other}"),
    }
}

#[test]
fn oscillator_from_both_functions() {
    let mut compared = 0;
    for case in reference("sdof_transition")["cases"]
        .as_array()
        .expect("cases")
    {
        let form = case["form"].as_str().expect("a form");
        let nodes = case["n"].as_u64().expect("a count") as usize;
        let element = element(form, nodes);
        let element = match case["quadrature"].as_str() {
            Some("reduced") => element.reduced(),
            _ => element,
        };
        for value in case["values"].as_array().expect("values") {
            let rho = value["rho"].as_f64().expect("a number");
            let xi = value["xi"].as_f64().expect("a number");
            let (m, d, k) = (1.0, 2.0 * xi * rho, rho * rho);
            let state = State {
                q: [0.3],
                p: [-0.2],
            };
            let (mut l, mut h) = ([0.0; 4], [0.0; 4]);
            transition::of_step(&OscillatorL { m, d, k }, element, &state, 0.0, 1.0, &mut l)
                .expect("from L");
            transition::of_step(&OscillatorH { m, d, k }, element, &state, 0.0, 1.0, &mut h)
                .expect("from H");
            let expected = numbers(&value["A"]);
            let what = format!("{element}, ρ = {rho}, ξ = {xi}");
            // Condition of the element times round-off; ρ goes up to where entries are 10².
            assert_close(&l, &expected, 1e-12, &format!("{what}, L"));
            assert_close(&h, &expected, 1e-12, &format!("{what}, H"));
            compared += 1;
        }
    }
    assert!(compared >= 80, "the table lost rows: {compared}");
}

#[test]
fn one_step_of_the_pendulum() {
    let mut compared = 0;
    for case in reference("nonlinear")["cases"].as_array().expect("cases") {
        let form = case["form"].as_str().expect("a form");
        let nodes = case["n"].as_u64().expect("a count") as usize;
        let (kind, points) = case["rule"].as_str().expect("a rule").split_at(1);
        let points = points.parse().expect("a count");
        let rule = if kind == "G" {
            Rule::Gauss(points)
        } else {
            Rule::Lobatto(points)
        };
        let element = element(form, nodes).with_rule(rule);
        let start = numbers(&case["y0"]);
        let start = State {
            q: [start[1]],
            p: [start[0]],
        };
        let h = case["h"].as_f64().expect("a number");
        check(&PendulumL {}, element, &start, h, case);
        check(&PendulumH {}, element, &start, h, case);
        compared += 1;
    }
    assert!(compared >= 20, "the table lost rows: {compared}");
}

#[track_caller]
fn check<M>(model: &M, element: Element, start: &State<1>, h: f64, case: &serde_json::Value)
where
    M: Model<1>,
{
    let mut matrix = [0.0; 4];
    let end = transition::of_step(model, element, start, 0.0, h, &mut matrix).expect("a step");
    let what = format!("{element} from {:?}, h = {h}", M::FORM);
    assert_close(&vector(&end), &numbers(&case["y1"]), 2e-14, &what);
    assert_close(&matrix, &numbers(&case["A"]), 2e-14, &what);
}
