//! Measurements that are kept between plans, as JSON.
//!
//! Measurements are kept, choices are not: another budget is answered from the same errors. Errors hold on every device;
//! costs carry the names of their device and program. A search that has come to its end is not made again.

use serde::de::{Deserializer, Error as _, SeqAccess, Visitor};
use serde::{Deserialize, Serialize};

use crate::budget::{Budget, ErrorTerm};
use crate::costs::RowCosts;
use crate::invalid::{InvalidField, name, within};
use crate::ladder::{MAX_ROWS, Row};
use crate::view_errors::ViewErrors;

/// The most bytes that all kept measurements together may have, and so any text of them.
pub const MAX_KEPT_BYTES: usize = 64 << 20;
/// The most screening views of a row.
pub const MAX_SCREENING_VIEWS: usize = 32;
/// The most certificates, failed certificates and devices of a row; more are dropped, oldest first.
const MAX_CERTIFICATES: usize = 16;
/// The most searches; the oldest are dropped.
const MAX_SEARCHES: usize = 64;
/// The greatest relative difference of a sum that was kept from the sum of its values, by rounding.
const SUM_TOLERANCE: f64 = 1e-9;

/// Everything that errors depend on. Each is the text of a hash, or a text as good.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs, reason = "self-naming fields")]
pub struct KeptKey {
    pub scene: String,
    pub cell: String,
    pub lighting: String,
    pub view_size: String,
    pub ladder_version: String,
}

/// The measurements of one key.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Kept {
    /// The scene and the settings that the errors depend on.
    pub key: KeptKey,
    /// Fresh views that certificates have used: they are never drawn again.
    pub fresh_views_drawn: u64,
    /// Rows that were measured.
    #[serde(deserialize_with = "bounded::<_, _, MAX_ROWS>")]
    pub rows: Vec<KeptRow>,
    /// Searches that have come to their end.
    #[serde(deserialize_with = "bounded::<_, _, MAX_SEARCHES>")]
    pub searches: Vec<KeptSearch>,
}

/// A search for the cheapest row that keeps a budget.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs, reason = "as the fields of a plan's request")]
pub struct KeptSearch {
    pub budget: Budget,
    pub pricing: String,
    pub device: String,
    pub program_version: String,
    /// The row that was chosen; `None` for direct drawing.
    pub row: Option<Row>,
}

/// The measurements of one row.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KeptRow {
    /// The row.
    pub row: Row,
    /// The errors on the first screening views, in order.
    #[serde(deserialize_with = "bounded::<_, _, MAX_SCREENING_VIEWS>")]
    pub screening: Vec<ViewErrors>,
    /// The sums of the errors over these views, in the order of the fields: damage to a value shows.
    pub sums: [f64; 5],
    /// Budgets that the row was certified to keep.
    #[serde(deserialize_with = "bounded::<_, _, MAX_CERTIFICATES>")]
    pub certificates: Vec<Certificate>,
    /// Budgets at which the row, or a safer one before it, failed its certificate and the row has none. It is not tried again
    /// at them, nor at stricter ones.
    #[serde(deserialize_with = "bounded::<_, _, MAX_CERTIFICATES>")]
    pub rejected: Vec<Budget>,
    /// Costs by device and program.
    #[serde(deserialize_with = "bounded::<_, _, MAX_CERTIFICATES>")]
    pub costs: Vec<KeptCosts>,
}

/// A limit that a row was certified to keep, with 95 % confidence for all rows of its plan together.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Certificate {
    /// The budget that was planned for.
    pub budget: Budget,
    /// Fresh views that counted.
    pub views: usize,
    /// Fresh views that were skipped, as they show next to nothing.
    pub skipped_views: usize,
    /// The error on these views, as a ratio.
    pub expected_ratio: f64,
    /// The bound on the error, as a ratio.
    pub bound_ratio: f64,
    /// The mean share of foreground in these views.
    pub foreground_ratio: f64,
}

/// Costs of a row on one device, by one version of the program.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KeptCosts {
    /// The device's name.
    pub device: String,
    /// The program's version.
    pub program_version: String,
    /// Whether they were timed in turn with those of other finalists.
    pub is_settled: bool,
    /// The costs.
    pub costs: RowCosts,
}

