//! The plan as a state machine: events in, commands out.

mod certification;
mod conclusion;
mod measurements;
mod reason;
mod remembering;
mod screening;
mod state;

use state::{Round, RowState, Stage, Work};

use crate::budget::{Budget, ErrorTerm};
use crate::command::{Command, Purpose};
use crate::cost_model::CostModel;
use crate::costs::{Price, Pricing};
use crate::event::{Event, ProbeId};
use crate::evidence::Evidence;
use crate::invalid::{InvalidField, MAX_NAME_BYTES, name, seconds, within};
use crate::kept::{Certificate, Kept, KeptKey, KeptSearch};
use crate::ladder::{Ladder, Row};
use crate::metric::Metric;
use crate::outcome::{Choice, Outcome, PromiseState, RowSummary};

/// Views and repetitions with which finalists are timed.
const TIMED_VIEWS: usize = 32;
const TIMED_REPEATS: usize = 2;
/// A measured time may be wrong by this.
const TOLERANCE: f64 = 1.02;
/// The most that a measured time may be over its limit where a row is chosen.
const EXACT: f64 = 1.0;
/// The least that a time is predicted to be may be wrong by this.
const PREDICTED_TOLERANCE: f64 = 1.15;
/// A measured time below this share of its limit is within it.
const CLEARLY_IN_TIME: f64 = 0.95;

/// Rows of a round of certificates; fewer where every true view is expensive.
const MOST_CERTIFIED: usize = 8;
const MOST_CERTIFIED_TRACED: usize = 3;

/// The rows of a round of certificates, where rays of light are traced and elsewhere.
#[must_use]
pub fn most_certified(is_traced: bool) -> usize {
    if is_traced { MOST_CERTIFIED_TRACED } else { MOST_CERTIFIED }
}

/// A device's name as plans have it: cut off where it is too long.
#[must_use]
pub fn device_name(name: &str) -> String {
    let name = if name.is_empty() { "unknown" } else { name };
    name[..name.floor_char_boundary(MAX_NAME_BYTES)].to_owned()
}

/// A plan to make.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanRequest {
    /// The number of the plan, which its measurements repeat.
    pub plan: u64,
    /// The budget to keep.
    pub budget: Budget,
    /// The scene and the settings that errors depend on.
    pub key: KeptKey,
    /// The device that measures costs.
    pub device: String,
    /// The version of the program that measures.
    pub program_version: String,
    /// The terms of prices beside costs, as a text. A search is not made again on the same terms, though drawing directly may
    /// cost a little more or less.
    pub pricing: String,
    /// The nodes' time that measuring may take in all, in s.
    pub allowance_s: f64,
    /// Rows of a round of certificates, 1 to 8: fewer where light is expensive.
    pub most_certified: usize,
    /// The seed of fresh views and of tests of pruning, which draw different numbers from it.
    pub seed: u64,
}

/// A plan: it chooses the cheapest row of a ladder, or direct drawing, that keeps a budget.
#[derive(Debug, Clone)]
pub struct Planner<P> {
    request: PlanRequest,
    ladder: Ladder,
    pricing: P,
    rows: Vec<RowState>,
    /// The prices of rows, from measured costs or predicted ones.
    prices: Vec<Price>,
    /// The same; of predicted costs one standard deviation less.
    least_prices: Vec<Price>,
    model: CostModel,
    stage: Stage,
    round: Round,
    pending: Option<(ProbeId, Work)>,
    probe_number: u64,
    fresh_views_drawn: u64,
    /// The searches of earlier plans.
    searches: Vec<KeptSearch>,
    finalists_were_timed: bool,
    spent_s: f64,
    allowance_s: f64,
    outcome: Option<Outcome>,
}

impl PlanRequest {
    fn validate(&self) -> Result<(), InvalidField> {
        self.key.validate()?;
        name(&self.device, "device")?;
        name(&self.program_version, "program_version")?;
        name(&self.pricing, "pricing")?;
        within(self.most_certified, 1..=8, "most_certified", "from 1 to 8")?;
        seconds(self.allowance_s, "allowance_s")
    }
}

impl<P: Pricing> Planner<P> {
    /// A plan that waits for [`Event::Remembered`].
    ///
    /// # Errors
    /// For a value that its field does not allow.
    pub fn new(request: PlanRequest, ladder: Ladder, pricing: P) -> Result<Self, InvalidField> {
        request.validate()?;
        let model = CostModel::fit(&[]);
        let mut planner = Self {
            rows: ladder.rows().iter().map(|_| RowState::default()).collect(),
            prices: Vec::new(),
            least_prices: Vec::new(),
            model,
            stage: Stage::Waiting,
            round: Round::default(),
            pending: None,
            probe_number: 0,
            fresh_views_drawn: 0,
            searches: Vec::new(),
            finalists_were_timed: false,
            spent_s: 0.0,
            allowance_s: request.allowance_s,
            outcome: None,
            request,
            ladder,
            pricing,
        };
        planner.predict();
        Ok(planner)
    }

    /// The commands that follow from an event. An impossible event is refused and changes nothing.
    pub fn step(&mut self, event: Event) -> Vec<Command> {
        match self.apply(event) {
            Ok(()) => self.advance(),
            Err(error) => vec![Command::Refuse(error)],
        }
    }

    /// The result, or the state of a plan that is being made.
    #[must_use]
    pub fn outcome(&self) -> Outcome {
        self.outcome.clone().unwrap_or_else(|| self.outcome_of(self.choice().0, PromiseState::Measuring, false))
    }

    /// The rows of the ladder, in order.
    #[must_use]
    pub fn summaries(&self) -> Vec<RowSummary> {
        (0..self.rows.len()).map(|row| self.summary(row)).collect()
    }

