//! Image, depth and visibility error.
