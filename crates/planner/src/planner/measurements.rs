//! Answers to measurements: they must be what was asked for.

use super::state::{Stage, Work};
use super::{Planner, TIMED_REPEATS, TIMED_VIEWS};
use crate::cost_model::{CostModel, TimedRow};
use crate::costs::{Price, Pricing, RowCosts};
use crate::event::{ProbeId, Probed, Timed};
use crate::invalid::InvalidField;
use crate::outcome::RowStatus;
use crate::view::ProbeView;

impl<P: Pricing> Planner<P> {
    pub(super) fn probed(&mut self, probed: &Probed) -> Result<(), InvalidField> {
        let probed_views: Vec<ProbeView> = probed.views.iter().map(|(view, _)| *view).collect();
        let (row, is_screening) = match self.pending_work(probed.id)? {
            Work::Screen { row, views } if *views == probed_views => (*row, true),
            Work::Certify { row, views } if *views == probed_views => (*row, false),
            Work::Time { .. } => return Err(InvalidField::new("id", "that of a timing", "that of a probe")),
            _ => return Err(InvalidField::new("views", "others", "those that were asked for")),
        };
        if row != probed.row {
            return Err(InvalidField::new("row", probed.row, "the row that was asked for"));
        }
        self.finish(probed.busy_s);
        self.learn_costs(row, &probed.costs, probed.views.len());
        let errors = probed.views.iter().map(|(_, errors)| *errors);
        if is_screening {
            self.rows[row].errors.extend(errors);
            self.rows[row].screening_views = self.rows[row].errors.len();
            self.assess(row);
        } else {
            self.round.errors.extend(errors);
            self.judge();
        }
        Ok(())
    }

    pub(super) fn timed(&mut self, timed: &Timed) -> Result<(), InvalidField> {
        let Work::Time { rows } = self.pending_work(timed.id)? else {
            return Err(InvalidField::new("id", "that of a probe", "that of a timing"));
        };
        if !rows.iter().eq(timed.rows.iter().map(|(row, _)| row)) {
            return Err(InvalidField::new("rows", "others", "those that were asked for"));
        }
        self.finish(timed.busy_s);
        // Rows that are timed for the prediction of costs were not timed in turn with other finalists.
        let is_settled = self.stage == Stage::Timing;
        for (row, costs) in &timed.rows {
            let state = &mut self.rows[*row];
            (state.costs, state.is_settled) = (Some(*costs), is_settled);
            state.timed_views = TIMED_VIEWS * TIMED_REPEATS;
        }
        self.finalists_were_timed |= is_settled;
        self.predict();
        Ok(())
    }

    /// A row that cannot be measured is not chosen. Finalists that cannot be timed again keep the costs that they have.
    pub(super) fn failed(&mut self, id: ProbeId, busy_s: f64) -> Result<(), InvalidField> {
        let rows = match self.pending_work(id)? {
            Work::Screen { row, .. } | Work::Certify { row, .. } => vec![*row],
            Work::Time { rows } => rows.iter().copied().filter(|&row| self.rows[row].costs.is_none()).collect(),
        };
        self.finish(busy_s);
        self.finalists_were_timed |= self.stage == Stage::Timing;
        for row in rows {
            self.rows[row].status = RowStatus::Failed;
        }
        self.skip_failed_row();
        Ok(())
    }

    /// Predicts the prices of all rows from those that were measured.
    pub(super) fn predict(&mut self) {
        let states = self.ladder.rows().iter().zip(&self.rows);
        let timed = states.filter_map(|(row, state)| Some(TimedRow { row: row.clone(), costs: state.costs? }));
        self.model = CostModel::fit(&timed.collect::<Vec<_>>());
        (self.prices, self.least_prices) = (0..self.rows.len()).map(|row| self.price_range(row)).unzip();
    }

    fn pending_work(&self, id: ProbeId) -> Result<&Work, InvalidField> {
        let pending = self.pending.as_ref().filter(|(pending, _)| *pending == id);
        pending.map(|(_, work)| work).ok_or_else(|| {
            InvalidField::new("id", format!("{} of plan {}", id.number, id.plan), "that of the pending measurement")
        })
    }

    fn finish(&mut self, busy_s: f64) {
        self.pending = None;
        self.spent_s += busy_s;
    }

    /// Further timings of a row change its own price alone: the model is for the others.
    fn learn_costs(&mut self, row: usize, costs: &RowCosts, views: usize) {
        let is_first = self.rows[row].costs.is_none();
        self.rows[row].add_costs(costs, views);
        if is_first {
            self.predict();
        } else {
            (self.prices[row], self.least_prices[row]) = self.price_range(row);
        }
    }

    /// The price of a row, and the least that it may be.
    fn price_range(&self, row: usize) -> (Price, Price) {
        let [price, least] = [0.0, 1.0].map(|deviations| {
            let measured = self.rows[row].costs;
            self.price(row, &measured.unwrap_or_else(|| self.model.predict(self.row(row), deviations)))
        });
        (price, least)
    }

    fn price(&self, row: usize, costs: &RowCosts) -> Price {
        let price = self.pricing.row(self.row(row), costs);
        // A row without a valid price is never the cheapest.
        let is_valid = [price.node_s, price.view_s].iter().all(|seconds| seconds.is_finite() && *seconds >= 0.0);
        if is_valid { price } else { Price { node_s: f64::INFINITY, view_s: f64::INFINITY } }
    }
}
