//! Common parts of the program's commands and the lab's.
//!
//! [`setup`] makes a scene on offer out of arguments, and [`scenes`] several. [`cluster`] runs coordinator and nodes in one process, and
//! [`experiment`] a client beside them.
//! [`quality`] is the quality of shared light. [`delivery`] opens sessions and receives views, and [`live`] follows a path with a moving camera. [`camera_file`]
//! reads camera files, and [`camera_record`] writes those of views. [`planning`] has the rows among which budgets
//! choose, and makes plans. [`addresses`] are those of the command line, and [`exit`] defines
//! the exit status.
#![cfg_attr(test, allow(clippy::unwrap_used))]

pub mod addresses;
pub mod camera_file;
pub mod camera_record;
pub mod cluster;
pub mod delivery;
pub mod exit;
pub mod experiment;
pub mod live;
pub mod node_limits;
pub mod planning;
pub mod process;
pub mod progress;
pub mod quality;
pub mod scenes;
pub mod setup;
pub mod sizes;

/// Prints a line on standard output. A reader that has gone, as in `up | head -1`, ends nothing.
#[macro_export]
macro_rules! print_line {
    ($($argument:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stdout(), $($argument)*);
    }};
}
