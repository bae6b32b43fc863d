//! Who does what. Pure: no clock, no await; the same events give the same commands.

mod assign;
mod balance;
mod choose;
mod state;

pub use assign::{share_images, share_sets, share_views};
pub use balance::{brute_force_k, k_fd, k_fd_printed, pipeline_time};
pub use choose::{Choice, ChoiceError, Demand, choose, predicted_direct_s, predicted_pipeline_s};
pub use state::{ClusterState, Command, Event, Opening};
