//! Budgets as users write them: `flip p95 0.06, time 8ms`.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::metric::{Metric, UnknownMetric};

/// The share of views that may be over a limit on 95 of 100 views.
pub(crate) const MOST_OVER: f64 = 0.05;
/// The most bytes of a term that an error repeats.
const SHOWN_BYTES: usize = 40;
/// The greatest limit on PSNR, in dB: 8-bit pictures that differ less are equal.
const MAX_PSNR_DB: f64 = 100.0;
/// The greatest limit on the time of a view, in ms.
const MAX_VIEW_MS: f64 = 60_000.0;

/// A limit on the errors of views, on the time of a view, or on both.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Budget {
    error: Option<ErrorTerm>,
    most_view_ms: Option<f64>,
}

/// A limit on the errors of views.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorTerm {
    metric: Metric,
    statistic: Statistic,
    /// In the unit of the metric's text: a ratio, dB, or per cent.
    limit: f64,
}

/// The views that have to keep a limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Statistic {
    /// All views in the mean.
    Mean,
    /// 95 of 100 views, each by itself.
    P95,
}

/// A text is no budget.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "self-naming fields")]
pub enum BudgetError {
    #[error("{term:?}: {source}")]
    UnknownMetric { term: String, source: UnknownMetric },
    #[error("{term:?} is no term of a budget, expected METRIC [p95] LIMIT, such as \"flip 0.05\", or \"time 8ms\"")]
    Malformed { term: String },
    #[error("{term:?}: the limit must be {allowed}")]
    OutOfRange { term: String, allowed: &'static str },
    #[error("{term:?}: a budget has at most one {kind} term")]
    Repeated { term: String, kind: &'static str },
}

impl Budget {
    /// The limit on errors.
    #[must_use]
    pub fn error(&self) -> Option<ErrorTerm> {
        self.error
    }

    /// The limit on the time of a view, in s: reconstructing and encoding it on the slowest node.
    #[must_use]
    pub fn most_view_s(&self) -> Option<f64> {
        self.most_view_ms.map(|ms| ms / 1e3)
    }

    /// The least strict budget whose keeping keeps both; `None` where the errors of both are not comparable.
    #[must_use]
    pub fn and(&self, other: &Self) -> Option<Self> {
        let error = match (self.error, other.error) {
            (Some(own), Some(other)) if own.implies(&other) => Some(own),
            (Some(own), Some(other)) => Some(other).filter(|other| other.implies(&own)),
            (own, other) => own.or(other),
        };
        let has_error = self.error.is_some() || other.error.is_some();
        let least_ms = [self.most_view_ms, other.most_view_ms].into_iter().flatten().reduce(f64::min);
        (error.is_some() == has_error).then_some(Self { error, most_view_ms: least_ms })
    }

    /// Whether what keeps this budget keeps the other as well.
    #[must_use]
    pub fn implies(&self, other: &Self) -> bool {
        self.and(other).as_ref() == Some(self)
    }

    fn add(&mut self, term: &str) -> Result<(), BudgetError> {
        match term.split_whitespace().collect::<Vec<_>>()[..] {
            ["time", limit] if self.most_view_ms.is_none() => self.most_view_ms = Some(milliseconds(limit, term)?),
            ["time", _] => return Err(BudgetError::Repeated { term: shown(term), kind: "time" }),
            ["time", ..] => return Err(malformed(term)),
            _ => {
                if self.error.replace(ErrorTerm::parse(term)?).is_some() {
                    return Err(BudgetError::Repeated { term: shown(term), kind: "error" });
                }
            }
        }
        Ok(())
    }
}

impl FromStr for Budget {
    type Err = BudgetError;

    /// Reading stops at the first term that is wrong: a text of any length costs no more than its first terms.
    fn from_str(text: &str) -> Result<Self, BudgetError> {
        let mut budget = Self { error: None, most_view_ms: None };
        text.split(',').try_for_each(|term| budget.add(term.trim()))?;
        Ok(budget)
    }
}

impl TryFrom<String> for Budget {
    type Error = BudgetError;
    fn try_from(text: String) -> Result<Self, BudgetError> {
        text.parse()
    }
}

impl From<Budget> for String {
    fn from(budget: Budget) -> Self {
        budget.to_string()
    }
}

impl fmt::Display for Budget {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let error = self.error.map(|term| term.to_string());
        let time = self.most_view_ms.map(|ms| format!("time {ms}ms"));
        f.write_str(&error.into_iter().chain(time).collect::<Vec<_>>().join(", "))
    }
}

impl ErrorTerm {
    /// The error that is limited.
    #[must_use]
    pub fn metric(&self) -> Metric {
        self.metric
    }

