//! Random declarations by the rules of the language: all its arguments, with formulas of all kinds.

mod energy;

use tfe_symbolic::syntax::context::{Context, Field, FieldKind};

use super::formula::{Binding, Coordinate, Holds, Size, Writer};
use super::random::Random;
use super::{Declaration, names};

/// A declaration that is a model, as a rule.
pub fn declaration(random: &mut Random) -> Declaration {
    let is_hamiltonian = random.per_mille(330);
    let kind = random.weighted(&[70, 10, 20]);
    let depths: &[usize] = match random.weighted(&[975, 23, 2]) {
        0 => &[0, 0, 0, 0, 1, 1, 1, 2],
        1 => &[1, 2, 2, 3],
        _ => &[2, 3, 3, 4],
    };
    let mut draft = Draft {
        writer: Writer::new(random),
        is_hamiltonian,
        is_family: kind != 0,
        depths,
        lets: Vec::new(),
        arguments: Vec::new(),
        positions: Vec::new(),
        springs: Vec::new(),
        generic: None,
    };
    draft.coordinates(kind);
    draft.bindings();
    draft.energy();
    draft.forces();
    draft.constraints();
    draft.outputs();
    draft.solvers();
    draft.variants();
    draft.finish()
}

struct Draft<'a> {
    writer: Writer<'a>,
    is_hamiltonian: bool,
    /// How deep formulas are: most declarations are small, so that many of them are tried.
    depths: &'static [usize],
    /// Whether the number of coordinates is no number.
    is_family: bool,
    lets: Vec<String>,
    arguments: Vec<String>,
    /// Names of constraints on positions.
    positions: Vec<String>,
    /// Fields that are stiffnesses of springs.
    springs: Vec<String>,
    generic: Option<String>,
}

