//! Common parts of the program's commands and the lab's.
//!
//! [`setup`] makes a scene on offer out of arguments; [`cluster`] runs coordinator and nodes in one process;
//! [`delivery`] opens sessions and receives views, [`live`] follows a path with a moving camera; [`cameras`] reads and
//! writes camera files; [`exit`] says what an exit status means.
#![cfg_attr(test, allow(clippy::unwrap_used))]

pub mod cameras;
pub mod cluster;
pub mod delivery;
pub mod exit;
pub mod fallbacks;
pub mod live;
pub mod pictures;
pub mod process;
pub mod provenance;
pub mod setup;
pub mod sizes;
