//! The plan as a state machine: it says what is to be measured, and takes the answers.
//!
//! 1. **Screening.** Rows are compared on common views by successive halving (Jamieson and Talwalkar 2016): on one view, the
//!    better half on four, and half of these on eight. The first view is for one row of each method, and then for rows that promise more than
//!    those that were measured, as far as their neighbours say.
//! 2. **Test.** The best of many rows on few views looks better than it is. Up to four rows are therefore tested on parts of
//!    fresh views, the safest first, and the first failure ends the test: whatever has passed holds together at 95 %
//!    (fixed-sequence testing, Angelopoulos et al. 2021).

use serde::{Deserialize, Serialize};

use crate::budget::Budget;
use crate::invalid::{InvalidField, within};
use crate::moments::upper_bound;
use crate::probe_view::ProbeView;
use crate::row::{Demand, MAX_ROWS, Row, RowCosts, error_after};
use crate::view_errors::ViewErrors;

/// Common views of each comparison.
const VIEWS: [usize; 3] = [1, 4, 8];
/// The most fresh views of a test.
const MOST_FRESH_VIEWS: usize = 64;
/// Rows that are left after screening.
const FINALISTS: usize = 4;
/// The most rows that are measured.
const MOST_MEASURED: usize = 20;
/// Of the rows with at most each of these shares of the budget's error the cheapest is tested, on this number of fresh views: an
/// error near the budget needs a narrow bound. A test has the views of the one before, and more.
const TESTS: [(f64, usize); 4] = [(0.5, 16), (0.75, 32), (0.9, MOST_FRESH_VIEWS), (1.0, MOST_FRESH_VIEWS)];
/// A row is worth a test where it saves this share of the price of the one that was tested before.
const WORTHWHILE: f64 = 0.05;

/// A measurement's plan, and its number within the plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct ProbeId {
    /// No two plans have the same number.
    pub plan: u64,
    /// From 1.
    pub number: u64,
}

/// A measurement that a plan asks for: the errors of a row on some views, and its costs.
#[derive(Debug, Clone, PartialEq)]
pub struct Probe {
    /// The answer repeats it.
    pub id: ProbeId,
    /// The place of the row.
    pub row: usize,
    /// At least one.
    pub views: Vec<ProbeView>,
}

/// The answer to a [`Probe`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Probed {
    /// The measurement.
    pub id: ProbeId,
    /// The errors of the views, in their order.
    pub views: Vec<ViewErrors>,
    /// The costs of the row.
    pub costs: RowCosts,
    /// The nodes' time for it, in s.
    pub busy_s: f64,
}

/// A plan to make.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanRequest {
    /// The number of the plan: it also chooses the fresh views.
    pub number: u64,
    /// The budget to keep.
    pub budget: Budget,
    /// The rows to choose from, with the coarsest samples first.
    pub rows: Vec<Row>,
    /// The place of the row whose views are the truth, if it may be chosen. It keeps every budget.
    pub exact: Option<usize>,
    /// The work that the views are part of.
    pub demand: Demand,
}

/// The error of a row on fresh views.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TestedError {
    /// The mean over the foreground, as a ratio.
    pub mean_ratio: f64,
    /// The bound on that mean at 95 %, as a ratio.
    pub bound_ratio: f64,
    /// The mean share of foreground in the views.
    pub foreground_ratio: f64,
    /// The number of views.
    pub views: usize,
}

/// The result of a plan.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// The rows that keep the budget, the cheapest first; none where nothing is known to keep it. All but the exact one were
    /// tested.
    pub kept: Vec<usize>,
    /// The choice and the reason in one sentence.
    pub reason: String,
}

/// The measurements of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RowSummary {
    /// The mean error over the foreground of all common views, as a ratio; `None` where it was not measured.
    pub error_ratio: Option<f64>,
    /// The nodes' time for a view, in s; infinite where it was not measured.
    pub price_s: f64,
    /// The test on fresh views that the row has passed.
    pub tested: Option<TestedError>,
}

/// A plan: it finds the cheapest row that keeps a budget.
#[derive(Debug, Clone)]
pub struct Planner {
    request: PlanRequest,
    rows: Vec<RowState>,
    stage: Stage,
    pending: Option<Probe>,
    probe_count: u64,
    spent_s: f64,
}

#[derive(Debug, Clone, Default)]
struct RowState {
    common: Vec<ViewErrors>,
    /// Costs of all measurements.
    costs: Vec<RowCosts>,
    is_dropped: bool,
    tested: Option<TestedError>,
}

