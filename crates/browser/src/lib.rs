//! A browser for tests and measurements: Debian's `chromium`, driven through its `chromedriver`.
//!
//! A [`Browser`] is one driver, one browser and one profile of its own, all gone when it is dropped. It opens
//! pages, runs scripts in them and keeps their console. [`input`] sends real events of mouse, fingers and keys: a page cannot
//! tell them from a person's. [`inspect`] reads what a person or an aid would: pictures, the accessibility tree, memory.
//!
//! Pages are driven over WebDriver, and over the DevTools protocol where WebDriver has no command. Everything is in CSS pixels
//! of the page's view, which [`Browser::set_view`] changes.
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod browser;
mod console;
mod error;
pub mod input;
pub mod inspect;
mod options;
mod process;
mod profile;

pub use browser::Browser;
pub use console::ConsoleEntry;
pub use error::BrowserError;
pub use options::{BrowserOptions, View};
pub use thirtyfour::Key;
