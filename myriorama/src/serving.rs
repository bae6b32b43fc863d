//! Arguments of commands with a coordinator: the budget of its sessions, and its viewer.

use app_core::addresses::InsecureArgs;
use app_core::planning::rows;
use app_core::scenes::ScenesArgs;
use app_core::sizes::within;
use clap::Args;
use cluster::MAX_AUDIT_TIME_RATIO;
use coordinator::{CoordinatorConfig, SceneOffers};
use planner::Budget;
use scene::Scene;

use crate::viewer::ViewerArgs;

/// Arguments of commands with a coordinator, beside its scenes and its address.
#[derive(Debug, Clone, Args)]
pub struct ServingArgs {
    #[command(flatten)]
    pub(crate) insecure: InsecureArgs,
    /// The budget of sessions that state none and name no method: the most error, as in "flip 0.02" or "psnr 34" (see `myriorama plan
    /// --help`). The cluster chooses what is sampled, and how views are made. None is kept with --method, --sample-size, --base and
    /// --blocks, and with a layered cube as --sampling [default: none]
    #[arg(long, value_name = "BUDGET")]
    budget: Option<Budget>,
    /// The share of a compositor's time that audits of promises may take, from 0 to 0.5: they draw some views directly as well,
    /// and compare. 0 is off
    #[arg(long, value_name = "RATIO", default_value_t = 0.01, value_parser = within(0.0..=MAX_AUDIT_TIME_RATIO))]
    audit: f64,
    #[command(flatten)]
    pub(crate) viewer: ViewerArgs,
}

impl ServingArgs {
    /// The scenes, and their offers.
    ///
    /// # Errors
    /// A scene cannot be used, or the arguments leave the budget no choice.
    pub fn load(&self, scenes: &ScenesArgs) -> anyhow::Result<(Vec<Scene>, SceneOffers)> {
        self.budget.map_or(Ok(()), |budget| scenes.check_for_budget(budget))?;
        scenes.load()
    }

    /// The configuration of the coordinator.
    pub fn config(&self) -> CoordinatorConfig {
        CoordinatorConfig {
            insecure_bind: self.insecure.insecure_bind,
            budget: self.budget,
            audit_time_ratio: self.audit,
            rows,
            ..CoordinatorConfig::default()
        }
    }
}
