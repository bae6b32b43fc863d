//! A browser for tests and measurements: Debian's `chromium`, driven over the DevTools protocol.
//!
//! A [`Browser`] is one browser and one profile of its own, both gone when it is dropped. It opens
//! pages, runs scripts in them and keeps their console. [`input`] sends real events of mouse, fingers and keys: a page cannot
//! tell them from a person's. [`inspect`] reads what a person or an aid would: pictures, the accessibility tree, memory.
//!
//! Everything is in CSS pixels of the page's view, which [`Browser::set_view`] changes. A method of the protocol without a
//! function here is called with [`Browser::devtools`].
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod browser;
mod connection;
mod console;
mod error;
pub mod input;
pub mod inspect;
mod key;
mod options;
mod process;
mod profile;
mod record;

pub use browser::Browser;
pub use console::ConsoleEntry;
pub use error::BrowserError;
pub use key::Key;
pub use options::{BrowserOptions, View};
