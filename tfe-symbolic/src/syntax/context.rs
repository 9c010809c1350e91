//! What the macro passes to the engine about the struct with the attribute.

/// The struct: its name, fields and const parameters.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Context {
    /// The name of the struct.
    pub struct_name: String,
    /// Its fields, in order.
    pub fields: Vec<Field>,
    /// Its const parameters of type `usize`.
    pub const_parameters: Vec<String>,
}

/// A field of the struct: a parameter of the model.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    /// The name.
    pub name: String,
    /// The type, as far as formulas care.
    pub kind: FieldKind,
}

/// The types of field that formulas can use.
#[derive(Clone, Debug, PartialEq)]
pub enum FieldKind {
    /// `f64`
    Scalar,
    /// `[f64; K]`
    Array(Length),
    /// `Vec<f64>`
    Vector,
    /// `Vec<usize>`: a list of indices, of models of run-time length
    Indices,
    /// `usize`
    Length,
    /// Any other type, as written; an error only where a formula uses the field.
    Other(String),
}

/// The length of an array field.
#[derive(Clone, Debug, PartialEq)]
pub enum Length {
    /// A number.
    Literal(usize),
    /// A const parameter of the struct.
    ConstParameter(String),
}

impl Context {
    /// The field of this name.
    pub fn field(&self, name: &str) -> Option<&Field> {
        self.fields.iter().find(|field| field.name == name)
    }
}