#[derive(Debug, Clone, PartialEq)]
enum Stage {
    /// Rows are compared on the common views of this round.
    Screening {
        round: usize,
    },
    /// Rows from the safest to the cheapest, and the place of the one that is tested.
    Testing {
        sequence: Vec<Test>,
        place: usize,
    },
    Concluded(Outcome),
}

/// A row, and the number of fresh views that it is tested on.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Test {
    row: usize,
    views: usize,
}

impl PlanRequest {
    fn validate(&self) -> Result<(), InvalidField> {
        within(self.rows.len(), 1..=MAX_ROWS, "rows", "from 1 to 49")?;
        self.rows.iter().try_for_each(Row::validate)?;
        within(self.exact.unwrap_or(0), 0..=self.rows.len() - 1, "exact", "the place of a row")
    }
}

impl Probed {
    /// # Errors
    /// For a value that its field does not allow.
    pub fn validate(&self) -> Result<(), InvalidField> {
        within(self.views.len(), 1..=MOST_FRESH_VIEWS, "views", "from 1 to 64")?;
        self.views.iter().try_for_each(ViewErrors::validate)?;
        within(self.busy_s, 0.0..=1e6, "busy_s", "from 0 to 10^6")?;
        self.costs.validate()
    }
}

impl Planner {
    /// # Errors
    /// For rows that are none, too many or invalid.
    pub fn new(request: PlanRequest) -> Result<Self, InvalidField> {
        request.validate()?;
        let rows = vec![RowState::default(); request.rows.len()];
        let stage = Stage::Screening { round: 0 };
        Ok(Self { request, rows, stage, pending: None, probe_count: 0, spent_s: 0.0 })
    }

    /// The measurement that is wanted, the same until it is answered; `None` once the plan is made.
    pub fn next_probe(&mut self) -> Option<Probe> {
        while self.pending.is_none() {
            match self.next_row() {
                Some((row, views)) => {
                    self.probe_count += 1;
                    let id = ProbeId { plan: self.request.number, number: self.probe_count };
                    self.pending = Some(Probe { id, row, views });
                }
                None if self.outcome().is_some() => return None,
                None => self.stage = self.next_stage(),
            }
        }
        self.pending.clone()
    }

    /// Takes an answer. One that nobody waits for changes nothing.
    ///
    /// # Errors
    /// For an answer that is impossible: the row counts as failed.
    pub fn answer(&mut self, probed: &Probed) -> Result<(), InvalidField> {
        let Some(probe) = self.pending.take_if(|probe| probe.id == probed.id) else { return Ok(()) };
        let count = probe.views.len();
        let valid =
            probed.validate().and_then(|()| within(probed.views.len(), count..=count, "views", "those asked for"));
        if valid.is_err() {
            self.drop_row(probe.row);
            return valid;
        }
        self.spent_s += probed.busy_s;
        let row = &mut self.rows[probe.row];
        match &mut self.stage {
            Stage::Testing { place, sequence } => {
                row.tested = tested(&probed.views, &self.request.budget);
                *place = if row.tested.is_some() { *place + 1 } else { sequence.len() };
            }
            _ => {
                row.common.extend(&probed.views);
                row.costs.extend(probe.views[0].is_whole().then_some(probed.costs));
            }
        }
        Ok(())
    }

    /// A row cannot be measured: it is not chosen.
    pub fn fail(&mut self, id: ProbeId) {
        if let Some(probe) = self.pending.take_if(|probe| probe.id == id) {
            self.drop_row(probe.row);
        }
    }

    /// The result, once the plan is made.
    #[must_use]
    pub fn outcome(&self) -> Option<&Outcome> {
        match &self.stage {
            Stage::Concluded(outcome) => Some(outcome),
            _ => None,
        }
    }

    /// The request.
    #[must_use]
    pub fn request(&self) -> &PlanRequest {
        &self.request
    }

    /// The measurements of a row, if there is such a row.
    #[must_use]
    pub fn summary(&self, row: usize) -> Option<RowSummary> {
        let state = self.rows.get(row)?;
        let error_ratio = (!state.common.is_empty()).then(|| self.error_ratio(row));
        Some(RowSummary { error_ratio, price_s: self.price_s(row), tested: state.tested })
    }

    /// The measured costs of a row, the median of each; `None` where it was not measured.
    #[must_use]
    pub fn costs(&self, row: usize) -> Option<RowCosts> {
        let all = &self.rows.get(row)?.costs;
        Some(RowCosts {
            sample_image_s: median(all.iter().map(|costs| costs.sample_image_s))?,
            load_set_s: median(all.iter().map(|costs| costs.load_set_s))?,
            view_s: median(all.iter().map(|costs| costs.view_s))?,
        })
    }

