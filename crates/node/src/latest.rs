//! Lists of the latest few values.

use std::collections::VecDeque;

/// Adds a value as the latest, and drops the oldest values until at most `most` are left.
pub fn push_latest<T>(latest: &mut VecDeque<T>, value: T, most: usize) {
    latest.push_back(value);
    while latest.len() > most {
        latest.pop_front();
    }
}
