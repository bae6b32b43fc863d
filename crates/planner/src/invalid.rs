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

impl InvalidField {
    pub(crate) fn new(field: &'static str, value: impl ToString, allowed: &'static str) -> Self {
        Self { field, value: value.to_string(), allowed }
    }
}

/// A value of a range, which `allowed` says in words; NaN is of none.
pub(crate) fn within<T: PartialOrd + ToString>(
    value: T,
    range: RangeInclusive<T>,
    field: &'static str,
    allowed: &'static str,
) -> Result<(), InvalidField> {
    if range.contains(&value) { Ok(()) } else { Err(InvalidField::new(field, value, allowed)) }
}

/// The most seconds of a field, far from overflow in sums and products.
const MOST_SECONDS: f64 = 1e6;

/// A number of seconds from 0 to 10⁶.
pub(crate) fn seconds(value: f64, field: &'static str) -> Result<(), InvalidField> {
    within(value, 0.0..=MOST_SECONDS, field, "from 0 to 10^6")
}

/// The most bytes of a name.
pub(crate) const MAX_NAME_BYTES: usize = 64;

/// A text of 1 to 64 bytes.
pub(crate) fn name(value: &str, field: &'static str) -> Result<(), InvalidField> {
    match value.len() {
        1..=MAX_NAME_BYTES => Ok(()),
        length => Err(InvalidField::new(field, format!("of {length} bytes"), "of 1 to 64 bytes")),
    }
}