    /// The views that have to keep the limit.
    #[must_use]
    pub fn statistic(&self) -> Statistic {
        self.statistic
    }

    /// The limit as a ratio: PSNR as the mean squared error, of a full scale of 1.
    #[must_use]
    pub fn most_ratio(&self) -> f64 {
        match self.metric {
            Metric::Flip | Metric::FlipWhole => self.limit,
            Metric::Psnr => 10_f64.powf(-self.limit / 10.0),
            Metric::Disocclusion => self.limit / 100.0,
        }
    }

    /// Whether what keeps this limit keeps the other limit as well.
    #[must_use]
    pub fn implies(&self, other: &Self) -> bool {
        let is_same = self.metric == other.metric && self.statistic == other.statistic;
        is_same && self.most_ratio() <= other.most_ratio()
    }

    /// A ratio of this metric as a person reads it, with its unit.
    #[must_use]
    pub fn shown(&self, ratio: f64) -> String {
        match self.metric {
            Metric::Flip | Metric::FlipWhole => format!("{ratio:.4}"),
            Metric::Psnr => format!("{:.2} dB", -10.0 * ratio.max(1e-10).log10()),
            Metric::Disocclusion => format!("{:.3} %", ratio * 100.0),
        }
    }

    fn parse(term: &str) -> Result<Self, BudgetError> {
        let words: Vec<&str> = term.split_whitespace().take(5).collect();
        let (limit, words) = words.split_last().ok_or_else(|| malformed(term))?;
        let (statistic, words) = match words.split_last() {
            Some((&"p95", name)) => (Statistic::P95, name),
            _ => (Statistic::Mean, words),
        };
        if words.is_empty() {
            return Err(malformed(term));
        }
        let metric = shown(&words.join(" ")).parse();
        let metric = metric.map_err(|source| BudgetError::UnknownMetric { term: shown(term), source })?;
        Ok(Self { metric, statistic, limit: limit_of(metric, limit, term)? })
    }
}

impl fmt::Display for ErrorTerm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let p95 = if self.statistic == Statistic::P95 { " p95" } else { "" };
        let unit = if self.metric == Metric::Disocclusion { "%" } else { "" };
        write!(f, "{}{p95} {}{unit}", self.metric, self.limit)
    }
}

/// The limit of an error term in the unit of its metric.
fn limit_of(metric: Metric, limit: &str, term: &str) -> Result<f64, BudgetError> {
    let (number, is_percent) = limit.strip_suffix('%').map_or((limit, false), |number| (number, true));
    let number: f64 = number.parse().map_err(|_| malformed(term))?;
    let (limit, most, allowed) = match (metric, is_percent) {
        (Metric::Psnr, true) => return Err(malformed(term)),
        (Metric::Psnr, false) => (number, MAX_PSNR_DB, "above 0 and at most 100 dB"),
        (Metric::Disocclusion, true) => (number, 100.0, "above 0 and at most 100 %"),
        (Metric::Disocclusion, false) => (number * 100.0, 100.0, "above 0 and at most 1"),
        (Metric::Flip | Metric::FlipWhole, true) => (number / 100.0, 1.0, "above 0 and at most 100 %"),
        (Metric::Flip | Metric::FlipWhole, false) => (number, 1.0, "above 0 and at most 1"),
    };
    in_range(limit, most, term, allowed)
}

/// A time in ms, from a text with its unit.
fn milliseconds(limit: &str, term: &str) -> Result<f64, BudgetError> {
    let (number, unit_ms) = match limit.strip_suffix("ms") {
        Some(number) => (number, 1.0),
        None => (limit.strip_suffix('s').ok_or_else(|| malformed(term))?, 1e3),
    };
    let number: f64 = number.parse().map_err(|_| malformed(term))?;
    in_range(number * unit_ms, MAX_VIEW_MS, term, "above 0 and at most 60 s")
}

fn in_range(limit: f64, most: f64, term: &str, allowed: &'static str) -> Result<f64, BudgetError> {
    let is_valid = limit > 0.0 && limit <= most;
    if is_valid { Ok(limit) } else { Err(BudgetError::OutOfRange { term: shown(term), allowed }) }
}

fn malformed(term: &str) -> BudgetError {
    BudgetError::Malformed { term: shown(term) }
}

/// The beginning of a text, for an error.
fn shown(text: &str) -> String {
    text.chars().take(SHOWN_BYTES).collect()
}