    /// The measurements so far, for later plans.
    #[must_use]
    pub fn measured(&self) -> Kept {
        self.kept(Choice::Direct, true)
    }

    /// Rows that are certified for the budget and within its time, the cheapest first.
    #[must_use]
    pub fn certified(&self) -> Vec<(Choice, Price, Certificate)> {
        let rows = self.eligible(EXACT).into_iter().filter(|&row| self.is_measured_for_time(row)).map(Choice::Row);
        rows.filter_map(|row| Some((row, self.price_of(row), self.certificate_of(row)?.clone()))).collect()
    }

    /// The nodes' time that measuring has taken, in s.
    #[must_use]
    pub fn spent_s(&self) -> f64 {
        self.spent_s
    }

    fn apply(&mut self, event: Event) -> Result<(), InvalidField> {
        event.validate()?;
        match event {
            Event::Remembered(kept) => self.remember(kept),
            Event::Probed(probed) => self.probed(&probed),
            Event::Timed(timed) => self.timed(&timed),
            Event::Failed { id, busy_s, .. } => self.failed(id, busy_s),
            Event::Allowed { allowance_s } => {
                self.allowance_s = allowance_s;
                Ok(())
            }
        }
    }

    /// Whether measuring has taken all the time that it may take.
    #[must_use]
    pub fn is_spent(&self) -> bool {
        self.spent_s >= self.allowance_s
    }

    fn advance(&mut self) -> Vec<Command> {
        let is_spent = self.is_spent();
        if self.stage.is_idle() || (self.pending.is_some() && !is_spent) {
            return Vec::new();
        }
        loop {
            match self.next_work() {
                Some(_) if is_spent => return self.conclude(true),
                Some(work) => return vec![self.issue(work)],
                None if self.stage == Stage::Timing => return self.conclude(false),
                None => self.next_stage(),
            }
        }
    }

    fn next_work(&self) -> Option<Work> {
        match self.stage {
            Stage::Waiting | Stage::Concluded => None,
            Stage::Screening => self.next_screening(),
            Stage::Certifying => self.next_certification(),
            Stage::Timing => self.next_timing(),
        }
    }

    /// Time alone needs no certificate: nothing is promised about errors.
    fn next_stage(&mut self) {
        let needs_certificates = self.stage == Stage::Screening && self.term().is_some();
        let is_further_round = self.stage == Stage::Certifying && self.reconsider();
        self.stage = match (needs_certificates, is_further_round) {
            (true, _) => Stage::Certifying,
            (_, true) => Stage::Screening,
            _ => Stage::Timing,
        };
        if needs_certificates {
            self.begin_round();
        }
    }

    fn issue(&mut self, work: Work) -> Command {
        self.probe_number += 1;
        let id = ProbeId { plan: self.request.plan, number: self.probe_number };
        self.pending = Some((id, work.clone()));
        match work {
            Work::Screen { row, views } => Command::Probe { id, row, views, purpose: Purpose::Screening },
            Work::Certify { row, views } => Command::Probe { id, row, views, purpose: Purpose::Certification },
            Work::Time { rows } => Command::Time { id, rows, view_count: TIMED_VIEWS, repeats: TIMED_REPEATS },
        }
    }

    fn term(&self) -> Option<ErrorTerm> {
        self.request.budget.error()
    }

    fn row(&self, row: usize) -> &Row {
        &self.ladder.rows()[row]
    }

    fn evidence(&self, row: usize, term: ErrorTerm) -> Evidence<'_> {
        Evidence { term, errors: &self.rows[row].errors }
    }

    /// Whether a row may be within the budget's time.
    fn is_in_time(&self, row: usize, tolerance: f64) -> bool {
        let tolerance = if self.rows[row].costs.is_some() { tolerance } else { PREDICTED_TOLERANCE };
        self.request.budget.most_view_s().is_none_or(|limit| self.least_prices[row].view_s <= limit * tolerance)
    }

    /// Whether measured costs say that a row is within the budget's time.
    fn is_clearly_in_time(&self, row: usize) -> bool {
        self.is_measured_for_time(row) && self.is_in_time(row, CLEARLY_IN_TIME)
    }

    /// Whether the costs of a row are measured, where the budget has a time.
    fn is_measured_for_time(&self, row: usize) -> bool {
        self.request.budget.most_view_s().is_none() || self.rows[row].costs.is_some()
    }

    /// The cost of drawing directly; `None` where that takes longer than the budget allows.
    fn direct_in_time(&self) -> Option<Price> {
        let direct = self.pricing.direct();
        let is_in_time = self.request.budget.most_view_s().is_none_or(|limit| direct.view_s <= limit);
        (is_in_time && direct.node_s.is_finite()).then_some(direct)
    }

    fn summary(&self, row: usize) -> RowSummary {
        let state = &self.rows[row];
        RowSummary {
            status: state.status,
            screening_views: state.screening_views,
            error_ratio: (!state.errors.is_empty()).then(|| self.error_ratio(row)),
            price: self.prices[row],
            is_measured: state.costs.is_some(),
        }
    }

    /// The error that the budget limits; FLIP for a budget of time.
    fn error_ratio(&self, row: usize) -> f64 {
        match self.term() {
            Some(term) => self.evidence(row, term).estimate(),
            None => {
                let errors = &self.rows[row].errors;
                let [at_0, at_1] =
                    [0.0, 1.0].map(|limit| errors.iter().map(|errors| errors.excess(Metric::Flip, limit)).sum::<f64>());
                // The sum of the weights is that of y at 0 less that of y at 1.
                at_0 / (at_0 - at_1).max(f64::MIN_POSITIVE)
            }
        }
    }
}
