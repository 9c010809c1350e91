//! Random formulas of what a declaration has: mostly well-formed, with the rules of vectors, velocities, indices and sums in mind.

use std::collections::BTreeMap;

use tfe_symbolic::syntax::context::{FieldKind, Length};

use super::mutation::{ONE, TWO};
use super::names;
use super::random::Random;

/// How many elements something has.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Size {
    /// No array.
    One,
    /// As many as this number says.
    Literal(usize),
    /// As many as a const parameter says.
    Parameter(String),
    /// As many as a field of type `usize` says.
    Field(String),
}

impl Size {
    /// Its text, where it is an array.
    pub fn text(&self) -> Option<String> {
        match self {
            Self::One => None,
            Self::Literal(length) => Some(length.to_string()),
            Self::Parameter(name) | Self::Field(name) => Some(name.clone()),
        }
    }

    fn is_known(&self) -> bool {
        matches!(self, Self::One | Self::Literal(_))
    }
}

/// A coordinate with its momentum, or an array of them.
#[derive(Clone, Debug)]
pub struct Coordinate {
    /// The coordinate.
    pub name: String,
    /// The momentum.
    pub momentum: String,
    /// How many there are.
    pub size: Size,
    /// Whether formulas may hold it, or its velocity only.
    pub is_cyclic: bool,
}

/// A `let`, with what its formula may hold.
#[derive(Clone, Debug)]
pub struct Binding {
    /// The name.
    pub name: String,
    /// The number of components of a vector.
    pub components: Option<usize>,
    /// What it may hold.
    pub holds: Holds,
}

/// What a formula may hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Holds {
    /// Coordinates
    pub positions: bool,
    /// Velocities
    pub velocities: bool,
    /// Momenta
    pub momenta: bool,
    /// The time
    pub time: bool,
    /// Sums over ranges of unknown length
    pub sums: bool,
}

impl Holds {
    /// Parameters and numbers.
    pub const NOTHING: Self = Self {
        positions: false,
        velocities: false,
        momenta: false,
        time: false,
        sums: false,
    };

    fn is_within(self, other: Self) -> bool {
        let pairs = [
            (self.positions, other.positions),
            (self.velocities, other.velocities),
            (self.momenta, other.momenta),
            (self.time, other.time),
            (self.sums, other.sums),
        ];
        pairs.into_iter().all(|(own, other)| !own || other)
    }
}

/// The index of a sum: `name + k` is an index of arrays of this size for k from −`below` to `above`.
#[derive(Clone, Debug)]
struct Index {
    name: String,
    size: Size,
    below: i64,
    above: i64,
}

/// Writes formulas.
pub struct Writer<'a> {
    /// Where everything comes from.
    pub random: &'a mut Random,
    /// The coordinates.
    pub coordinates: Vec<Coordinate>,
    /// The `let`s so far.
    pub lets: Vec<Binding>,
    /// The fields that formulas have used.
    pub fields: BTreeMap<String, FieldKind>,
    /// What else has a name.
    pub taken: Vec<String>,
    indices: Vec<Index>,
}

impl<'a> Writer<'a> {
    /// A writer that knows nothing yet.
    pub fn new(random: &'a mut Random) -> Self {
        Self {
            random,
            coordinates: Vec::new(),
            lets: Vec::new(),
            fields: BTreeMap::new(),
            taken: Vec::new(),
            indices: Vec::new(),
        }
    }

    /// A name that nothing has, as a rule.
    pub fn fresh(&mut self, usual: &[&str]) -> String {
        let mut name = names::name(self.random, usual);
        for attempt in 0..20 {
            if !self.taken.contains(&name) || self.random.per_mille(3) {
                break;
            }
            name = names::name(self.random, usual);
            if attempt > 6 {
                name = format!("{name}_{attempt}");
            }
        }
        self.taken.push(name.clone());
        name
    }

    fn chance(&mut self, per_mille: usize) -> bool {
        self.random.per_mille(per_mille)
    }

