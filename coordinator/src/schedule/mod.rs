//! Roles of the nodes, and when they change. Pure: no clock, no await; the same events give the same commands.
//!
//! [`Scheduler`] turns events into commands. It divides nodes by the time that work is predicted to take ([`choose`]), from
//! costs that nodes time themselves ([`MeasuredCosts`]), replaces a plan that works only where the switch is repaid, and
//! puts nodes at fault in quarantine. See `docs/scheduling.md`.

mod active_plan;
mod assign;
mod balance;
mod budget_plan;
mod budget_state;
mod budgeted;
mod cells;
mod choose;
mod command;
mod demand;
mod estimate;
mod event;
mod event_log;
mod hysteresis;
mod load;
mod makespan;
mod member;
mod node_costs;
mod node_shares;
mod operations;
mod overload;
mod prediction;
mod promise_audit;
mod reason;
mod relay_tree;
mod reports;
mod representation;
mod scheduler;
mod search;
mod session_mix;
mod smoothing;
mod workload_state;

#[cfg(test)]
mod budget_tests;
#[cfg(test)]
mod cells_tests;
#[cfg(test)]
mod fault_tests;
#[cfg(test)]
mod test_support;
#[cfg(test)]
mod workloads_tests;
#[cfg(test)]
pub(crate) use test_support::workload as workload_for_tests;

pub use balance::k_fd;
pub use budget_plan::BudgetPlan;
pub use budget_state::STILL_SET_S;
pub use budgeted::Budgeted;
pub use choose::choose;
pub use cluster::MeasuredCosts;
pub use command::{Command, Probe, ProbedImage, ViewProbe};
pub use demand::{Choice, ChoiceError, CurrentRoles, Demand, PolicyOverride, Predicted};
pub use event::{Event, Opening, ProbeKind};
pub use event_log::{LogError, Recorder, Step, replay};
pub use load::Load;
pub use node_costs::NodeCosts;
pub use prediction::pipeline_s;
pub use scheduler::Scheduler;
pub use search::Division;
