//! Names and elements of arrays.

use super::{DotRule, Index, Lowerer, Value};
use crate::check::{MAX_COORDINATES, Slots, Symbol};
use crate::diagnostic::{Kind, Span, nearest};
use crate::expr::constant::Constant;
use crate::expr::input::{Affine, IndexSymbol, Input, LoopVariable};
use crate::syntax::ast::{Expr, ExprKind};
use crate::syntax::context::{FieldKind, Length};
use crate::vocabulary::function_names;
use crate::vocabulary::is_function;

/// Where the elements of an indexed array come from.
enum Array {
    Coordinate,
    Momentum,
    Field(String),
}

/// Whether all digits before the exponent of a literal are zeros.
fn is_written_as_zero(number: &str) -> bool {
    let mut digits = number
        .bytes()
        .take_while(|byte| !matches!(byte, b'e' | b'E'));
    digits.all(|byte| !matches!(byte, b'1'..=b'9'))
}

impl Lowerer<'_> {
    pub(super) fn number(&mut self, text: &str, span: Span) -> Value {
        let number = text.to_owned();
        let mistake = match Constant::parse(&text.replace('_', "")) {
            Some(value) if value.is_zero() && !is_written_as_zero(text) => {
                Kind::NumberTooSmall { number }
            }
            Some(value) => return Value::Scalar(self.graph.constant(value)),
            None => Kind::NumberTooLarge { number },
        };
        self.report(span, mistake);
        Value::Error
    }

    pub(super) fn index(&self, name: &str) -> Option<&Index> {
        self.indices.iter().rev().find(|index| index.name == name)
    }

    /// The number of loops around the formula at hand.
    pub(super) fn depth(&self) -> LoopVariable {
        LoopVariable(self.hidden_loops + self.indices.len() as u32)
    }

    /// What `name` stands for, unless it is a `let` further down.
    pub(super) fn symbol(&self, name: &str) -> Option<&Symbol> {
        let visible = |symbol: &&Symbol| match symbol {
            Symbol::Let(at) => *at < self.visible_lets,
            _ => true,
        };
        self.model.symbols.get(name).filter(visible)
    }

    pub(super) fn use_symbol(&mut self, symbol: &IndexSymbol) {
        if let IndexSymbol::Field(name) = symbol
            && let Some(at) = self
                .context
                .fields
                .iter()
                .position(|field| field.name == *name)
        {
            self.fields[at] = true;
        }
    }

    pub(super) fn used_fields(&self) -> Vec<String> {
        let used = self
            .context
            .fields
            .iter()
            .zip(&self.fields)
            .filter(|(_, used)| **used);
        used.map(|(field, _)| field.name.clone()).collect()
    }

    pub(super) fn unknown(&mut self, name: &str, span: Span) {
        let name = name.to_owned();
        let kind = if is_function(&name) {
            Kind::FunctionAsValue { name }
        } else if self.model.symbols.contains_key(&name) {
            Kind::UsedBeforeLet { name }
        } else if self.model.names_missing {
            // The name may be declared in an argument that could not be read.
            return;
        } else {
            let visible = self
                .model
                .symbols
                .keys()
                .filter(|known| self.symbol(known).is_some());
            let indices = self.indices.iter().map(|index| &index.name);
            let known = visible
                .chain(indices)
                .map(String::as_str)
                .chain(["t", "pi"]);
            let nearest = nearest(&name, known);
            match self.rate_in_words(&name) {
                Some(stem) => Kind::VelocityName { name, stem },
                None => Kind::UnknownSymbol { name, nearest },
            }
        };
        self.report(span, kind);
    }

    /// `theta` of `theta_dot`, `thetadot`, `dot_theta` and `dtheta`, where `theta` is a coordinate or a `let`.
    fn rate_in_words(&self, name: &str) -> Option<String> {
        let stems = [
            name.strip_suffix("_dot"),
            name.strip_suffix("dot"),
            name.strip_prefix("dot_"),
            name.strip_prefix('d'),
        ];
        let has_rate = |stem: &&str| {
            let symbol = self.symbol(stem);
            matches!(symbol, Some(Symbol::Coordinate(_) | Symbol::Let(_)))
        };
        let stem = stems.into_iter().flatten().find(has_rate);
        stem.map(str::to_owned)
    }

    pub(super) fn name(&mut self, name: &str, span: Span) -> Value {
        if let Some(index) = self.index(name) {
            let value = index.value();
            return Value::Scalar(self.graph.input(Input::Integer(value)));
        }
        match name {
            "t" => return Value::Scalar(self.graph.input(Input::Time)),
            "pi" => {
                let pi = Constant::float(std::f64::consts::PI);
                return Value::Scalar(self.graph.constant(pi));
            }
            _ => {}
        }
        match self.symbol(name).cloned() {
            Some(Symbol::Coordinate(at)) => {
                self.slots(&self.model.coordinates[at], Input::Coordinate, span)
            }
            Some(Symbol::Momentum(at)) => {
                self.slots(&self.model.momenta[at], Input::Momentum, span)
            }
            Some(Symbol::Input(at)) => {
                self.inputs[at] = true;
                Value::Scalar(self.graph.input(Input::Control(name.to_owned())))
            }
            Some(Symbol::Let(at)) => {
                if self.setting.dot == DotRule::Forbidden && self.rates[at] {
                    let via = Some(name.to_owned());
                    self.report(span, Kind::VelocityInHamiltonian { via });
                    return Value::Error;
                }
                self.named(at)
            }
            Some(Symbol::Field(at)) => self.field(at, span),
            Some(Symbol::ConstParameter) => {
                let symbol = IndexSymbol::ConstParameter(name.to_owned());
                Value::Scalar(self.graph.input(Input::Integer(Affine::symbol(symbol))))
            }
            None => {
                self.unknown(name, span);
                Value::Error
            }
        }
    }

    /// A coordinate or momentum, or all of a literal array of them.
    fn slots(&mut self, slots: &Slots, input: fn(Affine) -> Input, span: Span) -> Value {
        let first = &slots.first;
        match &slots.length {
            None => Value::Scalar(self.graph.input(input(first.clone()))),
            Some(length) => match length.as_constant() {
                Some(length) => Value::Vector(
                    (0..length)
                        .filter_map(|at| first.plus_scaled(&Affine::constant(at), 1))
                        .map(|at| self.graph.input(input(at)))
                        .collect(),
                ),
                None => {
                    self.report(
                        span,
                        Kind::WholeArray {
                            name: slots.name.node.clone(),
                        },
                    );
                    Value::Error
                }
            },
        }
    }

    fn field(&mut self, at: usize, span: Span) -> Value {
        self.fields[at] = true;
        let field = &self.context.fields[at];
        let name = field.name.clone();
        match &field.kind {
            FieldKind::Scalar => Value::Scalar(self.graph.input(Input::Parameter(name))),
            FieldKind::Array(Length::Literal(length)) if *length <= MAX_COORDINATES => {
                let element = |at| Input::ParameterElement(name.clone(), Affine::constant(at));
                let elements = 0..*length as i64;
                Value::Vector(elements.map(|at| self.graph.input(element(at))).collect())
            }
            FieldKind::Array(_) | FieldKind::Vector | FieldKind::Indices => {
                self.report(span, Kind::WholeArray { name });
                Value::Error
            }
            FieldKind::Length => {
                let length = Affine::symbol(IndexSymbol::Field(name));
                Value::Scalar(self.graph.input(Input::Integer(length)))
            }
            FieldKind::Other(field_type) => {
                self.report(
                    span,
                    Kind::UnsupportedField {
                        name,
                        field_type: field_type.clone(),
                    },
                );
                Value::Error
            }
        }
    }

    /// The value of the `let` of this number.
    pub(super) fn named(&mut self, at: usize) -> Value {
        if self.rates[at] && self.setting.dot != self.usual_dot {
            return self.named_here(at, self.depth().0);
        }
        let lone = self.lets[at].clone();
        let value = match lone {
            Some(value) => value,
            None => {
                // First on its own, outside the loops and rules of the formula that uses it.
                let setting = super::Setting {
                    linear_loops: false,
                    ..self.setting
                };
                let value = self.within(setting, |lowerer| lowerer.named_here(at, 0));
                self.lets[at] = Some(value.clone());
                value
            }
        };
        let depth = self.depth().0;
        if self.has_loop(&value) && (self.setting.linear_loops || depth > 0) {
            // A loop inside other loops needs an index of its own, and the rules of that place.
            return self.named_here(at, depth);
        }
        value
    }

    /// The same at the place of use: its loops have indices of their own inside this many others.
    fn named_here(&mut self, at: usize, loops: u32) -> Value {
        let key = (at, loops, self.setting);
        if let Some(value) = self.lets_here.get(&key) {
            return value.clone();
        }
        let model = self.model;
        let (indices, place) = (std::mem::take(&mut self.indices), self.place.take());
        let hidden = std::mem::replace(&mut self.hidden_loops, loops);
        let visible = std::mem::replace(&mut self.visible_lets, at);
        let value = self.value(&model.lets[at].1);
        self.visible_lets = visible;
        self.hidden_loops = hidden;
        (self.indices, self.place) = (indices, place);
        self.lets_here.insert(key, value.clone());
        value
    }

    fn has_loop(&self, value: &Value) -> bool {
        match value {
            Value::Scalar(id) => self.graph.contains_sum(*id),
            Value::Vector(components) => components.iter().any(|id| self.graph.contains_sum(*id)),
            Value::Error => false,
        }
    }

    /// `value[index]`
    pub(super) fn element(&mut self, value: &Expr, index: &Expr, span: Span) -> Value {
        if let ExprKind::Name(name) = &value.node
            && self.index(name).is_none()
            && self.is_list(name)
        {
            // As a number.
            return match self.entry_of_list(name, index) {
                Some(entry) => Value::Scalar(self.graph.input(Input::Integer(entry))),
                None => Value::Error,
            };
        }
        if let ExprKind::Name(name) = &value.node
            && self.index(name).is_none()
            && let Some((array, first, length)) = self.array(name)
        {
            let Some(place) = self.affine(index) else {
                return Value::Error;
            };
            let place = self.kept_inside(place, length.as_ref());
            if !self.in_bounds(name, &place, length.as_ref(), index.span) {
                return Value::Error;
            }
            if let Array::Field(field) = &array
                && length.is_none()
                && !place.holds_entry()
            {
                self.require_length(field, &place);
            }
            let Some(flat) = place.plus_scaled(&first, 1) else {
                self.report(
                    span,
                    Kind::NumberTooLarge {
                        number: index.to_string(),
                    },
                );
                return Value::Error;
            };
            let extent = self.extent(&flat);
            let input = match array {
                Array::Coordinate | Array::Momentum => {
                    self.extents
                        .entry(flat.clone())
                        .and_modify(|known| *known = wider(*known, extent))
                        .or_insert(extent);
                    match array {
                        Array::Coordinate => Input::Coordinate(flat),
                        _ => Input::Momentum(flat),
                    }
                }
                Array::Field(name) => Input::ParameterElement(name, flat),
            };
            return Value::Scalar(self.graph.input(input));
        }
        let components = self.vector(value);
        let place = self.affine(index);
        let (Some(components), Some(place)) = (components, place) else {
            return Value::Error;
        };
        let Some(at) = place.as_constant() else {
            self.report(
                index.span,
                Kind::IndexNotConstant {
                    index: index.to_string(),
                },
            );
            return Value::Error;
        };
        let length = Affine::constant(components.len() as i64);
        if !self.in_bounds(&value.to_string(), &place, Some(&length), index.span) {
            return Value::Error;
        }
        Value::from(
            usize::try_from(at)
                .ok()
                .and_then(|at| components.get(at).copied()),
        )
    }

    /// The array of this name, where its elements begin and its length, if the macro can name it.
    fn array(&mut self, name: &str) -> Option<(Array, Affine, Option<Affine>)> {
        match self.symbol(name).cloned()? {
            Symbol::Coordinate(at) => {
                let slots = &self.model.coordinates[at];
                let first = slots.first.clone();
                Some((Array::Coordinate, first, Some(slots.length.clone()?)))
            }
            Symbol::Momentum(at) => {
                let slots = &self.model.momenta[at];
                let first = slots.first.clone();
                Some((Array::Momentum, first, Some(slots.length.clone()?)))
            }
            Symbol::Field(at) => {
                let length = match &self.context.fields[at].kind {
                    // No elements: reported where it is declared.
                    FieldKind::Array(Length::Literal(0)) => None,
                    FieldKind::Array(Length::Literal(length)) => {
                        Some(Affine::constant(i64::try_from(*length).ok()?))
                    }
                    FieldKind::Array(Length::ConstParameter(name)) => {
                        Some(Affine::symbol(IndexSymbol::ConstParameter(name.clone())))
                    }
                    FieldKind::Vector => None,
                    _ => return None,
                };
                self.fields[at] = true;
                Some((Array::Field(name.to_owned()), Affine::default(), length))
            }
            Symbol::Input(_) | Symbol::Let(_) | Symbol::ConstParameter => None,
        }
    }

    /// Reports a call of something that is no function.
    pub(super) fn not_a_function(&mut self, name: &str, span: Span) {
        // A `let` that could not be read may have been meant as a function; its mistake has been reported.
        if let Some(Symbol::Let(at)) = self.symbol(name)
            && matches!(self.model.lets[*at].1.node, ExprKind::Error)
        {
            return;
        }
        let name = name.to_owned();
        let kind = if self.index(&name).is_some()
            || self.model.symbols.contains_key(&name)
            || matches!(name.as_str(), "t" | "pi")
        {
            Kind::NotAFunction { name }
        } else {
            let nearest = nearest(&name, function_names());
            Kind::UnknownFunction { name, nearest }
        };
        self.report(span, kind);
    }
}

fn wider(a: Option<(i64, i64)>, b: Option<(i64, i64)>) -> Option<(i64, i64)> {
    let ((a_low, a_high), (b_low, b_high)) = (a?, b?);
    Some((a_low.min(b_low), a_high.max(b_high)))
}
