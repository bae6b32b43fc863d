//! Values that a field does not allow.

use std::ops::RangeInclusive;

/// A value that its field does not allow.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{field} is {value}, must be {allowed}")]
pub struct InvalidField {
    /// The name of the field.
    pub field: &'static str,
    /// Its value.
    pub value: String,
    /// The values that it may have, in words.
    pub allowed: &'static str,
}

/// A value of a range, which `allowed` says in words; NaN is of none.
pub(crate) fn within<T: PartialOrd + ToString>(
    value: T,
    range: RangeInclusive<T>,
    field: &'static str,
    allowed: &'static str,
) -> Result<(), InvalidField> {
    match range.contains(&value) {
        true => Ok(()),
        false => Err(InvalidField { field, value: value.to_string(), allowed }),
    }
}

/// A text of 1 to 256 bytes.
pub(crate) fn name(value: &str, field: &'static str) -> Result<(), InvalidField> {
    within(value.len(), 1..=256, field, "of 1 to 256 bytes")
}