    /// A number.
    pub fn scalar(&mut self, holds: Holds, depth: usize) -> String {
        if depth == 0 {
            return self.leaf(holds);
        }
        let inner = depth - 1;
        match self
            .random
            .weighted(&[20, 30, 28, 8, 22, 26, 4, 4, 6, 7, 4])
        {
            0 => self.leaf(holds),
            1 => {
                let operator = *self.random.pick(&["+", "-"]);
                let (left, right) = (self.scalar(holds, inner), self.scalar(holds, inner));
                format!("{left} {operator} {right}")
            }
            2 => {
                let (left, right) = (self.tight(holds, inner), self.tight(holds, inner));
                format!("{left}*{right}")
            }
            3 => {
                let plain = Holds {
                    sums: false,
                    ..holds
                };
                let (left, right) = (self.tight(holds, inner), self.tight(plain, inner));
                format!("{left}/{right}")
            }
            4 => {
                let plain = Holds {
                    sums: false,
                    ..holds
                };
                let base = self.tight(plain, inner);
                let exponent = names::exponent(self.random);
                format!("{base}^{exponent}")
            }
            5 => {
                let plain = Holds {
                    sums: false,
                    ..holds
                };
                if self.chance(150) {
                    let function = *self.random.pick(TWO);
                    let (left, right) = (self.scalar(plain, inner), self.scalar(plain, inner));
                    return format!("{function}({left}, {right})");
                }
                let usual = ["sin", "cos", "sin", "cos", "sqrt", "exp", "abs"];
                let list = if self.chance(500) {
                    usual.as_slice()
                } else {
                    ONE
                };
                let function = *self.random.pick(list);
                let argument = self.scalar(plain, inner);
                format!("{function}({argument})")
            }
            6 => format!("-{}", self.tight(holds, inner)),
            7 => {
                let plain = Holds {
                    sums: false,
                    ..holds
                };
                let sign = *self.random.pick(&["<", "<=", ">", ">="]);
                let (left, right) = (self.scalar(plain, inner), self.scalar(plain, inner));
                let (then, otherwise) = (self.scalar(plain, inner), self.scalar(plain, inner));
                format!("select({left} {sign} {right}, {then}, {otherwise})")
            }
            8 => self.sum(holds, inner),
            9 => {
                let plain = Holds {
                    sums: false,
                    ..holds
                };
                let components = *self.random.pick(&[2, 3, 3, 4]);
                let vector = self.vector(plain, inner, components);
                match self.random.below(3) {
                    0 => {
                        let other = self.vector(plain, inner, components);
                        format!("inner({vector}, {other})")
                    }
                    1 => format!("norm({vector})"),
                    _ => format!("({vector})[{}]", self.random.below(components)),
                }
            }
            _ if holds.velocities && holds.positions => {
                let positions = Holds {
                    velocities: false,
                    momenta: false,
                    sums: false,
                    ..holds
                };
                format!("dot({})", self.scalar(positions, inner))
            }
            _ => format!("({})", self.scalar(holds, inner)),
        }
    }

    /// A number in parentheses, unless it is short.
    pub fn tight(&mut self, holds: Holds, depth: usize) -> String {
        let text = self.scalar(holds, depth);
        let is_atom = text
            .chars()
            .all(|letter| letter.is_alphanumeric() || letter == '_');
        if is_atom || self.chance(60) {
            text
        } else {
            format!("({text})")
        }
    }

    fn leaf(&mut self, holds: Holds) -> String {
        let state = 40 * usize::from(holds.positions);
        let velocity = 14 * usize::from(holds.velocities);
        let momentum = 14 * usize::from(holds.momenta);
        let time = 5 * usize::from(holds.time);
        let bindings = 12 * usize::from(!self.lets.is_empty());
        let index = 4 * usize::from(!self.indices.is_empty());
        let weights = [16, state, velocity, momentum, 22, time, 2, bindings, index];
        match self.random.weighted(&weights) {
            0 => names::number(self.random),
            1 => self.state(false),
            2 => {
                let state = self.state_of(|_| true, false);
                format!("dot({state})")
            }
            3 => self.state(true),
            4 => self.parameter(),
            5 => "t".to_owned(),
            6 => "pi".to_owned(),
            7 => self.binding(holds),
            _ => {
                let index = self.random.pick(&self.indices);
                index.name.clone()
            }
        }
    }

    /// A coordinate or momentum that is not cyclic, or a number where there is none.
    fn state(&mut self, momentum: bool) -> String {
        self.state_of(|one| momentum || !one.is_cyclic, momentum)
    }

    fn state_of(&mut self, fits: impl Fn(&Coordinate) -> bool, momentum: bool) -> String {
        let fitting: Vec<Coordinate> = self
            .coordinates
            .iter()
            .filter(|one| fits(one))
            .cloned()
            .collect();
        if fitting.is_empty() {
            return "1".to_owned();
        }
        let one = self.random.pick(&fitting).clone();
        let name = if momentum { &one.momentum } else { &one.name };
        match self.index_of(&one.size) {
            None => name.clone(),
            Some(index) => format!("{name}[{index}]"),
        }
    }

