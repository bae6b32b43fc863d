//! Colours with names.

/// Names of the colours of a picture.
pub type Legend = Vec<(String, [u8; 3])>;
