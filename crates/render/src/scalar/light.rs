//! The scalar reference of light.
