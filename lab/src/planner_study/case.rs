//! One budget on one subject: the plan, and what it is worth.

use std::time::Instant;

use app_core::planning::Planning;
use planner::{Budget, Choice, ErrorTerm, Kept, Metric, Outcome, Planner, Price, Pricing as _, ViewErrors};
use probe::Prober;

use super::evidence::{Evidence, over_ratio};
use super::pricing::Priced;
use crate::fronts::row::{MeasuredRow, default_place};
use crate::statistics::mean_and_variation;

/// The share of a budget that the best row keeps, to which a plan's cost is compared.
const COMPARED_SHARE: f64 = 0.95;
/// Seconds of measuring that a plan may take.
const ALLOWANCE_S: f64 = 300.0;
/// The cameras of the default representation.
const DEFAULT_CAMERAS: u32 = 4;

/// A plan and its figures; `None` where a figure does not apply.
pub struct Case {
    pub subject: String,
    pub is_lit: bool,
    pub budget: Budget,
    pub choice: String,
    pub is_direct: bool,
    /// The cost of the choice over that of the cheapest row that keeps 0.95 of the budget, both from the table; of a budget
    /// of time the FLIP.
    pub regret: Option<f64>,
    /// The same over the cheapest row that keeps the whole budget.
    pub strict_regret: Option<f64>,
    /// The error on unseen views over the limit.
    pub over: f64,
    /// The coefficient of variation of the error on unseen views.
    pub variation: f64,
    /// The cost over that of the default or of direct drawing, whichever is cheaper and keeps the budget.
    pub over_default: f64,
    pub is_first: bool,
    /// From the first event to the outcome.
    pub plan_s: f64,
    pub spent_s: f64,
    /// From the first event to the outcome of the same plan, made again.
    pub again_s: f64,
    /// Predicted prices of rows that the plan did not measure, over those of the table.
    pub predictions: Vec<f64>,
}

/// Six budgets between what the rows of a table reach.
pub fn budgets(rows: &[MeasuredRow]) -> anyhow::Result<Vec<Budget>> {
    let between = |of: &dyn Fn(&MeasuredRow) -> f64, level: f64| {
        let values = || rows.iter().map(of);
        let (least, most) = (values().fold(f64::INFINITY, f64::min).max(1e-4), values().fold(1e-4, f64::max));
        least * (most / least).powf(level)
    };
    let flip = |row: &MeasuredRow| row.error_ratio(Metric::Flip);
    let disocclusion = |row: &MeasuredRow| row.error_ratio(Metric::Disocclusion);
    let time = |row: &MeasuredRow| row.price.view_s;
    let texts = [
        format!("flip {:.4}", between(&flip, 0.15)),
        format!("flip {:.4}", between(&flip, 0.35)),
        format!("flip {:.4}", between(&flip, 0.6)),
        format!("flip p95 {:.4}", 1.3 * between(&flip, 0.35)),
        format!("disocclusion {:.3}%", 100.0 * between(&disocclusion, 0.5)),
        format!("time {:.3}ms", 1e3 * between(&time, 0.4)),
    ];
    Ok(texts.iter().map(|text| text.parse()).collect::<Result<_, _>>()?)
}

/// A subject's plans share their measurements: the first has none.
pub struct Cases<'a> {
    pub subject: String,
    pub is_lit: bool,
    pub planning: &'a Planning,
    pub pricing: Priced,
    pub views_a_set: usize,
    pub evidence: &'a mut Evidence,
}

