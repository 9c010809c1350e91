//! What is said of each kind of mistake: the remedies are in `remedies`.

use crate::diagnostic::kind::Kind;
use crate::expr::function::{Domain, Function};

impl Kind {
    /// What is wrong: lower case, names in backticks, no full stop.
    pub fn message(&self) -> String {
        match self {
            Self::Expected { wanted, found, .. } => format!("expected {wanted}, found {found}"),
            Self::MissingComma { found } => format!("expected a comma, found `{found}`"),
            Self::MissingOperator { left, right } => {
                format!("missing operator between `{left}` and `{right}`")
            }
            Self::NumberWithType { .. } => "numbers in formulas have no type".into(),
            Self::NumberInBase { number, .. } => {
                format!("`{number}` is not a number to the base ten")
            }
            Self::DoubleStar => "`**` is not an operator".into(),
            Self::InclusiveRange => "`..=` is not supported in sums".into(),
            Self::Condition { word } => format!("`{word}` cannot be used in a formula"),
            Self::EqualsSign { .. } => "a formula cannot contain `=`".into(),
            Self::FieldAccess { object, field } => {
                format!("a formula cannot read the field `{field}` of `{object}`")
            }
            Self::MethodCall { method, .. } => {
                format!("a formula cannot call the method `{method}`")
            }
            Self::Path { path } => format!("a formula cannot contain the path `{path}`"),
            Self::Bars => "`|` cannot be used in a formula".into(),
            Self::NestedTooDeep { limit } => {
                format!("expression is nested more than {limit} levels deep")
            }
            Self::TooLong { limit } => format!("expression has more than {limit} operators"),
            Self::NumberTooLarge { number } => format!("number `{number}` is too large"),
            Self::NumberTooSmall { number } => {
                format!("number `{number}` is too small: as an `f64` it is zero")
            }
            Self::UnknownArgument { name, .. } => {
                format!("unknown argument `{name}` of `dynamics`")
            }
            Self::NoCoordinates => "the model has no coordinates".into(),
            Self::RepeatedArgument { argument } => format!("`{argument}` is given more than once"),
            Self::NameClash { name, taken } => format!("the name `{name}` is taken by {taken}"),
            Self::ReservedName { name, .. } => {
                format!("the name `{name}` is reserved in formulas")
            }
            Self::ReservedPrefix { name, .. } => {
                format!("the name `{name}` begins with `__tfe`, which is reserved for generated code")
            }
            Self::Keyword { name } => {
                format!("`{name}` is a keyword of Rust and cannot be used as a name")
            }
            Self::ZeroLength { name, .. } => format!("array `{name}` has no elements"),
            Self::UnknownLength { name, .. } => format!("unknown length `{name}`"),
            Self::LengthNotSimple => {
                "the length of an array must be a number, or the name of a const parameter or of a \
                 field of type `usize`"
                    .into()
            }
            Self::TooManyCoordinates { limit } => {
                format!("the model has more than {limit} coordinates")
            }
            Self::FamilyNotAlone { name } => {
                format!("array `{name}` has a generic length, so it must be the only coordinate")
            }
            Self::RunTimeLength { argument } => {
                format!("`{argument}` in a model of run-time length is not supported yet")
            }
            Self::ConstraintNotAffine { name } => {
                format!("constraint `{name}` is not affine in the velocities")
            }
            Self::ConstraintWithoutCoordinate { name } => {
                format!("constraint `{name}` does not depend on any coordinate")
            }
            Self::RepeatedConstraint { name, other } => {
                format!("constraint `{name}` is equivalent to `{other}`")
            }
            Self::MomentumInConstraint => "momenta cannot be used in a constraint".into(),
            Self::VelocityConstraintOfFamily { name } => format!(
                "constraint `{name}` contains velocities, which models of run-time length do not support yet"
            ),
            Self::ConstraintRange { range } => {
                format!("a family of constraints needs a literal range, found `{range}`")
            }
            Self::TooManyConstraints { limit } => {
                format!("a family of constraints has more than {limit} members")
            }
            Self::SumInConstraint { name, .. } => {
                format!("constraint `{name}` contains a sum that cannot be written out term by term")
            }
            Self::ListInRange { list } => {
                format!("the bound of a range cannot be an entry of the list `{list}`")
            }
            Self::OutputFamily => {
                "outputs over a range are supported only in models of run-time length".into()
            }
            Self::NoEnergy => "the model has neither a Lagrangian nor a Hamiltonian".into(),
            Self::TwoEnergies => "the model has both a Lagrangian and a Hamiltonian".into(),
            Self::NoMomenta => "a Hamiltonian needs momenta".into(),
            Self::TransformationOfLagrangian => "a time transformation needs a Hamiltonian".into(),
            Self::TransformationOfFamily { length } => format!(
                "a time transformation needs coordinates of literal length, found length `{length}`"
            ),
            Self::TransformationWith { argument } => {
                format!("a time transformation cannot be combined with `{argument}`")
            }
            Self::TransformationNotPositive => {
                "the time transformation dt/dτ is not positive".into()
            }
            Self::PowerOfLoop { .. } => {
                "a time transformation with forces needs a Hamiltonian whose sums can be written out term by term"
                    .into()
            }
            Self::MomentaWithLagrangian => {
                "a model with a Lagrangian cannot declare momenta".into()
            }
            Self::MomentaMismatch {
                coordinates,
                momenta,
            } => {
                format!("momenta `{momenta}` do not match coordinates `{coordinates}`")
            }
            Self::ForceTarget { target, .. } => format!("`{target}` is not a coordinate"),
            Self::UnusedCoordinate { name, energy } => {
                format!("coordinate `{name}` does not appear in the {energy}")
            }
            Self::UnusedField { name } => format!("field `{name}` is not used in any formula"),
            Self::NoVelocity { name } => {
                format!("the velocity of coordinate `{name}` does not appear in the Lagrangian")
            }
            Self::LinearVelocity { name } => {
                format!("the momentum of coordinate `{name}` does not depend on any velocity")
            }
            Self::ConstantEnergy { energy } => {
                format!("the {energy} does not depend on the state of the system")
            }
            Self::DissipationWithoutVelocity => {
                "the dissipation does not depend on any velocity".into()
            }
            Self::LinearDissipation => {
                "the dissipation is linear in velocities: the forces −∂D/∂v do not depend on any"
                    .into()
            }
            Self::NoInput => "`input` names no input".into(),
            Self::TooManyInputs { limit } => format!("a model can have at most {limit} inputs"),
            Self::InputWith { argument } => {
                format!("an input cannot be combined with `{argument}`")
            }
            Self::UnusedInput { name } => format!("input `{name}` is not used in any formula"),
            Self::RateOfInput { name } => {
                format!("the time derivative of input `{name}` is not known")
            }
            Self::InputOfConstraint { name, constraint } => {
                format!("constraint `{constraint}` depends on input `{name}`, whose time derivative is not known")
            }
            Self::NoSensitivity => "`sensitivity` names no parameter".into(),
            Self::NotAParameter {
                target,
                role: Some(role),
            } => format!("cannot differentiate with respect to `{target}`, which is {role}"),
            Self::NotAParameter { target, role: None } => {
                format!("cannot differentiate with respect to `{target}`")
            }
            Self::UnknownParameter { name, .. } => format!("unknown parameter `{name}`"),
            Self::ArrayOfParameters { name } => {
                format!("array `{name}` of parameters needs an index")
            }
            Self::IndexNotLiteral { index, .. } => {
                format!("index `{index}` of a parameter is not a literal")
            }
            Self::RepeatedParameter { name } => {
                format!("`sensitivity` names `{name}` more than once")
            }
            Self::ParameterOfConstraint { name, constraint } => {
                format!("cannot differentiate with respect to `{name}`, because constraint `{constraint}` depends on it")
            }
            Self::NoPass { name } => format!("model `{name}` has no pass"),
            Self::UnknownPass { name, .. } => format!("unknown pass `{name}`"),
            Self::PassEntry { pass } => format!("invalid arguments of `{pass}(…)`"),
            Self::TruncationDegree { limit } => {
                format!("the degree of a truncation must be an integer from 2 to {limit}")
            }
            Self::UnknownCoordinate { name, .. } => {
                format!("`{name}` is not a coordinate of the model")
            }
            Self::NoSuchElement { name } => format!("there is no coordinate `{name}`"),
            Self::RepeatedEntry { name } => format!("`{name}` is given more than once"),
            Self::PassValue { pass: "frozen" } => {
                "a frozen coordinate can depend only on parameters and time".into()
            }
            Self::PassValue { .. } => {
                "the point of a truncation can depend only on parameters".into()
            }
            Self::PassOfLength { pass } => {
                format!("`{pass}` needs arrays and sums of literal length")
            }
            Self::TruncationOfConstraints => "a model with constraints cannot be truncated".into(),
            Self::NoTaylorPolynomial => {
                "the model has no Taylor polynomial at the point of the truncation".into()
            }
            Self::LongTaylorPolynomial { degree } => {
                format!("the Taylor polynomial of this model is too long at degree {degree}")
            }
            Self::FrozenHamiltonian => "coordinates of a Hamiltonian cannot be frozen".into(),
            Self::NotCyclic { name } => {
                format!("`{name}` is not cyclic: the energy or a force depends on it")
            }
            Self::CyclicConstrained { name } => {
                format!("`{name}` cannot be ignored: a constraint acts on it")
            }
            Self::CyclicForced { name } => {
                format!("`{name}` cannot be ignored: a force acts on it, so its momentum is not constant")
            }
            Self::CyclicNotQuadratic { name } => {
                format!("`{name}` cannot be ignored: the Lagrangian is not quadratic in its velocity")
            }
            Self::RouthName { name, coordinate } => {
                format!("`{coordinate}` cannot be ignored: the name `{name}`, needed for its momentum or velocity, is already taken")
            }
            Self::NotASpring { field, found } => {
                format!("`{field}` is not the stiffness of a spring: {found}")
            }
            Self::UnknownConstraint { name, .. } => {
                format!("`{name}` is not a constraint of the model")
            }
            Self::ElasticVelocity { name } => {
                format!("constraint `{name}` contains velocities and cannot be replaced by a spring")
            }
            Self::NothingLeft { pass } => format!("`{pass}` leaves no coordinate"),
            Self::ConstraintLeft { name } => {
                format!("constraint `{name}` no longer depends on any coordinate")
            }
            Self::MasslessCoordinate { model, name } => {
                format!("coordinate `{name}` of model `{model}` has no kinetic energy")
            }
            Self::UnknownSymbol { name, .. } | Self::VelocityName { name, .. } => {
                format!("unknown name `{name}`")
            }
            Self::UnknownFunction { name, .. } => format!("unknown function `{name}`"),
            Self::NotAFunction { name } => format!("`{name}` is not a function"),
            Self::FunctionAsValue { name } => format!("function `{name}` needs arguments"),
            Self::UsedBeforeLet { name } => format!("`{name}` is used before its `let`"),
            Self::UnsupportedField { name, field_type } => {
                format!("field `{name}` of type `{field_type}` cannot be used in a formula")
            }
            Self::WrongArity {
                function,
                expected,
                found,
            } => {
                format!(
                    "`{function}` takes {}, found {found}",
                    counted(*expected, "argument")
                )
            }
            Self::Acceleration => "accelerations cannot be used in a model".into(),
            Self::VelocityInHamiltonian { via: None } => {
                "velocities cannot be used in a Hamiltonian".into()
            }
            Self::VelocityInHamiltonian { via: Some(name) } => {
                format!("`{name}` contains a velocity and cannot be used in a Hamiltonian")
            }
            Self::VelocityOfLoop => {
                "velocities are not available in a model whose Hamiltonian contains a sum in a loop".into()
            }
            Self::RateOfMomentum => {
                "the time derivative of a momentum cannot be used in a model".into()
            }
            Self::VariableExponent { exponent, .. } => {
                format!("exponent `{exponent}` is not constant, and the base may be negative")
            }
            Self::DivisionByZero => "division by zero".into(),
            Self::RootOfNegative => "a power of a negative number needs an integer exponent".into(),
            Self::OutsideDomain { function } => {
                format!("`{function}` is defined {} only", domain_words(*function))
            }
            Self::ScalarExpected { length } => {
                format!("expected a number, found a vector of length {length}")
            }
            Self::VectorExpected => "expected a vector, found a number".into(),
            Self::WrongLength { expected, found } => {
                format!("expected a vector of length {expected}, found length {found}")
            }
            Self::ProductOfVectors => "the product of two vectors is ambiguous".into(),
            Self::DivisionByVector => "cannot divide by a vector".into(),
            Self::PowerOfVector => "powers of vectors are not defined".into(),
            Self::ScalarPlusVector => "cannot add a number and a vector".into(),
            Self::EmptyVector => "a vector needs at least one component".into(),
            Self::Matrix => "the components of a vector are numbers, not vectors".into(),
            Self::WholeArray { name } => {
                format!("array `{name}` has no literal length and needs an index")
            }
            Self::IndexNotInteger { index } => format!("index `{index}` is not an integer"),
            Self::IndexNotAffine { index } => {
                format!(
                    "index `{index}` is not a sum of integers, lengths and multiples of indices"
                )
            }
            Self::IndexNotConstant { index } => {
                format!("index `{index}` of a vector is not constant")
            }
            Self::IndexOutOfRange {
                array,
                value,
                length,
                ranges,
            } => {
                let reached = match ranges.as_str() {
                    "" => format!("index `{value}` is"),
                    ranges => format!("index reaches `{value}` for `{ranges}`,"),
                };
                let length = length.as_ref().map(|length| format!(" of length {length}"));
                format!("{reached} outside `{array}`{}", length.unwrap_or_default())
            }
            Self::EmptyRange { range } => format!("range `{range}` is empty"),
            Self::SitesBelowZero { range } => {
                format!("range `{range}` begins below zero")
            }
            Self::NonlinearSum { .. } => {
                "a sum in a loop appears inside a nonlinear expression of the energy".into()
            }
            Self::UnknownElement { name, .. } => format!("unknown element `{name}`"),
            Self::NodesOutOfRange { nodes } => {
                format!("an element cannot have {}", counted(*nodes as usize, "node"))
            }
            Self::PointsOutOfRange { points } => {
                format!("a rule cannot have {}", counted(*points as usize, "point"))
            }
            Self::UnknownRule { name, .. } => format!("unknown rule `{name}`"),
            Self::RuleNotForFamily { rule, family } => {
                format!("rule `{rule}` is not defined for `{family}`")
            }
            Self::SolverOfFamily { length } => {
                format!("a solver needs coordinates of literal length, found length `{length}`")
            }
            Self::SolverOfTransformation { element, .. } => {
                format!("element `{element}` does not support a time transformation")
            }
            Self::SolverOfConstraints {
                element, velocity, ..
            } => {
                let kind = if *velocity { "velocity " } else { "" };
                format!("element `{element}` does not support {kind}constraints")
            }
        }
    }

    /// The field of the struct that is to blame.
    pub fn field(&self) -> Option<&str> {
        match self {
            Self::UnusedField { name }
            | Self::ReservedName { name, field: true }
            | Self::ReservedPrefix { name, field: true }
            | Self::ZeroLength { name, field: true } => Some(name),
            _ => None,
        }
    }
}

fn domain_words(function: Function) -> &'static str {
    match function.domain() {
        Domain::Everywhere => "everywhere",
        Domain::NotOddQuarterTurns => "away from odd multiples of π/2",
        Domain::NonNegative => "for non-negative numbers",
        Domain::Positive => "for positive numbers",
        Domain::UnitInterval => "between −1 and 1",
        Domain::OpenUnitInterval => "strictly between −1 and 1",
        Domain::AtLeastOne => "from 1 upwards",
    }
}

/// `3 arguments`
fn counted(count: usize, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}
