//! Image metrics: properties of each on patterns, and agreement with independent implementations.
#![allow(clippy::unwrap_used)]

mod agreement;
mod comparators;
