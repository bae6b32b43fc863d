//! Values of a table, and numbers for readers.

use serde::{Deserialize, Serialize};

/// One value of a table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Cell {
    /// A value that was not measured, is not finite or does not apply: `null`, an empty CSV field.
    Missing,
    /// Yes or no.
    Flag(bool),
    /// A count.
    Integer(i64),
    /// A measure; always finite.
    Number(f64),
    /// Words.
    Text(String),
}

impl Cell {
    /// The value as in an HTML table: numbers with four significant digits.
    #[must_use]
    pub fn display(&self) -> String {
        match self {
            Self::Missing => "–".into(),
            Self::Flag(flag) => if *flag { "yes" } else { "no" }.into(),
            Self::Integer(integer) => integer.to_string(),
            Self::Number(number) => format_number(*number),
            Self::Text(text) => text.clone(),
        }
    }

    /// The value as in a CSV file: numbers in full.
    #[must_use]
    pub fn full(&self) -> String {
        match self {
            Self::Missing => String::new(),
            Self::Flag(flag) => flag.to_string(),
            Self::Number(number) => number.to_string(),
            Self::Integer(_) | Self::Text(_) => self.display(),
        }
    }

    /// True for numbers, which are aligned right.
    #[must_use]
    pub fn is_numeric(&self) -> bool {
        matches!(self, Self::Integer(_) | Self::Number(_))
    }
}

/// Conversions to cells.
macro_rules! cell_from {
    ($($value:ident: $type:ty => $cell:expr;)*) => {$(
        impl From<$type> for Cell {
            fn from($value: $type) -> Self {
                $cell
            }
        }
    )*};
}

cell_from! {
    number: f64 => if number.is_finite() { Self::Number(number) } else { Self::Missing };
    number: f32 => f64::from(number).into();
    integer: i64 => Self::Integer(integer);
    integer: u32 => Self::Integer(integer.into());
    integer: usize => i64::try_from(integer).map_or(Self::Number(integer as f64), Self::Integer);
    flag: bool => Self::Flag(flag);
    text: &str => Self::Text(text.into());
    text: String => Self::Text(text);
}

impl<T: Into<Self>> From<Option<T>> for Cell {
    fn from(value: Option<T>) -> Self {
        value.map_or(Self::Missing, Into::into)
    }
}

/// A number with four significant digits and without trailing zeros, with a power of ten where it has too many zeros.
pub(crate) fn format_number(value: f64) -> String {
    match value {
        0.0 => return "0".into(),
        f64::INFINITY => return "∞".into(),
        f64::NEG_INFINITY => return "-∞".into(),
        _ if value.is_nan() => return "not a number".into(),
        _ => (),
    }
    // The exponent after rounding: 9999.6 is 10000.
    let scientific = format!("{value:.3e}");
    let (mantissa, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    match exponent {
        -4..=6 => without_trailing_zeros(&format!("{value:.*}", usize::try_from(3 - exponent).unwrap_or(0))),
        _ => format!("{}e{exponent}", without_trailing_zeros(mantissa)),
    }
}

fn without_trailing_zeros(number: &str) -> String {
    if number.contains('.') { number.trim_end_matches('0').trim_end_matches('.').into() } else { number.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_survive_json() {
        let cells = [Cell::Missing, true.into(), 3_u32.into(), 0.5.into(), 2.0.into(), "x".into(), None::<f64>.into()];
        let text = serde_json::to_string(&cells).unwrap();
        assert_eq!(text, r#"[null,true,3,0.5,2.0,"x",null]"#);
        assert_eq!(serde_json::from_str::<Vec<Cell>>(&text).unwrap(), cells);
    }

    #[test]
    fn a_number_has_four_significant_digits() {
        let cases = [
            (0.0, "0"),
            (1.0, "1"),
            (0.1 + 0.2, "0.3"),
            (1234.56, "1235"),
            (123_456.0, "123456"),
            (1.5e9, "1.5e9"),
            (0.000_123_4, "0.0001234"),
            (1e-7, "1e-7"),
            (-2.5, "-2.5"),
            (9999.96, "10000"),
            (f64::INFINITY, "∞"),
        ];
        for (value, text) in cases {
            assert_eq!(format_number(value), text);
        }
    }
}
