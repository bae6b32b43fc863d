//! Plans for budgets that a seed draws, beside the table of all rows.

use app_core::planning::measure;
use planner::{Budget, Demand, Row};
use scene::procedural::parts::Rng;

use super::table::{Stage, TableRow};

/// Numbers of views that share a sample set.
const VIEWS_A_SET: [usize; 3] = [24, 96, 290];
/// Views whose time a plan is compared with.
pub const COMPARED_VIEWS: f64 = 24.0;

/// A plan, and how its choice stands in the table.
#[derive(Debug, Clone)]
pub struct HeldOutPlan {
    pub scene: &'static str,
    pub budget: Budget,
    pub views_a_set: usize,
    /// The choice; `None` where nothing was found to keep the budget.
    pub chosen: Option<Row>,
    /// The choice's error in the table over the budget's.
    pub error_over_budget: f64,
    /// The table's price of the choice over that of the cheapest row that keeps the budget.
    pub price_ratio: f64,
    /// The time of the plan over that of 24 directly drawn views.
    pub time_ratio: f64,
    pub measurements: u64,
}

/// Makes `count` plans. Their budgets lie between the errors of the table's rows, in even steps of the logarithm that the seed
/// moves.
///
/// # Errors
/// The device fails.
pub fn held_out(stage: &Stage, table: &[TableRow], seed: u64, count: u64) -> anyhow::Result<Vec<HeldOutPlan>> {
    let flip: Budget = "flip 1".parse()?;
    let errors = table.iter().map(|row| row.error_ratio(&flip)).filter(|error| *error > 0.0);
    let (least, most) = errors.fold((1.0_f64, 0.0_f64), |(least, most), error| (least.min(error), most.max(error)));
    let mut plans = Vec::new();
    let mut random = Rng::new(seed, 0);
    for number in 0..count {
        let level = (number as f64 + f64::from(random.unit())) / count as f64;
        let budget: Budget = format!("flip {:.4}", least * (most / least).powf(level)).parse()?;
        let views_a_set = VIEWS_A_SET[(random.unit() * VIEWS_A_SET.len() as f32) as usize];
        let demand = Demand { nodes: 1, cells: 1, views_a_set };
        let mut plan = stage.plan(budget, demand, 1 + seed.wrapping_add(number) % (1 << 32))?;
        measure(&mut plan, &stage.probers_of_its_own(), |_| ())?;
        let chosen = plan.planner.outcome().and_then(|outcome| outcome.kept.first().copied());
        let row = chosen.and_then(|place| table.get(place));
        let keeping = table.iter().filter(|row| row.error_ratio(&budget) <= budget.most_ratio());
        let cheapest_s = keeping.map(|row| row.price_s(views_a_set)).fold(f64::INFINITY, f64::min);
        let (spent_s, measurements) = plan.planner.spent();
        let direct_s = table.last().map_or(f64::NAN, |exact| exact.costs.view_s);
        plans.push(HeldOutPlan {
            scene: stage.subject.scene,
            budget,
            views_a_set,
            chosen: row.map(|row| row.row.clone()),
            error_over_budget: row.map_or(f64::INFINITY, |row| row.error_ratio(&budget) / budget.most_ratio()),
            price_ratio: row.map_or(f64::INFINITY, |row| row.price_s(views_a_set) / cheapest_s),
            time_ratio: spent_s / (COMPARED_VIEWS * direct_s),
            measurements,
        });
    }
    Ok(plans)
}