    /// An index of an array of this size.
    pub fn index_of(&mut self, size: &Size) -> Option<String> {
        if *size == Size::One {
            return None;
        }
        let known = match size {
            Size::Literal(length) => Some(*length),
            _ => None,
        };
        let fits = |index: &&Index| match (&index.size, known) {
            (Size::Literal(own), Some(length)) => *own <= length,
            (own, _) => own == size,
        };
        let fitting: Vec<Index> = self.indices.iter().filter(fits).cloned().collect();
        if !fitting.is_empty() && !self.chance(100) {
            let Index {
                name, below, above, ..
            } = self.random.pick(&fitting).clone();
            let width = usize::try_from(below + above + 1).unwrap_or(1);
            let offset = i64::try_from(self.random.below(width)).unwrap_or(0) - below;
            return Some(match offset {
                0 => name,
                _ if offset > 0 => format!("{name}+{offset}"),
                _ => format!("{name}-{}", -offset),
            });
        }
        Some(match size {
            Size::Literal(length) => {
                let end = if self.chance(5) {
                    length + 2
                } else {
                    (*length).max(1)
                };
                self.random.below(end).to_string()
            }
            Size::Parameter(name) | Size::Field(name) => match self.random.below(30) {
                0 => format!("{name}-2"),
                1..15 => format!("{name}-1"),
                _ => "0".to_owned(),
            },
            Size::One => return None,
        })
    }

    /// A parameter: a field of type `f64`, or an element of an array.
    pub fn parameter(&mut self) -> String {
        let arrays = self.indices.last().cloned();
        if let Some(Index { size, .. }) = arrays
            && self.chance(400)
        {
            let kind = match &size {
                Size::Literal(length) => FieldKind::Array(Length::Literal(*length)),
                Size::Parameter(name) => FieldKind::Array(Length::ConstParameter(name.clone())),
                Size::Field(_) => FieldKind::Vector,
                Size::One => FieldKind::Scalar,
            };
            let name = self.field(&kind);
            let index = self.index_of(&size).unwrap_or_default();
            return format!("{name}[{index}]");
        }
        if self.chance(60) {
            let length = 1 + self.random.below(4);
            let name = self.field(&FieldKind::Array(Length::Literal(length)));
            return format!("{name}[{}]", self.random.below(length));
        }
        self.field(&FieldKind::Scalar)
    }

    /// A field of this kind, a new one or one used before.
    pub fn field(&mut self, kind: &FieldKind) -> String {
        let has_kind = |(_, own): &(&String, &FieldKind)| *own == kind;
        let known: Vec<String> = self
            .fields
            .iter()
            .filter(has_kind)
            .map(|(name, _)| name.clone())
            .collect();
        if !known.is_empty() && self.chance(600) {
            return self.random.pick(&known).clone();
        }
        let name = self.fresh(names::PARAMETERS);
        self.fields.insert(name.clone(), kind.clone());
        name
    }

    fn binding(&mut self, holds: Holds) -> String {
        let fits = |one: &&Binding| one.holds.is_within(holds);
        let fitting: Vec<Binding> = self.lets.iter().filter(fits).cloned().collect();
        if fitting.is_empty() {
            return self.parameter();
        }
        let Binding {
            name, components, ..
        } = self.random.pick(&fitting).clone();
        match components {
            None => name,
            Some(components) => format!("{name}[{}]", self.random.below(components)),
        }
    }

    /// A sum over a range that fits some array.
    fn sum(&mut self, holds: Holds, depth: usize) -> String {
        let mut sizes: Vec<Size> = self
            .coordinates
            .iter()
            .map(|one| one.size.clone())
            .collect();
        sizes.retain(|size| *size != Size::One && (holds.sums || size.is_known()));
        sizes.push(Size::Literal(1 + self.random.below(4)));
        if self.chance(20) {
            sizes.push(Size::Literal(*self.random.pick(&[
                16,
                17,
                40,
                512,
                513,
                2_147_483_647,
            ])));
        }
        let size = self.random.pick(&sizes).clone();
        self.sum_over(&size, |writer| writer.scalar(holds, depth))
    }

