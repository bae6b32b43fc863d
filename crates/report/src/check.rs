//! Checks: a measured value against a bar.

use serde::{Deserialize, Serialize};

use crate::table::format_number;

/// A bar for a value.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Bar {
    /// The least value.
    AtLeast(f64),
    /// The greatest value.
    AtMost(f64),
    /// The exact value, for counts.
    Equal(f64),
}

impl Bar {
    /// True where a value reaches the bar. NaN reaches none.
    #[must_use]
    pub fn holds(self, value: f64) -> bool {
        match self {
            Self::AtLeast(bar) => value >= bar,
            Self::AtMost(bar) => value <= bar,
            Self::Equal(bar) => value == bar,
        }
    }
}

impl std::fmt::Display for Bar {
    fn fmt(&self, formatter: &mut std::fmt::Formatter) -> std::fmt::Result {
        let (sign, bar) = match self {
            Self::AtLeast(bar) => ("≥", bar),
            Self::AtMost(bar) => ("≤", bar),
            Self::Equal(bar) => ("=", bar),
        };
        write!(formatter, "{sign} {}", format_number(*bar))
    }
}

/// The outcome of a check.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// The value reaches the bar.
    Holds,
    /// The value does not reach the bar.
    FallsShort,
    /// There is no value.
    NotRun,
}

impl Outcome {
    /// The printed words.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::Holds => "holds",
            Self::FallsShort => "FALLS SHORT",
            Self::NotRun => "not run",
        }
    }
}

/// A value against a bar.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Check {
    /// The name of the check.
    pub name: String,
    /// The value; `null` where not run, or not finite.
    pub value: Option<f64>,
    unit: String,
    bar: Bar,
    /// The same figure over the pixels that show a surface, where the value is a whole picture's. No bar is stated for it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub foreground: Option<f64>,
    /// The outcome; `null` where not run.
    holds: Option<bool>,
    /// The reason why the check was not run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
}

impl Check {
    /// Compares a value with the bar. A value that is not finite is compared, but not kept: +∞ dB reaches any bar, NaN
    /// none.
    #[must_use]
    pub fn new(name: impl Into<String>, value: f64, unit: impl Into<String>, bar: Bar) -> Self {
        Self {
            name: name.into(),
            value: Some(value).filter(|value| value.is_finite()),
            unit: unit.into(),
            bar,
            foreground: None,
            holds: Some(bar.holds(value)),
            reason: None,
        }
    }

    /// A check that was not run.
    #[must_use]
    pub fn not_run(name: impl Into<String>, unit: impl Into<String>, bar: Bar, reason: impl Into<String>) -> Self {
        Self { holds: None, reason: Some(reason.into()), ..Self::new(name, f64::NAN, unit, bar) }
    }

    /// The outcome.
    #[must_use]
    pub fn outcome(&self) -> Outcome {
        match self.holds {
            Some(true) => Outcome::Holds,
            Some(false) => Outcome::FallsShort,
            None => Outcome::NotRun,
        }
    }

    /// The value with its unit, or a dash.
    pub(crate) fn value_text(&self) -> String {
        let value = match self.value {
            Some(value) => with_unit(&format_number(value), &self.unit),
            None if self.holds.is_some() => "not finite".into(),
            None => "–".into(),
        };
        let Some(foreground) = self.foreground else { return value };
        format!("foreground {}, whole {value}", with_unit(&format_number(foreground), &self.unit))
    }

    /// The bar with the unit.
    pub(crate) fn bar_text(&self) -> String {
        with_unit(&self.bar.to_string(), &self.unit)
    }
}

fn with_unit(text: &str, unit: &str) -> String {
    format!("{text} {unit}").trim_end().into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_equal_to_its_bar_reaches_it() {
        for bar in [Bar::AtLeast(2.0), Bar::AtMost(2.0), Bar::Equal(2.0)] {
            assert_eq!(Check::new("x", 2.0, "", bar).outcome(), Outcome::Holds, "{bar}");
            assert_eq!(Check::new("x", f64::NAN, "", bar).outcome(), Outcome::FallsShort, "{bar}");
        }
        assert_eq!(Check::new("x", 1.9, "", Bar::AtLeast(2.0)).outcome(), Outcome::FallsShort);
        assert_eq!(Check::new("x", 2.1, "", Bar::AtMost(2.0)).outcome(), Outcome::FallsShort);
        assert_eq!(Check::new("x", f64::INFINITY, "dB", Bar::AtLeast(40.0)).outcome(), Outcome::Holds);
    }

    #[test]
    fn the_foregrounds_figure_comes_first_and_decides_nothing() {
        let check = Check { foreground: Some(0.09), ..Check::new("FLIP", 0.04, "", Bar::AtMost(0.05)) };
        assert_eq!(check.outcome(), Outcome::Holds);
        assert_eq!(check.value_text(), "foreground 0.09, whole 0.04");
        assert_eq!(serde_json::to_value(&check).unwrap()["foreground"], 0.09);
        assert_eq!(Check { foreground: None, ..check }.value_text(), "0.04");
    }

    #[test]
    fn json_has_the_fields_that_the_format_names() {
        let json = serde_json::to_value(Check::new("FLIP", 0.04, "", Bar::AtMost(0.05))).unwrap();
        assert_eq!(
            json,
            serde_json::json!({"name": "FLIP", "value": 0.04, "unit": "", "bar": {"at_most": 0.05}, "holds": true})
        );
        let json = serde_json::to_value(Check::not_run("GPU", "ms", Bar::AtMost(1.0), "no GPU")).unwrap();
        assert!(json["holds"].is_null() && json["value"].is_null());
        assert_eq!(json["reason"], "no GPU");
    }
}
