//! Budgets as users write them: `flip 0.02` or `psnr 34`.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// The most characters of a text that an error repeats.
const SHOWN_CHARS: usize = 40;
/// The greatest limit on PSNR, in dB: 8-bit pictures that differ less are equal.
const MAX_PSNR_DB: f64 = 100.0;

/// The error of a view that a budget limits, over the pixels that show a surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Metric {
    /// Mean FLIP.
    Flip,
    /// The mean squared error, as PSNR.
    Psnr,
}

/// A limit on the mean error of views.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Budget {
    metric: Metric,
    /// In the unit of the text: a ratio for FLIP, dB for PSNR.
    limit: f64,
}

/// A text is no budget.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "self-naming fields")]
pub enum BudgetError {
    #[error("{text:?} is no budget, expected \"flip LIMIT\" or \"psnr DB\", as in \"flip 0.02\" or \"psnr 34\"")]
    Malformed { text: String },
    #[error("{text:?} has two limits, a budget has one")]
    TwoLimits { text: String },
    #[error("{text:?}: the limit must be {allowed}")]
    OutOfRange { text: String, allowed: &'static str },
}

impl Budget {
    /// The error that is limited.
    #[must_use]
    pub fn metric(&self) -> Metric {
        self.metric
    }

    /// The limit as a ratio: PSNR as the mean squared error, of a full scale of 1.
    #[must_use]
    pub fn most_ratio(&self) -> f64 {
        match self.metric {
            Metric::Flip => self.limit,
            Metric::Psnr => 10_f64.powf(-self.limit / 10.0),
        }
    }

    /// A ratio of this metric as a person reads it, with its unit.
    #[must_use]
    pub fn shown(&self, ratio: f64) -> String {
        match self.metric {
            Metric::Flip => format!("FLIP {ratio:.4}"),
            Metric::Psnr => format!("{:.1} dB", -10.0 * ratio.max(1e-10).log10()),
        }
    }
}

impl FromStr for Budget {
    type Err = BudgetError;

    fn from_str(text: &str) -> Result<Self, BudgetError> {
        let shown: String = text.chars().take(SHOWN_CHARS).collect();
        if text.contains(',') {
            return Err(BudgetError::TwoLimits { text: shown });
        }
        let words: Vec<&str> = text.split_whitespace().take(3).collect();
        let (metric, most, allowed) = match words.first() {
            Some(&"flip") => (Metric::Flip, 1.0, "above 0 and at most 1"),
            Some(&"psnr") => (Metric::Psnr, MAX_PSNR_DB, "above 0 and at most 100 dB"),
            _ => return Err(BudgetError::Malformed { text: shown }),
        };
        let [_, limit] = words[..] else { return Err(BudgetError::Malformed { text: shown }) };
        match limit.parse() {
            Ok(limit) if limit > 0.0 && limit <= most => Ok(Self { metric, limit }),
            Ok(_) => Err(BudgetError::OutOfRange { text: shown, allowed }),
            Err(_) => Err(BudgetError::Malformed { text: shown }),
        }
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
        match self.metric {
            Metric::Flip => write!(f, "flip {}", self.limit),
            Metric::Psnr => write!(f, "psnr {}", self.limit),
        }
    }
}