    /// The nodes' time that measuring has taken, in s, and the number of measurements.
    #[must_use]
    pub fn spent(&self) -> (f64, u64) {
        (self.spent_s, self.probe_count)
    }

    fn drop_row(&mut self, row: usize) {
        self.rows[row].is_dropped = true;
        if let Stage::Testing { sequence, place } = &mut self.stage {
            *place = sequence.len();
        }
    }

    /// The next row to measure, and on which views.
    fn next_row(&self) -> Option<(usize, Vec<ProbeView>)> {
        match &self.stage {
            Stage::Screening { round: 0 } => {
                let row = self.next_to_compare()?;
                Some((row, vec![ProbeView::Common(0)]))
            }
            Stage::Screening { round } => {
                let row = self.left().into_iter().find(|&row| self.rows[row].common.len() < VIEWS[*round])?;
                let missing = self.rows[row].common.len()..VIEWS[*round];
                let views: Vec<ProbeView> = missing.map(|view| ProbeView::Common(view as u64)).collect();
                // The views of one measurement have one size.
                let alike = views.iter().take_while(|view| view.is_whole() == views[0].is_whole()).count();
                Some((row, views[..alike].to_vec()))
            }
            Stage::Testing { sequence, place } => {
                let Test { row, views } = *sequence.get(*place)?;
                Some((row, (0..views).map(|view| ProbeView::Fresh(view as u64)).collect()))
            }
            Stage::Concluded(_) => None,
        }
    }

    /// The next row that is compared on the first view: the exact one, the middle one of each method, and then the most
    /// promising one, as long as it is among the best.
    fn next_to_compare(&self) -> Option<usize> {
        let exact = self.request.exact.filter(|&exact| !self.rows[exact].is_dropped && !self.is_measured(exact));
        if exact.is_some() {
            return exact;
        }
        let candidates: Vec<usize> =
            (0..self.rows.len()).filter(|&row| !self.rows[row].is_dropped && !self.is_exact(row)).collect();
        let rows = &self.request.rows;
        for &row in &candidates {
            let alike = candidates.iter().copied().filter(|&other| rows[row].doublings_from(&rows[other]).is_some());
            let alike: Vec<usize> = alike.collect();
            if !alike.iter().any(|&other| self.is_measured(other)) {
                return Some(alike[alike.len() / 2]);
            }
        }
        if candidates.iter().filter(|&&row| self.is_measured(row)).count() >= MOST_MEASURED {
            return None;
        }
        let mut by_score = candidates;
        by_score.sort_by(|&a, &b| self.expected_score(a).total_cmp(&self.expected_score(b)));
        by_score.truncate(FINALISTS);
        by_score.into_iter().find(|&row| !self.is_measured(row))
    }

    /// Measured rows that may be chosen.
    fn left(&self) -> Vec<usize> {
        let rows = 0..self.rows.len();
        rows.filter(|&row| self.is_measured(row) && !self.rows[row].is_dropped && !self.is_exact(row)).collect()
    }

    fn next_stage(&mut self) -> Stage {
        let Stage::Screening { round } = self.stage else { return Stage::Concluded(self.conclusion()) };
        let mut left = self.left();
        if round + 1 == VIEWS.len() {
            return Stage::Testing { sequence: self.sequence(), place: 0 };
        }
        left.sort_by(|&a, &b| self.expected_score(a).total_cmp(&self.expected_score(b)));
        for row in left.split_off(left.len().min((left.len() / 2).max(FINALISTS))) {
            self.rows[row].is_dropped = true;
        }
        Stage::Screening { round: round + 1 }
    }

    fn is_measured(&self, row: usize) -> bool {
        !self.rows[row].common.is_empty()
    }

    fn is_exact(&self, row: usize) -> bool {
        self.request.exact == Some(row)
    }

    fn error_ratio(&self, row: usize) -> f64 {
        ViewErrors::mean_error(&self.rows[row].common, &self.request.budget)
    }

    fn price_s(&self, row: usize) -> f64 {
        let costs = self.costs(row);
        costs.map_or(f64::INFINITY, |costs| self.request.demand.price_s(&self.request.rows[row], &costs))
    }