/// A text is not the kept measurements that are asked for.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "self-naming fields")]
pub enum KeptError {
    #[error("kept measurements have {bytes} bytes, at most {MAX_KEPT_BYTES} are read")]
    TooLarge { bytes: usize },
    #[error("kept measurements cannot be read: {0}")]
    Damaged(#[from] serde_json::Error),
    #[error("kept measurements: {0}")]
    Invalid(#[from] InvalidField),
    #[error("kept measurements are of another {field}")]
    Foreign { field: &'static str },
}

impl Kept {
    /// A key without measurements.
    #[must_use]
    pub fn empty(key: KeptKey) -> Self {
        Self { key, fresh_views_drawn: 0, rows: Vec::new(), searches: Vec::new() }
    }

    /// The measurements of `key` from JSON. Lists that are too long are refused before they are read to their end.
    ///
    /// # Errors
    /// For a text that is too large, damaged, invalid, or of another key.
    pub fn from_json(json: &[u8], key: &KeptKey) -> Result<Self, KeptError> {
        if json.len() > MAX_KEPT_BYTES {
            return Err(KeptError::TooLarge { bytes: json.len() });
        }
        let kept: Self = serde_json::from_slice(json)?;
        kept.validate()?;
        match kept.key.difference(key) {
            Some(field) => Err(KeptError::Foreign { field }),
            None => Ok(kept),
        }
    }

    /// The measurements as JSON.
    ///
    /// # Errors
    /// For a value that JSON does not have; valid measurements have none.
    pub fn to_json(&self) -> Result<String, KeptError> {
        Ok(serde_json::to_string(self)?)
    }

    /// # Errors
    /// For a value that its field does not allow.
    pub fn validate(&self) -> Result<(), InvalidField> {
        self.key.validate()?;
        // Far more than any program draws, and far from overflow.
        within(self.fresh_views_drawn, 0..=1 << 48, "fresh_views_drawn", "at most 2^48")?;
        within(self.rows.len(), 0..=MAX_ROWS, "rows", "at most 220")?;
        self.rows.iter().try_for_each(KeptRow::validate)?;
        self.searches.iter().try_for_each(KeptSearch::validate)
    }

    /// Adds a search, as the newest.
    pub(crate) fn add_search(&mut self, search: KeptSearch) {
        self.searches.retain(|other| !other.is_like(&search));
        self.searches.push(search);
        self.searches.drain(..self.searches.len().saturating_sub(MAX_SEARCHES));
    }
}

impl KeptSearch {
    /// Whether two searches are the same, whatever they chose.
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        (self.budget, &self.pricing, &self.device, &self.program_version)
            == (other.budget, &other.pricing, &other.device, &other.program_version)
    }

    fn validate(&self) -> Result<(), InvalidField> {
        name(&self.pricing, "pricing")?;
        name(&self.device, "device")?;
        name(&self.program_version, "program_version")?;
        self.row.as_ref().map_or(Ok(()), Row::validate)
    }
}

impl KeptKey {
    pub(crate) fn validate(&self) -> Result<(), InvalidField> {
        self.texts().into_iter().zip(KEY_FIELDS).try_for_each(|(text, field)| name(text, field))
    }

    fn texts(&self) -> [&str; 5] {
        [&self.scene, &self.cell, &self.lighting, &self.view_size, &self.ladder_version]
    }

    /// The first field in which two keys differ.
    pub(crate) fn difference(&self, other: &Self) -> Option<&'static str> {
        let pairs = self.texts().into_iter().zip(other.texts());
        pairs.zip(KEY_FIELDS).find_map(|((a, b), field)| (a != b).then_some(field))
    }
}

impl KeptRow {
    /// The screening of a row, which has neither certificates nor costs yet.
    #[must_use]
    pub fn new(row: Row, screening: Vec<ViewErrors>) -> Self {
        let sums = sums(&screening);
        Self { row, screening, sums, certificates: Vec::new(), rejected: Vec::new(), costs: Vec::new() }
    }

    fn validate(&self) -> Result<(), InvalidField> {
        self.row.validate()?;
        within(self.screening.len(), 0..=MAX_SCREENING_VIEWS, "screening", "at most 32 views")?;
        self.screening.iter().try_for_each(ViewErrors::validate)?;
        for (sum, kept) in sums(&self.screening).into_iter().zip(self.sums) {
            let is_same = (sum - kept).abs() <= SUM_TOLERANCE * (1.0 + sum);
            is_same.then_some(()).ok_or_else(|| InvalidField::new("sums", kept, "the sums of the errors"))?;
        }
        self.certificates.iter().try_for_each(Certificate::validate)?;
        self.costs.iter().try_for_each(KeptCosts::validate)
    }
}

impl Certificate {
    /// Whether the certificate serves a term: its own, or a looser one.
    #[must_use]
    pub fn serves(&self, term: &ErrorTerm) -> bool {
        self.budget.error().is_some_and(|own| own.implies(term))
    }

    fn validate(&self) -> Result<(), InvalidField> {
        within(self.views, 1..=4096, "views", "from 1 to 4096")?;
        within(self.skipped_views, 0..=4096, "skipped_views", "at most 4096")?;
        within(self.expected_ratio, 0.0..=1.0, "expected_ratio", "from 0 to 1")?;
        let most = self.budget.error().map_or(0.0, |term| term.most_ratio());
        within(self.bound_ratio, 0.0..=most, "bound_ratio", "from 0 to the budget's limit")?;
        within(self.foreground_ratio, 0.0..=1.0, "foreground_ratio", "from 0 to 1")
    }
}

impl KeptCosts {
    fn validate(&self) -> Result<(), InvalidField> {
        name(&self.device, "device")?;
        name(&self.program_version, "program_version")?;
        self.costs.validate()
    }
}

const KEY_FIELDS: [&str; 5] = ["scene", "cell", "lighting", "view_size", "ladder_version"];

fn sums(errors: &[ViewErrors]) -> [f64; 5] {
    errors.iter().fold([0.0; 5], |sums, errors| {
        let values = errors.values();
        [0, 1, 2, 3, 4].map(|field| sums[field] + values[field])
    })
}

/// The last entries that a list may have.
pub(crate) fn newest<T: Clone>(all: &[T]) -> Vec<T> {
    all[all.len().saturating_sub(MAX_CERTIFICATES)..].to_vec()
}

/// A list of at most `MOST` entries.
fn bounded<'de, D: Deserializer<'de>, T: Deserialize<'de>, const MOST: usize>(from: D) -> Result<Vec<T>, D::Error> {
    struct Bounded<T, const MOST: usize>(std::marker::PhantomData<T>);

    impl<'de, T: Deserialize<'de>, const MOST: usize> Visitor<'de> for Bounded<T, MOST> {
        type Value = Vec<T>;

        fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
            write!(f, "at most {MOST} entries")
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut entries: A) -> Result<Vec<T>, A::Error> {
            let mut read = Vec::new();
            while let Some(entry) = entries.next_element()? {
                if read.len() == MOST {
                    return Err(A::Error::invalid_length(MOST + 1, &self));
                }
                read.push(entry);
            }
            Ok(read)
        }
    }

    from.deserialize_seq(Bounded::<T, MOST>(std::marker::PhantomData))
}
