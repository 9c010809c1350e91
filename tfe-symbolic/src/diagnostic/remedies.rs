//! The remedy for each kind of mistake.

use crate::diagnostic::kind::Kind;
use crate::expr::function::Function;
use crate::vocabulary::{self, Argument};

impl Kind {
    /// The remedy, where there is one to name.
    pub fn help(&self) -> Option<String> {
        Some(match self {
            Self::MissingComma { .. } => "arguments are separated by commas".into(),
            Self::MissingOperator { left, right } => format!("write `{left}*{right}`"),
            Self::NumberWithType { number } => format!("write `{number}`"),
            Self::NumberInBase {
                decimal: Some(number),
                ..
            } => format!("write `{number}`"),
            Self::NumberInBase { decimal: None, .. } => "write it to the base ten".into(),
            Self::DoubleStar => "write `^` for a power".into(),
            Self::InclusiveRange => "write `a..b+1`".into(),
            Self::Condition { .. } => {
                "write `select(a < b, then, otherwise)`; the comparisons are `<`, `<=`, `>` and `>=`".into()
            }
            Self::EqualsSign {
                left: Some(left),
                right,
            } => format!("write an expression that must be zero: `{left} - ({right})`"),
            Self::EqualsSign { left: None, .. } => {
                "write one expression, and name parts of it with `let name = …` before it".into()
            }
            Self::FieldAccess { object, field } if object == "self" => {
                format!("write `{field}`: the fields of the struct are in scope")
            }
            Self::FieldAccess { object, field } => format!(
                "formulas can use only the fields of this struct: declare `{object}_{field}: f64`"
            ),
            Self::MethodCall { object, method } if is_power(method) => {
                format!("write `^` for a power, as in `{object}^2`")
            }
            Self::MethodCall { object, method } => match arity(method) {
                2 => format!("write `{method}({}, …)`", without_brackets(object)),
                _ => format!("write `{method}({})`", without_brackets(object)),
            },
            Self::Path { path } => match path.rsplit("::").next() {
                Some("PI") => "write `pi`".into(),
                Some(name) if vocabulary::is_function(name) => format!("write `{name}(…)`"),
                _ => {
                    "write the name of a field of the struct, a coordinate or a `let`".into()
                }
            },
            Self::Bars => {
                "write `abs(x)` for an absolute value, and the formula itself instead of a closure".into()
            }
            Self::NumberTooSmall { .. } => "write `0`, or choose other units".into(),
            Self::NestedTooDeep { .. } | Self::TooLong { .. } => {
                "name parts of it with `let`".into()
            }
            Self::UnknownArgument {
                nearest: Some(nearest),
                ..
            }
            | Self::UnknownSymbol {
                nearest: Some(nearest),
                ..
            }
            | Self::UnknownFunction {
                nearest: Some(nearest),
                ..
            }
            | Self::UnknownLength {
                nearest: Some(nearest),
                ..
            }
            | Self::UnknownElement {
                nearest: Some(nearest),
                ..
            }
            | Self::UnknownRule {
                nearest: Some(nearest),
                ..
            }
            | Self::ForceTarget {
                nearest: Some(nearest),
                ..
            }
            | Self::UnknownParameter {
                nearest: Some(nearest),
                ..
            }
            | Self::UnknownPass {
                nearest: Some(nearest),
                ..
            }
            | Self::UnknownCoordinate {
                nearest: Some(nearest),
                ..
            }
            | Self::UnknownConstraint {
                nearest: Some(nearest),
                ..
            } => {
                format!("did you mean `{nearest}`?")
            }
            Self::UnknownArgument { nearest: None, .. } => {
                format!("the arguments are {}", backticked(&Argument::all().map(Argument::word).collect::<Vec<_>>()))
            }
            Self::UnknownSymbol {
                nearest: None,
                name,
            } => {
                format!("declare `{name}` as a field of the struct, a coordinate or a `let`")
            }
            Self::UnknownElement { nearest: None, .. } => {
                format!("the elements are {}", backticked(&vocabulary::ELEMENTS))
            }
            Self::UnknownRule { nearest: None, .. } => {
                format!("the rules are {}", backticked(vocabulary::RULES))
            }
            Self::UnknownLength {
                nearest: None,
                name,
            } => {
                format!(
                    "declare `const {name}: usize` on the struct, or a field `{name}: usize`, or \
                     write a number"
                )
            }
            Self::NoCoordinates => "add `coordinates(x)`".into(),
            Self::NameClash { .. }
            | Self::ReservedName { .. }
            | Self::ReservedPrefix { .. }
            | Self::Keyword { .. } => {
                "choose another name".into()
            }
            Self::FamilyNotAlone { name } => {
                format!(
                    "make the other coordinates elements of `{name}`, give all arrays literal lengths, or make the length a field of type `usize`"
                )
            }
            Self::RunTimeLength { .. } => {
                "give the coordinates a literal length, such as `q[10]`".into()
            }
            Self::ConstraintNotAffine { .. } => {
                "write a constraint on positions, or one in which velocities appear only linearly, such as `dot(x)*sin(phi) - dot(y)*cos(phi)`"
                    .into()
            }
            Self::ConstraintWithoutCoordinate { .. } => {
                "write an expression that must be zero, such as `x^2 + y^2 - l^2`".into()
            }
            Self::RepeatedConstraint { name, .. } => format!("remove `{name}`"),
            Self::MomentumInConstraint => "write the velocity instead, such as `dot(x)`".into(),
            Self::VelocityConstraintOfFamily { .. } => {
                "write a constraint on positions, or give the coordinates a literal length, such as `q[10]`"
                    .into()
            }
            Self::ConstraintRange { .. } => {
                "declare the constraints one by one, give the array and the range literal lengths, or make the length of the array a field of type `usize`"
                    .into()
            }
            Self::TooManyConstraints { .. } => "split the family into several shorter ones".into(),
            Self::SumInConstraint { limit, .. } => {
                format!("give the sum a literal length of at most {limit}, or write out its terms")
            }
            Self::ParameterOfConstraint { .. } => {
                "remove it from `sensitivity`: derivatives of constraints with respect to parameters are not supported"
                    .into()
            }
            Self::SolverOfConstraints { nodes, .. }
            | Self::SolverOfTransformation { nodes, .. } => format!("use `Mixed::<{nodes}>`"),
            Self::ListInRange { .. } => {
                "use numbers and fields of type `usize` as bounds".into()
            }
            Self::OutputFamily => "declare one `output` for each element".into(),
            Self::NoEnergy => "add `lagrangian = …` or `hamiltonian = …`".into(),
            Self::TwoEnergies => "keep one of them".into(),
            Self::NoMomenta => {
                "add `momenta(…)`, one for each coordinate, in the same order".into()
            }
            Self::TransformationOfLagrangian => {
                "declare the model with `momenta(…)` and `hamiltonian = …`".into()
            }
            Self::TransformationOfFamily { .. } => {
                "give the coordinates a literal length, such as `q[10]`".into()
            }
            Self::TransformationWith {
                argument: "constraint",
            } => "choose coordinates that satisfy the constraints, or remove one of the two".into(),
            Self::TransformationWith { .. } => "remove one of the two".into(),
            Self::TransformationNotPositive => {
                "write a positive expression for dt/dτ, such as the distance from a singularity".into()
            }
            Self::PowerOfLoop { limit } => format!(
                "give the sums literal lengths of at most {limit}, or remove `time_transformation`"
            ),
            Self::MomentaWithLagrangian => {
                "remove `momenta`: they are derived from the Lagrangian as ∂L/∂v".into()
            }
            Self::MomentaMismatch { .. } => {
                "declare one momentum for each coordinate, in the same order and of the same \
                 lengths"
                    .into()
            }
            Self::UnusedCoordinate { name, .. } => format!("remove `{name}` from `coordinates`"),
            Self::UnusedField { name } => {
                format!("remove it, or name it `_{name}` if other code needs it")
            }
            Self::NoVelocity { name } => {
                format!("add its kinetic energy, such as `m/2*dot({name})^2`")
            }
            Self::LinearVelocity { name } => {
                format!("add a term that is not linear in `dot({name})`, such as `m/2*dot({name})^2`")
            }
            Self::ConstantEnergy { .. } => "write the kinetic and potential energies".into(),
            Self::DissipationWithoutVelocity => {
                "write a Rayleigh function of velocities, such as `c/2*dot(x)^2`".into()
            }
            Self::LinearDissipation => {
                "write a Rayleigh function of velocities, such as `c/2*dot(x)^2`, or a force, such as `force(x) = -c*dot(x)`"
                    .into()
            }
            Self::NoInput => "name quantities that are given at run time, as in `input(u)`".into(),
            Self::TooManyInputs { .. } => {
                "replace inputs that depend on each other by formulas of one input".into()
            }
            Self::InputWith { argument } => {
                format!("remove one of them: the type that `{argument}` declares does not support inputs")
            }
            Self::UnusedInput { name } => {
                format!("use it, as in `force(x) = {name}`, or remove it")
            }
            Self::RateOfInput { .. } => "declare another input for this derivative".into(),
            Self::InputOfConstraint { .. } => {
                "write the prescribed motion as a formula of `t`, or replace the constraint by a stiff spring".into()
            }
            Self::NoSensitivity => "name fields of the struct, as in `sensitivity(omega)`".into(),
            Self::UnknownParameter {
                nearest: None,
                name,
            } => format!("declare `{name}` as a field of the struct"),
            Self::NotAParameter { target, role: None } if target == "t" => {
                "derivatives with respect to time are included with any parameter".into()
            }
            Self::NotAParameter { .. } => {
                "name fields of type `f64` or elements of array fields, such as `k[2]`"
                    .into()
            }
            Self::ArrayOfParameters { name } => {
                format!("name its elements, as in `{name}[0], {name}[1]`")
            }
            Self::IndexNotLiteral { array, .. } => {
                format!("name each element, as in `{array}[0], {array}[1]`")
            }
            Self::RepeatedParameter { .. } => "name it once".into(),
            Self::NoPass { name } => format!("add a pass, as in `model({name}, truncated(2))`"),
            Self::UnknownPass { nearest: None, .. } => {
                format!("the passes are {}", backticked(vocabulary::PASSES))
            }
            Self::PassEntry { pass } => format!("write it as in `{}`", usage(pass)),
            Self::TruncationDegree { .. } => "write `truncated(2)` for a linear model".into(),
            Self::UnknownCoordinate { nearest: None, .. } => {
                "name a coordinate as declared, such as `x` or `q[2]`; only `truncated` takes momenta and velocities"
                    .into()
            }
            Self::RepeatedEntry { .. } => "give it once".into(),
            Self::PassValue { .. } => {
                "write an expression of numbers and fields of the struct".into()
            }
            Self::PassOfLength {
                pass: "frozen" | "rigid" | "elastic" | "routh",
            } => "give arrays of coordinates literal lengths of at most a few thousand".into(),
            Self::PassOfLength { .. } => {
                "give arrays of coordinates literal lengths of at most a few thousand, or make the point the same for all elements of a single array"
                    .into()
            }
            Self::TruncationOfConstraints => {
                "choose coordinates that satisfy the constraints, or replace the constraints by springs first, with `elastic(name = k)`"
                    .into()
            }
            Self::NoTaylorPolynomial => {
                "choose another point, such as `truncated(2, r = l)`".into()
            }
            Self::LongTaylorPolynomial { .. } => {
                "truncate at a lower degree, or freeze coordinates first".into()
            }
            Self::NotCyclic { .. } => {
                "name only cyclic coordinates, which `structure()` lists".into()
            }
            Self::CyclicConstrained { .. } => {
                "choose coordinates that satisfy the constraint".into()
            }
            Self::CyclicForced { name } => {
                format!("keep `{name}`, or declare the model without the force")
            }
            Self::RouthName { name, .. } => format!("rename the field or output `{name}`"),
            Self::CyclicNotQuadratic { .. } => "declare the model with a Hamiltonian".into(),
            Self::FrozenHamiltonian => "declare the model with a Lagrangian".into(),
            Self::NotASpring { .. } => {
                "name a field of type `f64` whose energy is a square, such as `k/2*(r - l)^2`"
                    .into()
            }
            Self::UnknownConstraint { nearest: None, .. } => "name a constraint as declared".into(),
            Self::ElasticVelocity { .. } => {
                "name constraints on positions, or declare a `dissipation` instead".into()
            }
            Self::NothingLeft { .. } => "keep at least one coordinate".into(),
            Self::ConstraintLeft { .. } => {
                "freeze fewer coordinates, or declare the constraint in another model".into()
            }
            Self::MasslessCoordinate { name, .. } => {
                format!("freeze `{name}` too, or truncate about another point")
            }
            Self::UnknownFunction {
                nearest: None,
                name,
            } => unknown_function(name),
            Self::NotAFunction { name } => format!("write `{name}*(…)` for a product"),
            Self::VelocityName { stem, .. } => format!("write `dot({stem})`"),
            Self::FunctionAsValue { name } => format!("write `{name}(…)`"),
            Self::UsedBeforeLet { .. } => "move the `let` up".into(),
            Self::UnsupportedField { field_type, .. } if is_array_of_numbers(field_type) => {
                "write its length as a number or a const parameter of the struct: the macro does not know the values of constants"
                    .into()
            }
            Self::UnsupportedField { .. } => {
                "formulas can use fields of type `f64`, `[f64; N]`, `Vec<f64>` and `usize`".into()
            }
            Self::Acceleration => {
                "formulas can depend on velocities, but not on their time derivatives".into()
            }
            Self::VelocityInHamiltonian { .. } | Self::VelocityOfLoop => {
                "write the momenta instead".into()
            }
            Self::RateOfMomentum => "write the force on its coordinate instead".into(),
            Self::VariableExponent { base, exponent } => {
                format!("write `exp(({exponent})*ln({base}))` if the base is always positive")
            }
            Self::ScalarExpected { .. } => {
                "take a component such as `r[0]`, or use `inner` or `norm`".into()
            }
            Self::VectorExpected => "write a vector as `[a, b, c]`".into(),
            Self::Matrix => {
                "there are no matrices: name each row with a `let`, and write a product as `[inner(row0, r), inner(row1, r)]`"
                    .into()
            }
            Self::ProductOfVectors => "use `inner(a, b)` or `cross(a, b)`".into(),
            Self::RootOfNegative => {
                "for an odd root, put the sign in front, as in `-8^(1/3)`".into()
            }
            Self::PowerOfVector => "use `inner(r, r)` for the square of the length".into(),
            Self::DivisionByVector => "divide by its `norm`".into(),
            Self::WholeArray { name } => format!("write an element such as `{name}[i]`"),
            Self::IndexNotConstant { .. } => {
                "only coordinate arrays and array fields can have a variable index".into()
            }
            Self::SitesBelowZero { .. } => {
                "begin at zero, and shift the index in the formula".into()
            }
            Self::NonlinearSum { limit } => format!(
                "give the sum a literal length of at most {limit}, or rewrite the energy as a sum of local terms; the square of a sum is a double sum"
            ),
            Self::NodesOutOfRange { .. } => "choose 2 to 12 nodes".into(),
            Self::PointsOutOfRange { .. } => {
                format!("choose 1 to {} points", vocabulary::MAX_POINTS)
            }
            Self::RuleNotForFamily { .. } => "use `.quadrature(k)`".into(),
            Self::SolverOfFamily { .. } => {
                "give the coordinates literal lengths, or use `Simulation`".into()
            }
            Self::RepeatedArgument { argument } => match *argument {
                "coordinates" | "momenta" | "sensitivity" => {
                    format!("name all of them in one `{argument}(…)`")
                }
                "lagrangian" | "hamiltonian" | "dissipation" => {
                    format!("add up the terms in one `{argument} = …`")
                }
                _ => "keep one of them".into(),
            },
            Self::WrongArity {
                function, found, ..
            } => return wrong_arity(function, *found).map(str::to_owned),
            Self::Expected { found, .. } if found == "`\"`" => {
                "write formulas without quotes, as in `lagrangian = m/2*dot(x)^2`".into()
            }
            Self::Expected {
                form: Some(form), ..
            } => format!("write `{form}`"),
            Self::Expected { .. }
            | Self::NumberTooLarge { .. }
            | Self::ZeroLength { .. }
            | Self::LengthNotSimple
            | Self::TooManyCoordinates { .. }
            | Self::ForceTarget { .. }
            | Self::NoSuchElement { .. }
            | Self::DivisionByZero
            | Self::OutsideDomain { .. }
            | Self::WrongLength { .. }
            | Self::ScalarPlusVector
            | Self::EmptyVector
            | Self::IndexNotInteger { .. }
            | Self::IndexNotAffine { .. }
            | Self::IndexOutOfRange { .. }
            | Self::EmptyRange { .. } => return None,
        })
    }
}

