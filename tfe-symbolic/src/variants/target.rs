//! Which coordinates or momenta an entry of a pass speaks of.

use std::fmt;

use crate::diagnostic::{Kind, nearest};
use crate::expr::input::Affine;
use crate::model::declared::CoordinateArray;

/// `x`, `q[2]`, `q`, `dot(x)`
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Target {
    pub(crate) name: String,
    pub(crate) index: Option<i64>,
    /// Whether its velocity is meant.
    pub(crate) rate: bool,
}

/// The places of a target in the flat vector.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Places {
    /// These.
    Numbers(Vec<i64>),
    /// All there are; how many is not known here.
    All,
}

impl Target {
    /// The target among these arrays; of an array without index, all its elements.
    pub(super) fn places(
        &self,
        arrays: &[CoordinateArray],
        pass: &'static str,
    ) -> Result<Places, Kind> {
        // An element that was left of an array has its index in its name.
        let own = self.to_string();
        let single = arrays
            .iter()
            .find(|array| array.length.is_none() && array.name == own);
        let Some(array) = single.or_else(|| arrays.iter().find(|array| array.name == self.name))
        else {
            let names = arrays.iter().map(|array| array.name.as_str());
            return Err(Kind::UnknownCoordinate {
                nearest: nearest(&self.name, names),
                name: self.name.clone(),
            });
        };
        let no_such = || Kind::NoSuchElement { name: own.clone() };
        let first = array.first.as_constant();
        let length = array.length.as_ref().map(Affine::as_constant);
        match (first, length, self.index) {
            (Some(first), None, None) => Ok(Places::Numbers(vec![first])),
            (Some(first), None, Some(_)) if single.is_some() => Ok(Places::Numbers(vec![first])),
            (Some(first), Some(Some(length)), None) => {
                Ok(Places::Numbers((first..first + length).collect()))
            }
            (Some(first), Some(Some(length)), Some(at)) if at < length => {
                Ok(Places::Numbers(vec![first + at]))
            }
            (_, Some(None), None) if arrays.len() == 1 => Ok(Places::All),
            (_, None, Some(_)) | (_, Some(Some(_)), Some(_)) => Err(no_such()),
            _ => Err(Kind::PassOfLength { pass }),
        }
    }
}

/// `q[2]`, without the `dot` of a velocity.
impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.index {
            Some(index) => write!(f, "{}[{index}]", self.name),
            None => f.write_str(&self.name),
        }
    }
}
