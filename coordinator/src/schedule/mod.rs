//! Who does what. Pure: no clock, no await; the same events give the same commands.
//!
//! [`Scheduler`] takes events and says what is to be done. It divides nodes by what work is predicted to take
//! ([`choose`]), from costs that nodes time themselves ([`MeasuredCosts`]), and changes a plan that works only where
//! that pays. See `docs/scheduling.md`.

mod assign;
mod balance;
mod cells;
mod choose;
mod costs;
mod deal;
mod event;
mod exact;
mod log;
mod overload;
mod patience;
mod predict;
mod reason;
mod scheduler;
mod search;
mod transfer;
mod work;
mod written;

#[cfg(test)]
mod cells_tests;
#[cfg(test)]
mod simulation;
#[cfg(test)]
mod test_support;

pub use assign::share_images;
pub use balance::{brute_force_k, k_fd, k_fd_printed, pipeline_time};
pub(crate) use cells::firsts;
pub use choose::{Choice, ChoiceError, Demand, Predicted, Present, Wish, choose};
pub use cluster::MeasuredCosts;
pub use costs::NodeCosts;
pub use event::{Command, Event, Opening};
pub use log::{LogError, Recorder, replay};
pub use predict::{Load, direct_s, pipeline_by_s, pipeline_s, relay_fanout, time_share_s};
pub use scheduler::Scheduler;
pub use search::{Division, enumerate};