/// A group without its brackets; anything else as it is.
fn without_brackets(operand: &str) -> &str {
    let inside = operand.strip_prefix('(');
    let inside = inside.and_then(|inside| inside.strip_suffix(')'));
    inside.unwrap_or(operand)
}

/// How many arguments a function has.
fn arity(name: &str) -> usize {
    let mut special = vocabulary::SPECIAL_FUNCTIONS.iter();
    let special = special.find(|(special, _)| *special == name);
    let elementary = Function::parse(name).map(Function::arity);
    elementary.or(special.map(|(_, arity)| *arity)).unwrap_or(1)
}

/// What stands in the language for a function of other languages; else what functions there are.
fn unknown_function(name: &str) -> String {
    match name {
        name if is_power(name) => "write `^` for a power, as in `x^2`".into(),
        "log" => "the natural logarithm is `ln`".into(),
        "log10" => "write `ln(x)/ln(10)`".into(),
        _ => {
            let names: Vec<&str> = vocabulary::function_names().collect();
            format!("the functions are {}", backticked(&names))
        }
    }
}

/// What was meant by a function with this many arguments.
fn wrong_arity(function: &str, found: usize) -> Option<&'static str> {
    match (function, found) {
        ("dot", 2) => {
            Some("`dot(e)` is the time derivative of e; write `inner(a, b)` for a scalar product")
        }
        ("atan", 2) => Some("write `atan2(y, x)` for the angle of a point"),
        ("norm", 2..) => Some("write a vector, as in `norm([x, y])`"),
        ("hypot", 3..) => Some("write `norm([x, y, z])`"),
        ("min", 3..) => Some("write `min(a, min(b, c))`"),
        ("max", 3..) => Some("write `max(a, max(b, c))`"),
        _ => None,
    }
}

