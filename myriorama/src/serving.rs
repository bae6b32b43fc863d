//! Arguments of commands with a coordinator: the budget of its sessions, and its viewer.

use std::path::PathBuf;
use std::sync::Arc;

use app_core::addresses::InsecureArgs;
use app_core::exit::BadInput;
use app_core::plan_files::PlanFiles;
use app_core::planning::screening_light;
use app_core::scenes::ScenesArgs;
use app_core::sizes::within;
use clap::Args;
use cluster::MAX_AUDIT_TIME_RATIO;
use coordinator::{CoordinatorConfig, PlanStore, SceneOffers};
use planner::Budget;
use scene::Scene;

use crate::viewer::ViewerArgs;

/// Arguments of commands with a coordinator, beside its scenes and its address.
#[derive(Debug, Clone, Args)]
pub struct ServingArgs {
    #[command(flatten)]
    pub(crate) insecure: InsecureArgs,
    /// The budget of sessions that state none: the most error, and the most time of a view, as in "flip 0.05" or "flip p95
    /// 0.06, time 8ms" (see `myriorama plan --help`). The cluster chooses what is sampled, and how views are reconstructed,
    /// as far as a session does not name it. None is kept with a layered cube as --sampling or --base, and with --blocks [default: none]
    #[arg(long, value_name = "BUDGET")]
    budget: Option<Budget>,
    /// The share of a compositor's time that audits of promises may take, from 0 to 0.5: they draw some views directly as well,
    /// and compare. 0 is off
    #[arg(long, value_name = "RATIO", default_value_t = 0.01, value_parser = within(0.0..=MAX_AUDIT_TIME_RATIO))]
    audit: f64,
    #[command(flatten)]
    plans: PlansArgs,
    #[command(flatten)]
    pub(crate) viewer: ViewerArgs,
}

/// Where measurements are kept.
#[derive(Debug, Clone, Args)]
pub struct PlansArgs {
    /// The folder of measurements for budgets, which later plans use again [default: myriorama/plans in the folder for
    /// caches]
    #[arg(long, value_name = "DIR")]
    plans: Option<PathBuf>,
}

impl ServingArgs {
    /// The scenes, and their offers.
    ///
    /// # Errors
    /// A scene cannot be used, or the budget cannot be kept for it: it is sampled as a layered cube, or has one or blocks beside its samples.
    pub fn load(&self, scenes: &ScenesArgs) -> anyhow::Result<(Vec<Scene>, SceneOffers)> {
        let (scenes, offers) = scenes.load(self.budget.is_some())?;
        let Some(budget) = self.budget else { return Ok((scenes, offers)) };
        for offer in offers.iter() {
            let cube = match (&offer.cube, &offer.base) {
                (Some(cube), _) => format!("--sampling {}", cube.sampling),
                (None, Some((base, _))) => format!("--base {}", base.sampling),
                (None, None) if !offer.blocks.is_empty() => "--blocks".to_owned(),
                (None, None) => continue,
            };
            return Err(BadInput(format!("--budget {budget}: none can be kept with {cube}")).into());
        }
        Ok((scenes, offers))
    }

    /// The configuration of the coordinator.
    pub fn config(&self) -> CoordinatorConfig {
        CoordinatorConfig {
            insecure_bind: self.insecure.insecure_bind,
            budget: self.budget,
            audit_time_ratio: self.audit,
            plans: self.plans.files().map(|files| Arc::new(files) as Arc<dyn PlanStore>),
            screening_light,
            ..CoordinatorConfig::default()
        }
    }
}

impl PlansArgs {
    /// The files; `None` where the environment names no folder.
    pub fn files(&self) -> Option<PlanFiles> {
        self.plans.clone().or_else(PlanFiles::default_folder).map(PlanFiles::at)
    }
}