impl Cases<'_> {
    /// Plans for a budget with what earlier plans kept.
    pub fn case(&mut self, budget: Budget, prober: &mut Prober, kept: &mut Kept) -> anyhow::Result<Case> {
        let is_first = kept.rows.is_empty();
        let (planner, outcome, plan_s) = self.planned(budget, prober, kept)?;
        let (_, _, again_s) = self.planned(budget, prober, kept)?;
        let case = self.judged(budget, &outcome)?;
        let (spent_s, predictions) = (planner.spent_s(), self.predictions(&planner));
        Ok(Case { is_first, plan_s, spent_s, again_s, predictions, ..case })
    }

    /// A plan, its outcome, and the seconds that it took.
    fn planned(
        &self,
        budget: Budget,
        prober: &mut Prober,
        kept: &mut Kept,
    ) -> anyhow::Result<(Planner<Priced>, Outcome, f64)> {
        let start = Instant::now();
        let request = self.planning.request(budget, "this device".to_owned(), self.views_a_set, ALLOWANCE_S);
        let mut planner = Planner::new(request, self.planning.ladder.clone(), self.pricing)?;
        let Planning { viewpoints, representations, .. } = self.planning;
        let (outcome, measured) = probe::plan(&mut planner, prober, viewpoints, representations, kept.clone(), |_| ());
        *kept = measured;
        Ok((planner, outcome, start.elapsed().as_secs_f64()))
    }

    fn predictions(&self, planner: &Planner<Priced>) -> Vec<f64> {
        let rows = planner.summaries().into_iter().zip(&self.evidence.rows);
        let predicted = rows.filter(|(summary, _)| !summary.is_measured);
        predicted.map(|(summary, row)| summary.price.node_s / row.price.node_s).collect()
    }

    /// The figures of a choice; those of its plan are left out.
    fn judged(&mut self, budget: Budget, outcome: &Outcome) -> anyhow::Result<Case> {
        let chosen = match outcome.choice {
            Choice::Row(row) => Some(row),
            Choice::Direct => None,
        };
        let errors = chosen.map(|row| self.evidence.confirmation(row).map(<[_]>::to_vec)).transpose()?;
        let price = chosen.map_or(self.pricing.direct(), |row| self.evidence.rows[row].price);
        let (regret, strict_regret) = match budget.error() {
            Some(term) => (self.regret(term, price, COMPARED_SHARE)?, self.regret(term, price, 1.0)?),
            None => (self.regret_of_time(budget, chosen, COMPARED_SHARE), self.regret_of_time(budget, chosen, 1.0)),
        };
        let over_errors = budget.error().zip(errors.as_ref()).map(|(term, errors)| over_ratio(errors, term, 1.0));
        let over_time = budget.most_view_s().map(|limit| price.view_s / limit);
        Ok(Case {
            subject: self.subject.clone(),
            is_lit: self.is_lit,
            budget,
            choice: chosen.map_or("direct".to_owned(), |row| self.evidence.rows[row].row.to_string()),
            is_direct: chosen.is_none(),
            regret,
            strict_regret,
            over: over_errors.into_iter().chain(over_time).fold(0.0, f64::max),
            variation: errors.as_deref().map_or(0.0, |errors| variation(errors, budget.error())),
            over_default: price.node_s / self.default_s(budget),
            is_first: false,
            plan_s: 0.0,
            spent_s: 0.0,
            again_s: 0.0,
            predictions: Vec::new(),
        })
    }

    fn regret(&mut self, term: ErrorTerm, price: Price, share: f64) -> anyhow::Result<Option<f64>> {
        let cheapest_s = self.evidence.cheapest_s(term, share)?.unwrap_or(f64::INFINITY);
        Ok(Some(price.node_s / cheapest_s.min(self.pricing.direct().node_s)))
    }

    /// FLIP over the least within the time. Direct drawing in time has no error, and nothing else is compared.
    fn regret_of_time(&self, budget: Budget, chosen: Option<usize>, share: f64) -> Option<f64> {
        let most_s = share * budget.most_view_s()?;
        let in_time = self.evidence.rows.iter().filter(|row| row.price.view_s <= most_s);
        let least = in_time.map(|row| row.error_ratio(Metric::Flip)).fold(f64::INFINITY, f64::min);
        let own = self.evidence.rows[chosen?].error_ratio(Metric::Flip);
        (least.is_finite() && least > 0.0).then(|| own / least)
    }

    /// The default's cost, or that of direct drawing, whichever is less and keeps the budget.
    fn default_s(&mut self, budget: Budget) -> f64 {
        let keeps = |row: &&MeasuredRow| {
            let keeps_error = budget.error().is_none_or(|term| over_ratio(&row.errors, term, 1.0) <= 1.0);
            keeps_error && budget.most_view_s().is_none_or(|limit| row.price.view_s <= limit)
        };
        let place = default_place(&self.planning.ladder, DEFAULT_CAMERAS).ok();
        let default = self.evidence.rows.iter().find(|row| Some(row.place) == place).filter(keeps);
        default.map_or(f64::INFINITY, |row| row.price.node_s).min(self.pricing.direct().node_s)
    }
}

fn variation(errors: &[ViewErrors], term: Option<ErrorTerm>) -> f64 {
    let metric = term.map_or(Metric::Flip, |term| term.metric());
    let values: Vec<f64> = errors.iter().map(|errors| errors.error_ratio(metric)).collect();
    mean_and_variation(&values).1
}
