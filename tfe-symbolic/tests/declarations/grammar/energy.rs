//! Energies: kinetic ones, potentials, springs, and what is long or nested deeply.

use tfe_symbolic::syntax::context::FieldKind;

use super::super::formula::{Coordinate, Holds, Size};
use super::Draft;

impl Draft<'_> {
    /// What an energy may hold.
    fn of_energy(&self) -> Holds {
        Holds {
            positions: true,
            velocities: false,
            momenta: false,
            time: true,
            sums: true,
        }
    }

    pub(super) fn energy(&mut self) {
        let mut terms: Vec<String> = Vec::new();
        for one in self.writer.coordinates.clone() {
            terms.push(self.kinetic(&one));
        }
        let holds = self.of_energy();
        if !self.is_hamiltonian && self.chance(150) {
            let positions = Holds {
                sums: false,
                time: false,
                ..holds
            };
            let depth = self.depth().min(2);
            let position = self.writer.scalar(positions, depth);
            terms.push(format!("(dot({position}))^2"));
        }
        for _ in 0..*self.writer.random.pick(&[0, 1, 1, 1, 2]) {
            let depth = self.depth();
            let holds = Holds {
                velocities: !self.is_hamiltonian && self.chance(100),
                momenta: self.is_hamiltonian && self.chance(150),
                time: self.chance(150),
                ..holds
            };
            terms.push(self.writer.tight(holds, depth));
        }
        if self.chance(60) && !self.is_hamiltonian {
            let name = self.writer.fresh(&["stiff", "k_s"]);
            self.writer.fields.insert(name.clone(), FieldKind::Scalar);
            let positions = Holds {
                time: false,
                sums: false,
                ..holds
            };
            let stretch = self.writer.tight(positions, 2);
            terms.push(format!("-{name}/2*{stretch}^2"));
            self.springs.push(name);
        }
        if self.chance(4) {
            terms.push(self.long());
        }
        let mut text = String::new();
        for (at, term) in terms.iter().enumerate() {
            let sign = if self.chance(700) { "+" } else { "-" };
            match at {
                0 => text += term,
                _ => text += &format!(" {sign} {term}"),
            }
        }
        let word = if self.is_hamiltonian {
            "hamiltonian"
        } else {
            "lagrangian"
        };
        self.arguments.push(format!("{word} = {text}"));
    }

    fn kinetic(&mut self, one: &Coordinate) -> String {
        let is_hamiltonian = self.is_hamiltonian;
        let vector = match (&one.size, is_hamiltonian) {
            (Size::Literal(2..9), false) if self.chance(500) => Some(format!("dot({})", one.name)),
            (Size::Literal(2..9), true) if self.chance(500) => Some(one.momentum.clone()),
            _ => None,
        };
        if let Some(vector) = vector {
            let mass = self.mass();
            return format!("{mass}*inner({vector}, {vector})");
        }
        if matches!(&one.size, Size::Literal(4)) && !is_hamiltonian && self.chance(400) {
            let rate = format!("body_rate({})", one.name);
            return format!(
                "inner({rate}, {rate}) + inner(dot({0}), dot({0}))/2",
                one.name
            );
        }
        let size = one.size.clone();
        let (name, momentum) = (one.name.clone(), one.momentum.clone());
        let whole = match &size {
            Size::One => None,
            _ => Some(size.text().unwrap_or_default()),
        };
        let body = |draft: &mut Self, index: &str| {
            let mass = draft.mass();
            match is_hamiltonian {
                true => format!("{mass}*{momentum}{index}^2"),
                false => format!("{mass}*dot({name}{index})^2"),
            }
        };
        match whole {
            None => body(self, ""),
            // All of them, or else some would have no velocity.
            Some(end) => {
                let body = body(self, "[ia]");
                format!("sum(ia in 0..{end}, {body})")
            }
        }
    }

    /// A positive factor, as a rule.
    fn mass(&mut self) -> String {
        let holds = Holds {
            positions: true,
            sums: false,
            ..Holds::NOTHING
        };
        match self.writer.random.below(8) {
            0 | 1 => "0.5".to_owned(),
            2..5 => format!("{}/2", self.writer.parameter()),
            5 => {
                let length = self.writer.parameter();
                format!("{}*{length}^2", self.writer.parameter())
            }
            6 => format!("(1 + {}^2)", self.writer.tight(holds, 1)),
            _ => {
                let depth = self.depth().min(2);
                self.writer.tight(holds, depth)
            }
        }
    }

    /// Text that is long or nested deeply.
    fn long(&mut self) -> String {
        let holds = Holds {
            positions: true,
            ..Holds::NOTHING
        };
        let part = self.writer.tight(holds, 1);
        let count = *self.writer.random.pick(&[12, 40, 99, 120, 400, 2100]);
        match self.writer.random.below(6) {
            0 => format!("{}{part}{}", "(".repeat(count), ")".repeat(count)),
            1 => format!(
                "{}{part}{}",
                "sin(".repeat(count.min(120)),
                ")".repeat(count.min(120))
            ),
            2 => vec![part; count].join(" + "),
            3 => vec![part; count.min(400)].join("*"),
            4 => format!("{}{part}", "-".repeat(count)),
            _ => format!("{part}{}", "^2".repeat(count)),
        }
    }
}
