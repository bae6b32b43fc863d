//! Warnings about the contents of a file: one of each kind, with its first place and its count.

use std::fmt::Display;

use crate::error::shortened;

/// Most names that a warning lists.
const MAX_NAMES: usize = 8;

/// What an importer leaves out, replaces or corrects.
#[derive(Default)]
pub(crate) struct Warnings {
    kinds: Vec<Kind>,
}

struct Kind {
    text: &'static str,
    /// The first places, each once.
    places: Vec<String>,
    count: u64,
    lists_names: bool,
}

impl Warnings {
    /// Counts one more of a kind. Its first place is named.
    pub(crate) fn count(&mut self, text: &'static str, place: impl Display) {
        let kind = self.kind(text, false);
        kind.count += 1;
        if kind.places.is_empty() {
            kind.places.push(shortened(place.to_string()));
        }
    }

    /// Adds a name to those of a kind.
    pub(crate) fn list(&mut self, text: &'static str, name: impl Display) {
        let name = shortened(name.to_string());
        let kind = self.kind(text, true);
        if !kind.places.contains(&name) {
            kind.count += 1;
            if kind.places.len() < MAX_NAMES {
                kind.places.push(name);
            }
        }
    }

    fn kind(&mut self, text: &'static str, lists_names: bool) -> &mut Kind {
        let number = self.kinds.iter().position(|kind| kind.text == text).unwrap_or(self.kinds.len());
        if number == self.kinds.len() {
            self.kinds.push(Kind { text, places: Vec::new(), count: 0, lists_names });
        }
        &mut self.kinds[number]
    }

    /// The first place and the number of a kind.
    pub(crate) fn first(&self, text: &str) -> Option<(&str, u64)> {
        let kind = self.kinds.iter().find(|kind| kind.text == text)?;
        Some((kind.places.first()?, kind.count))
    }

    /// Logs one warning of each kind.
    pub(crate) fn log(self) {
        for Kind { text, places, count, lists_names } in self.kinds {
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
