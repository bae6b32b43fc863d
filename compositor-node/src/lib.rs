//! The compositor's service.
