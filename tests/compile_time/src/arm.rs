//! Source code of user programs: serial robot arms in space.

use std::fmt::Write as _;

/// The text of `main.rs` with an arm of a number of links; with zero links, with a pendulum.
///
/// Each link is a slender rod of length `l[i]` with mass `m[i]`. Its joint turns about the axis c of the previous link
/// (the first, third, …) or about its axis b, so that neighbouring joint axes are perpendicular. Each link has nine
/// `let`s: the two axes that the joint rotates, and the centre of mass.
///
/// ```text
/// L = Σ m/2 |dp/dt|² + m l²/24 |da/dt|² − m g p_z       p: centre of mass, a: the axis of the rod
/// ```
pub fn program(links: usize) -> String {
    if links == 0 {
        return with_main(
            "coordinates(q), lagrangian = m*l^2/2*dot(q)^2 + m*g*l*cos(q)",
            "m: f64, l: f64, g: f64",
            "m: 1.0, l: 1.0, g: 9.81",
            1,
        );
    }
    let mut text = String::new();
    let all: Vec<String> = (0..links).map(|i| format!("q{i}")).collect();
    let _ = writeln!(text, "coordinates({}),", all.join(", "));
    let mut axes =
        [["1", "0", "0"], ["0", "1", "0"], ["0", "0", "1"]].map(|axis| axis.map(str::to_owned));
    let mut end = ["0", "0", "0"].map(str::to_owned);
    let mut energy = Vec::new();
    for i in 0..links {
        // a' = cos a + sin b, b' = cos b − sin a about c;  a' = cos a − sin c, c' = cos c + sin a about b.
        let (other, sign, opposite) = if i % 2 == 0 {
            (1, "+", "-")
        } else {
            (2, "-", "+")
        };
        let (first, second) = (axes[0].clone(), axes[other].clone());
        for (k, component) in ["x", "y", "z"].into_iter().enumerate() {
            let (a, b) = (&first[k], &second[k]);
            axes[0][k] = format!("a{i}{component}");
            axes[other][k] = format!("b{i}{component}");
            let _ = writeln!(
                text,
                "    let a{i}{component} = cos(q{i})*({a}) {sign} sin(q{i})*({b}),"
            );
            let _ = writeln!(
                text,
                "    let b{i}{component} = cos(q{i})*({b}) {opposite} sin(q{i})*({a}),"
            );
            let _ = writeln!(
                text,
                "    let p{i}{component} = {} + l[{i}]/2*a{i}{component},",
                end[k]
            );
            end[k] = format!("p{i}{component} + l[{i}]/2*a{i}{component}");
        }
        energy.push(format!(
            "m[{i}]/2*(dot(p{i}x)^2 + dot(p{i}y)^2 + dot(p{i}z)^2) \
             + m[{i}]*l[{i}]^2/24*(dot(a{i}x)^2 + dot(a{i}y)^2 + dot(a{i}z)^2) - m[{i}]*g*p{i}z"
        ));
    }
    let _ = write!(text, "    lagrangian = {}", energy.join("\n        + "));
    let fields = format!("m: [f64; {links}], l: [f64; {links}], g: f64");
    let values = format!("m: [1.0; {links}], l: [1.0; {links}], g: 9.81");
    with_main(&text, &fields, &values, links)
}

fn with_main(arguments: &str, fields: &str, values: &str, dof: usize) -> String {
    format!(
        "use tfe::prelude::*;\n\n\
         #[dynamics({arguments})]\n\
         struct Arm {{ {fields} }}\n\n\
         fn main() -> Result<(), Box<dyn std::error::Error>> {{\n    \
             let arm = Arm {{ {values} }};\n    \
             let start = arm.state([0.1; {dof}], [0.0; {dof}]);\n    \
             let motion = Simulation::new(&arm).element(Mixed::<3>).step(0.001).run(start, 0.0..0.01)?;\n    \
             println!(\"{{:?}}\", motion.last());\n    \
             Ok(())\n\
         }}\n"
    )
}

#[cfg(test)]
mod tests {
    use super::program;

    #[test]
    fn there_are_nine_lets_a_link() {
        for links in 1..=12 {
            assert_eq!(program(links).matches("let ").count(), 9 * links + 3);
        }
    }

    #[test]
    fn neighbouring_joints_turn_about_perpendicular_axes() {
        let text = program(2);
        assert!(
            text.contains("let a0y = cos(q0)*(0) + sin(q0)*(1),"),
            "{text}"
        );
        assert!(
            text.contains("let a1z = cos(q1)*(a0z) - sin(q1)*(1),"),
            "{text}"
        );
        assert!(
            text.contains("let p1x = p0x + l[0]/2*a0x + l[1]/2*a1x,"),
            "{text}"
        );
    }
}