    /// The price, raised by what the error is over the budget; of a row that was not measured as its nearest neighbour says.
    fn expected_score(&self, row: usize) -> f64 {
        let own = &self.request.rows[row];
        let measured = (0..self.rows.len()).filter(|&other| self.is_measured(other) && !self.is_exact(other));
        let alike = measured.filter_map(|other| Some((other, own.doublings_from(&self.request.rows[other])?)));
        let nearest = alike.min_by(|(_, a), (_, b)| distance(a).total_cmp(&distance(b)));
        let Some((other, doublings)) = nearest else { return f64::INFINITY };
        let costs = self.costs(other).unwrap_or_default().after(doublings);
        let over = self.error_ratio(other) * error_after(doublings) / self.request.budget.most_ratio();
        self.request.demand.price_s(own, &costs) * over.max(1.0).powi(4)
    }

    /// The rows to test, from the safest to the cheapest.
    fn sequence(&self) -> Vec<Test> {
        let most_ratio = self.request.budget.most_ratio();
        let mut least_s = self.request.exact.map_or(f64::INFINITY, |exact| self.price_s(exact));
        let mut sequence = Vec::new();
        for (share, views) in TESTS {
            let safe = (0..self.rows.len()).filter(|&row| {
                self.is_measured(row) && !self.is_exact(row) && self.error_ratio(row) <= share * most_ratio
            });
            let cheapest = safe.min_by(|&a, &b| self.price_s(a).total_cmp(&self.price_s(b)));
            let cheapest = cheapest.filter(|&row| self.price_s(row) < least_s * (1.0 - WORTHWHILE));
            least_s = cheapest.map_or(least_s, |row| self.price_s(row));
            sequence.extend(cheapest.map(|row| Test { row, views }));
        }
        sequence
    }

    fn conclusion(&self) -> Outcome {
        let exact = self.request.exact.filter(|&exact| self.price_s(exact).is_finite());
        let tested = (0..self.rows.len()).filter(|&row| self.rows[row].tested.is_some() && !self.is_exact(row));
        let mut kept: Vec<usize> = tested.chain(exact).collect();
        kept.sort_by(|&a, &b| self.price_s(a).total_cmp(&self.price_s(b)));
        Outcome { reason: self.reason(kept.first().copied()), kept }
    }

    fn reason(&self, chosen: Option<usize>) -> String {
        let PlanRequest { budget, rows, exact, .. } = &self.request;
        let direct = exact.map_or_else(String::new, |exact| {
            format!(", against {} for drawing directly with all rays", milliseconds(self.price_s(exact)))
        });
        match (chosen, chosen.and_then(|row| self.rows[row].tested)) {
            (Some(row), Some(TestedError { mean_ratio, bound_ratio, views, .. })) => format!(
                "{} keeps {budget}: {} on {views} fresh views, at most {} with 95 % confidence; it costs {} a view{direct}.",
                rows[row],
                budget.shown(mean_ratio),
                budget.shown(bound_ratio),
                milliseconds(self.price_s(row)),
            ),
            (Some(row), None) => format!(
                "Drawing directly with all rays keeps {budget} at {} a view, and nothing cheaper is known to keep it.",
                milliseconds(self.price_s(row))
            ),
            (None, _) => {
                let measured = (0..rows.len()).filter(|&row| !self.rows[row].common.is_empty());
                let nearest = measured.min_by(|&a, &b| self.error_ratio(a).total_cmp(&self.error_ratio(b)));
                let nearest = nearest.map_or_else(String::new, |row| {
                    format!("; {} comes nearest with {}", rows[row], budget.shown(self.error_ratio(row)))
                });
                format!("Nothing is known to keep {budget}{nearest}.")
            }
        }
    }
}

fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

fn distance(doublings: &[f64; 3]) -> f64 {
    doublings.iter().map(|times| times.abs()).sum()
}

/// The test of a budget on fresh views; `None` where it fails. The mean over the foreground is a ratio of two means, of errors and of
/// foreground. Its bound is Student's with the deviations of that ratio (Cochran 1977, section 6.4): how much foreground views have
/// does not widen it.
fn tested(views: &[ViewErrors], budget: &Budget) -> Option<TestedError> {
    let foreground_ratio = views.iter().map(|view| view.foreground_ratio).sum::<f64>() / views.len() as f64;
    let mean_ratio = ViewErrors::mean_error(views, budget);
    let deviations = views.iter().map(|view| {
        view.foreground_ratio * (view.error_ratio(budget) - mean_ratio) / foreground_ratio.max(f64::MIN_POSITIVE)
    });
    let bound_ratio = mean_ratio + upper_bound(&deviations.collect::<Vec<f64>>())?;
    let passes = bound_ratio <= budget.most_ratio() && foreground_ratio > 0.0;
    passes.then_some(TestedError { mean_ratio, bound_ratio, foreground_ratio, views: views.len() })
}

fn milliseconds(seconds: f64) -> String {
    format!("{:.1} ms", seconds * 1e3)
}
