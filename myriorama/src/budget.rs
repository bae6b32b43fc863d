//! The budget of a coordinator's sessions.

use std::path::PathBuf;
use std::sync::Arc;

use app_core::plan_files::PlanFiles;
use app_core::planning::screening_light;
use clap::Args;
use coordinator::{CoordinatorConfig, PlanStore};
use planner::Budget;

/// Arguments of commands with a coordinator.
#[derive(Debug, Clone, Args)]
pub struct BudgetArgs {
    /// The budget of sessions that state none: the most error, and the most time of a view, as in "flip 0.05" or "flip p95
    /// 0.06, time 8ms" (see `myriorama plan --help`). The cluster chooses what is sampled, and how views are reconstructed,
    /// as far as a session does not name it [default: none]
    #[arg(long, value_name = "BUDGET")]
    budget: Option<Budget>,
    #[command(flatten)]
    plans: PlansArgs,
}

/// Where measurements are kept.
#[derive(Debug, Clone, Args)]
pub struct PlansArgs {
    /// The folder of measurements for budgets, which later plans use again [default: myriorama/plans in the folder for
    /// caches]
    #[arg(long, value_name = "DIR")]
    plans: Option<PathBuf>,
}

impl BudgetArgs {
    /// A coordinator's configuration with this budget.
    pub fn configure(&self, config: CoordinatorConfig) -> CoordinatorConfig {
        let plans = self.plans.files().map(|files| Arc::new(files) as Arc<dyn PlanStore>);
        CoordinatorConfig { budget: self.budget, plans, screening_light, ..config }
    }
}

impl PlansArgs {
    /// The files; `None` where the environment names no folder.
    pub fn files(&self) -> Option<PlanFiles> {
        self.plans.clone().or_else(PlanFiles::default_folder).map(PlanFiles::at)
    }
}
