//! Numbers slightly out of range.

use std::fmt;
use std::ops::RangeInclusive;

use crate::error::Fault;

/// Clamps `value` to `range`: a colour of −0.01 or a roughness of 1.5 is an exporter's rounding and no reason to refuse
/// a model. A value that is not a finite number is refused.
pub(crate) fn clamped(element: impl fmt::Display, value: f32, range: RangeInclusive<f32>) -> Result<f32, Fault> {
    if value.is_finite() {
        let within = value.clamp(*range.start(), *range.end());
        if within != value {
            tracing::warn!("{element}: {value} is out of range, {within} is taken");
        }
        Ok(within)
    } else {
        Err(Fault::malformed(element, "not finite"))
    }
}

/// Clamps each of `values`; see [`clamped`].
pub(crate) fn all_clamped<const N: usize>(
    element: impl fmt::Display,
    mut values: [f32; N],
    range: RangeInclusive<f32>,
) -> Result<[f32; N], Fault> {
    for value in &mut values {
        *value = clamped(&element, *value, range.clone())?;
    }
    Ok(values)
}
