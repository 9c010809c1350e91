//! Structs in the notation of the corpus and in Rust.

use tfe_symbolic::syntax::context::{Context, Field, FieldKind, Length};

/// `<N> m, k: [3], c: [N], w: Vec, n: usize, left: indices, label: String`
pub fn context(text: &str) -> Context {
    let mut context = Context {
        struct_name: "Model".into(),
        ..Context::default()
    };
    let mut fields = text.trim();
    if let Some((parameters, rest)) = fields
        .strip_prefix('<')
        .and_then(|rest| rest.split_once('>'))
    {
        let parameters = parameters.split(',').map(|name| name.trim().to_owned());
        context.const_parameters = parameters.collect();
        fields = rest;
    }
    let fields = fields.split(',').map(str::trim);
    for field in fields.filter(|field| !field.is_empty()) {
        let (name, kind) = match field.split_once(':') {
            None => (field, FieldKind::Scalar),
            Some((name, kind)) => (name.trim(), kind_of(kind.trim())),
        };
        let name = name.to_owned();
        context.fields.push(Field { name, kind });
    }
    context
}

fn kind_of(text: &str) -> FieldKind {
    let length = text
        .strip_prefix('[')
        .and_then(|text| text.strip_suffix(']'));
    match (text, length) {
        (_, Some(length)) => FieldKind::Array(match length.parse() {
            Ok(length) => Length::Literal(length),
            Err(_) => Length::ConstParameter(length.to_owned()),
        }),
        ("Vec", _) => FieldKind::Vector,
        ("usize", _) => FieldKind::Length,
        ("indices", _) => FieldKind::Indices,
        (other, _) => FieldKind::Other(other.to_owned()),
    }
}

/// The inverse of [`context`].
pub fn notation(context: &Context) -> String {
    let mut text = String::new();
    if !context.const_parameters.is_empty() {
        text = format!("<{}> ", context.const_parameters.join(", "));
    }
    let fields = context.fields.iter().map(|field| {
        let name = &field.name;
        match &field.kind {
            FieldKind::Scalar => name.clone(),
            FieldKind::Array(Length::Literal(length)) => format!("{name}: [{length}]"),
            FieldKind::Array(Length::ConstParameter(length)) => format!("{name}: [{length}]"),
            FieldKind::Vector => format!("{name}: Vec"),
            FieldKind::Indices => format!("{name}: indices"),
            FieldKind::Length => format!("{name}: usize"),
            FieldKind::Other(other) => format!("{name}: {other}"),
        }
    });
    text + &fields.collect::<Vec<_>>().join(", ")
}

/// The struct in Rust.
pub fn rust(context: &Context) -> String {
    let raw = |name: &str| match is_keyword(name) {
        true => format!("r#{name}"),
        false => name.to_owned(),
    };
    let parameters = context.const_parameters.iter();
    let parameters = parameters.map(|name| format!("const {name}: usize"));
    let fields = context.fields.iter().map(|field| {
        let of_length = |length: &str| format!("[f64; {length}]");
        let kind = match &field.kind {
            FieldKind::Scalar => "f64".to_owned(),
            FieldKind::Array(Length::Literal(length)) => of_length(&length.to_string()),
            FieldKind::Array(Length::ConstParameter(length)) => of_length(length),
            FieldKind::Vector => "Vec<f64>".to_owned(),
            FieldKind::Indices => "Vec<usize>".to_owned(),
            FieldKind::Length => "usize".to_owned(),
            FieldKind::Other(other) => other.clone(),
        };
        format!("pub {}: {kind}", raw(&field.name))
    });
    format!(
        "#[derive(Clone)] pub struct {}<{}> {{ {} }}",
        raw(&context.struct_name),
        parameters.collect::<Vec<_>>().join(", "),
        fields.collect::<Vec<_>>().join(", ")
    )
}

fn is_keyword(name: &str) -> bool {
    super::names::KEYWORDS.contains(&name)
}