/// Whether other languages have powers by a function, or a method, of this name.
fn is_power(name: &str) -> bool {
    matches!(name, "pow" | "powi" | "powf")
}

/// Whether the type is `[f64; …]`, with a length that is neither a number nor a const parameter.
fn is_array_of_numbers(field_type: &str) -> bool {
    let elements = field_type.trim_start().strip_prefix('[');
    elements.is_some_and(|elements| elements.trim_start().starts_with("f64"))
}

/// A pass as it may be written.
fn usage(pass: &str) -> &'static str {
    match pass {
        "frozen" => "frozen(r = l)",
        "routh" => "routh(phi, psi)",
        "rigid" => "rigid(rod = k)",
        "elastic" => "elastic(rod = k)",
        _ => "truncated(4, theta = 0)",
    }
}

/// `` `a`, `b` and `c` ``
fn backticked(names: &[&str]) -> String {
    let mut names: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
    match names.pop() {
        None => String::new(),
        Some(last) if names.is_empty() => last,
        Some(last) => format!("{} and {last}", names.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_whose_length_is_a_constant_have_a_remedy_of_their_own() {
        let help = |field_type: &str| {
            let (name, field_type) = ("k".to_owned(), field_type.to_owned());
            let kind = Kind::UnsupportedField { name, field_type };
            kind.help().unwrap_or_default()
        };
        for array in ["[f64; SPRINGS]", "[f64 ; 2 + 1]"] {
            assert!(help(array).contains("const parameter"), "{array}");
        }
        for other in ["String", "f32", "[f32; 3]", "[[f64; 3]; 3]"] {
            assert!(!help(other).contains("const parameter"), "{other}");
        }
    }
}
