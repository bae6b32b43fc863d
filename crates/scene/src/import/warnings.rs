//! Warnings about a file: one for each kind, with the first place and the number of all places.

use std::cell::RefCell;
use std::fmt::Display;

/// Collects the warnings about one file. They are logged once it is read.
#[derive(Default)]
pub(crate) struct Warnings(RefCell<Vec<Warning>>);

struct Warning {
    first_element: String,
    reason: String,
    count: usize,
}

impl Warnings {
    /// Adds a place. Places with equal reasons are one warning.
    pub(crate) fn add(&self, element: impl Display, reason: impl AsRef<str>) {
        let mut warnings = self.0.borrow_mut();
        let reason = reason.as_ref();
        match warnings.iter_mut().find(|warning| warning.reason == reason) {
            Some(warning) => warning.count += 1,
            None => {
                warnings.push(Warning { first_element: element.to_string(), reason: reason.to_owned(), count: 1 });
            }
        }
    }

    /// Logs all warnings about `file`.
    pub(crate) fn log(self, file: &str) {
        for Warning { first_element, reason, count } in self.0.into_inner() {
            match count {
                1 => tracing::warn!("{file}: {first_element}: {reason}"),
                _ => tracing::warn!("{file}: {first_element}, the first of {count}: {reason}"),
            }
        }
    }
}
