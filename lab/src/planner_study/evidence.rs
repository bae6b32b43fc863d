//! Tables of all rows on views that no plan sees.

use std::collections::BTreeMap;

use anyhow::Context as _;
use app_core::planning::Planning;
use app_core::progress::bar;
use planner::{ErrorTerm, ProbeView, Statistic, ViewErrors};
use probe::{Light, Prober};

use super::pricing::Priced;
use crate::fronts::row::{MeasuredRow, REPEATS, TIMED_VIEWS, mean_error, time_again};
use crate::fronts::subject::Subject;

/// Views of the table, and of confirmations.
const TABLE_VIEWS: u64 = 32;
const CONFIRMED_VIEWS: u64 = 256;
/// The most views over a limit on 95 of 100 in confirmations: with 20 or more it is broken.
const MOST_OVER: usize = 19;

/// All rows of a subject, measured on views that no plan sees.
pub struct Evidence {
    prober: Prober,
    planning: Planning,
    pub rows: Vec<MeasuredRow>,
    confirmed: BTreeMap<usize, Vec<ViewErrors>>,
}

impl Evidence {
    /// Measures the table. The seed of its views is another than that of plans.
    pub fn measure(subject: &Subject, planning: Planning, pricing: &Priced) -> anyhow::Result<Self> {
        let mut prober = subject.prober(&planning);
        let views = planning.viewpoints.cameras(&(0..TABLE_VIEWS).map(ProbeView::Fresh).collect::<Vec<_>>());
        let row_count = planning.ladder.rows().len();
        let progress = bar(format!("table, {}", subject.conditions.name), (1 + REPEATS) * row_count);
        let mut rows = Vec::with_capacity(row_count);
        for (place, of) in planning.representations.iter().enumerate() {
            let row = (place, &planning.ladder.rows()[place]);
            rows.push(MeasuredRow::measure(&mut prober, row, of, &views, pricing)?);
            progress.inc(1);
        }
        let timed = (&planning.representations[..], &planning.viewpoints.first(TIMED_VIEWS)[..]);
        time_again(&mut prober, &mut rows, timed, pricing, || progress.inc(1))?;
        progress.finish_and_clear();
        Ok(Self { prober, planning, rows, confirmed: BTreeMap::new() })
    }

    /// Errors of a row on the views of confirmations.
    pub fn confirmation(&mut self, row: usize) -> anyhow::Result<&[ViewErrors]> {
        if !self.confirmed.contains_key(&row) {
            let views: Vec<_> = (TABLE_VIEWS..TABLE_VIEWS + CONFIRMED_VIEWS).map(ProbeView::Fresh).collect();
            let mut errors = Vec::with_capacity(CONFIRMED_VIEWS as usize);
            for cameras in self.planning.viewpoints.cameras(&views).chunks(64) {
                errors.extend(self.prober.probe(&self.planning.representations[row], Light::Session, cameras)?.0);
            }
            self.confirmed.insert(row, errors);
        }
        self.confirmed.get(&row).map(Vec::as_slice).context("a row without a confirmation")
    }

    /// The least price of a row that keeps `scale` of a limit: the cheapest that does in the table and on the views of
    /// confirmations.
    pub fn cheapest_s(&mut self, term: ErrorTerm, scale: f64) -> anyhow::Result<Option<f64>> {
        let mut rows: Vec<(usize, f64)> = self
            .rows
            .iter()
            .filter(|row| over_ratio(&row.errors, term, scale) <= 1.0)
            .map(|row| (row.place, row.price.node_s))
            .collect();
        rows.sort_by(|a, b| a.1.total_cmp(&b.1));
        for (row, price_s) in rows {
            if over_ratio(self.confirmation(row)?, term, scale) <= 1.0 {
                return Ok(Some(price_s));
            }
        }
        Ok(None)
    }
}

/// An error over `scale` times its limit, at most 1 where it is kept. For a limit on 95 views in 100 it is the number of
/// views over the limit, over the most that there may be.
pub fn over_ratio(errors: &[ViewErrors], term: ErrorTerm, scale: f64) -> f64 {
    let most = term.most_ratio() * scale;
    match term.statistic() {
        Statistic::Mean => mean_error(errors, term.metric()) / most,
        Statistic::P95 => {
            let counting = || errors.iter().filter(|errors| errors.counts_for(&term));
            let over = counting().filter(|errors| errors.error_ratio(term.metric()) > most).count();
            let allowed = MOST_OVER as f64 * counting().count() as f64 / CONFIRMED_VIEWS as f64;
            if over == 0 { 0.0 } else { over as f64 / allowed }
        }
    }
}