    /// A sum over the indices of arrays of this size, or nearly all of them.
    pub fn sum_over(&mut self, size: &Size, body: impl FnOnce(&mut Self) -> String) -> String {
        let Some(end) = size.text() else {
            return body(self);
        };
        // The index is free again behind the sum.
        let depth = self.indices.len();
        let name = match self.chance(10) {
            true => self.fresh(&["i", "j"]),
            false => (*["i", "j", "kk", "ll"].get(depth).unwrap_or(&"ii")).to_owned(),
        };
        let outer = self
            .indices
            .iter()
            .rfind(|index| index.size == *size && !size.is_known());
        let outer = outer.map(|index| index.name.clone());
        let is_long = !matches!(size, Size::Literal(0..3));
        let (range, below, above) = match (self.random.below(8), outer) {
            (0, _) if is_long => (format!("0..{}", shorter(size)), 0, 1),
            (1, _) if is_long => (format!("1..{end}"), 1, 0),
            (2 | 3, Some(outer)) => (format!("0..{outer}"), 0, 0),
            (4, Some(outer)) => (format!("{outer}+1..{end}"), 0, 0),
            _ => (format!("0..{end}"), 0, 0),
        };
        self.indices.push(Index {
            name: name.clone(),
            size: size.clone(),
            below,
            above,
        });
        let body = body(self);
        self.indices.truncate(depth);
        format!("sum({name} in {range}, {body})")
    }

    /// A formula with the index of a declaration by site: the range and the formula.
    pub fn by_site(
        &mut self,
        size: &Size,
        body: impl FnOnce(&mut Self) -> String,
    ) -> (String, String) {
        let end = size.text().unwrap_or_else(|| "2".to_owned());
        let (range, above) = match (self.random.below(2), size) {
            (0, Size::Literal(0..3)) | (1, _) => (format!("i in 0..{end}"), 0),
            _ => (format!("i in 0..{}", shorter(size)), 1),
        };
        let depth = self.indices.len();
        self.indices.push(Index {
            name: "i".to_owned(),
            size: size.clone(),
            below: 0,
            above,
        });
        let body = body(self);
        self.indices.truncate(depth);
        (range, body)
    }

    /// A vector of so many components.
    pub fn vector(&mut self, holds: Holds, depth: usize, components: usize) -> String {
        let fits = |one: &&Coordinate| one.size == Size::Literal(components) && !one.is_cyclic;
        let arrays: Vec<String> = self
            .coordinates
            .iter()
            .filter(fits)
            .map(|one| one.name.clone())
            .collect();
        if holds.positions && !arrays.is_empty() && self.chance(500) {
            let array = self.random.pick(&arrays).clone();
            if holds.velocities && self.chance(300) {
                return format!("dot({array})");
            }
            return array;
        }
        if depth == 0 {
            if self.chance(120) {
                return self.field(&FieldKind::Array(Length::Literal(components)));
            }
            let parts: Vec<String> = (0..components).map(|_| self.leaf(holds)).collect();
            return format!("[{}]", parts.join(", "));
        }
        let inner = depth - 1;
        match self.random.below(9) {
            0 | 1 => {
                let operator = *self.random.pick(&["+", "-"]);
                let (left, right) = (
                    self.vector(holds, inner, components),
                    self.vector(holds, inner, components),
                );
                format!("({left} {operator} {right})")
            }
            2 => {
                let (factor, vector) = (
                    self.tight(holds, inner),
                    self.vector(holds, inner, components),
                );
                format!("{factor}*{vector}")
            }
            3 => {
                let (vector, divisor) = (
                    self.vector(holds, inner, components),
                    self.tight(holds, inner),
                );
                format!("{vector}/{divisor}")
            }
            4 if components == 3 => {
                let (left, right) = (self.vector(holds, inner, 3), self.vector(holds, inner, 3));
                format!("cross({left}, {right})")
            }
            5 if components == 3 => {
                let (quaternion, vector) =
                    (self.vector(holds, inner, 4), self.vector(holds, inner, 3));
                format!("rotate({quaternion}, {vector})")
            }
            6 if components == 3 && holds.velocities && holds.positions => {
                let positions = Holds {
                    velocities: false,
                    momenta: false,
                    ..holds
                };
                format!("body_rate({})", self.vector(positions, inner, 4))
            }
            7 => {
                let (left, right) = (self.scalar(holds, inner), self.scalar(holds, inner));
                let (then, otherwise) = (
                    self.vector(holds, inner, components),
                    self.vector(holds, inner, components),
                );
                format!("select({left} < {right}, {then}, {otherwise})")
            }
            _ => {
                let parts: Vec<String> =
                    (0..components).map(|_| self.scalar(holds, inner)).collect();
                format!("[{}]", parts.join(", "))
            }
        }
    }
}

/// One less.
fn shorter(size: &Size) -> String {
    match size {
        Size::One => "1".to_owned(),
        Size::Literal(length) => length.saturating_sub(1).to_string(),
        Size::Parameter(name) | Size::Field(name) => format!("{name}-1"),
    }
}
