//! The tables of elements that are known by other names.

use tfe_runtime::quadrature::Quadrature;
use tfe_runtime::scheme::{Scheme, SchemeTable, Tables};
use tfe_runtime::{Element, Mixed, Rule};

fn table(element: Element) -> SchemeTable {
    SchemeTable::new(element).expect("a valid element")
}

#[track_caller]
fn assert_table(actual: &[f64], expected: &[f64]) {
    assert_eq!(actual.len(), expected.len());
    for (actual, expected) in actual.iter().zip(expected) {
        // The tables are rounded once; the expected expressions a few times.
        assert!(
            (actual - expected).abs() <= 2.0 * f64::EPSILON,
            "{actual} for {expected}"
        );
    }
}

/// a_kl = ∫₀^{c_k} ℓ_l: collocation on the points of a rule.
fn collocation(rule: &Quadrature) -> Vec<f64> {
    let k = rule.len();
    let nodes: Vec<f64> = (0..k).map(|i| rule.node(i)).collect();
    let exact = Quadrature::gauss(k);
    let mut matrix = vec![0.0; k * k];
    for stage in 0..k {
        for point in 0..k {
            let mut values = vec![0.0; k];
            let tau = nodes[stage] * exact.node(point);
            tfe_runtime::basis::shape_functions(&nodes, tau, &mut values);
            for l in 0..k {
                matrix[stage * k + l] += nodes[stage] * exact.weight(point) * values[l];
            }
        }
    }
    matrix
}

#[test]
fn mixed_and_reduced_primal_elements_are_gauss_collocation() {
    for nodes in 2..=8 {
        let expected = collocation(&Quadrature::gauss(nodes - 1));
        for element in [Element::mixed(nodes), Element::primal(nodes).reduced()] {
            let table = table(element);
            let view = table.view();
            assert!(view.collocated);
            for (actual, expected) in view.position.iter().zip(&expected) {
                assert!((actual - expected).abs() < 8.0 * f64::EPSILON, "{element}");
            }
            for (position, force) in view.position.iter().zip(view.force) {
                // Computed in different ways, rounded once each.
                assert!((position - force).abs() <= f64::EPSILON, "{element}");
            }
        }
    }
}

#[test]
fn both_elements_have_one_table() {
    for nodes in 2..=12 {
        let (mixed, primal) = (
            table(Element::mixed(nodes)),
            table(Element::primal(nodes).reduced()),
        );
        assert_table(mixed.view().position, primal.view().position);
        assert_table(mixed.view().force, primal.view().force);
        assert_table(primal.view().momentum, mixed.view().momentum);
    }
}

#[test]
fn energy_conserving_with_as_few_points_is_gauss_too() {
    for nodes in 2..=8 {
        let element = Element::energy_conserving(nodes).reduced();
        assert_table(
            table(element).view().position,
            table(Element::mixed(nodes)).view().position,
        );
    }
}

#[test]
fn radau_elements_are_radau_iia() {
    let two = [5.0 / 12.0, -1.0 / 12.0, 0.75, 0.25];
    assert_table(table(Element::radau(3)).view().position, &two);
    let root = 6.0_f64.sqrt();
    let three = [
        (88.0 - 7.0 * root) / 360.0,
        (296.0 - 169.0 * root) / 1800.0,
        (-2.0 + 3.0 * root) / 225.0,
        (296.0 + 169.0 * root) / 1800.0,
        (88.0 + 7.0 * root) / 360.0,
        (-2.0 - 3.0 * root) / 225.0,
        (16.0 - root) / 36.0,
        (16.0 + root) / 36.0,
        1.0 / 9.0,
    ];
    assert_table(table(Element::radau(4)).view().position, &three);
}

#[test]
fn radau_elements_with_lobatto_points_are_lobatto_iiic() {
    let element = Element::radau(4).with_rule(Rule::Lobatto(3));
    let sixth = 1.0 / 6.0;
    let expected = [
        sixth,
        -2.0 * sixth,
        sixth,
        sixth,
        5.0 / 12.0,
        -1.0 / 12.0,
        sixth,
        4.0 * sixth,
        sixth,
    ];
    assert_table(table(element).view().position, &expected);
}

#[test]
fn energy_conserving_two_nodes_is_the_averaged_field() {
    // y(τ) = y₀ + τ (y₁ − y₀): every stage sees b_l c_k.
    let table = table(Element::energy_conserving(2));
    let view = table.view();
    for k in 0..view.points() {
        for l in 0..view.points() {
            let expected = view.nodes[k] * view.weights[l];
            assert!((view.position[k * view.points() + l] - expected).abs() < f64::EPSILON);
        }
    }
}

#[test]
fn primal_with_two_lobatto_points_is_stoermer_verlet() {
    let table = table(Element::primal(2).lobatto());
    let view = table.view();
    assert_eq!(
        (view.velocity, view.position),
        (&[1.0, 1.0][..], &[0.0, 1.0][..])
    );
    assert_eq!(
        (view.momentum, view.force),
        (&[0.5, 0.5][..], &[0.5, 0.0][..])
    );
}

#[test]
fn an_impulse_at_an_end_belongs_to_the_node() {
    for element in [
        Element::primal(4),
        Element::mixed(5),
        Element::primal(3).lobatto(),
    ] {
        let table = table(element);
        for row in 0..table.view().unknowns() {
            assert!(
                (table.view().impulse_weight(row, 0.0) - 1.0).abs() < 1e-14,
                "{element}"
            );
            assert!(
                table.view().impulse_weight(row, 1.0).abs() < 1e-14,
                "{element}"
            );
        }
    }
}

#[test]
fn constants_and_run_time_tables_are_equal() {
    const ELEMENT: Element = Mixed::<5>.element();
    const SCHEME: Scheme<{ ELEMENT.points() }, { ELEMENT.unknowns() }> = Scheme::new(ELEMENT);
    let table = table(ELEMENT);
    let (a, b) = (SCHEME.view(), table.view());
    assert_eq!((a.position, a.position_low), (b.position, b.position_low));
    assert_eq!(
        (a.weights, a.advance_low, a.impulse),
        (b.weights, b.advance_low, b.impulse)
    );
    assert_eq!(a.rate[..4 * 4], *b.rate);
}