impl Draft<'_> {
    fn chance(&mut self, per_mille: usize) -> bool {
        self.writer.random.per_mille(per_mille)
    }

    fn depth(&mut self) -> usize {
        *self.writer.random.pick(self.depths)
    }

    fn coordinates(&mut self, kind: usize) {
        let sizes = match kind {
            0 => {
                let count = *self.writer.random.pick(&[1, 1, 1, 1, 1, 1, 1, 2, 2, 3]);
                let size = |random: &mut Random| match random.weighted(&[88, 11, 1]) {
                    0 => Size::One,
                    1 => Size::Literal(1 + random.below(4)),
                    _ => {
                        Size::Literal(*random.pick(&[0, 5, 17, 40, 10_000, 10_001, 2_147_483_648]))
                    }
                };
                (0..count).map(|_| size(self.writer.random)).collect()
            }
            1 => {
                let name = self.writer.fresh(&["N", "M", "COUNT"]);
                self.generic = Some(name.clone());
                vec![Size::Parameter(name)]
            }
            _ => {
                let count = *self.writer.random.pick(&[1, 1, 1, 1, 2, 3]);
                let mut sizes = Vec::new();
                for at in 0..count {
                    let name = self.writer.fresh(&["n", "w", "links"]);
                    let is_one = at > 0 && self.chance(300);
                    sizes.push(match is_one {
                        true => Size::One,
                        false => {
                            self.writer.fields.insert(name.clone(), FieldKind::Length);
                            Size::Field(name)
                        }
                    });
                }
                sizes
            }
        };
        for size in sizes {
            let name = self.writer.fresh(names::COORDINATES);
            let momentum = match self.is_hamiltonian {
                true => self
                    .writer
                    .fresh(&["p", "px", "py", "p_x", "pr", "ps", "p_phi"]),
                false => String::new(),
            };
            let is_cyclic = size == Size::One && self.chance(80);
            self.writer.coordinates.push(Coordinate {
                name,
                momentum,
                size,
                is_cyclic,
            });
        }
        let listed = |name: fn(&Coordinate) -> &str, coordinates: &[Coordinate]| {
            let one = |one: &Coordinate| match one.size.text() {
                None => name(one).to_owned(),
                Some(length) => format!("{}[{length}]", name(one)),
            };
            coordinates.iter().map(one).collect::<Vec<_>>().join(", ")
        };
        let all = &self.writer.coordinates;
        self.arguments
            .push(format!("coordinates({})", listed(|one| &one.name, all)));
        if self.is_hamiltonian {
            self.arguments
                .push(format!("momenta({})", listed(|one| &one.momentum, all)));
        }
    }

    /// What forces and outputs may hold.
    fn of_motion(&mut self) -> Holds {
        let time = self.chance(700);
        Holds {
            positions: true,
            velocities: !self.is_hamiltonian || (!self.is_family && self.chance(300)),
            momenta: self.is_hamiltonian,
            time,
            sums: true,
        }
    }

    fn bindings(&mut self) {
        let count = *self.writer.random.pick(&[0, 0, 0, 1, 1, 2, 3]);
        for _ in 0..count {
            let holds = Holds {
                positions: self.chance(850),
                velocities: !self.is_hamiltonian && self.chance(200),
                momenta: self.is_hamiltonian && self.chance(200),
                time: self.chance(150),
                sums: self.chance(100),
            };
            let depth = self.depth();
            let components = match self.chance(300) {
                true => Some(*self.writer.random.pick(&[2, 3, 3, 4])),
                false => None,
            };
            let value = match components {
                Some(components) => self.writer.vector(holds, depth, components),
                None => self.writer.scalar(holds, depth),
            };
            let name = self.writer.fresh(names::OTHERS);
            self.lets.push(format!("let {name} = {value}"));
            self.writer.lets.push(Binding {
                name,
                components,
                holds,
            });
        }
    }

    fn forces(&mut self) {
        let is_forced = self.chance(350);
        let count = if is_forced {
            1 + self.writer.random.below(2)
        } else {
            0
        };
        for _ in 0..count {
            let holds = self.of_motion();
            let one = self.writer.random.pick(&self.writer.coordinates).clone();
            let depth = self.depth();
            let (target, value) = match &one.size {
                Size::Literal(components @ 1..9) if self.chance(300) => (
                    one.name.clone(),
                    self.writer.vector(holds, depth, *components),
                ),
                Size::One => (one.name.clone(), self.writer.scalar(holds, depth)),
                size if self.chance(500) => {
                    let (_, value) = self
                        .writer
                        .by_site(size, |writer| writer.scalar(holds, depth));
                    (format!("{}[i]", one.name), value)
                }
                size => {
                    let index = self.writer.index_of(size).unwrap_or_default();
                    (
                        format!("{}[{index}]", one.name),
                        self.writer.scalar(holds, depth),
                    )
                }
            };
            self.arguments.push(format!("force({target}) = {value}"));
        }
        if self.chance(120) {
            let one = self.writer.random.pick(&self.writer.coordinates).clone();
            let factor = self.writer.parameter();
            let value = match one.size.text() {
                None => format!("{factor}/2*dot({})^2", one.name),
                Some(end) => format!("sum(i in 0..{end}, {factor}/2*dot({}[i])^2)", one.name),
            };
            self.arguments.push(format!("dissipation = {value}"));
        }
    }

    fn constraints(&mut self) {
        if !self.chance(180) {
            return;
        }
        for _ in 0..1 + self.writer.random.below(2) {
            let name = self.writer.fresh(names::OTHERS);
            let depth = self.depth();
            let time = self.chance(200);
            let holds = Holds {
                positions: true,
                time,
                ..Holds::NOTHING
            };
            let arrays = self.writer.coordinates.iter().map(|one| one.size.clone());
            let arrays: Vec<Size> = arrays.filter(|size| *size != Size::One).collect();
            if !arrays.is_empty() && self.chance(500) {
                let size = self.writer.random.pick(&arrays).clone();
                let (range, value) = self
                    .writer
                    .by_site(&size, |writer| writer.scalar(holds, depth));
                self.arguments
                    .push(format!("constraint({name}[{range}]) = {value}"));
                continue;
            }
            if !self.is_family && self.chance(300) {
                let one = self.writer.random.pick(&self.writer.coordinates).clone();
                let velocity = match self.writer.index_of(&one.size) {
                    None => format!("dot({})", one.name),
                    Some(index) => format!("dot({}[{index}])", one.name),
                };
                let (factor, rest) = (self.writer.tight(holds, 1), self.writer.scalar(holds, 1));
                self.arguments
                    .push(format!("constraint({name}) = {factor}*{velocity} - {rest}"));
                continue;
            }
            let value = match self.chance(200) {
                true => self.writer.vector(holds, depth, 2),
                false => self.writer.scalar(holds, depth),
            };
            self.arguments.push(format!("constraint({name}) = {value}"));
            self.positions.push(name);
        }
    }

    fn outputs(&mut self) {
        let is_shown = self.chance(300);
        let count = if is_shown {
            1 + self.writer.random.below(2)
        } else {
            0
        };
        for _ in 0..count {
            let holds = self.of_motion();
            let depth = self.depth();
            let name = self.writer.fresh(names::OTHERS);
            let sizes = self.writer.coordinates.iter().map(|one| one.size.clone());
            let sizes: Vec<Size> = sizes
                .filter(|size| matches!(size, Size::Field(_)))
                .collect();
            if !sizes.is_empty() && self.chance(400) {
                let size = self.writer.random.pick(&sizes).clone();
                let (range, value) = self
                    .writer
                    .by_site(&size, |writer| writer.scalar(holds, depth));
                self.arguments
                    .push(format!("output({name}[{range}]) = {value}"));
            } else {
                let value = self.writer.scalar(holds, depth);
                self.arguments.push(format!("output({name}) = {value}"));
            }
        }
        if matches!(self.writer.coordinates[0].size, Size::Field(_)) && self.chance(60) {
            let list = self.writer.field(&FieldKind::Indices);
            let one = self.writer.coordinates[0].name.clone();
            let at = self.writer.random.below(3);
            self.arguments
                .push(format!("output(listed) = {one}[{list}[{at}]]"));
        }
    }

    fn solvers(&mut self) {
        if self.is_family && !self.chance(20) {
            return;
        }
        let is_held = !self.positions.is_empty();
        if self.chance(120) {
            let element = if is_held {
                "Mixed"
            } else {
                self.writer.random.pick(&[
                    "Primal",
                    "Mixed",
                    "ThreeField",
                    "EnergyConserving",
                    "Radau",
                ])
            };
            let rule = match element {
                "Primal" => {
                    *self
                        .writer
                        .random
                        .pick(&["", ".reduced()", ".lobatto()", ".quadrature(3)"])
                }
                _ => *self
                    .writer
                    .random
                    .pick(&["", "", ".quadrature(4)", ".reduced()"]),
            };
            let nodes = if self.chance(60) {
                self.writer.random.below(20)
            } else {
                2 + self.writer.random.below(5)
            };
            let name = self.writer.fresh(&["Fast", "Exact", "Solver1"]);
            self.arguments
                .push(format!("solver({name}, {element}::<{nodes}>{rule})"));
        }
        if self.chance(100) {
            let kinds = self.writer.fields.iter();
            let scalars = kinds.filter(|(_, kind)| **kind == FieldKind::Scalar);
            let mut scalars: Vec<String> = scalars.map(|(name, _)| name.clone()).collect();
            self.writer.random.shuffle(&mut scalars);
            scalars.truncate(2);
            if !scalars.is_empty() {
                self.arguments
                    .push(format!("sensitivity({})", scalars.join(", ")));
            }
        } else if self.is_hamiltonian && !self.is_family && !is_held && self.chance(200) {
            let holds = Holds {
                positions: true,
                momenta: true,
                ..Holds::NOTHING
            };
            let rate = self.writer.tight(holds, 1);
            self.arguments
                .push(format!("time_transformation = 1/(1 + {rate}^2)"));
            return;
        }
        if self.chance(20) {
            let path = *self.writer.random.pick(&[
                "renamed::tfe",
                "::a::b",
                "crate",
                "self::tfe",
                "super::super",
            ]);
            self.arguments.push(format!("crate = {path}"));
        }
    }

    fn variants(&mut self) {
        if !self.chance(180) {
            return;
        }
        let name = self.writer.fresh(&["Small", "Reduced", "Linear"]);
        let mut passes = Vec::new();
        for _ in 0..*self.writer.random.pick(&[1, 1, 1, 2]) {
            let one = self.writer.random.pick(&self.writer.coordinates).clone();
            let target = match &one.size {
                Size::One => one.name.clone(),
                size => {
                    let index = self.writer.index_of(size).unwrap_or_default();
                    format!("{}[{index}]", one.name)
                }
            };
            let time = self.chance(200);
            let value = self.writer.scalar(
                Holds {
                    time,
                    ..Holds::NOTHING
                },
                1,
            );
            let cyclic = self.writer.coordinates.iter().find(|one| one.is_cyclic);
            let cyclic = cyclic.map(|one| one.name.clone());
            let (position, spring) = (
                self.positions.first().cloned(),
                self.springs.first().cloned(),
            );
            passes.push(
                match (self.writer.random.below(6), cyclic, position, spring) {
                    (0..3, Some(cyclic), ..) => format!("routh({cyclic})"),
                    (0..4, _, Some(position), _) => {
                        let stiffness = self.writer.fresh(&["stiffness", "k_el"]);
                        format!("elastic({position} = {stiffness})")
                    }
                    (0..4, _, _, Some(spring)) => {
                        let constraint = self.writer.fresh(&["rigid_rod", "stretch"]);
                        format!("rigid({constraint} = {spring})")
                    }
                    (4, ..) => format!("frozen({target} = {value})"),
                    (..) => {
                        let degree = *self.writer.random.pick(&[2, 2, 2, 3, 4, 5, 6, 1, 12]);
                        let value = self.writer.parameter();
                        match self.writer.random.below(3) {
                            0 => format!("truncated({degree}, {target} = {value})"),
                            1 => format!("truncated({degree}, dot({target}) = {value})"),
                            _ => format!("truncated({degree})"),
                        }
                    }
                },
            );
        }
        self.arguments
            .push(format!("model({name}, {})", passes.join(", ")));
    }

    fn finish(mut self) -> Declaration {
        // Arguments stand in any order, but a `let` stands before those that use it.
        self.writer.random.shuffle(&mut self.arguments);
        for (at, binding) in self.lets.drain(..).enumerate() {
            self.arguments.insert(at, binding);
        }
        let mut text = self.arguments.join(", ");
        if self.writer.random.per_mille(300) {
            text.push(',');
        }
        let mut context = Context {
            struct_name: "Model".to_owned(),
            const_parameters: self.generic.into_iter().collect(),
            fields: Vec::new(),
        };
        for (name, kind) in std::mem::take(&mut self.writer.fields) {
            context.fields.push(Field { name, kind });
        }
        if self.writer.random.per_mille(20) {
            let name = names::name(self.writer.random, names::PARAMETERS);
            let kind = FieldKind::Other("String".to_owned());
            context.fields.push(Field { name, kind });
        }
        Declaration {
            context,
            arguments: text,
        }
    }
}
