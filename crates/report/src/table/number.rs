//! Numbers for readers.

/// A number with four significant digits and without trailing zeros, with a power of ten where it has too many zeros.
#[must_use]
pub fn format_number(value: f64) -> String {
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
    use super::format_number;

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
