//! Warnings about the contents of a file: one of each kind, with its first place and its count.

use std::borrow::Cow;
use std::cell::RefCell;
use std::collections::HashSet;
use std::fmt::Display;

use crate::{Fault, shortened};

/// Most names that a warning lists.
const MAX_NAMES: usize = 8;

/// What an importer leaves out, replaces or corrects. It is logged once the file is read.
#[derive(Default)]
pub(crate) struct Warnings(RefCell<Vec<Kind>>);

struct Kind {
    text: Cow<'static, str>,
    /// The first places, each once.
    places: Vec<String>,
    count: u64,
    /// All names of a kind that lists names.
    names: HashSet<String>,
    lists_names: bool,
}

impl Warnings {
    /// Counts one more of a kind. Its first place is named.
    pub(crate) fn count(&self, text: impl Into<Cow<'static, str>>, place: impl Display) {
        self.add(text.into(), place, false);
    }

    /// Adds a name to those of a kind.
    pub(crate) fn list(&self, text: impl Into<Cow<'static, str>>, name: impl Display) {
        self.add(text.into(), name, true);
    }

    fn add(&self, text: Cow<'static, str>, place: impl Display, lists_names: bool) {
        let mut kinds = self.0.borrow_mut();
        let number = kinds.iter().position(|kind| kind.text == text).unwrap_or(kinds.len());
        if number == kinds.len() {
            kinds.push(Kind { text, places: Vec::new(), count: 0, names: HashSet::new(), lists_names });
        }
        let kind = &mut kinds[number];
        if lists_names && !kind.names.insert(shortened(place.to_string())) {
            return;
        }
        kind.count += 1;
        let most = if lists_names { MAX_NAMES } else { 1 };
        if kind.places.len() < most {
            kind.places.push(shortened(place.to_string()));
        }
    }

    /// The fault of a file without triangles, by the first of `reasons` that left out a face.
    pub(crate) fn no_triangles(&self, reasons: [&str; 3]) -> Option<Fault> {
        let kinds = self.0.borrow();
        let kind = reasons.iter().find_map(|why| kinds.iter().find(|kind| kind.text == *why))?;
        Some(Fault::malformed(kind.places.first()?, format!("there are no triangles: {}", kind.text)))
    }

    /// Logs one warning of each kind.
    pub(crate) fn log(self) {
        for Kind { text, places, count, lists_names, .. } in self.0.into_inner() {
            let further = count - (places.len() as u64).min(count);
            let names = places.join(", ");
            match (lists_names, further) {
                (_, 0) => tracing::warn!("{text}: {names}"),
                (true, _) => tracing::warn!("{text}: {names} and {further} more"),
                (false, _) => tracing::warn!("{text}: {count}, the first: {names}"),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_beyond_those_listed_are_counted_once() {
        let warnings = Warnings::default();
        for number in (0..20).chain(0..20) {
            warnings.list("names", format_args!("name {number}"));
        }
        let kinds = warnings.0.borrow();
        assert_eq!((kinds[0].count, kinds[0].places.len()), (20, MAX_NAMES));
    }
}
